"""Velocity Verlet for grains, with the forces that act on single grains (gravity, walls, damping) inside the second
kick.

    v(n+1/2) = v(n) + a(n) dt/2,   x(n+1) = x(n) + v(n+1/2) dt,   v_pred(n+1) = v(n+1/2) + a(n) dt/2
    a(n+1) = forces(x(n+1), v_pred(n+1)),   v(n+1) = v(n+1/2) + a(n+1) dt/2

and the same for spins. Velocities enter the contact forces as predicted for the full step (pkdgrav does the same).
External impulses are summed with the same half steps, so that momentum + what left - impulses is constant to rounding.

Arrays: ``dem.contact.contact_scheme.Grains``, columns: ``dem.contact.columns``.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from dem.contact.columns import (
    HISTORY,
    MASS,
    OFFSET,
    RADIUS,
    REFERENCE_STIFFNESS,
    ROLL,
    SLIP,
    STIFFNESS,
    TOUCHING,
    TWIST,
    TX,
    TY,
    TZ,
    USUAL,
    WX,
    WY,
    WZ,
)
from dem.contact.contact import Bodies, Springs, contact, numbers_of, released
from dem.contact.contact_scheme import Chunk, Grains, Scheme, Step
from dem.contact.gravity import central
from dem.contact.kinematics import Ball, wall_kinematics
from dem.contact.walls import distance_of
from matter.compilation.jit import kernel

# what the kick reports: dissipated by drag and at walls, elastic energy in walls, external impulse 3-8, worst overlap
# with a wall, its grain, largest speed squared
DRAG, WALL_DISSIPATED, WALL_ELASTIC, IMPULSE, WALL_OVERLAP, WALL_GRAIN, SPEED = 0, 1, 2, 3, 9, 10, 11
REPORT = 12


@kernel
def drift(chunk, grains, reference, dt, report):
    """First half kick, drift and prediction for the grains of a chunk; returns the largest squared displacement of
    an active grain.

    In: ``Chunk`` and ``Grains`` as plain tuples, positions of the last list ``reference`` (n, 3). Out: ``X``,
    ``V``, ``W``; the external impulse in ``report``.
    """
    chunk, grains = Chunk(*chunk), Grains(*grains)
    X, V, W, A, E = grains.X, grains.V, grains.W, grains.A, grains.E
    half = 0.5 * dt
    largest = 0.0
    jx, jy, jz, lx, ly, lz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(chunk.lo, chunk.hi):
        for c in range(6):
            W[i, c] += half * A[i, c]
            V[i, c] = W[i, c] + half * A[i, c]
        jx += E[i, 0]
        jy += E[i, 1]
        jz += E[i, 2]
        lx += E[i, TX]
        ly += E[i, TY]
        lz += E[i, TZ]
        for c in range(3):
            X[i, c] += dt * W[i, c]
        if i < chunk.active:
            a, b, d = X[i, 0] - reference[i, 0], X[i, 1] - reference[i, 1], X[i, 2] - reference[i, 2]
            largest = max(largest, a * a + b * b + d * d)
    report[IMPULSE] += half * jx
    report[IMPULSE + 1] += half * jy
    report[IMPULSE + 2] += half * jz
    report[IMPULSE + 3] += half * lx
    report[IMPULSE + 4] += half * ly
    report[IMPULSE + 5] += half * lz
    return largest


@functools.cache
def kick_loop(scheme: Scheme) -> Any:
    """The compiled second half of a step for one scheme: ``kick``."""
    rescale, offset, attract = scheme.rescale, scheme.offset, scheme.attract
    reference_column = REFERENCE_STIFFNESS if scheme.history > REFERENCE_STIFFNESS else HISTORY - 1

    @kernel
    def kick(chunk, grains, halo, walls, external, step, report):
        """Sum the forces on the grains of a chunk and finish the step (``step.half`` 0 only evaluates); returns the
        first grain that is not finite, or -1.

        In, as plain tuples: ``Chunk``, ``Grains`` with the contacts' forces ``F``, ``Boundaries``, ``ExternalField``,
        ``Step`` of ``dem.contact.contact_scheme``; ``Halo`` holds what lower chunks added to these grains, and is
        zeroed here. Out: ``A``, ``E``, ``W``; histories of the walls; ``report`` (REPORT,).
        """
        chunk, step = Chunk(*chunk), Step(*step)
        lo, hi, active = chunk.lo, chunk.hi, chunk.active
        X, V, W, A, E, F, kind, returned = grains
        halo_force, last = halo
        rows, walled, wall_tables, wall_history = walls
        uniform, g_table, g_radius, weight, drag, self_acceleration = external
        dt, half = step.dt, step.half
        bad = -1
        drag_loss, wall_dissipated, wall_elastic, worst, worst_grain, fastest = 0.0, 0.0, 0.0, 0.0, -1, 0.0
        jx, jy, jz, lx, ly, lz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        central_part = g_radius > 0.0
        for i in range(lo, hi):
            if i < active:
                for c in range(chunk.number):
                    if i <= last[c]:
                        for k in range(6):
                            F[i, k] += halo_force[c, i, k]
                            halo_force[c, i, k] = 0.0
            x, y, z, radius = X[i, 0], X[i, 1], X[i, 2], X[i, RADIUS]
            m, stiffness = V[i, MASS], V[i, STIFFNESS]
            inertia = 0.4 * m * radius * radius
            vx, vy, vz, wx, wy, wz = V[i, 0], V[i, 1], V[i, 2], V[i, WX], V[i, WY], V[i, WZ]
            wm = weight[i] * m
            ex, ey, ez = wm * uniform[0], wm * uniform[1], wm * uniform[2]
            if central_part:
                r = math.sqrt(x * x + y * y + z * z)
                if r > 0.0:
                    q = wm * central(r, g_table, g_radius) / r
                    ex -= q * x
                    ey -= q * y
                    ez -= q * z
            if attract != 0:
                ex += m * self_acceleration[i, 0]
                ey += m * self_acceleration[i, 1]
                ez += m * self_acceleration[i, 2]
            tx, ty, tz = 0.0, 0.0, 0.0
            if i < active:
                touches_wall = False
                if offset != 0:
                    for w in range(rows.shape[0]):
                        touches_wall |= wall_history[i, w, TOUCHING] != 0.0
                for w in range(rows.shape[0] if walled[i] != 0 else 0):
                    d, nx, ny, nz = distance_of(rows, w, x, y, z)
                    touch = radius
                    if offset != 0:
                        touch += wall_history[i, w, OFFSET]
                    if d >= touch:
                        if wall_history[i, w, TOUCHING] != 0.0:
                            wall_dissipated += released(
                                wall_history[i, w], stiffness, radius, wall_tables[w, kind[i]], rescale
                            )
                            for k in range(HISTORY):
                                wall_history[i, w, k] = 0.0
                            if rescale != 0 or (offset != 0 and wall_history[i, w, OFFSET] > 0.0):
                                wall_history[i, w, OFFSET] = 0.0
                            if offset != 0:
                                wall_history[i, w, USUAL] = 0.0
                        if offset != 0 and wall_history[i, w, OFFSET] < 0.0 and d >= radius:
                            wall_history[i, w, OFFSET] = 0.0
                        continue
                    kinematics = wall_kinematics((nx, ny, nz), d, (vx, vy, vz), Ball(radius, wx, wy, wz), touch - d)
                    if offset != 0:
                        # deeper at once than it can have come within the step: it sank past the upper edge of the
                        # wall, and begins unloaded
                        fresh = (
                            wall_history[i, w, TOUCHING] == 0.0
                            and wall_history[i, w, OFFSET] == 0.0
                            and not touches_wall
                            and half > 0.0
                        )
                        if fresh and touch - d > 2.0 * abs(kinematics.un) * dt + 1e-3 * radius:
                            wall_history[i, w, OFFSET] = d - touch
                            continue
                    numbers = numbers_of(wall_tables, w, np.int64(kind[i]))
                    springs = Springs(
                        wall_history[i, w, SLIP], wall_history[i, w, SLIP + 1], wall_history[i, w, SLIP + 2],
                        wall_history[i, w, ROLL],
                        wall_history[i, w, ROLL + 1], wall_history[i, w, ROLL + 2], wall_history[i, w, TWIST],
                        wall_history[i, w, TOUCHING],
                        wall_history[i, w, reference_column],
                    )  # fmt: skip
                    bodies = Bodies(stiffness, m, radius, radius, 0.0, 0.0)
                    fn, fx, fy, fz, mx, my, mz, elastic_energy, dissipated_energy, _, h = contact(
                        kinematics, bodies, numbers, springs, dt, scheme
                    )
                    wall_history[i, w, SLIP], wall_history[i, w, SLIP + 1] = h.sx, h.sy
                    wall_history[i, w, SLIP + 2] = h.sz
                    wall_history[i, w, ROLL], wall_history[i, w, ROLL + 1] = h.ax, h.ay
                    wall_history[i, w, ROLL + 2] = h.az
                    wall_history[i, w, TWIST], wall_history[i, w, TOUCHING] = h.phi, h.flag
                    if rescale != 0:
                        wall_history[i, w, REFERENCE_STIFFNESS] = h.reference_stiffness
                    wall_elastic += elastic_energy
                    wall_dissipated += dissipated_energy
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
            c = drag[i]
            if c > 0.0:
                ex -= c * m * vx
                ey -= c * m * vy
                ez -= c * m * vz
                tx -= c * inertia * wx
                ty -= c * inertia * wy
                tz -= c * inertia * wz
                drag_loss += c * dt * (m * (vx * vx + vy * vy + vz * vz) + inertia * (wx * wx + wy * wy + wz * wz))
            E[i, 0], E[i, 1], E[i, 2] = ex, ey, ez
            E[i, TX] = y * ez - z * ey + tx
            E[i, TY] = z * ex - x * ez + ty
            E[i, TZ] = x * ey - y * ex + tz
            p, q = 1.0 / m, 1.0 / inertia
            A[i, 0] = (ex + F[i, 0]) * p
            A[i, 1] = (ey + F[i, 1]) * p
            A[i, 2] = (ez + F[i, 2]) * p
            A[i, WX] = (tx + F[i, TX]) * q
            A[i, WY] = (ty + F[i, TY]) * q
            A[i, WZ] = (tz + F[i, TZ]) * q
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
            lx += E[i, TX]
            ly += E[i, TY]
            lz += E[i, TZ]
        report[DRAG] += drag_loss
        report[WALL_DISSIPATED] += wall_dissipated
        report[WALL_ELASTIC] = wall_elastic
        report[IMPULSE] += half * jx
        report[IMPULSE + 1] += half * jy
        report[IMPULSE + 2] += half * jz
        report[IMPULSE + 3] += half * lx
        report[IMPULSE + 4] += half * ly
        report[IMPULSE + 5] += half * lz
        report[WALL_OVERLAP], report[WALL_GRAIN], report[SPEED] = worst, worst_grain, fastest
        return bad

    return kick
