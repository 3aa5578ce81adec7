"""The contact of two grains (all components) and the loop over the half list of pairs, compiled for the laws that a case names.

Conventions: n points from grain i to grain j; u is the velocity of j's surface relative to i's at the contact,
u = v_j - v_i - (l1 w_i + l2 w_j) x n with l1 + l2 = d the lever arms to the contact plane of the two spheres, so that torques and
forces conserve angular momentum exactly. Laws and sources: ``dem.laws``; the combination is that of Zhang et al. 2017, Icarus 294, 98
(pkdgrav).

Every pair stands once in the list, in the row of the grain that comes first; its force goes to both grains. Threads take contiguous
chunks of rows; what a chunk adds to grains beyond its own end goes into its spill buffer and is added afterwards in the order of the chunks.
A result is therefore bitwise repeatable at one number of threads; between numbers of threads the last bits differ.

A chunk is worked on in blocks: the list is looked through for pairs that touch, what the laws need of 64 to 96 of them is turned into columns, the
laws run over the columns (without arrays written or calls in between, so that the compiler takes eight contacts at once), and forces and histories
go back in the order of the list. A step is 2.6 times as fast as with one contact after the other (100,000 grains, AVX-512).

``pair_loop(scheme)`` compiles the loop for one ``Scheme``. Its flags are constants to the compiler, so a case pays for no law that it does not use.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from dem.columns import (
    COHESION,
    DAMPING_N,
    DAMPING_T,
    FRICTION,
    HISTORY,
    LAID,
    MASS,
    MODULUS,
    OFFSET,
    PAIR_COLUMNS,
    RADIUS,
    RATIO,
    ROLL,
    ROLLING,
    SHAPE,
    SLIP,
    STIFFNESS,
    TOUCHING,
    TWIST,
    TWISTING,
    TX,
    TY,
    TZ,
    USUAL,
    WX,
    WY,
    WZ,
)  # fmt: skip
from dem.laws import cohesion_sjkr, cohesion_zhang, normal_hertz, normal_hooke, rolling_sds, tangential_mindlin, tangential_spring, twisting_sds
from dem.scheme import HERTZ, NO_COHESION, SJKR, ZHANG, Scheme
from matter.gather import LANES, WIDE, add_rows, append_passed, prefetch_row, put_rows, take_row_pairs, take_rows
from matter.jit import kernel, law

_hooke = normal_hooke.force
_hertz = normal_hertz.force
_tangential = tangential_spring.force
_kept = tangential_mindlin.kept
_rolling = rolling_sds.moment
_twisting = twisting_sds.moment
_zhang = cohesion_zhang.pull
_sjkr_area, _sjkr_volume = cohesion_sjkr.area, cohesion_sjkr.volume

# what a chunk reports of a step
ELASTIC, DISSIPATED, EXCESS, CONTACTS, OVERLAP, OVERLAP_I, OVERLAP_J, OVER_WARN = range(8)
REPORT = 8


@law(forceinline=True)
def turned(sx, sy, sz, nx, ny, nz, angle):
    """A spring turned by ``angle`` about the normal, laid back into the contact plane, with its length kept."""
    s2 = sx * sx + sy * sy + sz * sz
    if s2 == 0.0:
        return sx, sy, sz
    tx = sx + angle * (ny * sz - nz * sy)
    ty = sy + angle * (nz * sx - nx * sz)
    tz = sz + angle * (nx * sy - ny * sx)
    along = tx * nx + ty * ny + tz * nz
    tx -= along * nx
    ty -= along * ny
    tz -= along * nz
    t2 = tx * tx + ty * ty + tz * tz
    if t2 == 0.0:
        return 0.0, 0.0, 0.0
    q = math.sqrt(s2 / t2)
    return tx * q, ty * q, tz * q


@law(forceinline=True)
def edge_of_contact(overlap, un, flag, dt):
    """Weight of the dashpots, time over which springs load, and the new flag, in a step in which a contact may begin or end.

    The force of step n stands for the interval n - 1/2 .. n + 1/2. A contact that began tau = x / |u_n| before n lasted for
    1/2 + tau/dt of it (above 1: the end of the interval before is made good), and one that ends tau after n likewise. Without this
    weight the jump of the dashpot force makes the restitution depend on the phase of the step, by 2 % at t_c/30 and e_n = 0.55.
    ``flag`` is 0 before the contact, else 1 + what the last step has already given to this one.
    """
    if flag == 0.0:
        if -un * dt > 0.0:
            part = min(1.0, overlap / (-un * dt))
            return 0.5 + part, part * dt, 1.0
        return 1.0, dt, 1.0
    given = flag - 1.0
    if un * dt > overlap:
        part = 0.5 + overlap / (un * dt)
        return part - given, dt, 1.0 + max(0.0, part - 1.0)
    return 1.0 - given, dt, 1.0


class Meeting(NamedTuple):
    """How two bodies meet: unit vector ``n`` from the first to the second, ``overlap`` [m], separation speed ``un`` and slip velocity ``u`` in the contact
    plane [m/s], rolling rate ``r``, relative spin ``twist`` and mean ``spin`` about n [rad/s]."""

    nx: float
    ny: float
    nz: float
    overlap: float
    un: float
    ux: float
    uy: float
    uz: float
    rx: float
    ry: float
    rz: float
    twist: float
    spin: float


class Numbers(NamedTuple):
    """The numbers of a contact, as in a row of the table of pairs (``dem.columns``)."""

    damping_n: float
    damping_t: float
    friction: float
    shape: float
    rolling: float
    twisting: float
    ratio: float


class Springs(NamedTuple):
    """The history of a contact (``dem.columns``): tangential spring ``s`` [m], rolling spring ``a`` and twisting spring ``phi`` [rad], ``flag``, and the
    stiffness that they were ``laid`` down for [N/m], where the scheme has it."""

    sx: float
    sy: float
    sz: float
    ax: float
    ay: float
    az: float
    phi: float
    flag: float
    laid: float


class Bodies(NamedTuple):
    """``k``: k_n [N/m] (Hertz: the tangent stiffness); ``mass``: the reduced mass [kg]; ``radius``: R [m]; ``over_speed``: closing speed [m/s] above which the
    excess is taken out by a further dashpot (0: none); ``pull`` [N] and ``bound`` [J]: force and energy of cohesion."""

    k: float
    mass: float
    radius: float
    over_speed: float
    pull: float
    bound: float


class Response(NamedTuple):
    """What a contact gives: normal force ``fn`` (pushes apart), tangential force ``t`` [N] and moment ``m`` [N m] on the first body; energy ``stored`` in
    springs, ``spent`` and taken out as ``excess`` in this step [J]; the ``springs`` after it."""

    fn: float
    tx: float
    ty: float
    tz: float
    mx: float
    my: float
    mz: float
    stored: float
    spent: float
    excess: float
    springs: Springs


@law(forceinline=True)
def contact(meeting, bodies, numbers, springs, dt, tail, scheme):
    """One contact over one step of ``dt`` [s]: a ``Response`` from ``Meeting``, ``Bodies``, ``Numbers`` and the ``Springs`` before it.

    ``tail``: the normal force may pull at the end of a contact; ``scheme`` (normal, mindlin, sliding) as in ``Scheme``. With ``mindlin`` and friction the
    springs are now laid down for ``bodies.k``.
    """
    nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist_rate, spin = meeting
    k, reduced, radius, over_speed, pull, bound = bodies
    sx, sy, sz, ax, ay, az, phi, flag, laid = springs
    normal, mindlin, rule = scheme
    share, span, flag = edge_of_contact(overlap, un, flag, dt)
    root = math.sqrt(k * reduced) * share
    damping = numbers.damping_n * root
    if normal == HERTZ:
        fn = _hertz(overlap, un, k, damping, tail)
        spent = (2.0 / 3.0 * k * overlap - fn) * un * dt
        stored = 4.0 / 15.0 * k * overlap * overlap
    else:
        fn = _hooke(overlap, un, k, damping, tail)
        spent = (k * overlap - fn) * un * dt
        stored = 0.5 * k * overlap * overlap
    excess = 0.0
    mu = numbers.friction
    tx, ty, tz, mx, my, mz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if mu > 0.0:
        load = abs(fn)
        kt = k * numbers.ratio
        ct = numbers.damping_t * root
        turn = spin * dt
        sx, sy, sz = turned(sx, sy, sz, nx, ny, nz, turn)
        # springs of changing stiffness: ``kept`` of each stays, ``old`` turns the new stiffness into the one it was laid down for
        kept, old = 1.0, 1.0
        if mindlin != 0:
            kept, old = _kept(k, laid, mindlin), laid / k
        before = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        if mindlin != 0:
            before *= old
            sx *= kept
            sy *= kept
            sz *= kept
        tx, ty, tz, sx, sy, sz = _tangential(sx + ux * span, sy + uy * span, sz + uz * span, ux, uy, uz, kt, ct, mu * load, rule)
        after = 0.5 * kt * (sx * sx + sy * sy + sz * sz)
        spent += (tx * ux + ty * uy + tz * uz) * dt - (after - before)
        stored += after
        arm = numbers.shape * radius
        if arm > 0.0:
            if numbers.rolling > 0.0:
                ax, ay, az = turned(ax, ay, az, nx, ny, nz, turn)
                kr = k * arm * arm
                before = 0.5 * kr * (ax * ax + ay * ay + az * az)
                if mindlin != 0:
                    before *= old
                    ax *= kept
                    ay *= kept
                    az *= kept
                mx, my, mz, ax, ay, az = _rolling(
                    ax + rx * span, ay + ry * span, az + rz * span, rx, ry, rz, kr, damping * arm * arm, numbers.rolling * arm * load, rule
                )
                after = 0.5 * kr * (ax * ax + ay * ay + az * az)
                spent += (mx * rx + my * ry + mz * rz) * dt - (after - before)
                stored += after
            if numbers.twisting > 0.0:
                kq = 2.0 * kt * arm * arm
                before = 0.5 * kq * phi * phi
                if mindlin != 0:
                    before *= old
                    phi *= kept
                mt, phi = _twisting(phi + twist_rate * span, twist_rate, kq, 2.0 * ct * arm * arm, numbers.twisting * mu * arm * load, rule)
                after = 0.5 * kq * phi * phi
                spent += mt * twist_rate * dt - (after - before)
                stored += after
                mx += mt * nx
                my += mt * ny
                mz += mt * nz
        if mindlin != 0:
            laid = k
    if over_speed > 0.0 and -un > over_speed:
        # twice the step as the time constant: the excess is gone within a few steps, and no step can reverse it
        push = reduced * (-un - over_speed) / (2.0 * dt)
        fn += push
        excess = -push * un * dt
    if pull != 0.0:
        # its jump at the edges of the contact weighs like that of the dashpots
        fn -= pull * share
        stored -= bound
    return Response(fn, tx, ty, tz, mx, my, mz, stored, spent, excess, Springs(sx, sy, sz, ax, ay, az, phi, flag, laid))


@law
def released(h, k, radius, table, mindlin):
    """Energy [J] of the springs of a contact that opens, which is lost: history ``h`` and ``table`` rows of their tables, k_n [N/m], R [m]."""
    if mindlin != 0:
        k = h[LAID]
    arm = table[SHAPE] * radius
    kt, kr = k * table[RATIO], k * arm * arm
    sliding = kt * (h[SLIP] * h[SLIP] + h[SLIP + 1] * h[SLIP + 1] + h[SLIP + 2] * h[SLIP + 2])
    rolling = kr * (h[ROLL] * h[ROLL] + h[ROLL + 1] * h[ROLL + 1] + h[ROLL + 2] * h[ROLL + 2])
    return 0.5 * (sliding + rolling + 2.0 * kt * arm * arm * h[TWIST] * h[TWIST])


# entries of the list are looked through by segments; a block of contacts so found is worked on at once, as columns of a scratch table that stays in the
# nearest cache
SEGMENT, BLOCK = 32, 96
# columns of the scratch: places and radii of both grains (8), V of the first (8) and of the second (8), history (9), pair table, limit on the closing speed;
# and places and radii of a segment (8)
_PLACE, _PLACE_TWO, _ONE, _TWO, _HISTORY = 0, 4, 8, 16, 24
_SLIP, _ROLL, _TWIST, _TOUCHING = _HISTORY + SLIP, _HISTORY + ROLL, _HISTORY + TWIST, _HISTORY + TOUCHING
_EIGHTH = _HISTORY + HISTORY
_TABLE = _EIGHTH + 1
_FAST = _TABLE + PAIR_COLUMNS
_FREE, _FREE_TWO = _FAST + 1, _FAST + 5
_WIDTH = _FREE + 8
# and of what comes out, in the place of what went in: force and moment on the first, elastic energy, overlap over the smaller radius;
# force and moment on the second, dissipated, excess
_ON_ONE, _STORED, _RATIO = 0, 6, 7
_ON_TWO, _SPENT, _EXCESS = 8, 14, 15


@functools.cache
def pair_loop(scheme: Scheme) -> Any:
    """The compiled loop for one scheme: ``pair_forces``."""
    mindlin, cohesion, offset, sleep = scheme.mindlin, scheme.cohesion, scheme.offset, scheme.sleep
    normal, laws = scheme.normal, (scheme.normal, scheme.mindlin, scheme.sliding)

    @kernel(fastmath=True, forceinline=True)
    def apply_laws(count, s, dt, tail):
        """The laws on ``count`` contacts in the columns of ``s``: places, velocities, histories, tables in; forces, energies, histories out."""
        for k in range(count):
            nx, ny, nz = s[_PLACE_TWO, k] - s[_PLACE, k], s[_PLACE_TWO + 1, k] - s[_PLACE + 1, k], s[_PLACE_TWO + 2, k] - s[_PLACE + 2, k]
            ri, rj = s[_PLACE + RADIUS, k], s[_PLACE_TWO + RADIUS, k]
            wxi, wyi, wzi = s[_ONE + WX, k], s[_ONE + WY, k], s[_ONE + WZ, k]
            wxj, wyj, wzj = s[_TWO + WX, k], s[_TWO + WY, k], s[_TWO + WZ, k]
            mi, mj = s[_ONE + MASS, k], s[_TWO + MASS, k]
            d2 = nx * nx + ny * ny + nz * nz
            d = math.sqrt(d2)
            q = 1.0 / d
            nx *= q
            ny *= q
            nz *= q
            touch = ri + rj
            if offset != 0:
                touch += s[_EIGHTH, k]
            overlap = touch - d
            l1 = 0.5 * (d + (ri * ri - rj * rj) * q)
            l2 = d - l1
            ax, ay, az = l1 * wxi + l2 * wxj, l1 * wyi + l2 * wyj, l1 * wzi + l2 * wzj
            ux = s[_TWO, k] - s[_ONE, k] - (ay * nz - az * ny)
            uy = s[_TWO + 1, k] - s[_ONE + 1, k] - (az * nx - ax * nz)
            uz = s[_TWO + 2, k] - s[_ONE + 2, k] - (ax * ny - ay * nx)
            un = ux * nx + uy * ny + uz * nz
            ux -= un * nx
            uy -= un * ny
            uz -= un * nz
            px, py, pz = wxj - wxi, wyj - wyi, wzj - wzi
            twist = px * nx + py * ny + pz * nz
            spin = 0.5 * ((wxi + wxj) * nx + (wyi + wyj) * ny + (wzi + wzj) * nz)
            lean = 0.5 * (l2 - l1) / (l1 * l2)
            rx = px - twist * nx + lean * (ny * uz - nz * uy)
            ry = py - twist * ny + lean * (nz * ux - nx * uz)
            rz = pz - twist * nz + lean * (nx * uy - ny * ux)
            k_n = min(s[_ONE + STIFFNESS, k], s[_TWO + STIFFNESS, k])
            both = 1.0 / ((mi + mj) * (ri + rj))  # one division for two
            reduced, radius = mi * mj * (ri + rj) * both, ri * rj * (mi + mj) * both
            if normal == HERTZ:
                k_n = 2.0 * s[_TABLE + MODULUS, k] * math.sqrt(radius * overlap)
            pull, bound = 0.0, 0.0
            if cohesion == ZHANG:
                pull = _zhang(s[_TABLE + COHESION, k], s[_TABLE + SHAPE, k], radius)
                bound = pull * overlap
            elif cohesion == SJKR:
                pull = s[_TABLE + COHESION, k] * _sjkr_area(overlap, ri, rj)
                bound = s[_TABLE + COHESION, k] * _sjkr_volume(overlap, ri, rj)
            numbers = Numbers(
                s[_TABLE + DAMPING_N, k], s[_TABLE + DAMPING_T, k], s[_TABLE + FRICTION, k], s[_TABLE + SHAPE, k], s[_TABLE + ROLLING, k],
                s[_TABLE + TWISTING, k], s[_TABLE + RATIO, k],
            )  # fmt: skip
            springs = Springs(
                s[_SLIP, k], s[_SLIP + 1, k], s[_SLIP + 2, k], s[_ROLL, k], s[_ROLL + 1, k], s[_ROLL + 2, k], s[_TWIST, k], s[_TOUCHING, k], s[_EIGHTH, k]
            )
            limit = s[_FAST, k]
            meeting = Meeting(nx, ny, nz, overlap, un, ux, uy, uz, rx, ry, rz, twist, spin)
            bodies = Bodies(k_n, reduced, radius, max(limit, 0.0), pull, bound)
            fn, tx, ty, tz, mx, my, mz, stored, spent, beyond, h = contact(meeting, bodies, numbers, springs, dt, tail, laws)
            tx -= fn * nx
            ty -= fn * ny
            tz -= fn * nz
            cx, cy, cz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
            s[_ON_ONE, k], s[_ON_ONE + 1, k], s[_ON_ONE + 2, k] = tx, ty, tz
            s[_ON_ONE + TX, k], s[_ON_ONE + TY, k], s[_ON_ONE + TZ, k] = l1 * cx + mx, l1 * cy + my, l1 * cz + mz
            s[_ON_TWO, k], s[_ON_TWO + 1, k], s[_ON_TWO + 2, k] = -tx, -ty, -tz
            s[_ON_TWO + TX, k], s[_ON_TWO + TY, k], s[_ON_TWO + TZ, k] = l2 * cx - mx, l2 * cy - my, l2 * cz - mz
            s[_STORED, k], s[_SPENT, k], s[_EXCESS, k] = stored, spent, beyond
            s[_RATIO, k] = overlap / min(ri, rj) if limit < 0.0 else 0.0
            s[_SLIP, k], s[_SLIP + 1, k], s[_SLIP + 2, k] = h.sx, h.sy, h.sz
            s[_ROLL, k], s[_ROLL + 1, k], s[_ROLL + 2, k], s[_TWIST, k], s[_TOUCHING, k] = h.ax, h.ay, h.az, h.phi, h.flag
            if mindlin != 0:
                s[_EIGHTH, k] = h.laid

    @kernel(fastmath=True)
    def part(i, j, e, X, V, kind, hist, table):
        """Clear the history of a pair that does not touch; the energy that its springs lose."""
        ri, rj = X[i, RADIUS], X[j, RADIUS]
        lost = 0.0
        if hist[e, TOUCHING] != 0.0:
            lost = released(hist[e], min(V[i, STIFFNESS], V[j, STIFFNESS]), ri * rj / (ri + rj), table[kind[i], kind[j]], mindlin)
            for c in range(HISTORY):
                hist[e, c] = 0.0
            if mindlin != 0 or (offset != 0 and hist[e, OFFSET] > 0.0):
                hist[e, OFFSET] = 0.0
            if offset != 0:
                hist[e, USUAL] = 0.0
        if offset != 0 and hist[e, OFFSET] < 0.0:
            x, y, z = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            if x * x + y * y + z * z >= (ri + rj) * (ri + rj):
                hist[e, OFFSET] = 0.0
        return lost

    @kernel(fastmath=True)
    def pair_forces(chunk, grains, listed, step, spill, report, sleepers):
        """Forces and torques of all pairs whose first grain lies in the rows of a chunk.

        In: ``Chunk``, ``Grains`` (places, predicted velocities, species, returned), ``Listed``, ``Step``, ``Sleepers`` (of ``dem.scheme``); with ``sleep``
        ``chunk.begin`` to ``end`` count in ``todo``.
        Out: ``F`` of the chunk's own rows, set here; contributions to grains at and beyond ``chunk.hi`` in ``spill`` (n, 6), of which rows from there on must
        be zero; histories and ``known``; ``report`` (REPORT,); with ``sleep`` the ``row_energy`` of its live rows.
        Returns the highest grain index that was written, so that only that part of the spill need be added.
        """
        lo, hi, begin, end = chunk.lo, chunk.hi, chunk.begin, chunk.end
        X, V, F, kind, returned = grains.X, grains.V, grains.F, grains.kind, grains.returned
        first, col, todo, known, hist, table = listed
        dt, tail, over_speed, warn = step.dt, step.tail, step.over_speed, step.warn
        live, row_energy = sleepers.live, sleepers.row_energy
        s = np.empty((_WIDTH, BLOCK))
        entry, one, two = np.empty(BLOCK + WIDE, np.int32), np.empty(BLOCK + WIDE, np.int32), np.empty(BLOCK + WIDE, np.int32)
        entries, left, right, near = np.empty(SEGMENT, np.int32), np.empty(SEGMENT, np.int32), np.empty(SEGMENT, np.int32), np.empty(SEGMENT, np.int8)
        pair, of_pair = np.empty(BLOCK, np.int32), table.reshape(-1, PAIR_COLUMNS)
        mixed, some_returned = False, False
        for i in range(lo, X.shape[0]):
            mixed |= kind[i] != kind[lo]
            some_returned |= returned[i] != 0
        for k in range(BLOCK):
            s[_EIGHTH, k], s[_FAST, k] = 0.0, -1.0
            for c in range(PAIR_COLUMNS):
                s[_TABLE + c, k] = table[kind[lo], kind[lo], c] if lo < hi else 0.0
        for i in range(lo, hi):
            for c in range(6):
                F[i, c] = 0.0
            if sleep != 0 and live[i] != 0:
                row_energy[i, 0], row_energy[i, 1] = 0.0, 0.0
        elastic, dissipated, excess = 0.0, 0.0, 0.0
        contacts, over, last = 0, 0, hi - 1
        worst, worst_i, worst_j = 0.0, -1, -1
        at = begin
        while at < end:
            m = 0
            while at < end and m <= BLOCK - SEGMENT:
                many = min(end - at, SEGMENT)
                for k in range(many):
                    entries[k] = todo[at + k] if sleep != 0 else at + k
                    left[k], right[k] = first[entries[k]], col[entries[k]]
                if sleep == 0:  # what the next segment reads
                    for k in range(at + many, min(at + 2 * many, end)):
                        prefetch_row(X, col[k])
                for k in range(many, SEGMENT):
                    left[k], right[k], near[k] = lo, lo, 0
                for k in range(0, many, LANES):
                    take_row_pairs(X, left, right, k, s, _FREE)
                parted = 0
                for k in range(many):
                    x, y, z = s[_FREE_TWO, k] - s[_FREE, k], s[_FREE_TWO + 1, k] - s[_FREE + 1, k], s[_FREE_TWO + 2, k] - s[_FREE + 2, k]
                    touch = s[_FREE + RADIUS, k] + s[_FREE_TWO + RADIUS, k]
                    if offset != 0:
                        touch += hist[entries[k], OFFSET]
                    near[k] = x * x + y * y + z * z < touch * touch
                if sleep != 0:
                    for k in range(many):
                        parted += known[entries[k]] & (1 - near[k])
                else:
                    for k in range(many):
                        parted += known[at + k] & (1 - near[k])
                if parted > 0:
                    for k in range(many):
                        if near[k] == 0 and known[entries[k]] != 0:
                            dissipated += part(left[k], right[k], entries[k], X, V, kind, hist, table)
                            known[entries[k]] = offset != 0 and hist[entries[k], OFFSET] != 0.0
                before = m
                for k in range(0, many, WIDE):
                    append_passed(left, near, k, one, m)
                    append_passed(right, near, k, two, m)
                    m += append_passed(entries, near, k, entry, m)
                for k in range(before, m):
                    prefetch_row(hist, entry[k])
                    prefetch_row(V, two[k])
                    prefetch_row(F, two[k])
                at += many
            if m == 0:
                continue
            filled = (m + LANES - 1) // LANES * LANES  # filled up with the last contact: evaluated, not counted
            for k in range(m, filled):
                entry[k], one[k], two[k] = entry[m - 1], one[m - 1], two[m - 1]
            for k in range(0, filled, LANES):
                take_row_pairs(X, one, two, k, s, _PLACE)
                take_rows(V, one, k, s, _ONE)
                take_rows(V, two, k, s, _TWO)
                take_rows(hist, entry, k, s, _HISTORY)
            if mindlin != 0 or offset != 0:
                for k in range(filled):
                    s[_EIGHTH, k] = hist[entry[k], LAID]
            if some_returned:
                for k in range(filled):
                    i, j = one[k], two[k]
                    s[_FAST, k] = -1.0
                    if returned[i] + returned[j] > 0:
                        mi, mj = V[i, MASS], V[j, MASS]
                        stiffness = min(V[i, STIFFNESS], V[j, STIFFNESS])
                        s[_FAST, k] = over_speed * (X[i, RADIUS] + X[j, RADIUS]) * math.sqrt(0.5 * stiffness * (mi + mj) / (mi * mj))
            if mixed:
                for k in range(filled):
                    pair[k] = kind[one[k]] * table.shape[1] + kind[two[k]]
                for k in range(0, filled, LANES):
                    take_rows(of_pair, pair, k, s, _TABLE)
                if cohesion != NO_COHESION:
                    for k in range(filled):
                        s[_TABLE + COHESION, k] = of_pair[pair[k], COHESION]
            apply_laws(filled, s, dt, tail)
            contacts += m
            largest, furthest = 0.0, 0
            for k in range(m):
                elastic += s[_STORED, k]
                dissipated += s[_SPENT, k]
                excess += s[_EXCESS, k]
            for k in range(m):
                largest = max(largest, s[_RATIO, k])
                furthest = max(furthest, two[k])
            if largest > min(worst, warn):
                for k in range(m):
                    if s[_RATIO, k] > worst:
                        worst, worst_i, worst_j = s[_RATIO, k], one[k], two[k]
                    if s[_RATIO, k] > warn:
                        over += 1
            whole = m // LANES * LANES
            if furthest >= hi:
                whole = 0
                last = max(last, furthest)
            for k in range(m):
                known[entry[k]] = 1
            for k in range(0, m // LANES * LANES, LANES):
                put_rows(s, _HISTORY, k, entry, hist)
            for k in range(0, whole, LANES):
                add_rows(s, _ON_ONE, k, one, F)
                add_rows(s, _ON_TWO, k, two, F)
            for k in range(whole, m):
                i, j = one[k], two[k]
                for c in range(6):
                    F[i, c] += s[_ON_ONE + c, k]
                for c in range(6):
                    if j < hi:
                        F[j, c] += s[_ON_TWO + c, k]
                    else:
                        spill[j, c] += s[_ON_TWO + c, k]
            for k in range(m // LANES * LANES, m):
                for c in range(HISTORY):
                    hist[entry[k], c] = s[_HISTORY + c, k]
            if mindlin != 0:
                for k in range(m):
                    hist[entry[k], LAID] = s[_EIGHTH, k]
            if sleep != 0:
                for k in range(m):
                    row_energy[one[k], 0] += s[_STORED, k]
                    row_energy[one[k], 1] += 1.0
        if sleep != 0:
            elastic, contacts = 0.0, 0
            for i in range(lo, hi):
                elastic += row_energy[i, 0]
                contacts += int(row_energy[i, 1])
        report[ELASTIC], report[DISSIPATED], report[EXCESS], report[CONTACTS] = elastic, dissipated, excess, contacts
        report[OVERLAP], report[OVERLAP_I], report[OVERLAP_J], report[OVER_WARN] = worst, worst_i, worst_j, over
        return last

    return pair_forces
