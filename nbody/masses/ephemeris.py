"""Orbits of the massive bodies, integrated once and shared by every test particle.

The full mutual gravity of Sun, Jupiter and moons is integrated with DOP853 at fixed steps; positions, velocities and
accelerations at equally spaced nodes give quintic Hermite polynomials (error of one interval h^6/46080 x^(6): 0.1 m
for a moon at 48 nodes per revolution). Positions are relative to the barycentre of Jupiter and its moons, so that far
from them only a slowly varying field remains.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import kernel, law
from nbody.masses.dop853 import COLUMNS, COUNT, STAGES, A, B
from nbody.masses.newtonian import newton
from nbody.masses.system import Start, System

NODES_PER_REVOLUTION = 48
SUBSTEPS = 1  # 0.4 m after 1.4 years against IAS15; two give 0.15 m


class Orbits(NamedTuple):
    """What compiled loops take of an ``Ephemeris``: the paths of the massive bodies, their masses ``gm`` [m^3/s^2]
    (Sun, planet, moons) and the quadrupole ``ring`` of the moons."""

    polynomial: np.ndarray
    interval: float
    gm: np.ndarray
    ring: float


@dataclass(frozen=True)
class Ephemeris:
    """Quintic polynomials of the bodies' paths.

    ``polynomial`` has shape (intervals, 1 + moons, 3, 6): body 0 is the Sun, then the moons; coordinate; coefficients
    of ascending powers of (t - t_i) / ``interval``. ``energy_error`` and ``angular_momentum_error`` are the largest
    relative changes of the whole system.
    """

    polynomial: np.ndarray
    interval: float
    gm: np.ndarray
    ring: float
    energy_error: float
    angular_momentum_error: float

    @property
    def orbits(self) -> Orbits:
        """Paths and masses for a compiled loop."""
        return Orbits(self.polynomial, self.interval, self.gm, self.ring)

    def state(self, body: int, t: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity [m, m/s] of ``body`` (0 Sun, 1 planet, 2 ... moons) at times ``t`` [s], shape (...,
        3)."""
        t = np.asarray(t, float)
        body_position = np.clip((t / self.interval).astype(int), 0, len(self.polynomial) - 1)
        u = (t / self.interval - body_position)[..., None]

        def one(column: int) -> tuple[np.ndarray, np.ndarray]:
            c0, c1, c2, c3, c4, c5 = np.moveaxis(self.polynomial[body_position, column], -1, 0)
            x = ((((c5 * u + c4) * u + c3) * u + c2) * u + c1) * u + c0
            v = (((5 * c5 * u + 4 * c4) * u + 3 * c3) * u + 2 * c2) * u + c1
            return x, v / self.interval

        if body != 1:
            return one(0 if body == 0 else body - 1)
        moons = [one(index) for index in range(1, self.polynomial.shape[1])]
        weights = -self.gm[2:] / self.gm[1]
        return sum(w * x for w, (x, _) in zip(weights, moons)), sum(w * v for w, (_, v) in zip(weights, moons))


@law
def _value(c, d, u):
    """Coordinate ``d`` of a path with the coefficients ``c`` (3, 6)."""
    return ((((c[d, 5] * u + c[d, 4]) * u + c[d, 3]) * u + c[d, 2]) * u + c[d, 1]) * u + c[d, 0]


@law
def _slope(c, d, u):
    """The derivative of ``_value`` in u."""
    return (((5.0 * c[d, 5] * u + 4.0 * c[d, 4]) * u + 3.0 * c[d, 3]) * u + 2.0 * c[d, 2]) * u + c[d, 1]


@law
def body_position(polynomial, interval, body, t):
    """Position (x, y, z) [m] of column ``body`` at time ``t`` [s]."""
    s = t / interval
    i = min(max(int(s), 0), polynomial.shape[0] - 1)
    u = s - i
    c = polynomial[i, body]
    return _value(c, 0, u), _value(c, 1, u), _value(c, 2, u)


@law
def motion(polynomial, interval, body, t):
    """Velocity (x, y, z) [m/s] of column ``body`` at time ``t`` [s]."""
    s = t / interval
    i = min(max(int(s), 0), polynomial.shape[0] - 1)
    u = s - i
    c = polynomial[i, body]
    return _slope(c, 0, u) / interval, _slope(c, 1, u) / interval, _slope(c, 2, u) / interval


