"""What the crater threw out: the blanket around it, and the matter that leaves the body."""

from __future__ import annotations

import numpy as np

from crater.ground import cloud as clouds
from crater.ground.datum import Datum
from crater.ground.shape import Ruler
from matter.constants import G
from matter.errors import InputError
from matter.particles import Particles

INNER, OUTER = 1.1, 3.0
"""The blanket is fitted between these many rim radii."""


def blanket(mean: np.ndarray, ruler: Ruler, rim: float) -> tuple[float, float]:
    """Exponent n and height t0 [m] of h = t0 (r / R)^-n beyond the crest at ``rim`` = R [m]; NaN where fewer than five
    rings stand up.

    Least squares of log h on log(r / R), weights area, from 1.1 R to 3 R or to the first ring at or below the datum
    (McGetchin et al. 1973: n = 3; t0 holds the uplift of the rim as well as what was thrown on it).
    """
    ring = np.flatnonzero((ruler.s > INNER * rim) & (ruler.s < OUTER * rim))
    low = np.flatnonzero(mean[ring] <= 0.0)
    ring = ring[: low[0]] if len(low) else ring
    if len(ring) < 5:
        return float("nan"), float("nan")
    # an error of fixed height weighs as h in the logarithm
    weight = np.sqrt(ruler.area[ring]) * mean[ring]
    slope, offset = np.polyfit(np.log(ruler.s[ring] / rim), np.log(mean[ring]), 1, w=weight)
    return float(-slope), float(np.exp(offset))


def leaving(particles: Particles, body_mass: float, projectile_momentum: np.ndarray | None = None) -> dict[str, float]:
    """Mass that leaves a body of ``body_mass`` [kg]: more kinetic than potential energy and moving outwards; target
    and projectile apart.

    ``target_mass_kg``, ``projectile_mass_kg``, ``momentum_x .. z`` [kg m/s] of what leaves, and ``beta`` = 1 - (p_out
    . p) / p^2 with the projectile's momentum p where it is given: the momentum that stays with the body, in units of
    what was brought.
    """
    particles.need("position", "velocity", "mass")
    r = np.linalg.norm(particles.position, axis=1)
    energy = 0.5 * (particles.velocity**2).sum(axis=1) - G * body_mass / np.maximum(r, 1.0)
    outwards = np.einsum("ij,ij->i", particles.velocity, particles.position) > 0.0
    return _lost(particles, (energy > 0.0) & outwards, projectile_momentum)


def leaving_ground(
    particles: Particles, datum: Datum, escape_speed: float, projectile_momentum: np.ndarray | None = None
) -> dict[str, float]:
    """The same for flat ground: what is above the ``datum``, rises, and is faster than ``escape_speed`` [m/s] of the
    body that the ground stands for."""
    particles.need("position", "velocity", "mass")
    fast = (particles.velocity**2).sum(axis=1) > escape_speed**2
    above = datum.polar(particles.position)[2] > 0.0
    return _lost(
        particles, fast & above & (datum.vertical(particles.position, particles.velocity) > 0.0), projectile_momentum
    )


def _lost(particles: Particles, escaping: np.ndarray, projectile_momentum: np.ndarray | None) -> dict[str, float]:
    foreign = particles.layer < 0 if "layer" in particles else np.zeros(len(particles), dtype=bool)
    momentum = (particles.mass[escaping, None] * particles.velocity[escaping]).sum(axis=0)
    result = {
        "target_mass_kg": float(particles.mass[escaping & ~foreign].sum()),
        "projectile_mass_kg": float(particles.mass[escaping & foreign].sum()),
        **{f"momentum_{axis}": float(p) for axis, p in zip("xyz", momentum)},
    }
    if projectile_momentum is not None:
        p = np.asarray(projectile_momentum, dtype=float)
        result["beta"] = float(1.0 - momentum @ p / (p @ p))
    return result


SPEEDS = 25


def mass_above(particles: Particles, datum: Datum, fastest: float) -> dict[str, list[float]]:
    """M(>v): ``mass_kg`` of the target's matter that flies (above the ``datum``, rising, no part of the ground) faster
    than each of ``speed_m_s``.

    Speeds are spaced evenly in the logarithm from a thousandth of ``fastest`` [m/s] to it. Empty where the snapshot
    has no ground or lacks mass and velocity.
    """
    if not {"mass", "velocity"} <= set(particles):
        return {}
    target = particles.select(particles.layer >= 0) if "layer" in particles else particles
    try:
        body = clouds.particle_cloud(target, "the snapshot")
        ground = np.zeros(len(target), dtype=bool)
        ground[np.flatnonzero(target.state == 0) if "state" in target else slice(None)] = clouds.supported(body)
    except InputError:
        return {}
    height = datum.polar(target.position)[2]
    flying = ~ground & (height > 0.0) & (datum.vertical(target.position, target.velocity) > 0.0)
    speed, mass = np.linalg.norm(target.velocity[flying], axis=1), target.mass[flying]
    steps = np.geomspace(1e-3 * fastest, fastest, SPEEDS)
    return {"speed_m_s": steps.tolist(), "mass_kg": [float(mass[speed > v].sum()) for v in steps]}
