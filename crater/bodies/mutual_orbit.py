"""What an impact does to the mutual orbit of a body and its companion, and what of its ejecta leaves them both.

The orbit was a circle of radius d, v_0^2 = mu / d, mu = G (M + m). The body's velocity against its companion is then
v_0 t + dv, t along its track, and by the vis-viva equation

    1 / a = 2 / d - |v_0 t + dv|^2 / mu',   P = 2 pi sqrt(a^3 / mu')         mu' with the mass that stays

(Murray & Dermott 1999, Solar System Dynamics, eq. 2.34), for a small dv: dP / P = 3 dv . t / v_0.

A body that is not a ball pulls its companion by MacCullagh's formula (the same, eq. 4.5). With its longest axis along
the line between them, semi-axes alpha >= beta >= gamma of the even ellipsoid of its inertia,

    force = G M m (1 + e) / d^2,   e = 3 (2 alpha^2 - beta^2 - gamma^2) / (10 d^2)

A body that changes its shape and nothing else keeps the orbit's angular momentum L = mu_r sqrt(mu d (1 + e)). The mean
distance then falls by the fraction de and the mean rate L / (mu_r d^2) rises by 2 de:

    dP / P = -2 de

(the effect is that of Nakano et al. 2024, Planet. Sci. J. 5, 133). A body that tumbles, or lies askew, has less of it.

Ejecta that leave the body at the velocity v, in the well w, have left it with u = v sqrt(1 - 2 w / v^2), and fly
against the pair's centre of mass with U = u + v_0 t M / (M + m), from where the body was at the impact, d from its
companion. They leave the pair where U^2 > 2 mu / d, on a hyperbola with

    h = d x U,   e = U x h / mu - d / |d|,   U_inf = sqrt(U^2 - 2 mu / d) (sqrt(e^2 - 1) h x e / (|h| e^2) - e / e^2)

(the same, section 2.8: the true anomaly of the asymptote has the cosine -1 / e), and the pair keeps

    dP = p - sum of m U_inf over what leaves the pair,   beta(e) = dP . e / (p . e)

Two conics are patched: the body's pull, which bends no path here, is done before the companion's begins. This is the
beta of the pair's motion about the Sun; what falls back or onto the companion keeps its momentum in the pair. It can
exceed the body's own: what is thrown forward takes its orbital momentum with it, m v_0 M / (M + m).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from crater.bodies.body_state import BodyState
from crater.bodies.exchange import Exchange
from matter.constants import G

SOURCES = ("MurrayDermott1999", "Nakano2024")


class Orbit(NamedTuple):
    """A circle about a companion of ``mass`` [kg] at ``distance`` [m]; unit vectors (3,) at the impact: ``track``,
    where the body flies to, and ``outward``, from the companion to the body."""

    mass: float
    distance: float
    track: np.ndarray
    outward: np.ndarray


def period(orbit: Orbit, body: float, change: np.ndarray) -> float:
    """Period [s] of the mutual orbit after the ``change`` (3,) [m/s] of the velocity of a ``body`` [kg] that was on
    the circle; NaN where it leaves its companion. The circle itself is that of this mass: the mass that is lost is
    nothing to it."""
    mu = G * (orbit.mass + body)
    velocity = math.sqrt(mu / orbit.distance) * orbit.track + change
    inverse = 2.0 / orbit.distance - float(velocity @ velocity) / mu
    return 2.0 * math.pi * math.sqrt(inverse**-3 / mu) if inverse > 0.0 else math.nan


def excess_of_pull(orbit: Orbit, axes: np.ndarray) -> float:
    """e of a body with the full ``axes`` (3,) [m] of the ellipsoid of its inertia, longest first, towards its
    companion."""
    a, b, c = 0.5 * np.asarray(axes, dtype=float)
    return float(0.3 * (2.0 * a**2 - b**2 - c**2) / orbit.distance**2)


def period_change_by_shape(orbit: Orbit, body: float, before: np.ndarray, after: np.ndarray) -> float:
    """Change [s] of the period of the circle of a ``body`` [kg] whose full axes (3,) [m] turn from those ``before``
    into those ``after``."""
    change = excess_of_pull(orbit, after) - excess_of_pull(orbit, before)
    return -2.0 * change * period(orbit, body, np.zeros(3))


def pair_exchange(orbit: Orbit, before: BodyState, after: BodyState, brought: np.ndarray) -> Exchange:
    """What stays with body and companion of the momentum (3,) [kg m/s] that a projectile ``brought``."""
    whole, p = before.particles.select(before.body), after.particles
    body = float(whole.mass.sum())
    away = ~after.bound
    velocity = p.velocity[away] - whole.mass @ whole.velocity / body
    round_pair = math.sqrt(G * (orbit.mass + body) / orbit.distance) * orbit.mass / (orbit.mass + body)
    own = _climbed(velocity, after.well[away]) + round_pair * orbit.track
    last = _asymptotic(own, orbit.distance * orbit.outward, G * (orbit.mass + body))
    mass = p.mass[away]
    leaves = last.any(axis=1)
    momentum = mass[:, None] * last
    escaped_mass = float(mass[leaves].sum())
    return Exchange(
        np.asarray(brought, dtype=float),
        brought - momentum.sum(axis=0),
        np.sqrt(np.sum(momentum**2, axis=0)),
        orbit.mass + float(p.mass.sum()) - escaped_mass,
        escaped_mass,
        float(mass.sum()),
    )


def _climbed(velocity: np.ndarray, well: np.ndarray) -> np.ndarray:
    """Velocities (n, 3) after wells (n,) [J/kg] that were climbed."""
    square = np.einsum("ij,ij->i", velocity, velocity)
    left = np.clip(1.0 - 2.0 * well / np.maximum(square, 1e-300), 0.0, None)
    return np.asarray(velocity * np.sqrt(left)[:, None])


def _asymptotic(velocity: np.ndarray, position: np.ndarray, mu: float) -> np.ndarray:
    """Velocities (n, 3) far away of what flies from a ``position`` (3,) at a ``velocity`` (n, 3) about mu [m^3/s^2]; 0
    where it is bound."""
    square = np.einsum("ij,ij->i", velocity, velocity) - 2.0 * mu / np.linalg.norm(position)
    h = np.cross(position, velocity)
    e = np.cross(velocity, h) / mu - position / np.linalg.norm(position)
    e2 = np.einsum("ij,ij->i", e, e)
    turned = np.cross(h, e) / np.maximum(np.linalg.norm(h, axis=1), 1e-300)[:, None]
    way = (np.sqrt(np.maximum(e2 - 1.0, 0.0))[:, None] * turned - e) / np.maximum(e2, 1e-300)[:, None]
    return np.asarray(np.sqrt(np.maximum(square, 0.0))[:, None] * way)
