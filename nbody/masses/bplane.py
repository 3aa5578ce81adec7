"""The last leg: from a moon's Hill sphere to its surface, under the planet's tide to a fifth of the way, then on the
two-body hyperbola.

A particle at distance r0 with velocity v0 (relative to the moon, angle theta between -x0 and v0) reaches the surface
of radius R with

    v_imp^2 = v0^2 + 2 GM (1/R - 1/r0),   sin(gamma) = r0 v0 sin(theta) / (R v_imp),

gamma the angle from the vertical, if sin(gamma) <= 1: a disc of impact parameters b = r0 sin(theta) <= b_max = R v_imp
/ v0. Moon mode (Winter 2017, section 2.1.1): the velocity at entry is kept, the position redrawn uniformly on the
hemisphere of the Hill sphere that faces the entry point until the particle hits. Here the hit is drawn at once:
uniform over the cap theta < theta_max about -v0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class Impact(NamedTuple):
    """How particles hit: ``position``, ``velocity`` relative to the moon at the surface (n, 3), ``angle`` from the
    vertical [rad], ``flight_time`` from the Hill sphere [s]."""

    position: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray
    flight_time: np.ndarray


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Row-wise scalar product."""
    return np.einsum("...i,...i->...", a, b)


def capture_parameter(radius: float, gm: float, distance: np.ndarray | float, speed: np.ndarray | float) -> np.ndarray:
    """Largest impact parameter b_max [m] (lever arm of the velocity at ``distance``) that still hits the surface."""
    inside = 1.0 + 2.0 * gm * (1.0 / radius - 1.0 / distance) / speed**2
    return np.minimum(radius * np.sqrt(np.maximum(inside, 0.0)), distance)


def hit_probability(radius: float, gm: float, distance: np.ndarray | float, speed: np.ndarray | float) -> np.ndarray:
    """Chance that a particle entering the Hill sphere anywhere on its cross-section hits: (b_max / r0)^2."""
    return (capture_parameter(radius, gm, distance, speed) / distance) ** 2


