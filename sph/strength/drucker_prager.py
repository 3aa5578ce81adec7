"""Drucker-Prager yield: friction and cohesion (Drucker & Prager 1952, Q. Appl. Math. 10, 157), for soil, sand and
broken rock.

    sqrt(J2) <= (1 - D) A + B P,   A = 6 c cos(phi) / (sqrt(3) (3 - sin(phi))),
    B = 6 sin(phi) / (sqrt(3) (3 - sin(phi)))

phi angle of internal friction, c cohesion, P pressure (positive in compression), D damage: the cone through the
compressive edges of Mohr-Coulomb, so that triaxial compression yields at the angle phi. Damage breaks the cohesion and
leaves the friction; the shear stress itself is not reduced by it. The whole is softened by the melt energy, its tip
with it. The cone ends at the tension P = -(1 - D) A / B: beyond it no pressure is borne, and none at all by dry sand
(c = 0). phi = 0 is a constant shear strength, c cot(phi) then infinite.
"""

import math
from typing import Annotated, NamedTuple

from pydantic import Field

from matter.case.identity_fields import Follows
from matter.case.quantity import Angle, Pressure, SpecificEnergy
from matter.compilation.jit import law
from sph.strength import thermal_softening

SOURCES = ("DruckerPrager1952",)
RUBS = True
"""Friction stands in Y: pressure raises it."""
MIXES_DAMAGE = True
"""Damage stands in the cohesion."""
SQRT3 = 1.7320508075688772


class Parameters(NamedTuple):
    """friction_angle phi [rad], cohesion c [Pa], melt_energy [J/kg], that of the material
    (``[melting]``; none: no softening)."""

    friction_angle: Annotated[Angle, Field(ge=0.0, lt=0.5 * math.pi)]
    cohesion: Annotated[Pressure, Field(ge=0.0)]
    melt_energy: Annotated[SpecificEnergy, Follows()] = math.inf


EXAMPLE = Parameters(math.radians(35.0), 1e6)


class Cone(NamedTuple):
    """A [Pa], B and melt_energy [J/kg]: what the compiled loop reads, without angles."""

    A: float
    B: float
    melt_energy: float


Row = Cone


def cone(p: Parameters) -> Cone:
    """The cone of an angle and a cohesion."""
    edge = 6.0 / (SQRT3 * (3.0 - math.sin(p.friction_angle)))
    return Cone(edge * p.cohesion * math.cos(p.friction_angle), edge * math.sin(p.friction_angle), p.melt_energy)


row = cone


@law
def shear_strength(P, u, D, k):
    """The limit of sqrt(J2) [Pa] at pressure P [Pa], specific energy u [J/kg] and damage D; ``k`` a ``Cone``."""
    return max((1.0 - D) * k.A + k.B * P, 0.0) * thermal_softening.softening(u, k.melt_energy)


@law
def yield_stress(P, u, D, k):
    """The limit of sqrt(3 J2) [Pa]."""
    return SQRT3 * shear_strength(P, u, D, k)


@law
def apex(u, D, k):
    """The largest tension [Pa] that the cone admits, (1 - D) A / B = (1 - D) c cot(phi), softened as its height is;
    1e300 without friction (while any cohesion is left)."""
    left = (1.0 - D) * k.A * thermal_softening.softening(u, k.melt_energy)
    if left <= 0.0:
        return 0.0
    if k.B <= 0.0:
        return 1e300
    return left / k.B
