"""What the ground opposes to a crater besides its weight, and what kind of ground that makes it: from the laws and
values of a case's materials.

The shear strength at no pressure counts, Y = sqrt(J2) at yield. Where a law names one strength for all pressures (von
Mises), the tension that the intact material bears is the better figure where it is less. Rock with flaws is weaker the
larger the piece, since a larger piece holds a weaker flaw: Weibull's exponent m gives

    Y(L) = Y(L_0) (L / L_0)^(-3 / m),   L_0 = 0.1 m     (Weibull 1939; Housen & Holsapple 1999, Icarus 142, 21)

with L the crater and L_0 the samples on which cohesion is measured. Granite (90 MPa, m = 6.2) then opposes 8 MPa to a
crater of 14 m, where 6.9 MPa is fitted to craters of metres in hard rock (Holsapple 1993), and 0.7 MPa to one of 2.5
km. What the shock has broken keeps at least its broken cohesion.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from sph.materials.rows import Materials
from sph.strength.dispatch import yield_stress

SOURCES = ("HousenHolsapple1999", "Holsapple1993")

SAMPLE = 0.1
"""Size of the samples of cohesion [m]."""
HOLDS = 0.1
"""Strength over rho g D at which the walls of a crater stand: a vertical cut as high as the crater is deep, H = D / 3,
stands up to Y = rho g H / 4 (Taylor 1937), 0.08 rho g D."""
LOOSE = 1.2
"""Distention from which on ground is as loose as sand."""


class Ground(NamedTuple):
    """Kind of ground (as ``[crater] ground``), its ``strength`` [Pa] for a crater of the size asked for, bulk
    ``density`` [kg/m^3], bulk ``sound`` speed and longitudinal ``wave`` speed [m/s]."""

    kind: Literal["fluid", "rock", "sand"]
    strength: float
    density: float
    sound: float
    wave: float


def ground(materials: Materials, name: str, size: float, strength: bool = True, damage: bool = True) -> Ground:
    """The ground of material ``name`` for a crater of ``size`` [m]; ``strength`` and ``damage`` as ``[sph]`` has
    them."""
    i, rows = materials.index(name), materials.rows
    law, row = int(rows.strength[i]), rows.strength_row[i]
    density, sound = float(materials.bulk_density[i]), float((rows.bulk[i] / rows.rho0[i]) ** 0.5)
    wave = float(((rows.bulk[i] + 4.0 / 3.0 * rows.shear[i]) / rows.rho0[i]) ** 0.5) if strength else sound
    if not strength or law == 0 or rows.shear[i] == 0.0:
        return Ground("fluid", 0.0, density, sound, wave)

    def shear(pressure: float, damaged: float) -> float:
        keeps = 1.0 if rows.mixes_damage[i] else 1.0 - damaged
        return keeps * float(yield_stress(law, row, pressure, 0.0, damaged)) / math.sqrt(3.0)

    broken = shear(0.0, 1.0)
    whole = broken if materials.predamaged(name) else shear(0.0, 0.0)
    if not rows.mixes_damage[i] and rows.tension[i] > 0.0:
        whole = min(whole, float(rows.tension[i]))
    if damage and rows.flawed[i] > 0.0 and whole > broken and size > SAMPLE:
        whole = max(whole * (size / SAMPLE) ** (-3.0 / materials.weibull(name).m), broken)
    if whole <= 0.0 and shear(1e8, 1.0 if materials.predamaged(name) else 0.0) <= 0.0:
        return Ground("fluid", 0.0, density, sound, wave)
    loose = whole <= 0.0 or rows.alpha0[i] >= LOOSE
    return Ground("sand" if loose else "rock", whole, density, sound, wave)
