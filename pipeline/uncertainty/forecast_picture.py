"""How pictures show a quantity of a forecast: median, 68 and 95 % of each column, what was published below."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple


class Published(NamedTuple):
    """A published value or range, in the panel's unit, and whose it is."""

    low: float
    high: float
    words: str


def panel(axes: Any, title: str, bars: Mapping[str, Sequence[float]], published: Sequence[Published] = ()) -> None:
    """Draw the quantiles at ``forecast_files.LEVELS`` of each column, by its colour, in matplotlib ``axes``."""
    for row, (colour, (low, less, middle, more, high)) in enumerate(bars.items()):
        axes.plot([low, high], [-row, -row], color=colour, lw=2)
        axes.plot([less, more], [-row, -row], color=colour, lw=7, solid_capstyle="butt")
        axes.plot([middle], [-row], "o", color="white", mec=colour, ms=6)
    for row, found in enumerate(published):
        y = -len(bars) - row
        axes.plot([found.low, found.high], [y, y], "|-", color="#1f4e79", lw=1.5, ms=8)
        axes.annotate(found.words, (found.high, y), (5, -3), textcoords="offset points", fontsize=7)
    axes.set_ylim(-0.7 - len(bars) - len(published), 0.7)
    axes.margins(x=0.22)
    axes.set_yticks([])
    axes.set_title(title, fontsize=9, loc="left")
    axes.tick_params(labelsize=8)
    axes.spines[["left", "right", "top"]].set_visible(False)
