"""Free flight about a body as if all of its mass were at its centre: how high, and what becomes of it.

    e = v^2 / 2 - mu / r,   l = |x x v|,   mu = G M
    a = -mu / 2 e,   eps^2 = 1 + 2 e l^2 / mu^2,   pericentre a (1 - eps), apocentre a (1 + eps)
    t = sqrt(a^3 / mu) (E - eps sin E),   r = a (1 - eps cos E)            (Kepler's equation)

Matter that is unbound and moves away escapes. Bound matter whose pericentre lies above the body orbits it. The rest
comes back to the body's radius after a time that follows from Kepler's equation.

Source: Murray & Dermott 1999, Solar System Dynamics, sections 2.3 and 2.4.
"""

from __future__ import annotations

import math

import numpy as np

SOURCES = ("MurrayDermott1999",)

RETURNS, LATER, ORBITS, ESCAPES = range(4)
FATES = ("returns", "later", "orbits", "escapes")
"""What becomes of matter in free flight: it comes back within the time that is asked for, later, not at all though it
is bound, or leaves for good."""


def _orbit(mu: float, position: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, ...]:
    """Distance, energy, radial velocity, and of what is bound half axis and eccentricity (NaN of the rest)."""
    r = np.maximum(np.linalg.norm(position, axis=1), 1e-300)
    energy = 0.5 * np.einsum("ij,ij->i", velocity, velocity) - mu / r
    radial = np.einsum("ij,ij->i", position, velocity) / r
    momentum2 = np.einsum("ij,ij->i", *2 * (np.cross(position, velocity),))
    bound = energy < 0.0
    a = np.where(bound, -0.5 * mu / np.where(bound, energy, -1.0), np.nan)
    eccentricity = np.sqrt(np.maximum(1.0 + 2.0 * energy * momentum2 / mu**2, 0.0))
    return r, energy, radial, a, np.where(bound, eccentricity, np.nan)


def apocentre(mu: float, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Largest distance (n,) [m] from the centre that matter at ``position`` (n, 3) [m] with the ``velocity`` (n, 3)
    [m/s] reaches; infinite where it is unbound."""
    r, _, _, a, eccentricity = _orbit(mu, position, velocity)
    return np.where(np.isnan(a), math.inf, np.maximum(np.nan_to_num(a * (1.0 + eccentricity)), r))


def _time_from_pericentre(mu: float, r: np.ndarray, a: np.ndarray, eccentricity: np.ndarray) -> np.ndarray:
    """Time [s] on the way out from the pericentre to the distance r."""
    cosine = np.clip((1.0 - r / a) / np.maximum(eccentricity, 1e-12), -1.0, 1.0)
    angle = np.arccos(cosine)
    return np.asarray(np.sqrt(a**3 / mu) * (angle - eccentricity * np.sin(angle)))


def time_back(mu: float, position: np.ndarray, velocity: np.ndarray, down: np.ndarray) -> np.ndarray:
    """Time (n,) [s] until matter comes in through the distance ``down`` (n,) [m] from the centre; infinite where it is
    unbound, or does not come so near."""
    r, _, radial, a, eccentricity = _orbit(mu, position, velocity)
    bound = ~np.isnan(a)
    a, eccentricity = np.where(bound, a, 1.0), np.where(bound, eccentricity, 0.0)
    period = 2.0 * math.pi * np.sqrt(a**3 / mu)
    here = _time_from_pericentre(mu, r, a, eccentricity)
    here = np.where(radial >= 0.0, here, period - here)
    there = period - _time_from_pericentre(mu, np.minimum(down, r), a, eccentricity)
    back = bound & (a * (1.0 - eccentricity) < down)
    return np.where(back, np.maximum(there - here, 0.0), math.inf)


def fate(mu: float, position: np.ndarray, velocity: np.ndarray, surface: np.ndarray, within: float) -> np.ndarray:
    """What becomes of matter (``FATES``, (n,)) about a body whose surface is at the distance ``surface`` (n,) [m] from
    the centre; it returns when it is back ``within`` this time [s]."""
    _, energy, radial, _, _ = _orbit(mu, position, velocity)
    back = time_back(mu, position, velocity, surface)
    found = np.where(np.isinf(back), ORBITS, np.where(back > within, LATER, RETURNS))
    # unbound matter that comes in meets the body
    found = np.where(energy >= 0.0, np.where(radial > 0.0, ESCAPES, RETURNS), found)
    return found.astype(np.int8)
