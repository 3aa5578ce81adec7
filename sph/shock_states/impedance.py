"""The planar limit: pressure of a plate that hits another at a normal speed v, before any free surface is felt.

Both sides of the contact move on with one speed w and share one pressure: P_target(w) = P_projectile(v - w), each on
its own Hugoniot (Melosh 1989, section 4.5). A sphere reaches it at the first contact only; nothing in a run should lie
much above it. Pores count as crushed: the shock starts from the bulk density.
"""

from __future__ import annotations

from typing import NamedTuple

from scipy.optimize import brentq

from sph.materials.rows import Materials
from sph.shock_states import hugoniot

SOURCES = ("Melosh1989",)


class ContactState(NamedTuple):
    """Pressure at the contact [Pa], and the speed that the target's surface takes [m/s]."""

    pressure: float
    speed: float


def planar(materials: Materials, projectile: str, target: str, speed: float) -> ContactState:
    """A plate of ``projectile`` on one of ``target`` (names) at ``speed`` [m/s].

    Raises ``ValueError`` where an equation of state has no shock of that strength, or the two curves do not meet.
    """
    sides = []
    for name in (projectile, target):
        m = materials.index(name)
        pressure, rest = hugoniot.solid(materials.rows, m)
        sides.append((pressure, rest._replace(rho=float(materials.bulk_density[m]))))
    (own, light), (other, ground) = sides

    def miss(w: float) -> float:
        return hugoniot.behind(other, ground, w).P - hugoniot.behind(own, light, speed - w).P

    w = float(brentq(miss, 1e-3 * speed, (1.0 - 1e-3) * speed, xtol=1e-6 * speed))
    return ContactState(hugoniot.behind(other, ground, w).P, w)
