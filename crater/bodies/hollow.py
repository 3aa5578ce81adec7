"""How wide a hollow is on the map of a body: its area on the surface of before, whatever its outline and however far
it reaches round the body.

With dh the change of height and s the local spacing, the hollow of a level t is what hangs together with the deepest
change below -t, of the area A(t). Noise hides where dh = 0; a bowl whose depth falls with the square of the distance
from its middle has A(t) = A (1 - t / depth), so that two levels give it without noise:

    A = 2 A(s / 2) - A(s),        across = 2 sqrt(A / pi)
"""

from __future__ import annotations

import math

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from crater.bodies.height_map import HeightMap
from crater.measures.uncertainty import Quantity, quantity
from matter.solids.halved_sides import sides


def across(chart: HeightMap) -> Quantity:
    """Diameter [m] of the circle of the hollow's area; errors: half of what the step from s / 2 to the ground of
    before adds, and half a spacing. None where no change is deeper than two spacings."""
    deepest = int(np.argmin(chart.change))
    spacing = float(chart.spacing[deepest])
    if chart.change[deepest] > -2.0 * spacing:
        return Quantity(None, None, "m", "no change of height is deeper than two spacings")
    half, whole = (_area(chart, deepest, fraction) for fraction in (0.5, 1.0))
    wide = 2.0 * math.sqrt(max(2.0 * half - whole, half) / math.pi)
    level = 0.5 * (wide - 2.0 * math.sqrt(half / math.pi))
    return quantity(wide, {"level": level, "resolution": 0.5 * spacing}, "m")


def _area(chart: HeightMap, deepest: int, fraction: float) -> float:
    """Area [m^2] of what hangs together with the point ``deepest`` and lies a ``fraction`` of the spacing below the
    ground of before."""
    below = chart.change < -fraction * chart.spacing
    ends = sides(chart.points.triangles).ends
    ends = ends[below[ends].all(axis=1)]
    n = len(below)
    _, group = connected_components(coo_matrix((np.ones(len(ends)), ends.T), shape=(n, n)), directed=False)
    return float(chart.points.area[below & (group == group[deepest])].sum())
