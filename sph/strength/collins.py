"""Rock strength of Collins, Melosh & Ivanov 2004 (Meteorit. Planet. Sci. 39, 217): intact and broken rock, mixed by
damage.

    intact (Lundborg 1968)   Y_i = Y_i0 + mu_i P / (1 + mu_i P / (Y_M - Y_i0))
    broken                   Y_d = min(Y_d0 + mu_d P, Y_i)
    sqrt(J2) <= Y = [(1 - D) Y_i + D Y_d] max(1 - u / u_melt, 0)

Eqs. 1-4 there, softening by energy instead of temperature. Y_i0 cohesion, mu_i coefficient of internal friction, Y_M
the limiting strength at high pressure, Y_d0 and mu_d of the broken rock, D damage. Under tension both branches go on
with their slope at P = 0 down to zero (the intact one smoothly). D stands in Y: the shear stress itself is not reduced
by (1 - D) once more.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.identity_fields import Follows
from matter.case.quantity import PositivePressure, Pressure, SpecificEnergy
from matter.compilation.jit import law
from sph.strength import thermal_softening

SOURCES = ("Collins2004", "Lundborg1968")
RUBS = True
"""Friction stands in Y: pressure raises it."""
MIXES_DAMAGE = True
"""Y goes from intact to broken rock with damage."""
SQRT3 = 1.7320508075688772


class Parameters(NamedTuple):
    """Y_i0 (cohesion) [Pa], mu_i (internal_friction), Y_M (limiting_strength) [Pa] > cohesion, Y_d0 (cohesion_damaged)
    [Pa], mu_d (friction_damaged), melt_energy [J/kg], that of the material (``[melting]``; none: no softening)."""

    cohesion: Annotated[Pressure, Field(ge=0.0)]
    internal_friction: Annotated[float, Field(ge=0.0)]
    limiting_strength: PositivePressure
    cohesion_damaged: Annotated[Pressure, Field(ge=0.0)] = 0.0
    friction_damaged: Annotated[float, Field(ge=0.0)] = 0.0
    melt_energy: Annotated[SpecificEnergy, Follows()] = math.inf


EXAMPLE = Parameters(90e6, 2.0, 1.5e9, 1e5, 0.8, 3.4e6)


def fault(p: Parameters) -> str:
    """What is wrong with the values together, or nothing."""
    return "" if p.limiting_strength > p.cohesion else "limiting_strength must be above cohesion"


@law
def intact(P, p):
    """Y_i [Pa] of intact rock at pressure P [Pa]."""
    friction = p.internal_friction * P
    if friction <= 0.0:
        return max(p.cohesion + friction, 0.0)
    return p.cohesion + friction / (1.0 + friction / (p.limiting_strength - p.cohesion))


@law
def broken(P, p):
    """Y_d [Pa] of broken rock at pressure P [Pa], never above that of intact rock."""
    return min(max(p.cohesion_damaged + p.friction_damaged * P, 0.0), intact(P, p))


@law
def shear_strength(P, u, D, p):
    """The limit of sqrt(J2) [Pa] at pressure P [Pa], specific energy u [J/kg] and damage D."""
    return ((1.0 - D) * intact(P, p) + D * broken(P, p)) * thermal_softening.softening(u, p.melt_energy)


@law
def yield_stress(P, u, D, p):
    """The limit of sqrt(3 J2) [Pa]."""
    return SQRT3 * shear_strength(P, u, D, p)
