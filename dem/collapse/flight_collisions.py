"""Grains in free flight that meet each other: collisions of rigid spheres at their exact times.

In flight gravity acts on all alike, so two grains approach on a straight line, and when and where they touch within
the next ``dt`` is known. Normal restitution is that of their contact law; friction acts with at most mu times the
normal impulse, and at most so far that the surfaces stick (they do not spring back sideways). With n from i to j, u
the velocity of j's surface at the contact relative to i's, m = m_i m_j / (m_i + m_j):

    J_n = (1 + e_n) m |u_n|,   J_t = min(mu J_n, 2/7 m |u_t|).

The new velocities count from the contact at t on, so the positions now become x + (v_old - v_new) t: momentum, angular
momentum and potential energy are kept exactly, and what is lost is booked with the contacts (and by itself in
``lost_in_flight``). Pairs that overlap already collide at once when they approach. A grain collides once per look;
looks come every few steps.

Source: Walton 1993, in: Particulate Two-Phase Flow, ed. Roco (three-parameter hard spheres; here without tangential
restitution).
"""

from __future__ import annotations

import math

import numpy as np

from dem.contact.columns import DISSIPATED, MASS, PX, PY, PZ, RADIUS, VX, VY, VZ, WX
from dem.grains.assembly import BALLISTIC, Assembly
from matter.compilation.jit import kernel


def collide(bed: Assembly, dt: float) -> int:
    """Let the flying grains that meet within ``dt`` [s] collide, at a full step; returns the number of collisions."""
    flying = np.arange(bed.active, bed.moving)
    if len(flying) < 2:
        return 0
    assert np.all(bed.state[flying] == BALLISTIC)
    drift = bed.velocity[flying] - np.median(bed.velocity[flying], axis=0)
    way = dt * np.sqrt(np.einsum("ij,ij->i", drift, drift))
    reach = bed.X[flying, RADIUS] + float(bed.X[flying, RADIUS].max()) + 2.0 * way
    cells = _Cells(bed.position[flying], float(np.median(reach)))
    order = cells.order
    pairs = encounters(
        bed.X[flying[order]],
        bed.W[flying[order]],
        reach[order],
        way[order],
        cells.low,
        cells.size,
        cells.start,
        cells.shape,
        dt,
    )
    if len(pairs) == 0:
        return 0
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0], pairs[:, 2]))]
    i, j = flying[order[pairs[:, 0].astype(np.int64)]], flying[order[pairs[:, 1].astype(np.int64)]]
    laws = (bed.contact.shell, bed.contact.ocean)
    restitution = np.array([[min(a.restitution, b.restitution) for b in laws] for a in laws])
    friction = np.array([[min(a.friction, b.friction) for b in laws] for a in laws])
    done, lost = bounce(i, j, pairs[:, 2].copy(), bed.X, bed.W, bed.V, bed.kind, restitution, friction)
    bed.report[DISSIPATED] += lost
    bed.lost_in_flight += lost
    return int(done)


class _Cells:
    """A grid over most of the grains; the few far away count to the cells at its edge, so that it needs no more cells
    than there are grains to fill it."""

    def __init__(self, position: np.ndarray, size: float):
        self.low, high = np.quantile(position, (0.02, 0.98), axis=0)
        self.size = max(size, float(np.cbrt(np.prod(np.maximum(high - self.low, size)) / (8.0 * len(position)))))
        self.shape = ((high - self.low) / self.size).astype(np.int64) + 1
        index = np.clip(np.floor((position - self.low) / self.size), 0, self.shape - 1).astype(np.int64)
        flat = (index[:, 0] * self.shape[1] + index[:, 1]) * self.shape[2] + index[:, 2]
        self.order = np.argsort(flat, kind="stable")
        self.start = np.searchsorted(flat[self.order], np.arange(int(np.prod(self.shape)) + 1)).astype(np.int64)


