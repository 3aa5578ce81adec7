"""The measures of a crater: one row each, and the only list of them.

A measure is added by one row here and one function of its name in ``crater/measures/quantities.py``. Everything that
shows, compares, keeps or expects measures takes its names, units and words from this table.
"""

from __future__ import annotations

from typing import NamedTuple

MOMENTS = ("volume", "depth", "diameter")
"""Moments of the transient crater: the first maximum of one of these."""
TIME = "time_s"
"""The time of a moment, which stands beside its measures."""


class Measure(NamedTuple):
    """One measure, named with its SI unit as in ``measures.json``; the page shows every one."""

    name: str
    unit: str
    words: str
    """With its definition, for the tables of page and terminal."""
    noun: str
    """In a sentence."""
    symbol: str = ""
    """At the head of a narrow table."""
    needs: str = ""
    """Without this it has no value: ``diameter`` (the hollow is deeper than the particles resolve) or ``rim`` (a
    closed one)."""
    terminal: bool = False
    """In the table at the end of a run."""
    compared: bool = False
    """Published, observed and expected values of it can be stated, and craters are set side by side by it."""
    match: float | None = None
    """Largest relative difference that still counts as a match between independent craters; None: no ratio of it is
    formed."""
    moment: str = ""
    """The moment of the transient crater at which this is largest."""
    column: int = 0
    """Place among the columns of the time series, from 1; 0 where it has none."""
    marker: str = ""
    """Its mark in the picture of a comparison."""


TABLE = (
    Measure("diameter_rim_m", "m", "rim diameter, crest to crest", "rim diameter", "D rim", "rim", True, True, 0.10,
    column=3, marker="^"),
    Measure(
        "diameter_apparent_m", "m", "apparent diameter, at the datum", "apparent diameter", "D apparent", "diameter",
        True, True, 0.10,
        moment="diameter", column=2, marker="o",
    ),
    Measure("depth_m", "m", "depth below the datum", "depth", "depth", "", True, True, 0.20, moment="depth", column=1,
    marker="v"),
    Measure("depth_rim_to_floor_m", "m", "depth, crest to floor", "depth from rim to floor", "rim to floor", "rim",
    True, True),
    Measure("rim_height_m", "m", "rim height above the datum", "rim height", "rim height", "rim", True, True,
    column=4),
    Measure("volume_m3", "m^3", "volume below the datum", "volume", "volume", "diameter", True, True, 0.25,
    moment="volume", column=5),
    Measure("depth_over_diameter", "1", "depth / apparent diameter", "depth over apparent diameter", "d/D", "diameter",
    True),
    Measure("wall_slope_deg", "deg", "steepest slope of the wall", "slope of the wall", needs="diameter"),
    Measure("floor_diameter_m", "m", "floor diameter", "floor diameter", needs="diameter"),
    Measure("central_peak_m", "m", "central peak above the floor", "height of the central peak", needs="diameter"),
    Measure(
        "central_peak_diameter_m", "m", "central peak: width at half its height", "width of the central peak",
        needs="diameter",
    ),
    Measure("central_pit_m", "m", "central pit below the ridge around it", "depth of the central pit"),
    Measure("terraces", "1", "terraces on the wall", "number of terraces", needs="diameter"),
    Measure("ellipticity", "1", "ellipticity (1 - b/a)", "ellipticity", needs="diameter"),
    Measure("rim_asymmetry", "1", "rim height: first harmonic / mean", "asymmetry of the rim", needs="rim"),
    Measure("blanket_exponent", "1", "ejecta blanket: exponent of the power "
                                     "law", "exponent of the ejecta blanket", needs="rim"),
    Measure("blanket_height_at_rim_m", "m", "ejecta blanket and uplift: height at the "
                                            "rim", "height of the ejecta blanket at the rim", needs="rim"),
    Measure("far_field_level_m", "m", "rise of the ground beyond 3 radii", "rise of the far field", column=6),
)  # fmt: skip

BY_NAME = {measure.name: measure for measure in TABLE}
UNITS = {measure.name: measure.unit for measure in TABLE}
COMPARED = tuple(measure.name for measure in TABLE if measure.compared)
"""Measures by which craters are compared, published and expected."""
RATIOS = tuple(measure.name for measure in TABLE if measure.match is not None)
"""Measures of which ratios are formed."""
COLUMNS = tuple(measure.name for measure in sorted(TABLE, key=lambda measure: measure.column) if measure.column)
"""Measures of the time series, in the order of its columns."""
MAXIMA = {moment: next(measure.name for measure in TABLE if measure.moment == moment) for moment in MOMENTS}
"""Moments of the transient crater, and the measure whose first maximum each is."""


def unit_of(name: str) -> str:
    """Unit of a measure, or of its time."""
    return "s" if name == TIME else UNITS[name]
