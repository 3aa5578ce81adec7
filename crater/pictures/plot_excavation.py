"""Picture of where ejecta came from: first depths by landing distance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crater.drawing.figure import figure, grid, save
from crater.ejecta import excavation
from matter.wording import readable


def draw_depth_classes(
    blanket: Sequence[Mapping[str, Any]], diameter: float, path: Path, what: str = "landing distance"
) -> None:
    """Above, the fraction of each class of first depth (in ``diameter`` [m]) in what lies in a class of distance;
    below, its mass."""
    from matplotlib import colormaps

    classes = [entry for entry in blanket if sum(entry["mass_kg"]) > 0.0]
    mass = np.array([entry["mass_kg"] for entry in classes])
    total = mass.sum(axis=1)
    fig = figure(6.6, 5.2)
    fraction, amount = fig.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    index, base = np.arange(len(classes)), np.zeros(len(classes))
    for k, colour in enumerate(colormaps["viridis_r"](np.linspace(0.08, 0.95, mass.shape[1]))):
        if mass[:, k].any():
            fraction.bar(index, mass[:, k] / total, 0.8, bottom=base, color=colour, label=_depths(k, diameter))
        base += mass[:, k] / total
    fraction.set(ylabel="fraction of the mass", ylim=(0.0, 1.0))
    fraction.legend(
        frameon=False, fontsize=8, title="first depth", title_fontsize=8, loc="center left", bbox_to_anchor=(1, 0.5)
    )
    amount.bar(index, total, 0.8, color="#888888")
    amount.set(ylabel="mass [kg]", xlabel=f"{what} from the axis / R")
    amount.set_xticks(index, [_range(entry) for entry in classes])
    for axis in (fraction, amount):
        grid(axis)
    save(fig, path)


def _depths(k: int, diameter: float) -> str:
    """A class of first depths in words."""
    edges = excavation.DEPTHS
    upper = readable.length(edges[k + 1] * diameter) if k + 1 < len(edges) else ""
    if k == 0:
        return f"above {upper}"
    return f"to {upper}" if upper else f"below {readable.length(edges[k] * diameter)}"


def _range(entry: Mapping[str, Any]) -> str:
    if entry["escapes"]:
        return "escapes"
    return f"{entry['from_R']:g} to {entry['to_R']:g}" if entry["to_R"] else f"beyond {entry['from_R']:g}"
