"""The measures of a body after an impact: one row each, and the only list of them.

A measure is added by one row here and one function of its name in ``crater/bodies/measured.py``. ``measures.json``,
the page and the terminal take names, units and words from this table.
"""

from __future__ import annotations

from typing import NamedTuple


class BodyMeasure(NamedTuple):
    """One measure, named with its SI unit as in ``measures.json``; the page shows every one."""

    name: str
    unit: str
    words: str
    """With its definition, for the tables of page and terminal."""
    pair: bool = False
    """It has a value before the impact, one after it, and their difference."""
    terminal: bool = False
    """In the table at the end of a run."""


TABLE = (
    BodyMeasure("axis_a_m", "m", "longest axis, of the ellipsoid of equal inertia", True, True),
    BodyMeasure("axis_b_m", "m", "middle axis", True, True),
    BodyMeasure("axis_c_m", "m", "shortest axis", True, True),
    BodyMeasure("axis_ratio_a_over_b", "1", "a / b", True, True),
    BodyMeasure("axis_ratio_a_over_c", "1", "a / c", True, True),
    BodyMeasure("extent_x_m", "m", "extent along x of the body's own frame", True),
    BodyMeasure("extent_y_m", "m", "extent along y", True),
    BodyMeasure("extent_z_m", "m", "extent along z, the spin axis of before", True),
    BodyMeasure("body_volume_m3", "m^3", "volume inside the surface", True, True),
    BodyMeasure("body_mass_kg", "kg", "mass that is bound", True),
    BodyMeasure("spin_period_s", "s", "period of rotation", True, True),
    BodyMeasure("spin_axis_turned_deg", "deg", "angle of the axis of rotation with that of before"),
    BodyMeasure("centre_of_mass_moved_m", "m", "way of the centre of mass in the body"),
    BodyMeasure("height_change_rms_m", "m", "change of height along the normal, RMS over the surface", terminal=True),
    BodyMeasure("height_change_lowest_m", "m", "deepest change of height", terminal=True),
    BodyMeasure("height_change_highest_m", "m", "highest change of height"),
    BodyMeasure("hollow_across_m", "m", "width of the hollow, of the circle of its area", terminal=True),
    BodyMeasure("changed_share", "1", "fraction of the surface whose height changed by more than three errors"),
    BodyMeasure(
        "change_spread", "1", "fraction of the surface that this change would take were it even", terminal=True
    ),
    BodyMeasure("resurfaced_share", "1", "fraction of the surface that moved, was removed or buried", terminal=True),
    BodyMeasure("resurfaced_depth_m", "m", "depth of resurfacing, mean over that fraction"),
    BodyMeasure("ejected_mass_kg", "kg", "mass that has left the ground", terminal=True),
    BodyMeasure("escaping_mass_kg", "kg", "mass that leaves the body", terminal=True),
    BodyMeasure("beta_normal", "1", "beta along the normal of the surface at the site", terminal=True),
    BodyMeasure("beta_flight", "1", "beta along the projectile's flight", terminal=True),
    BodyMeasure("beta_along_track", "1", "beta along the track of the orbit", terminal=True),
    BodyMeasure("pair_escaping_mass_kg", "kg", "mass that leaves the body and its companion"),
    BodyMeasure("beta_pair_normal", "1", "beta of what leaves body and companion, along the normal", terminal=True),
    BodyMeasure("beta_pair_flight", "1", "beta of what leaves body and companion, along the flight"),
    BodyMeasure("delta_v_m_s", "m/s", "change of velocity", terminal=True),
    BodyMeasure("delta_v_along_track_m_s", "m/s", "change of velocity along the track", terminal=True),
    BodyMeasure("orbit_period_before_s", "s", "period of the mutual orbit before the impact"),
    BodyMeasure("orbit_period_change_s", "s", "change of the period by the change of velocity", terminal=True),
    BodyMeasure("orbit_period_change_by_shape_s", "s", "change of the period by the new shape", terminal=True),
)

BY_NAME = {measure.name: measure for measure in TABLE}
PAIRS = tuple(measure.name for measure in TABLE if measure.pair)
"""Measures with a value before and one after."""
SINGLES = tuple(measure.name for measure in TABLE if not measure.pair)
"""Measures with one value."""
