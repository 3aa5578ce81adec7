"""When the shock stage of a case that does not say it lowers its sound speed, and to what: the ``[sph.late]`` of a
crater that grows after the shock has left (``sph.stepping.late`` is what a late stage does).

After the shock has left, the flow about a crater slows down while its time step stays that of sound. A point source
opens a crater as R(t) = R_T (t / T)^(mu / (1 + mu)), mu = 0.5 (``matter.case.formation_time``), so its edge moves at

    v(t) = R_T / (3 T) (t / T)^(-2/3)

and matter of the sound speed c flows as if it could not be compressed for v << c; what weighs on it or holds it
together strains it by rho g D / (rho c^2) and Y / (rho c^2). So

    c(t)  = max(MACH v(t), sqrt(STRAIN max(g D, Y / rho)))       MACH = 20, STRAIN = 20
    first at  t_1 = D / c_0, when a wave at the bulk sound speed c_0 of the rock has crossed the diameter, or where
              c(t) has fallen below c_0 / 2, whichever is later

and then by LOWER each time, which v takes a time LOWER^(-3/2) longer to do. Steps of the whole flow are then some MACH
R_T / (courant spacing), whatever the gravity: 43 million become some thousands on an asteroid.

The viscosity of the shock goes earlier, when

    v(t) < c_0 / 6   and   c_0 t > FRONTS dx      dx: spacing of the particles of the crater

(the wave is then a diameter of the crater as it is away, and as many spacings as a front is wide), at the latest at
t_1, also where the sound speed is not lowered. Until then it brakes the flow, the more the coarser: kept until t_1 it
leaves holes of 29, 32, 34 m3 in the shot at Ryugu with 12, 8, 5.5 cm; until 0.2 ms 36, 35, 36 m3; until 0.38 ms, by
this rule, 32 m3 with 12 cm (docs/results/sph_late).

A slow projectile that stays whole, rho U^2 below its own strength, ploughs on: v is not less than its speed, which the
drag rho C_d pi a^2 U^2 / 2 lowers as

    U / (1 + t / tau),     tau = 8 rho_p a / (3 C_d rho U),     C_d = 1

No late stage: ground without weight and strength; a crater that strength holds in rock or metal, where waves break and
bend what does not flow; a shock that leaves later than the run ends. A first switch in the second half of the run
would save little: only the viscosity goes. A crater in loose ground without flaws flows until its cohesion ends it, as
one that its weight ends, where the first switch comes in the first eighth of the run: shorter ones are about waves.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from matter.case import formation_time
from matter.case.body import Impact, Target
from sph.materials.rows import Materials
from sph.planning import durations, ground_strength

MACH, STRAIN = 20.0, 20.0
"""Sound speed over the flow's; bulk modulus over what strains the ground."""
CROSSED = 1.0
"""Diameters that a wave crosses before the first switch."""
SOFTEST_START = 0.5
"""Largest first sound speed over that of the rock."""
LATEST, LATEST_HELD = 0.5, 0.125
"""Latest first switch over the length of the run where weight and where cohesion ends the crater."""
SLOW, FRONTS = 6.0, 10.0
"""Sound speed of the rock over that of the flow, and spacings between crater and wave, where the viscosity of the
shock goes."""
DRAG = 1.0
"""Drag coefficient of a ball in grains."""
LOWER = 0.5**0.5
"""Sound speed after a switch over that before; two switches for every half."""


def flow_speed(time: float, radius: float, formation: float) -> float:
    """v [m/s] of the edge of a crater that reaches ``radius`` [m] at the time ``formation`` T [s], at ``time`` [s]."""
    exponent = formation_time.GROWTH
    return exponent * radius / formation * (time / formation) ** (exponent - 1.0)


def braking_time(impact: Impact, materials: Materials, ground: ground_strength.Ground, strength: bool) -> float:
    """tau [s] of a projectile that stays whole, whose speed falls as U / (1 + t / tau); 0 for one that becomes part of
    the flow."""
    ball = impact.projectile
    solid = ground_strength.ground(materials, ball.material, ball.radius, strength)
    if ground.density * impact.speed**2 >= solid.strength:
        return 0.0
    return 8.0 / 3.0 * solid.density / ground.density * ball.radius / (DRAG * impact.speed)


