"""The crater that an impact is expected to make, before anything is computed: what sizes the domain, the bed and the
lengths of runs that a case leaves open.

Diameter: geometric mean of the scaling laws of that kind of ground (``crater.scaling.crater_size.GROUNDS``), transient
and apparent. They are laws of the gravity regime; strength enters as the gravity that would end the growth at the same
size, by Holsapple's interpolation between both regimes

    pi_V = K {pi_2 + pi_3^((2 + mu) / 2)}^(-3 mu / (2 + mu)),   pi_2 = g a / U^2,  pi_3 = Y / (rho U^2),
    U = v cos(theta)

(Holsapple 1993, Annu. Rev. Earth Planet. Sci. 21, 333), so g_Y = pi_3^((2 + mu) / 2) U^2 / a is added to g. The
strength of rock falls with size (``sph.planning.ground_strength``), so size and strength are found in turns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from crater.scaling import crater_size
from matter.case.body import Impact, Target
from matter.errors import InputError
from sph.materials.rows import Materials
from sph.planning import durations, ground_strength

_TURNS = 12


class Expected(NamedTuple):
    """Transient apparent ``diameter`` [m], surface ``gravity`` [m/s^2], the ``ground`` for a crater of that size."""

    diameter: float
    gravity: float
    ground: ground_strength.Ground

    @property
    def weight(self) -> float:
        """rho g D [Pa]."""
        return self.ground.density * self.gravity * self.diameter

    @property
    def held(self) -> bool:
        """Whether strength keeps the walls of the crater standing."""
        return self.ground.strength > ground_strength.HOLDS * self.weight


def of_case(
    target: Target,
    impact: Impact,
    materials: Materials,
    strength: bool = True,
    damage: bool = True,
    diameter: float | None = None,
) -> Expected:
    """The crater of an impact; ``diameter`` [m] where the case gives it. Raises ``InputError`` where neither weight
    nor strength ends its growth."""
    gravity, name = durations.surface_gravity(target, materials), target.layers[-1].material
    if diameter is not None:
        return Expected(diameter, gravity, ground_strength.ground(materials, name, diameter, strength, damage))
    ball, size = impact.projectile, 20.0 * impact.projectile.radius
    density = float(materials.bulk_density[materials.index(ball.material)])
    for _ in range(_TURNS):
        ground = ground_strength.ground(materials, name, size, strength, damage)
        mu, square = crater_size.VOLUMES[ground.kind][1], (impact.speed * math.cos(impact.angle_from_vertical)) ** 2
        held = (ground.strength / (ground.density * square)) ** (0.5 * (2.0 + mu)) * square / ball.radius
        if gravity + held <= 0.0:
            raise InputError(
                "neither weight nor strength ends the growth of this crater: say how wide it is expected to be"
            )
        event = crater_size.ImpactEvent(
            ball.radius, impact.speed, impact.angle_from_vertical, gravity + held, density, ground.density
        )
        size = math.exp(
            sum(math.log(crater_size.LAWS[law](event)) for law in crater_size.GROUNDS[ground.kind])
            / len(crater_size.GROUNDS[ground.kind])
        )
    return Expected(size, gravity, ground_strength.ground(materials, name, size, strength, damage))
