"""Free flight of matter thrown out, led back to where it left the ground and on to where it ends.

Flat ground: parabolas under a constant g. What is faster than the escape speed at the ground, where there is one,
escapes. A body of radius R: orbits about its centre,

    mu = g R^2,   p = h^2 / mu,   e cos f = p / r - 1,   e sin f = h v_r / mu,   h = |x x v|

which leave the ground at the true anomaly f_R = arccos((p / R - 1) / e) and come back to it at 2 pi - f_R; the times
between are those of Kepler's equation. Energy v^2 / 2 - mu / r >= 0 escapes; what is bound and stays above the ground
circles. No air, no collisions, no rotation.

Places and velocities are canonical: axis +z, the ground at z = 0 or |x| = R.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from crater.ground.datum import Datum

SOURCES = ("MurrayDermott1999",)
FATES = ("falls back", "escapes", "circles")
FALLS, ESCAPES, CIRCLES = range(3)


class Flight(NamedTuple):
    """Of each particle (n,): where [m] and with which velocity [m/s] it left the ground, and how long ago [s]; its
    fate, where it lands [m], and in how long [s], NaN where it does not."""

    position: np.ndarray
    velocity: np.ndarray
    since: np.ndarray
    fate: np.ndarray
    landing: np.ndarray
    until: np.ndarray


def flight(datum: Datum, gravity: float, escape_speed: float, position: np.ndarray, velocity: np.ndarray) -> Flight:
    """The flight of rising particles above the ground, canonical positions [m] and velocities [m/s] (n, 3);
    ``gravity`` [m/s^2] > 0 at the ground, ``escape_speed`` [m/s] of flat ground (0: nothing escapes)."""
    if datum.is_sphere:
        return _orbits(datum.radius, gravity * datum.radius**2, position, velocity)
    return _parabolas(gravity, escape_speed, position, velocity)


def _parabolas(g: float, escape_speed: float, x: np.ndarray, v: np.ndarray) -> Flight:
    rise = np.sqrt(v[:, 2] ** 2 + 2.0 * g * x[:, 2])
    since, until = (rise - v[:, 2]) / g, (rise + v[:, 2]) / g
    level = v * (1.0, 1.0, 0.0)
    start, launch = x - level * since[:, None], level.copy()
    start[:, 2], launch[:, 2] = 0.0, rise
    fate = np.full(len(x), FALLS, dtype=np.int8)
    if escape_speed > 0.0:
        fate[np.linalg.norm(launch, axis=1) > escape_speed] = ESCAPES
    landing = x + level * until[:, None]
    landing[:, 2] = 0.0
    return Flight(start, launch, since, fate, *_known(fate, landing, until))


def _orbits(R: float, mu: float, x: np.ndarray, v: np.ndarray) -> Flight:
    r, speed = np.linalg.norm(x, axis=1), np.linalg.norm(v, axis=1)
    out = x / r[:, None]
    radial = np.einsum("ij,ij->i", v, out)
    along = v - radial[:, None] * out
    across = np.maximum(np.linalg.norm(along, axis=1), 1e-9 * speed)
    along = along / across[:, None]
    h, energy = r * across, 0.5 * (radial**2 + across**2) - mu / r
    p = h**2 / mu
    cosine, sine = p / r - 1.0, h * radial / mu
    e, f = np.hypot(cosine, sine), np.arctan2(sine, cosine)
    # radial speed at the ground, squared; below zero where the orbit does not get down to it
    steep = 2.0 * (energy + mu / R) - (h / R) ** 2
    meets = steep >= 0.0
    fate = np.where(energy >= 0.0, ESCAPES, np.where(meets, FALLS, CIRCLES)).astype(np.int8)
    steep = np.where(meets, np.sqrt(np.maximum(steep, 0.0)), radial)
    # by both sine and cosine: near the vertical its cosine alone says little; what never met the ground starts here
    f_ground = np.where(meets, np.arctan2(h * steep / mu, p / R - 1.0), f)

    def turned(angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        return c * out + s * along, c * along - s * out

    at = np.where(meets, R, r)
    up, level = turned(f_ground - f)
    start, launch = up * at[:, None], steep[:, None] * up + (h / at)[:, None] * level
    landing = turned(2.0 * np.pi - f_ground - f)[0] * R
    begun, now = _time(f_ground, e, energy, p, mu), _time(f, e, energy, p, mu)
    period = 2.0 * np.pi * mu / np.maximum(-2.0 * energy, 1e-12 * mu / R) ** 1.5
    return Flight(start, launch, now - begun, fate, *_known(fate, landing, period - begun - now))


def _time(f: np.ndarray, e: np.ndarray, energy: np.ndarray, p: np.ndarray, mu: float) -> np.ndarray:
    """Time from the periapsis to the true anomaly ``f`` [s]: Kepler's equation, elliptic or hyperbolic."""
    # (1 - e) / (1 + e) from the energy: 1 - e alone is rounding for what rises straight up
    ratio = -2.0 * energy * p / mu / (1.0 + e) ** 2
    ratio = np.where(np.abs(ratio) > 1e-30, ratio, 1e-30)
    part = np.sqrt(np.abs(ratio)) * np.tan(0.5 * f)
    bound = ratio > 0.0
    E, F = 2.0 * np.arctan(part), 2.0 * np.arctanh(np.where(bound, 0.0, np.clip(part, -1.0 + 1e-15, 1.0 - 1e-15)))
    mean = np.where(bound, E - e * np.sin(E), e * np.sinh(F) - F)
    return np.sqrt((p / (np.abs(ratio) * (1.0 + e) ** 2)) ** 3 / mu) * mean


def _known(fate: np.ndarray, landing: np.ndarray, until: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    falls = fate == FALLS
    return np.where(falls[:, None], landing, np.nan), np.where(falls, until, np.nan)
