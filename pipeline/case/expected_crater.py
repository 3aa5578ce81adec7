"""The crater that an impact is expected to make, before anything is computed: what sizes the domain, the bed and the
lengths of runs that a case leaves open.

Diameter: geometric mean of the scaling laws of that kind of ground (``crater.scaling.crater_size.GROUNDS``), transient
and apparent. They are laws of the gravity regime; strength enters as the gravity that would end the growth at the same
size, by Holsapple's interpolation between both regimes

    pi_V = K {pi_2 + pi_3^((2 + mu) / 2)}^(-3 mu / (2 + mu)),   pi_2 = g a / U^2,  pi_3 = Y / (rho U^2),
    U = v cos(theta)

(Holsapple 1993, Annu. Rev. Earth Planet. Sci. 21, 333), so g_Y = pi_3^((2 + mu) / 2) U^2 / a is added to g. The
strength of rock falls with size (``sph.planning.ground_strength``), so size and strength are found in turns.

Of several layers that one counts in which the middle of its own crater lies (``Target.layer_of``), looked for from the
top. A crater that would reach through a layer, but not into the middle of the next one, ends at their boundary.

A crater almost as wide as the body that it is on is none: the body breaks as a whole (``sph.outcome.disruption``), and
what is expected is as wide as the body's radius.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from crater.scaling import crater_size
from matter.case.body import MIDDLE, Impact, Target
from matter.errors import InputError
from sph.materials.rows import Materials
from sph.planning import durations, ground_strength

ENDS = 0.95
"""Depth of the middle of a crater that ends at a boundary, over that of the boundary."""
WHOLE = 0.8
"""Diameter of a crater over that of its body from which on the body breaks as a whole."""
_TURNS = 12


class Expected(NamedTuple):
    """Transient apparent ``diameter`` [m], the ``material`` whose crater it is, surface ``gravity`` [m/s^2], the
    ``ground`` for a crater of that size."""

    diameter: float
    material: str
    gravity: float
    ground: ground_strength.Ground
    breaks: bool = False
    """Whether the body breaks as a whole."""

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
    gravity = durations.surface_gravity(target, materials)

    def of_size(name: str, size: float) -> Expected:
        breaks = not target.flat and size > WHOLE * 2.0 * target.radius
        size = target.radius if breaks else size
        ground = ground_strength.ground(materials, name, size, strength, damage)
        return Expected(size, name, gravity, ground, breaks)

    if diameter is not None:
        name = target.layer_of(diameter).material
        ground = ground_strength.ground(materials, name, diameter, strength, damage)
        return Expected(diameter, name, gravity, ground)
    above, depth = target.layers[-1].material, 0.0
    for layer in reversed(target.layers):
        size = _diameter(layer.material, impact, materials, gravity, strength, damage)
        if size * MIDDLE < depth:
            return of_size(above, ENDS * depth / MIDDLE)
        depth, above = depth + layer.thickness, layer.material
        if size * MIDDLE < depth:
            break
    return of_size(above, size)


def _diameter(name: str, impact: Impact, materials: Materials, gravity: float, strength: bool, damage: bool) -> float:
    """Diameter [m] of the crater in deep ground of the material ``name``; raises ``InputError``."""
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
    return size
