"""When the shock stage of a case that does not say it lowers its sound speed, and to what: the ``[sph.late]`` of a
crater that grows after the shock has left (``sph.stepping.late`` is what a late stage does).

After the shock has left, the flow about a crater slows down while its time step stays that of sound. A point source
opens a crater as R(t) = R_T (t / T)^(mu / (1 + mu)), mu = 0.5 (``matter.case.formation_time``), so its edge moves at

    v(t) = R_T / (3 T) (t / T)^(-2/3)

and matter of the sound speed c flows as if it could not be compressed for v << c; what weighs on it or holds it
together strains it by rho g D / (rho c^2) and Y / (rho c^2). So

    c(t)  = max(MACH v(t), sqrt(STRAIN max(g D, Y / rho)))       MACH = 20, STRAIN = 20
    first at  t_1 = D / c_0, when a wave at the bulk sound speed c_0 of the rock has crossed the diameter, or where
              c(t) has fallen below c_0 / 2, whichever is later; the viscosity of the shock goes at t_1

and then by LOWER each time, which v takes a time LOWER^(-3/2) longer to do. Steps of the whole flow are then some MACH
R_T / (courant spacing), whatever the gravity: 43 million become some thousands on an asteroid.

A slow projectile that stays whole, rho U^2 below its own strength, ploughs on: v is not less than its speed, which the
drag rho C_d pi a^2 U^2 / 2 lowers as

    U / (1 + t / tau),     tau = 8 rho_p a / (3 C_d rho U),     C_d = 1

No late stage: ground without weight and strength; a crater that strength holds in rock or metal, where waves break and
bend what does not flow; a first switch later than an eighth of the run, which would save little. A crater in loose
ground without flaws flows until its cohesion ends it, as one that its weight ends.
"""

from __future__ import annotations

import math
from typing import Any

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
LATEST = 0.125
"""Latest first switch over the length of the run."""
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


def late_stage(
    target: Target, impact: Impact, materials: Materials, strength: bool, damage: bool, end: float
) -> dict[str, Any] | None:
    """``[sph.late]`` of a run until ``end`` [s]; None where there should be none. ``strength``, ``damage`` as
    ``[sph]`` has them."""
    diameter, gravity = impact.expected_transient_diameter, durations.surface_gravity(target, materials)
    name = target.layer_of(diameter).material
    ground = ground_strength.ground(materials, name, diameter, strength, damage)
    weight, holds = gravity * diameter, ground.strength / ground.density
    strains = max(weight, holds)
    flawed = damage and bool(materials.rows.flawed[materials.index(name)]) and not materials.predamaged(name)
    flows = holds < ground_strength.HOLDS * weight or (ground.kind == "sand" and not flawed)
    if ground.sound <= 0.0 or strains <= 0.0 or not flows:
        return None
    formation = durations.crater_time(target, impact, materials, strength, damage)
    slowest = math.sqrt(STRAIN * strains)
    first = SOFTEST_START * ground.sound
    left = CROSSED * diameter / ground.sound
    brakes = braking_time(impact, materials, ground, strength)

    def time_of(flow: float) -> float:
        """When crater and projectile have come down to a speed of ``flow`` [m/s]."""
        later = 1.0 / (1.0 - formation_time.GROWTH)  # v ~ t^-(1 - exponent): lower by q takes q^later as long
        edge = formation * (flow_speed(formation, 0.5 * diameter, formation) / flow) ** later
        return max(edge, brakes * (impact.speed / flow - 1.0))

    when = max(left, time_of(first / MACH))
    fastest = max(flow_speed(when, 0.5 * diameter, formation), impact.speed * brakes / (brakes + when))
    speed = max(MACH * fastest, slowest)
    if speed > first * (1.0 + 1e-9) or when > LATEST * end:
        return None
    switches = [(when, speed)]
    while LOWER * speed >= slowest and durations.rounded(when := time_of(LOWER * speed / MACH)) < end:
        switches.append((when, speed := LOWER * speed))
    viscosity_at = durations.rounded(left)
    (at, c), *slower = [(durations.rounded(when), durations.rounded(speed)) for when, speed in switches]
    return {
        "at": at,
        "sound_speed": c,
        "viscosity_at": viscosity_at if viscosity_at < at else None,
        "slower": tuple({"at": when, "sound_speed": speed} for when, speed in slower),
    }
