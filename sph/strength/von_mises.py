"""Von Mises yield with a radial return and thermal softening (Benz & Asphaug 1994, 1999).

    S <- f S,   f = min(Y / sqrt(3 J2), 1),   J2 = S:S / 2,   Y = Y0 max(1 - u / u_melt, 0)

This is the radial return: after it sqrt(3 J2) = Y, and a second application changes nothing. (Benz & Asphaug print Y^2 / (3 J2), which
returns below the yield surface and makes the result depend on the step.)
"""

import math
from typing import NamedTuple

from matter.jit import law
from matter.quantity import PositivePressure, SpecificEnergy


class Parameters(NamedTuple):
    """Y0: yield stress of the cold material [Pa]; melt_energy: specific energy at which strength is gone [J/kg]."""

    Y0: PositivePressure
    melt_energy: SpecificEnergy


@law
def yield_stress(u, p):
    """Y [Pa] at specific energy u [J/kg]."""
    return p.Y0 * min(max(1.0 - u / p.melt_energy, 0.0), 1.0)


@law
def return_factor(J2, Y):
    """The factor f by which the deviatoric stress shrinks; J2 [Pa^2], Y [Pa]."""
    if Y <= 0.0:
        return 0.0
    if 3.0 * J2 <= Y * Y:
        return 1.0
    return Y / math.sqrt(3.0 * J2)