class Growth(NamedTuple):
    """A crater that grows after the shock: ``ground`` in which it is, ``by_weight`` whether weight ends it, squared
    speed ``strains`` [m^2/s^2] of what strains the ground, ``diameter`` [m], ``formation`` time [s], time ``brakes``
    [s] in which drag halves the ``speed`` [m/s] of a projectile that stays whole."""

    ground: ground_strength.Ground
    by_weight: bool
    strains: float
    diameter: float
    formation: float
    brakes: float
    speed: float

    @property
    def left(self) -> float:
        """When the wave has crossed the crater's diameter [s]."""
        return CROSSED * self.diameter / self.ground.sound

    def time_of(self, flow: float) -> float:
        """When crater and projectile have come down to a speed of ``flow`` [m/s]."""
        later = 1.0 / (1.0 - formation_time.GROWTH)  # v ~ t^-(1 - exponent): lower by q takes q^later as long
        edge = self.formation * (flow_speed(self.formation, 0.5 * self.diameter, self.formation) / flow) ** later
        return max(edge, self.brakes * (self.speed / flow - 1.0))

    def fastest(self, time: float) -> float:
        """Speed of the edge or of the projectile at ``time`` [m/s]."""
        ball = self.speed * self.brakes / (self.brakes + time)
        return max(flow_speed(time, 0.5 * self.diameter, self.formation), ball)

    def viscosity_at(self, spacing: float) -> float:
        """When the viscosity of the shock goes [s], with particles ``spacing`` [m] apart where the crater grows."""
        smooth = max(self.time_of(self.ground.sound / SLOW), FRONTS * spacing / self.ground.sound)
        return durations.rounded(min(self.left, smooth))


def growth(target: Target, impact: Impact, materials: Materials, strength: bool, damage: bool) -> Growth | None:
    """The crater that is expected, None where it does not grow after the shock. ``strength``, ``damage`` as ``[sph]``
    has them."""
    diameter, gravity = impact.expected_transient_diameter, durations.surface_gravity(target, materials)
    name = target.layer_of(diameter).material
    ground = ground_strength.ground(materials, name, diameter, strength, damage)
    weight, holds = gravity * diameter, ground.strength / ground.density
    flawed = damage and bool(materials.rows.flawed[materials.index(name)]) and not materials.predamaged(name)
    by_weight, strains = holds < ground_strength.HOLDS * weight, max(weight, holds)
    if ground.sound <= 0.0 or strains <= 0.0 or not (by_weight or (ground.kind == "sand" and not flawed)):
        return None
    formation = durations.crater_time(target, impact, materials, strength, damage)
    brakes = braking_time(impact, materials, ground, strength)
    return Growth(ground, by_weight, strains, diameter, formation, brakes, impact.speed)


def late_stage(crater: Growth, spacing: float, end: float) -> dict[str, Any] | None:
    """``[sph.late]`` of a run until ``end`` [s] with particles ``spacing`` [m] apart where the crater grows; None
    where there should be none."""
    slowest, first = math.sqrt(STRAIN * crater.strains), SOFTEST_START * crater.ground.sound
    when = max(crater.left, crater.time_of(first / MACH))
    speed, viscosity_at = max(MACH * crater.fastest(when), slowest), crater.viscosity_at(spacing)
    stays = speed > first * (1.0 + 1e-9) or when > (LATEST if crater.by_weight else LATEST_HELD) * end
    if viscosity_at >= end or (stays and not crater.by_weight):
        return None
    if stays:
        return {"viscosity_at": viscosity_at}
    switches = [(when, speed)]
    while LOWER * speed >= slowest and durations.rounded(when := crater.time_of(LOWER * speed / MACH)) < end:
        switches.append((when, speed := LOWER * speed))
    (at, c), *slower = [(durations.rounded(when), durations.rounded(speed)) for when, speed in switches]
    return {
        "at": at,
        "sound_speed": c,
        "viscosity_at": viscosity_at if viscosity_at < at else None,
        "slower": tuple({"at": when, "sound_speed": speed} for when, speed in slower),
    }
