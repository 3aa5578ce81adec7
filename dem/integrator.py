"""Velocity Verlet for grains, with the forces that act on single grains (gravity, walls, damping) inside the second kick.

    v(n+1/2) = v(n) + a(n) dt/2,   x(n+1) = x(n) + v(n+1/2) dt,   v_pred(n+1) = v(n+1/2) + a(n) dt/2
    a(n+1) = forces(x(n+1), v_pred(n+1)),   v(n+1) = v(n+1/2) + a(n+1) dt/2

and the same for spins. Velocities enter the contact forces as predicted for the full step (pkdgrav does the same). External impulses
are summed with the same half steps, so that momentum + what left - impulses is constant to rounding.

Arrays: ``X`` (n, 4) position and radius; ``V`` (n, 8) predicted velocity and spin, mass, k_n; ``W`` (n, 6) velocity and spin; ``A`` (n, 6)
accelerations; ``E`` (n, 6) external force, and external torque about the origin (orbital and spin).
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from dem.forces import HERTZ, SJKR, ZHANG, Scheme, _sjkr_area, _sjkr_volume, _zhang, contact, released
from dem.gravity import central
from dem.walls import distance_of
from matter.jit import kernel

# what the kick reports: dissipated by drag and at walls, elastic energy in walls, external impulse 3-8, worst overlap with a wall, its grain,
# largest speed squared, grains to be woken
DRAG, WALL_DISSIPATED, WALL_ELASTIC, IMPULSE, WALL_OVERLAP, WALL_GRAIN, SPEED, WOKEN = 0, 1, 2, 3, 9, 10, 11, 12
REPORT = 13


@functools.cache
def drift_loop(scheme: Scheme) -> Any:
    """The compiled first half of a step for one scheme: ``drift``."""
    sleep = scheme.sleep

    @kernel
    def drift(lo, hi, active, X, V, W, A, E, reference, dt, report, asleep):
        """First half kick, drift and prediction for grains lo..hi; returns the largest squared displacement of an active grain."""
        half = 0.5 * dt
        largest = 0.0
        jx, jy, jz, lx, ly, lz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(lo, hi):
            if sleep != 0:
                if asleep[i] != 0:
                    jx += E[i, 0]
                    jy += E[i, 1]
                    jz += E[i, 2]
                    lx += E[i, 3]
                    ly += E[i, 4]
                    lz += E[i, 5]
                    continue
            for c in range(6):
                W[i, c] += half * A[i, c]
                V[i, c] = W[i, c] + half * A[i, c]
            jx += E[i, 0]
            jy += E[i, 1]
            jz += E[i, 2]
            lx += E[i, 3]
            ly += E[i, 4]
            lz += E[i, 5]
            for c in range(3):
                X[i, c] += dt * W[i, c]
            if i < active:
                a, b, d = X[i, 0] - reference[i, 0], X[i, 1] - reference[i, 1], X[i, 2] - reference[i, 2]
                largest = max(largest, a * a + b * b + d * d)
        report[3] += half * jx
        report[4] += half * jy
        report[5] += half * jz
        report[6] += half * lx
        report[7] += half * ly
        report[8] += half * lz
        return largest

    return drift


@functools.cache
def kick_loop(scheme: Scheme) -> Any:
    """The compiled second half of a step for one scheme: ``kick``."""
    normal, mindlin, cohesion, rule = scheme.normal, scheme.mindlin, scheme.cohesion, scheme.sliding
    offset, sleep, attract, columns = scheme.offset, scheme.sleep, scheme.attract, scheme.history

    @kernel
    def kick(
        lo, hi, chunk, active, X, V, W, A, E, F, spill, last, drag, weight, kind, returned, walls, walled, wall_tables, wall_history,
        uniform, g_table, g_radius, dt, half, tail, report, asleep, near, live, wall_energy, held, rest, wake, memory, pull_of_all,
    ):  # fmt: skip
        """Sum the forces on grains lo..hi and finish the step (``half`` = dt/2; 0 only evaluates); returns the first grain that is not finite, or -1.

        ``spill`` (chunks, n, 6) holds what lower chunks added to these grains, up to grain ``last[chunk]``; it is zeroed here.
        ``walled`` marks grains that can reach a wall before the next list; ``weight`` multiplies gravity, ``drag`` [1/s] is a linear damping of velocity
        and spin.
        With ``sleep``: a grain that sleeps (``asleep`` 1) stays where it is; what holds it counts as an external force, -F. One with a grain awake
        ``near`` it is marked (``asleep`` 2) when ``held`` (n, 6), the running mean over ``memory`` [s] of what its acceleration would be beyond that
        with which it fell asleep (``rest``), exceeds ``wake`` times gravity. ``wall_energy`` (n) as it was when last ``live``.
        ``pull_of_all`` (n, 3) acceleration by all other grains.
        """
        bad, woken = -1, 0
        gone, wall_lost, wall_stored, worst, worst_grain, fastest = 0.0, 0.0, 0.0, 0.0, -1, 0.0
        jx, jy, jz, lx, ly, lz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        central_part = g_radius > 0.0
        for i in range(lo, hi):
            if i < active:
                for c in range(chunk):
                    if i <= last[c]:
                        for k in range(6):
                            F[i, k] += spill[c, i, k]
                            spill[c, i, k] = 0.0
            x, y, z, radius = X[i, 0], X[i, 1], X[i, 2], X[i, 3]
            m, stiffness = V[i, 6], V[i, 7]
            inertia = 0.4 * m * radius * radius
            vx, vy, vz, wx, wy, wz = V[i, 0], V[i, 1], V[i, 2], V[i, 3], V[i, 4], V[i, 5]
            wm = weight[i] * m
            ex, ey, ez = wm * uniform[0], wm * uniform[1], wm * uniform[2]
            if central_part:
                r = np.sqrt(x * x + y * y + z * z)
                if r > 0.0:
                    q = wm * central(r, g_table, g_radius) / r
                    ex -= q * x
                    ey -= q * y
                    ez -= q * z
            if attract != 0:
                ex += m * pull_of_all[i, 0]
                ey += m * pull_of_all[i, 1]
                ez += m * pull_of_all[i, 2]
            tx, ty, tz = 0.0, 0.0, 0.0
            stored_before = wall_stored
            if sleep != 0:
                g2 = (ex * ex + ey * ey + ez * ez) / (m * m)
            if i < active and (sleep == 0 or live[i] != 0):
                held_by_wall = False
                if offset != 0:
                    for w in range(walls.shape[0]):
                        held_by_wall |= wall_history[i, w, 7] != 0.0
                for w in range(walls.shape[0] if walled[i] != 0 else 0):
                    d, nx, ny, nz = distance_of(walls, w, x, y, z)
                    touch = radius
                    if offset != 0:
                        touch += wall_history[i, w, 8]
                    if d >= touch:
                        if wall_history[i, w, 7] != 0.0:
                            wall_lost += released(wall_history[i, w], stiffness, radius, wall_tables[w, kind[i]], mindlin)
                            for k in range(8):
                                wall_history[i, w, k] = 0.0
                            if mindlin != 0 or (offset != 0 and wall_history[i, w, 8] > 0.0):
                                wall_history[i, w, 8] = 0.0
                            if offset != 0:
                                wall_history[i, w, 9] = 0.0
                        if offset != 0 and wall_history[i, w, 8] < 0.0 and d >= radius:
                            wall_history[i, w, 8] = 0.0
                        continue
                    # the wall is body 2, at rest: u = -v - d w x n
                    ux = -vx - d * (wy * nz - wz * ny)
                    uy = -vy - d * (wz * nx - wx * nz)
                    uz = -vz - d * (wx * ny - wy * nx)
                    un = ux * nx + uy * ny + uz * nz
                    wn = wx * nx + wy * ny + wz * nz
                    if offset != 0:
                        # deeper at once than it can have come within the step: it sank past the upper edge of the wall, and begins unloaded
                        fresh = wall_history[i, w, 7] == 0.0 and wall_history[i, w, 8] == 0.0 and not held_by_wall and half > 0.0
                        if fresh and touch - d > 2.0 * abs(un) * dt + 1e-3 * radius:
                            wall_history[i, w, 8] = d - touch
                            continue
                    k_wall = stiffness
                    if normal == HERTZ:
                        k_wall = 2.0 * wall_tables[w, kind[i], 7] * np.sqrt(radius * (touch - d))
                    pull, bound = 0.0, 0.0
                    if cohesion == ZHANG:
                        pull = _zhang(wall_tables[w, kind[i], 8], wall_tables[w, kind[i], 3], radius)
                        bound = pull * (touch - d)
                    elif cohesion == SJKR:
                        pull = wall_tables[w, kind[i], 8] * _sjkr_area(touch - d, radius, 0.0)
                        bound = wall_tables[w, kind[i], 8] * _sjkr_volume(touch - d, radius, 0.0)
                    s = kind[i]
                    table = (
                        wall_tables[w, s, 0], wall_tables[w, s, 1], wall_tables[w, s, 2], wall_tables[w, s, 3], wall_tables[w, s, 4],
                        wall_tables[w, s, 5], wall_tables[w, s, 6],
                    )  # fmt: skip
                    h = (
                        wall_history[i, w, 0], wall_history[i, w, 1], wall_history[i, w, 2], wall_history[i, w, 3], wall_history[i, w, 4],
                        wall_history[i, w, 5], wall_history[i, w, 6], wall_history[i, w, 7], wall_history[i, w, min(columns - 1, 8)],
                    )  # fmt: skip
                    fn, fx, fy, fz, mx, my, mz, stored, spent, _, h = contact(
                        nx, ny, nz, touch - d, un, ux - un * nx, uy - un * ny, uz - un * nz, wn * nx - wx, wn * ny - wy, wn * nz - wz, -wn, wn,
                        k_wall, m, radius, table, h, dt, tail, 0.0, pull, bound, rule, normal, mindlin,
                    )  # fmt: skip
                    wall_history[i, w, 0], wall_history[i, w, 1], wall_history[i, w, 2], wall_history[i, w, 3] = h[0], h[1], h[2], h[3]
                    wall_history[i, w, 4], wall_history[i, w, 5], wall_history[i, w, 6], wall_history[i, w, 7] = h[4], h[5], h[6], h[7]
                    if mindlin != 0 and table[2] > 0.0:
                        wall_history[i, w, 8] = k_wall
                    wall_stored += stored
                    wall_lost += spent
                    if returned[i] == 0 and (touch - d) / radius > worst:
                        worst, worst_grain = (touch - d) / radius, i
                    fx -= fn * nx
                    fy -= fn * ny
                    fz -= fn * nz
                    ex += fx
                    ey += fy
                    ez += fz
                    tx += d * (ny * fz - nz * fy) + mx
                    ty += d * (nz * fx - nx * fz) + my
                    tz += d * (nx * fy - ny * fx) + mz
            if sleep != 0:
                if live[i] == 0:
                    wall_stored += wall_energy[i]
                else:
                    wall_energy[i] = wall_stored - stored_before
                if asleep[i] != 0:
                    if near[i] != 0:
                        q = 2.0 * half / memory
                        held[i, 0] += q * ((ex + F[i, 0]) / m - rest[i, 0] - held[i, 0])
                        held[i, 1] += q * ((ey + F[i, 1]) / m - rest[i, 1] - held[i, 1])
                        held[i, 2] += q * ((ez + F[i, 2]) / m - rest[i, 2] - held[i, 2])
                        held[i, 3] += q * ((tx + F[i, 3]) / (m * radius) - rest[i, 3] - held[i, 3])
                        held[i, 4] += q * ((ty + F[i, 4]) / (m * radius) - rest[i, 4] - held[i, 4])
                        held[i, 5] += q * ((tz + F[i, 5]) / (m * radius) - rest[i, 5] - held[i, 5])
                        a2 = held[i, 0] ** 2 + held[i, 1] ** 2 + held[i, 2] ** 2
                        t2 = held[i, 3] ** 2 + held[i, 4] ** 2 + held[i, 5] ** 2
                        if max(a2, t2) > wake * wake * g2:
                            asleep[i] = 2
                            woken += 1
                    ex, ey, ez = -F[i, 0], -F[i, 1], -F[i, 2]
                    E[i, 0], E[i, 1], E[i, 2] = ex, ey, ez
                    E[i, 3] = y * ez - z * ey - F[i, 3]
                    E[i, 4] = z * ex - x * ez - F[i, 4]
                    E[i, 5] = x * ey - y * ex - F[i, 5]
                    for k in range(6):
                        A[i, k] = 0.0
                    jx += ex
                    jy += ey
                    jz += ez
                    lx += E[i, 3]
                    ly += E[i, 4]
                    lz += E[i, 5]
                    continue
            c = drag[i]
            if c > 0.0:
                ex -= c * m * vx
                ey -= c * m * vy
                ez -= c * m * vz
                tx -= c * inertia * wx
                ty -= c * inertia * wy
                tz -= c * inertia * wz
                gone += c * dt * (m * (vx * vx + vy * vy + vz * vz) + inertia * (wx * wx + wy * wy + wz * wz))
            E[i, 0], E[i, 1], E[i, 2] = ex, ey, ez
            E[i, 3] = y * ez - z * ey + tx
            E[i, 4] = z * ex - x * ez + ty
            E[i, 5] = x * ey - y * ex + tz
            p, q = 1.0 / m, 1.0 / inertia
            A[i, 0] = (ex + F[i, 0]) * p
            A[i, 1] = (ey + F[i, 1]) * p
            A[i, 2] = (ez + F[i, 2]) * p
            A[i, 3] = (tx + F[i, 3]) * q
            A[i, 4] = (ty + F[i, 4]) * q
            A[i, 5] = (tz + F[i, 5]) * q
            total = 0.0
            for k in range(6):
                W[i, k] += half * A[i, k]
                total += A[i, k]
            fastest = max(fastest, W[i, 0] * W[i, 0] + W[i, 1] * W[i, 1] + W[i, 2] * W[i, 2])
            if bad < 0 and not np.isfinite(total + x + y + z):
                bad = i
            jx += ex
            jy += ey
            jz += ez
            lx += E[i, 3]
            ly += E[i, 4]
            lz += E[i, 5]
        report[0] += gone
        report[1] += wall_lost
        report[2] = wall_stored
        report[3] += half * jx
        report[4] += half * jy
        report[5] += half * jz
        report[6] += half * lx
        report[7] += half * ly
        report[8] += half * lz
        report[12] = woken
        report[9], report[10], report[11] = worst, worst_grain, fastest
        return bad

    return kick
