"""The last leg: from a moon's Hill sphere to its surface on the two-body hyperbola.

A particle at distance r0 with velocity v0 (relative to the moon, angle theta between -x0 and v0) reaches the surface of radius R with

    v_imp^2 = v0^2 + 2 GM (1/R - 1/r0),   sin(gamma) = r0 v0 sin(theta) / (R v_imp),

gamma the angle from the vertical, if sin(gamma) <= 1: a disc of impact parameters b = r0 sin(theta) <= b_max = R v_imp / v0.
Moon mode (Winter 2017, section 2.1.1): the velocity at entry is kept, the position redrawn uniformly on the hemisphere of the Hill sphere
that faces the entry point until the particle hits. Here the hit is drawn at once: uniform over the cap theta < theta_max about -v0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class Impact(NamedTuple):
    """How particles hit: ``position``, ``velocity`` relative to the moon at the surface (n, 3), ``angle`` from the vertical [rad],
    ``flight_time`` from the Hill sphere [s]."""

    position: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray
    flight_time: np.ndarray


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Row-wise scalar product."""
    return np.einsum("...i,...i->...", a, b)


def capture_parameter(radius: float, gm: float, distance: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Largest impact parameter b_max [m] (lever arm of the velocity at ``distance``) that still hits the surface."""
    inside = 1.0 + 2.0 * gm * (1.0 / radius - 1.0 / distance) / speed**2
    return np.minimum(radius * np.sqrt(np.maximum(inside, 0.0)), distance)


def hit_probability(radius: float, gm: float, distance: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Chance that a particle entering the Hill sphere anywhere on its cross-section hits: (b_max / r0)^2."""
    return (capture_parameter(radius, gm, distance, speed) / distance) ** 2


def resample(entry: np.ndarray, velocity: np.ndarray, radius: float, gm: float, rng: np.random.Generator, tries: int = 100000):
    """Moon mode: a new place on the Hill sphere from which the particle hits.

    ``entry`` and ``velocity`` (3,) are relative to the moon. Returns (place (3,), draws): how many uniform draws over the facing hemisphere
    it would have taken. None for the place when no such point exists on that hemisphere.
    """
    distance, speed = np.linalg.norm(entry), np.linalg.norm(velocity)
    n, back = entry / distance, -velocity / speed
    sine = capture_parameter(radius, gm, distance, speed) / distance
    least = math.sqrt(max(0.0, 1.0 - sine * sine))
    share = 1.0 - least  # of the hemisphere's solid angle 2 pi, while the cap lies inside it
    helper = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    first = np.cross(back, helper)
    first /= np.linalg.norm(first)
    second = np.cross(back, first)
    for draw in range(1, tries + 1):
        c, longitude = rng.uniform(least, 1.0), rng.uniform(0.0, 2.0 * math.pi)
        s = math.sqrt(1.0 - c * c)
        place = c * back + s * (math.cos(longitude) * first + math.sin(longitude) * second)
        if place @ n >= 0.0:
            return distance * place, int(rng.negative_binomial(draw, share)) + draw
    return None, tries


def fall(place: np.ndarray, velocity: np.ndarray, radius: float, gm: float) -> Impact:
    """Two-body flight of particles (n, 3) from outside down to ``radius``; all must hit (NaN where they do not)."""
    r0, v0 = np.sqrt(dot(place, place)), np.sqrt(dot(velocity, velocity))
    h = np.cross(place, velocity)
    momentum = np.sqrt(dot(h, h))
    energy = 0.5 * v0**2 - gm / r0
    speed = np.sqrt(2.0 * (energy + gm / radius))
    with np.errstate(invalid="ignore"):
        angle = np.arcsin(momentum / (radius * speed))
    p = momentum**2 / gm
    e = np.sqrt(np.maximum(1.0 + 2.0 * energy * momentum**2 / gm**2, 1e-30))
    start = -np.arccos(np.clip((p / r0 - 1.0) / e, -1.0, 1.0))
    end = -np.arccos(np.clip((p / radius - 1.0) / e, -1.0, 1.0))
    up = place / r0[:, None]
    across = velocity - dot(velocity, up)[:, None] * up
    length = np.sqrt(dot(across, across))
    across = np.where(length[:, None] > 0.0, across / np.maximum(length, 1e-300)[:, None], 0.0)
    turn = (end - start)[:, None]
    position = radius * (np.cos(turn) * up + np.sin(turn) * across)
    tangent = -np.sin(turn) * up + np.cos(turn) * across
    arrival = -(speed * np.cos(angle))[:, None] * position / radius + (speed * np.sin(angle))[:, None] * tangent
    return Impact(position, arrival, angle, _time(start, energy, momentum, e, gm) - _time(end, energy, momentum, e, gm))


def _time(anomaly: np.ndarray, energy: np.ndarray, momentum: np.ndarray, e: np.ndarray, gm: float) -> np.ndarray:
    """Time before the pericentre [s] at a (negative) true anomaly, on hyperbola or ellipse."""
    a = -gm / (2.0 * energy)
    root = np.sqrt(np.abs(e - 1.0) / (e + 1.0)) * np.abs(np.tan(0.5 * anomaly))
    with np.errstate(invalid="ignore", divide="ignore"):
        hyperbolic = 2.0 * np.arctanh(np.minimum(root, 1.0 - 1e-16))
        elliptic = 2.0 * np.arctan(root)
        far = e * np.sinh(hyperbolic) - hyperbolic
        near = elliptic - e * np.sin(elliptic)
    return np.sqrt(np.abs(a) ** 3 / gm) * np.where(energy > 0.0, far, near)


def pericentre(place: np.ndarray, velocity: np.ndarray, gm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance [m], speed [m/s] and time from ``place`` [s] of the closest approach of particles (n, 3) on two-body orbits."""
    r0, v0 = np.sqrt(dot(place, place)), np.sqrt(dot(velocity, velocity))
    h = np.cross(place, velocity)
    momentum = np.sqrt(dot(h, h))
    energy = 0.5 * v0**2 - gm / r0
    e = np.sqrt(np.maximum(1.0 + 2.0 * energy * momentum**2 / gm**2, 1e-30))
    p = momentum**2 / gm
    nearest = p / (1.0 + e)
    start = -np.arccos(np.clip((p / r0 - 1.0) / e, -1.0, 1.0))
    return nearest, momentum / nearest, _time(start, energy, momentum, e, gm)
