"""How wide and deep a bed is when a case does not say it, from the expected transient diameter D.

radius    1.25 D in flat ground, 1.5 D along the arc of a body: 2.5 and 3 crater radii. The collapsed crater with its
          rim reaches some 1.4 crater radii, the sides' damped layer begins beyond two. (A crater wider than 0.8 of its
          bed cannot be handed over.) Never beyond the ground that there is.
depth     0.75 D: twice the depth of the transient crater; in a body no deeper than the innermost layer's surface, in
          flat ground than its bottom. A bowl is as deep as it is wide.
"""

from __future__ import annotations

import math

from matter.body import Impact, Target

FLAT_RADIUS, ARC_RADIUS, DEPTH = 1.25, 1.5, 0.75
_QUARTER = 0.9
"""Most of a quarter of a body's circumference."""


def radius(target: Target, impact: Impact) -> float:
    """Radius of the bed along the datum [m]."""
    diameter = impact.expected_transient_diameter
    if target.flat:
        return min(FLAT_RADIUS * diameter, target.radius if target.shape == "half_sphere" else target.half_width)
    return min(ARC_RADIUS * diameter, _QUARTER * 0.5 * math.pi * target.radius)


def depth(diameter: float, available: float) -> float:
    """Depth of the bed [m], of what is ``available`` [m]."""
    return min(DEPTH * diameter, available)
