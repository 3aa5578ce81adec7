"""The picture of a forecast of ``studies.hera_forecast``: medians, 68 and 95 % of the headline and of the flat column,
with what was published beside them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.uncertainty import forecast_picture
from pipeline.uncertainty.forecast_files import LEVELS
from pipeline.uncertainty.forecast_picture import Published
from studies import kept_pictures

COLOURS = {"makadia": "#b03a2e", "flat": "#7f8c8d"}
PANELS: dict[str, tuple[str, float, tuple[Published, ...]]] = {
    "mass": ("mass, $10^9$ kg", 1e-9, (Published(4.3, 4.3, "as dense as Didymos, 2,400"),)),
    "density": ("bulk density, kg/m$^3$", 1.0, (
        Published(1320.0, 1760.0, "Makadia 2026 (condition)"),
        Published(2400.0, 2400.0, "Raducan 2024: below 2,400"))),
    "beta_ejecta": (r"$\beta$ (Cheng's definition)", 1.0, (
        Published(2.2, 4.9, "Cheng 2023, 1,500-3,300"), Published(1.7, 2.3, "heliocentric, Makadia 2026"))),
    "mass_left": ("mass that left, $10^7$ kg", 1e-7, (
        Published(1.1, 5.5, "Ferrari 2025"), Published(1.7, 2.2, "Kim & Jewitt 2023"))),
    "a_over_b": ("$a/b$", 1.0, (Published(1.3, 1.3, "Naidu 2024"),)),
    "a_over_c": ("$a/c$", 1.0, (Published(1.6, 1.6, "Naidu 2024"),)),
    "hollow": ("width of the hollow, m", 1.0, (Published(50.0, 50.0, "Jewitt 2023: would feed the boulders"),)),
    "resurfaced": ("resurfaced fraction", 1.0, ()),
    "plane_turned": ("orbit's plane turned, deg", 1.0, ()),
}  # fmt: skip


def picture(made: Mapping[str, Any], path: Path) -> None:
    """Write the picture; without matplotlib, nothing."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    figure = Figure(figsize=(9.6, 5.6), dpi=110)
    for axes, (name, (words, factor, published)) in zip(figure.subplots(3, 3).flat, PANELS.items()):
        bars = {COLOURS[column]: factor * np.quantile(made[column][name].astype(float), LEVELS) for column in COLOURS}
        forecast_picture.panel(axes, words, bars, published)
        axes.set_ylim(-3.6, 0.7)  # alike in all panels
    figure.text(
        0.01, 0.01, "red: headline; grey: our beta alone, density not known; thick 68 %, thin 95 %; blue: published",
        fontsize=8,
    )  # fmt: skip
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(path, metadata={"Software": None})
    kept_pictures.shrink(path, limit=120)
