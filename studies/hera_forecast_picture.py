"""The picture of a forecast of ``studies.hera_forecast``: medians, 68 and 95 % of the headline and of the flat column,
with what was published beside them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from studies import kept_pictures

LEVELS = (0.025, 0.16, 0.5, 0.84, 0.975)
COLOURS = {"makadia": "#b03a2e", "flat": "#7f8c8d"}


class Rival(NamedTuple):
    """A published value or range in the panel's unit, and whose it is."""

    low: float
    high: float
    words: str


PANELS: dict[str, tuple[str, float, tuple[Rival, ...]]] = {
    "mass": ("mass, $10^9$ kg", 1e-9, (Rival(4.3, 4.3, "as dense as Didymos, 2,400"),)),
    "density": ("bulk density, kg/m$^3$", 1.0, (
        Rival(1320.0, 1760.0, "Makadia 2026 (condition)"), Rival(2400.0, 2400.0, "Raducan 2024: below 2,400"))),
    "beta_ejecta": (r"$\beta$ (Cheng's definition)", 1.0, (
        Rival(2.2, 4.9, "Cheng 2023, 1,500-3,300"), Rival(1.7, 2.3, "heliocentric, Makadia 2026"))),
    "mass_left": ("mass that left, $10^7$ kg", 1e-7, (
        Rival(1.1, 5.5, "Ferrari 2025"), Rival(1.7, 2.2, "Kim & Jewitt 2023"))),
    "a_over_b": ("$a/b$", 1.0, (Rival(1.3, 1.3, "Naidu 2024"),)),
    "a_over_c": ("$a/c$", 1.0, (Rival(1.6, 1.6, "Naidu 2024"),)),
    "hollow": ("width of the hollow, m", 1.0, (Rival(50.0, 50.0, "Jewitt 2023: would feed the boulders"),)),
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
    for axes, (name, (words, factor, rivals)) in zip(figure.subplots(3, 3).flat, PANELS.items()):
        for row, column in enumerate(COLOURS):
            low, less, middle, more, high = factor * np.quantile(made[column][name].astype(float), LEVELS)
            axes.plot([low, high], [-row, -row], color=COLOURS[column], lw=2)
            axes.plot([less, more], [-row, -row], color=COLOURS[column], lw=7, solid_capstyle="butt")
            axes.plot([middle], [-row], "o", color="white", mec=COLOURS[column], ms=6)
        for row, rival in enumerate(rivals):
            y = -2.0 - row
            axes.plot([rival.low, rival.high], [y, y], "|-", color="#1f4e79", lw=1.5, ms=8)
            axes.annotate(rival.words, (rival.high, y), (5, -3), textcoords="offset points", fontsize=7)
        axes.set_ylim(-3.6, 0.7)
        axes.margins(x=0.22)
        axes.set_yticks([])
        axes.set_title(words, fontsize=9, loc="left")
        axes.tick_params(labelsize=8)
        axes.spines[["left", "right", "top"]].set_visible(False)
    figure.text(
        0.01, 0.01, "red: headline; grey: our beta alone, density not known; thick 68 %, thin 95 %; blue: published",
        fontsize=8,
    )  # fmt: skip
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    figure.savefig(path, metadata={"Software": None})
    kept_pictures.shrink(path, limit=120)
