"""Springs that hold the weight of a bed: k_n / r at which its contacts overlap by a small fraction of what they may.

    k_n = P_floor r / (REST_SHARE x_max),   x_max = ``static_overlap``

(Schwartz, Richardson & Michel 2012, Granular Matter 14, 363, section 2.4; pkdgrav's rule, which takes
P_floor r / x_max: contacts at the floor then overlap by some 3 x_max). Under weak gravity that is far below the 2 K r
of the grains' solid, whose springs would take steps of microseconds and wait for ever for their overlaps.
"""

from __future__ import annotations

from dem.contact.grain_solid import elastic

REST_FRACTION = 0.03
"""Of ``static_overlap``, for k_n at rest: overlaps of 0.001 radii, so that the packing fraction is that of hard grains
within half a percent."""


def modulus(static_overlap: float, floor_pressure: float) -> float:
    """k_n / r [Pa] for a pressure at the floor [Pa]."""
    return floor_pressure / (REST_FRACTION * static_overlap)


def softer(static_overlap: float, floor_pressure: float, material_name: str, solid_density: float | None) -> bool:
    """Whether they are softer than the solid's own, 2 K r; ``solid_density`` as ``elastic`` takes it."""
    return modulus(static_overlap, floor_pressure) < 2.0 * elastic(material_name, solid_density)[0]
