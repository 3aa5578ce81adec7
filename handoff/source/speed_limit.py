"""The speed above which rising matter is ejecta, where a case does not give one.

Matter that rises slower than sqrt(2 g H), H the bed's headroom, does not get past the top of the bed and is left to
the grains. Under weak gravity that says nothing: on an asteroid (1.2e-4 m/s^2, headroom 2 m) it is 2 cm/s, and dense
ground metres around a growing crater moves up faster than that. There the flow itself is the scale. A cavity of radius
R at the time t grows at some 0.4 R / t (R ~ t^0.4, between the scalings of energy and momentum; Holsapple & Schmidt
1987, J. Geophys. Res. 92, 6350), matter in its wall moves no faster than the wall, and what has R / t or more has
outrun it:

    limit = max(``MULTIPLE`` R / t, sqrt(2 g H)),    R at least one particle spacing, the least that could be seen

On flat ground, where craters are small and gravity may be any, and on bodies of any shape, whose gravity is weak; the
cones of a round body keep sqrt(2 g H). Without a time (0) too.
"""

from __future__ import annotations

import math

import numpy as np

from handoff.domains.domain import Cone, Domain
from handoff.source import cavity

SOURCES = ("SchmidtHousen1987",)

MULTIPLE = 1.0
"""Speed limit over cavity radius over time."""


def default(position: np.ndarray, spacing: np.ndarray, time: float, domain: Domain, gravity: float) -> float:
    """The limit [m/s] for a source at ``time`` [s]: ``position`` (n, 3) and ``spacing`` (n,) [m] of what is compact
    whatever its speed."""
    reaches_top = math.sqrt(2.0 * gravity * domain.span[1])
    if isinstance(domain, Cone) or time <= 0.0 or len(position) == 0:
        return reaches_top
    radius = max(
        cavity.of_particles(position, spacing, domain).radius, cavity.spacing_near_axis(position, spacing, domain)
    )
    return max(MULTIPLE * radius / time, reaches_top)
