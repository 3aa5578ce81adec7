"""Pictures of grains: a thin slab through the x-z plane, and the profiles of a bed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dem.assembly import LEFT, Assembly
from dem.domain import Domain

_COLOURS = {0: "#d9c8a0", 1: "#5b8fc7"}


def slab(axes: Any, bed: Assembly, domain: Domain, colours: np.ndarray | None = None, thickness: float = 1.0, unit: float = 1e3) -> None:
    """Draw the circles that grains within ``thickness`` mean radii of y = 0 cut out of that plane; lengths in ``unit`` m."""
    from matplotlib.collections import EllipseCollection

    y = np.abs(bed.X[:, 1])
    here = np.flatnonzero((y < np.minimum(bed.X[:, 3], thickness * bed.mean_radius)) & (bed.state != LEFT))
    cut = np.sqrt(bed.X[here, 3] ** 2 - y[here] ** 2)
    if colours is None:
        face: Any = [_COLOURS[int(k)] if h == 0 else "#efe7d5" for k, h in zip(bed.kind[here], bed.headroom[here])]
        circles = EllipseCollection(
            2 * cut / unit, 2 * cut / unit, np.zeros(len(here)), units="xy", facecolors=face, edgecolors="#444444", linewidths=0.2,
            offsets=bed.X[here][:, [0, 2]] / unit, offset_transform=axes.transData,
        )  # fmt: skip
    else:
        circles = EllipseCollection(
            2 * cut / unit, 2 * cut / unit, np.zeros(len(here)), units="xy", array=colours[here], cmap="viridis", edgecolors="none",
            offsets=bed.X[here][:, [0, 2]] / unit, offset_transform=axes.transData,
        )  # fmt: skip
    axes.add_collection(circles)
    angle = np.linspace(-domain.half_angle, domain.half_angle, 200)
    for radius, style in ((domain.core_radius, "k-"), (domain.datum_radius, "r--")):
        axes.plot(radius * np.sin(angle) / unit, radius * np.cos(angle) / unit, style, lw=0.8)
    for side in (-1, 1):
        line = np.array([domain.core_radius, domain.top_radius]) / unit
        axes.plot(side * line * np.sin(domain.half_angle), line * np.cos(domain.half_angle), "k-", lw=0.8)
    axes.set_aspect("equal")
    axes.set_xlabel("x [km]")
    axes.set_ylabel("z [km]")


def bed(assembly: Assembly, domain: Domain, report: dict[str, Any], path: Path) -> None:
    """A cut through the bed above its profiles of packing fraction, density and stress."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 9), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 3)
    slab(figure.add_subplot(grid[0, :]), assembly, domain)
    profile = report["profile"]
    depth = (domain.datum_radius - np.array(profile["radius_m"])) / 1e3
    panels = (
        ("packing fraction", [("packing_fraction", "grains", "-")], 1.0),
        ("bulk density [kg/m$^3$]", [("density_kg_m3", "grains", "-"), ("density_target_kg_m3", "body", "--")], 1.0),
        ("stress [MPa]", [("radial_stress_Pa", "radial", "-"), ("tangential_stress_Pa", "tangential", "-"),
                          ("pressure_target_Pa", "body's pressure", "--")], 1e6),
    )  # fmt: skip
    for k, (label, lines, scale) in enumerate(panels):
        axes = figure.add_subplot(grid[1, k])
        for key, name, style in lines:
            axes.plot(np.array(profile[key]) / scale, depth, style, label=name)
        axes.invert_yaxis()
        axes.set_xlabel(label)
        axes.set_ylabel("depth below the datum [km]")
        axes.legend(frameon=False)
    figure.savefig(path, dpi=110)
