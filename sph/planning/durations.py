"""How long the shock stage runs and how often it writes when a case does not say it: all in units of the crater's
formation time T (``matter.case.formation_time``).

end           2 T         the crater is deepest at some 0.5 T, widest at T; the handoff looks at three snapshots after
                          the greatest depth
snapshots     T / 15      thirty in a run: one lies before the handoff's 0.1 T, the greatest depth and volume are
                          bracketed within 4 %
history       a quarter of that
first step    a / 100 U   a hundredth of the time in which the projectile (radius a, speed U) flies its own radius;
                          steps then grow by 10 % each
relaxation    1.5 times the way of sound through the body's radius, damped by e^-10 in all; none for flat ground, which
              starts in balance with its weight, and whose strength holds what noise is left
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from matter.case import at_rest, formation_time
from matter.case.body import Impact, Target
from sph.materials.rows import Materials, collect
from sph.materials.settings import Choice
from sph.planning import ground_strength

END, SNAPSHOT, HISTORY = 2.0, 1.0 / 15.0, 0.25
FIRST = 0.01
_CHOSEN: deque[tuple[Target, Impact, Mapping[str, Choice], Materials]] = deque(maxlen=8)
"""What was chosen last: ``--check`` of a case asks 140 times."""
CROSSINGS, FOLDS = 1.5, 10.0


def chosen(target: Target, impact: Impact, materials: Mapping[str, Choice]) -> Materials:
    """The materials of target and projectile with the laws that the case chooses, the same as before for the same
    objects; raises ``InputError``."""
    for known_target, known_impact, known_materials, found in _CHOSEN:
        if known_target is target and known_impact is impact and known_materials is materials:
            return found
    names = [*target.materials, *impact.projectile.materials, *target.block_materials]
    found = collect(tuple(dict.fromkeys(names)), materials)
    _CHOSEN.append((target, impact, materials, found))
    return found


def surface_gravity(target: Target, materials: Materials) -> float:
    """Gravity at the surface [m/s^2], of a body at uniform densities; 0 where nothing attracts."""
    return at_rest.surface_gravity(target, materials.at_rest) if target.flat or target.attracts else 0.0


def crater_time(target: Target, impact: Impact, materials: Materials, strength: bool, damage: bool) -> float:
    """The crater's formation time T [s] in the ground that is hit."""
    diameter, radius = impact.expected_transient_diameter, impact.projectile.radius
    ground = ground_strength.ground(materials, target.layer_of(diameter).material, diameter, strength, damage)
    ended = formation_time.of_crater(diameter, surface_gravity(target, materials), ground.density, ground.strength)
    return min(ended, formation_time.of_growth(diameter, radius, impact.speed))


def first_step(impact: Impact) -> float:
    """Length of the first step [s]."""
    return rounded(FIRST * impact.projectile.radius / impact.speed)


def relaxation_time(target: Target, materials: Materials) -> float:
    """Length of the settling before the impact [s]."""
    if target.flat or target.solid or not target.weighs or target.start != "relaxed":
        return 0.0
    i = [materials.index(layer.material) for layer in target.layers]
    sound = (materials.rows.bulk[i] / materials.rows.rho0[i]) ** 0.5
    return rounded(CROSSINGS * sum(layer.thickness / float(c) for layer, c in zip(target.layers, sound)))


def rounded(value: float) -> float:
    """Two digits: a default is a rule of thumb, and reads better in ``case.used.toml``."""
    return round(value, 1 - math.floor(math.log10(value))) if value > 0.0 else 0.0
