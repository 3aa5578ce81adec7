"""Johnson-Cook strength of metals: hardened by plastic strain and by its rate, weakened by heat (Johnson & Cook 1983,
Proc. 7th Int. Symp. Ballistics, 541, eq. 1).

    Y = [A + B eps^n] [1 + C ln(rate / rate_0)] [1 - T*^m],   T* = (T - T_0) / (T_m - T_0), 0 to 1,   rate_0 = 1 / s

A [Pa] yield stress, B [Pa] and n hardening, C sensitivity to the rate, m softening; eps the plastic strain that a
particle has gathered. At each evaluation it grows by what the radial return takes off, (1 - f) sqrt(3 J2) / (3 G), and
hardens the next one: explicit, good while a step strains by little. The rate is one number for the material
(``strain_rate``, for an impact of the order of speed over radius of the projectile): C ln 10 is 0.5 % to 6 % a decade,
so that the point-to-point rate is left out. T* needs ``[thermal] melt_temperature`` (``sph.materials.temperature``);
without it, heat is u / melt_energy. Molten (T* = 1) it bears nothing. Damage takes the shear stress as a whole.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.identity_fields import Follows
from matter.case.quantity import PositivePressure, Pressure, Rate, SpecificEnergy
from matter.compilation.jit import law

SOURCES = ("JohnsonCook1983",)
MIXES_DAMAGE = False
"""Damage does not stand in Y: it takes the shear stress as a whole."""
HARDENS = True
"""Plastic strain is kept by particle and stands in Y."""


class Parameters(NamedTuple):
    """A [Pa], B [Pa], n, C, m, strain_rate [1/s] (default: rate_0, no hardening by rate), melt_energy [J/kg] where
    no temperature is known (default: heat weakens nothing)."""

    A: PositivePressure
    B: Annotated[Pressure, Field(ge=0)]
    n: Annotated[float, Field(gt=0)]
    C: Annotated[float, Field(ge=0)]
    m: Annotated[float, Field(gt=0)]
    strain_rate: Annotated[Rate, Field(ge=1)] = 1.0
    melt_energy: Annotated[SpecificEnergy, Follows()] = math.inf


EXAMPLE = Parameters(90e6, 292e6, 0.31, 0.025, 1.09, 1.0, 4e5)
"""OFHC copper of Johnson & Cook 1983, table 1."""


@law
def yield_stress(P, u, D, p):
    """Y [Pa] without plastic strain, the limit of sqrt(3 J2), at ``u`` / melt_energy = T*; pressure and damage do not
    change it."""
    warm = min(max(u / p.melt_energy, 0.0), 1.0)
    thermal = 1.0 - math.pow(warm, p.m) if warm > 0.0 else 1.0
    return p.A * (1.0 + p.C * math.log(p.strain_rate)) * thermal


@law
def hardening(strain, p):
    """The factor of Y at a plastic strain."""
    return 1.0 + p.B / p.A * math.pow(strain, p.n) if strain > 0.0 else 1.0
