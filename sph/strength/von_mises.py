"""Von Mises yield with a radial return and thermal softening (Benz & Asphaug 1994, 1999).

    S <- f S,   f = min(Y / sqrt(3 J2), 1),   J2 = S:S / 2,   Y = Y0 max(1 - u / u_melt, 0)

This is the radial return: after it sqrt(3 J2) = Y, and a second application changes nothing. (Benz & Asphaug print Y^2
/ (3 J2), which returns below the yield surface and makes the result depend on the step.) Damage takes the shear stress
as a whole, (1 - D) S (``sph.stepping.state``).
"""

import math
from typing import Annotated, NamedTuple

from matter.case.identity_fields import Follows
from matter.case.quantity import PositivePressure, SpecificEnergy
from matter.compilation.jit import law
from sph.strength import thermal_softening

SOURCES = ("BenzAsphaug1994", "BenzAsphaug1999")
MIXES_DAMAGE = False
"""Damage does not stand in Y: it takes the shear stress as a whole."""


class Parameters(NamedTuple):
    """Y0: yield stress of the cold material [Pa]; melt_energy: specific energy at which strength is gone [J/kg],
    that of the material (``[melting]``; none: never)."""

    Y0: PositivePressure
    melt_energy: Annotated[SpecificEnergy, Follows()] = math.inf


EXAMPLE = Parameters(3.5e9, 3.4e6)


@law
def yield_stress(P, u, D, p):
    """Y [Pa], the limit of sqrt(3 J2), at specific energy u [J/kg]; pressure and damage do not change it."""
    return p.Y0 * thermal_softening.softening(u, p.melt_energy)


@law
def return_factor(J2, Y):
    """The factor f by which the deviatoric stress shrinks; J2 [Pa^2], Y [Pa] the limit of sqrt(3 J2)."""
    if Y <= 0.0:
        return 0.0
    if 3.0 * J2 <= Y * Y:
        return 1.0
    return Y / math.sqrt(3.0 * J2)