@kernel
def _integrate(x, v, gm, nodes, interval, substeps, positions, velocities, accelerations):
    """DOP853 with fixed steps; states at the nodes into ``positions`` ... (nodes, n, 3)."""
    n = x.shape[0]
    h = interval / substeps
    kx, kv = np.empty((STAGES, n, 3)), np.empty((STAGES, n, 3))
    xs, acceleration = np.empty((n, 3)), np.empty((n, 3))
    for node in range(nodes):
        newton(x, gm, acceleration)
        for i in range(n):
            for d in range(3):
                positions[node, i, d], velocities[node, i, d], accelerations[node, i, d] = (
                    x[i, d],
                    v[i, d],
                    acceleration[i, d],
                )
        for _ in range(substeps):
            for s in range(STAGES):
                for i in range(n):
                    for d in range(3):
                        dx, dv = 0.0, 0.0
                        for entry in range(COUNT[s]):
                            j = COLUMNS[s, entry]
                            dx += A[s, j] * kx[j, i, d]
                            dv += A[s, j] * kv[j, i, d]
                        xs[i, d] = x[i, d] + h * dx
                        kx[s, i, d] = v[i, d] + h * dv
                newton(xs, gm, kv[s])
            for i in range(n):
                for d in range(3):
                    dx, dv = 0.0, 0.0
                    for s in range(STAGES):
                        dx += B[s] * kx[s, i, d]
                        dv += B[s] * kv[s, i, d]
                    x[i, d] += h * dx
                    v[i, d] += h * dv


def compute(system: System, start: Start, duration: float, substeps: int = SUBSTEPS) -> Ephemeris:
    """Integrate the massive bodies from ``start`` over ``duration`` [s]."""
    gm = system.gm
    paths = [(moon, system.planet) for moon in system.moons] or [(system.planet, system.sun)]
    shortest = min(2.0 * np.pi * np.sqrt(one.semi_major_axis**3 / about.gm) for one, about in paths)
    interval = shortest / NODES_PER_REVOLUTION
    nodes = int(np.ceil(duration / interval)) + 2
    x, v, a = (np.empty((nodes, len(gm), 3)) for _ in range(3))
    # the Sun moves slowly in its own inertial frame: start there, then refer everything to the planetary barycentre
    _integrate(start.position.copy(), start.velocity.copy(), gm, nodes, interval, substeps, x, v, a)
    energy, momentum = _invariants(x[[0, -1]], v[[0, -1]], gm)
    weights = gm[1:] / gm[1:].sum()
    for array in (x, v, a):
        array -= (weights @ array[:, 1:])[:, None, :]
    keep = [0, *range(2, len(gm))]
    ring = 0.5 * sum(moon.gm * moon.semi_major_axis**2 for moon in system.moons)
    return Ephemeris(
        polynomial=_quintic(x[:, keep], v[:, keep], a[:, keep], interval),
        interval=interval,
        gm=gm,
        ring=ring,
        energy_error=abs(energy[1] / energy[0] - 1.0),
        angular_momentum_error=abs(momentum[1] / momentum[0] - 1.0),
    )


def _quintic(x: np.ndarray, v: np.ndarray, a: np.ndarray, interval: float) -> np.ndarray:
    """Coefficients of the quintic Hermite polynomials between neighbouring nodes, shape (nodes - 1, bodies, 3, 6)."""
    v, a = v * interval, a * interval**2
    x0, x1, v0, v1, a0, a1 = x[:-1], x[1:], v[:-1], v[1:], a[:-1], a[1:]
    rise = x1 - x0
    c3 = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * rise - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    return np.ascontiguousarray(np.stack([x0, v0, 0.5 * a0, c3, c4, c5], axis=-1))


def _invariants(x: np.ndarray, v: np.ndarray, gm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Energy and z angular momentum (times G) of the whole system about its barycentre, each of shape (times,)."""
    x = x - (gm / gm.sum() @ x)[:, None, :]
    v = v - (gm / gm.sum() @ v)[:, None, :]
    energy = 0.5 * (gm * (v**2).sum(axis=2)).sum(axis=1)
    for i in range(len(gm)):
        for j in range(i + 1, len(gm)):
            energy = energy - gm[i] * gm[j] / np.linalg.norm(x[:, i] - x[:, j], axis=1)
    momentum = (gm * (x[..., 0] * v[..., 1] - x[..., 1] * v[..., 0])).sum(axis=1)
    return energy, momentum