def resample(
    entry: np.ndarray, velocity: np.ndarray, radius: float, gm: float, rng: np.random.Generator, margin: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Moon mode: new positions on the Hill sphere from which particles hit, for entries (n, 3) with velocities (n, 3)
    relative to the moon.

    Returns positions (n, 3) and how many uniform draws over the facing hemisphere each would have taken. ``margin``
    widens the disc (b <= margin b_max). An entry points inwards, so that at least half of the cap lies on that
    hemisphere: there is always a solution.
    """
    distance, speed = np.sqrt(dot(entry, entry)), np.sqrt(dot(velocity, velocity))
    n, back = entry / distance[:, None], -velocity / speed[:, None]
    sine = np.minimum(margin * capture_parameter(radius, gm, distance, speed) / distance, 1.0)
    least = np.sqrt(1.0 - sine**2)
    first = np.cross(back, np.where(abs(back[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]]))
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(back, first)
    positions, hits, waiting = np.empty_like(n), np.zeros(len(n), np.int64), np.arange(len(n))
    while len(waiting):
        c = rng.uniform(least[waiting], 1.0)
        longitude = rng.uniform(0.0, 2.0 * math.pi, len(waiting))
        s = np.sqrt(1.0 - c * c)
        side = np.cos(longitude)[:, None] * first[waiting] + np.sin(longitude)[:, None] * second[waiting]
        positions[waiting] = c[:, None] * back[waiting] + s[:, None] * side
        hits[waiting] += 1
        waiting = waiting[dot(positions[waiting], n[waiting]) < 0.0]
    # each draw falls into the cap with probability 1 - cos(theta_max), its fraction of the hemisphere
    return distance[:, None] * positions, rng.negative_binomial(hits, np.maximum(1.0 - least, 1e-12)) + hits


def fall(entry: np.ndarray, velocity: np.ndarray, radius: float, gm: float) -> Impact:
    """Two-body flight of particles (n, 3) from outside down to ``radius``; all must hit (NaN where they do not)."""
    r0, v0 = np.sqrt(dot(entry, entry)), np.sqrt(dot(velocity, velocity))
    h = np.cross(entry, velocity)
    momentum = np.sqrt(dot(h, h))
    energy = 0.5 * v0**2 - gm / r0
    speed = np.sqrt(2.0 * (energy + gm / radius))
    with np.errstate(invalid="ignore"):
        angle = np.arcsin(momentum / (radius * speed))
    p = momentum**2 / gm
    e = np.sqrt(np.maximum(1.0 + 2.0 * energy * momentum**2 / gm**2, 1e-30))
    start = -np.arccos(np.clip((p / r0 - 1.0) / e, -1.0, 1.0))
    end = -np.arccos(np.clip((p / radius - 1.0) / e, -1.0, 1.0))
    up = entry / r0[:, None]
    across = velocity - dot(velocity, up)[:, None] * up
    length = np.sqrt(dot(across, across))
    across = np.where(length[:, None] > 0.0, across / np.maximum(length, 1e-300)[:, None], 0.0)
    turn = (end - start)[:, None]
    position = radius * (np.cos(turn) * up + np.sin(turn) * across)
    tangent = -np.sin(turn) * up + np.cos(turn) * across
    arrival = -(speed * np.cos(angle))[:, None] * position / radius + (speed * np.sin(angle))[:, None] * tangent
    return Impact(
        position, arrival, angle, _time(start, energy, momentum, e, gm) - _time(end, energy, momentum, e, gm)
    )


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


def descend(
    position: np.ndarray,
    velocity: np.ndarray,
    planet: np.ndarray,
    rate: np.ndarray,
    gm: float,
    gm_planet: float,
    depth: float = 0.2,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fly from the Hill sphere to about ``depth`` of its radius under the pull of moon and planet: there the tide is
    125 times weaker.

    a = -GM x/r^3 + GM_p [ (p - x)/|p - x|^3 - p/|p|^3 ], the ``planet`` p (n, 3) turning about +z at ``rate`` (n,);
    Runge-Kutta 4, 24 steps. Against the hyperbola alone this takes off errors up to 1.1 deg and 1.2e-3 in speed of
    slow particles. Returns position, velocity, time.
    """
    r0, v0 = np.sqrt(dot(position, position)), np.sqrt(dot(velocity, velocity))
    end = (1.0 - depth) * r0 / v0

    def acceleration(t: np.ndarray, x: np.ndarray) -> np.ndarray:
        c, s = np.cos(rate * t), np.sin(rate * t)
        p = np.stack([c * planet[:, 0] - s * planet[:, 1], s * planet[:, 0] + c * planet[:, 1], planet[:, 2]], axis=1)
        pull = [(q, np.sqrt(dot(q, q))[:, None] ** 3) for q in (p - x, p, x)]
        return gm_planet * (pull[0][0] / pull[0][1] - pull[1][0] / pull[1][1]) - gm * pull[2][0] / pull[2][1]

    x, v, t = position, velocity, np.zeros(len(position))
    h = end / 24.0
    k = h[:, None]
    for _ in range(24):
        a1 = acceleration(t, x)
        v2 = v + 0.5 * k * a1
        a2 = acceleration(t + 0.5 * h, x + 0.5 * k * v)
        v3 = v + 0.5 * k * a2
        a3 = acceleration(t + 0.5 * h, x + 0.5 * k * v2)
        v4 = v + k * a3
        a4 = acceleration(t + h, x + k * v3)
        x = x + k / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v = v + k / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        t = t + h
    return x, v, end


def pericentre(position: np.ndarray, velocity: np.ndarray, gm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance [m], speed [m/s] and time from ``position`` [s] of the closest approach of particles (n, 3) on two-body
    orbits."""
    r0, v0 = np.sqrt(dot(position, position)), np.sqrt(dot(velocity, velocity))
    h = np.cross(position, velocity)
    momentum = np.sqrt(dot(h, h))
    energy = 0.5 * v0**2 - gm / r0
    e = np.sqrt(np.maximum(1.0 + 2.0 * energy * momentum**2 / gm**2, 1e-30))
    p = momentum**2 / gm
    nearest = p / (1.0 + e)
    start = -np.arccos(np.clip((p / r0 - 1.0) / e, -1.0, 1.0))
    return nearest, momentum / nearest, _time(start, energy, momentum, e, gm)


def apsis(position: np.ndarray, velocity: np.ndarray, gm: float) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors to the closest approach and along the motion there, for particles (n, 3) on two-body orbits."""
    h = np.cross(position, velocity)
    eccentricity = np.cross(velocity, h) / gm - position / np.linalg.norm(position, axis=1)[:, None]
    up = eccentricity / np.maximum(np.linalg.norm(eccentricity, axis=1), 1e-300)[:, None]
    along = np.cross(h / np.maximum(np.linalg.norm(h, axis=1), 1e-300)[:, None], up)
    return up, along


def mirrored(position: np.ndarray, velocity: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """State at the same distance on the way out: the orbit is symmetric about the apsis ``up``, with time reversed."""
    x = 2.0 * dot(position, up)[:, None] * up - position
    return x, velocity - 2.0 * dot(velocity, up)[:, None] * up
