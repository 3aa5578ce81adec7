"""How wide and deep a bed is when a case does not say it, from the expected transient diameter D.

radius    3 radii of the settled crater, so that ground without blanket lies round it. A settled crater comes out 0.6
          to 1.1 D wide (apparent diameter: Valhalla 616/980 km, sci_ryugu 13/14.5 m, first_crater 91/84 m): with 1.1
          that is 1.65 D, on a body along the arc. Of flat ground never more than four fifths: the shock
          stage's outermost particles leave the surface at its edge rough, and carving with it lets grains slump
          there. In flat ground grains grow outwards (``dem.beds.grading``), so that the width costs little.
depth     0.75 D: twice the depth of the transient crater; in a body no deeper than the innermost layer's surface, in
          flat ground than its bottom. A bowl is as deep as it is wide.
"""

from __future__ import annotations

import math

from matter.case.body import Impact, Target

SETTLED = 1.1
"""Apparent diameter of a settled crater over the expected transient one: the widest measured."""
RADII = 3.0
"""Radius of the bed in radii of the settled crater."""
DEPTH = 0.75
WITHIN = 0.8
"""Radius of the bed over the half width of flat ground, at most."""
_QUARTER = 0.9
"""Most of a quarter of a body's circumference."""


def settled_radius(impact: Impact) -> float:
    """Expected apparent radius [m] of the settled crater."""
    return 0.5 * SETTLED * impact.expected_transient_diameter


def radius(target: Target, impact: Impact) -> float:
    """Radius of the bed along the datum [m]."""
    if target.flat:
        room = WITHIN * (target.radius if target.shape == "half_sphere" else target.half_width)
    else:
        room = _QUARTER * 0.5 * math.pi * target.radius
    return min(RADII * settled_radius(impact), room)


def depth(diameter: float, available: float) -> float:
    """Depth of the bed [m], of what is ``available`` [m]."""
    return min(DEPTH * diameter, available)