@kernel
def encounters(X, W, reach, way, low, size, start, shape, dt):
    """Pairs of cell-sorted grains that touch within ``dt``: rows (i, j, time). Of each pair the grain with the longer
    ``way`` looks for the other."""
    n = X.shape[0]
    pairs = [(0.0, 0.0, 0.0) for _ in range(0)]
    for i in range(n):
        first, last = np.empty(3, np.int64), np.empty(3, np.int64)
        for c in range(3):
            first[c] = min(max(0, int(np.floor((X[i, c] - reach[i] - low[c]) / size))), shape[c] - 1)
            last[c] = max(0, min(shape[c] - 1, int(np.floor((X[i, c] + reach[i] - low[c]) / size))))
        for a in range(first[0], last[0] + 1):
            for b in range(first[1], last[1] + 1):
                base = (a * shape[1] + b) * shape[2]
                for j in range(start[base + first[2]], start[base + last[2] + 1]):
                    if j == i or way[j] > way[i] or (way[j] == way[i] and j < i):
                        continue
                    x, y, z = X[j, PX] - X[i, PX], X[j, PY] - X[i, PY], X[j, PZ] - X[i, PZ]
                    u, v, w = W[j, VX] - W[i, VX], W[j, VY] - W[i, VY], W[j, VZ] - W[i, VZ]
                    closing = x * u + y * v + z * w
                    if closing >= 0.0:
                        continue
                    touch = X[i, RADIUS] + X[j, RADIUS]
                    gap = x * x + y * y + z * z - touch * touch
                    if gap <= 0.0:
                        pairs.append((float(i), float(j), 0.0))
                        continue
                    speed2 = u * u + v * v + w * w
                    root = closing * closing - speed2 * gap
                    if root <= 0.0:
                        continue
                    time = gap / (-closing + math.sqrt(root))
                    if time < dt:
                        pairs.append((float(i), float(j), time))
    out = np.empty((len(pairs), 3))
    for k in range(len(pairs)):
        out[k, 0], out[k, 1], out[k, 2] = pairs[k]
    return out


@kernel
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def bounce(first, second, time, X, W, V, kind, restitution, friction):
    """Carry out the collisions in the order given, each grain in its first only; their number, and the energy lost
    [J]."""
    # vectors by loops over their three parts: array expressions would cost seconds of compilation
    done, lost = 0, 0.0
    busy = np.zeros(X.shape[0], np.int8)
    vi, vj, wi, wj = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    n, u, impulse, turn = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for c in range(len(first)):
        i, j, t = first[c], second[c], time[c]
        if busy[i] != 0 or busy[j] != 0:
            continue
        busy[i] = busy[j] = 1
        done += 1
        for k in range(3):
            vi[k], vj[k], wi[k], wj[k] = W[i, k], W[j, k], W[i, WX + k], W[j, WX + k]
            n[k] = X[j, k] + t * vj[k] - X[i, k] - t * vi[k]
        distance = math.sqrt(_dot(n, n))
        for k in range(3):
            n[k] /= distance
        # lever arms in the fraction of the radii, so that they add up to the distance also where the grains overlap
        ri, rj = (
            distance * X[i, RADIUS] / (X[i, RADIUS] + X[j, RADIUS]),
            distance * X[j, RADIUS] / (X[i, RADIUS] + X[j, RADIUS]),
        )
        mi, mj = V[i, MASS], V[j, MASS]
        m = mi * mj / (mi + mj)
        for k in range(3):
            p, q = (k + 1) % 3, (k + 2) % 3
            arm = (ri * wi[p] + rj * wj[p]) * n[q] - (ri * wi[q] + rj * wj[q]) * n[p]
            u[k] = vj[k] - vi[k] - arm
        un = _dot(u, n)
        for k in range(3):
            u[k] -= un * n[k]  # from here on what slips
        slip = math.sqrt(_dot(u, u))
        normal = (1.0 + restitution[kind[i], kind[j]]) * m * (-un)
        inertia_i, inertia_j = 0.4 * mi * X[i, RADIUS] ** 2, 0.4 * mj * X[j, RADIUS] ** 2
        for k in range(3):
            impulse[k] = -normal * n[k]  # on i
        if slip > 0.0:
            sticks = slip / (1.0 / m + ri * ri / inertia_i + rj * rj / inertia_j)
            rubs = min(friction[kind[i], kind[j]] * normal, sticks) / slip
            for k in range(3):
                impulse[k] += rubs * u[k]
        for k in range(3):
            p, q = (k + 1) % 3, (k + 2) % 3
            turn[k] = n[p] * impulse[q] - n[q] * impulse[p]
        before = mi * _dot(vi, vi) + mj * _dot(vj, vj) + inertia_i * _dot(wi, wi) + inertia_j * _dot(wj, wj)
        for k in range(3):
            W[i, k] = vi[k] + impulse[k] / mi
            W[j, k] = vj[k] - impulse[k] / mj
            W[i, WX + k] = wi[k] + ri / inertia_i * turn[k]
            W[j, WX + k] = wj[k] + rj / inertia_j * turn[k]
        after = (
            mi * _dot(W[i], W[i])
            + mj * _dot(W[j], W[j])
            + inertia_i * _dot(W[i, WX:], W[i, WX:])
            + inertia_j * _dot(W[j, WX:], W[j, WX:])
        )
        lost += 0.5 * (before - after)
        for k in range(3):
            X[i, k] += t * (vi[k] - W[i, k])
            X[j, k] += t * (vj[k] - W[j, k])
    return done, lost
