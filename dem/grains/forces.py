"""The loop over the half list of pairs, compiled for the laws that a case names. One contact: ``dem.contact``.

Every pair stands once in the list, in the row of the grain that comes first; its force goes to both grains. Threads
take contiguous chunks of rows; what a chunk adds to grains beyond its own end goes into its halo buffer and is added
afterwards in the order of the chunks. A result is therefore bitwise repeatable at one number of threads; between
numbers of threads the last bits differ.

A chunk is worked on in blocks: the list is looked through for pairs that touch, what the laws need of 64 to 96 of them
is turned into columns, the laws run over the columns (without arrays written or calls in between, so that the compiler
takes eight contacts at once), and forces and histories go back in the order of the list. A step is 2.6 times as fast
as with one contact after the other (100,000 grains, AVX-512).

``pair_loop(scheme)`` compiles the loop for one ``Scheme``. Its flags are constants to the compiler, so a case pays for
no law that it does not use.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from dem.contact.columns import (
    HISTORY,
    MASS,
    NORMAL,
    OFFSET,
    PAIR_COLUMNS,
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
)  # fmt: skip
from dem.contact.contact import Bodies, Springs, contact, lowered, reader, released
from dem.contact.contact_scheme import Chunk, Grains, Listed, Scheme, Step
from dem.contact.kinematics import Ball, grain_kinematics
from matter.compilation.gather import (
    LANES,
    WIDE,
    add_rows,
    append_passed,
    prefetch_row,
    put_rows,
    take_row_pairs,
    take_rows,
)
from matter.compilation.jit import inner_kernel, kernel, law

# what a chunk reports of a step
ELASTIC, DISSIPATED, EXCESS, CONTACTS, OVERLAP, OVERLAP_I, OVERLAP_J, OVER_WARN = range(8)
REPORT = 8


# entries of the list are looked through by segments; a block of contacts so found is worked on at once, as columns of
# a scratch table that stays in the nearest cache
SEGMENT, BLOCK = 32, 96
# columns of the scratch: positions and radii of both grains (8), V of the first (8) and of the second (8), history
# (9), pair table, limit on the closing speed; and positions and radii of a segment (8)
_POSITION, _POSITION_TWO, _ONE, _TWO, _HISTORY = 0, 4, 8, 16, 24
_SLIP, _ROLL, _TWIST, _TOUCHING = _HISTORY + SLIP, _HISTORY + ROLL, _HISTORY + TWIST, _HISTORY + TOUCHING
_EIGHTH = _HISTORY + HISTORY
_TABLE = _EIGHTH + 1
_FAST = _TABLE + PAIR_COLUMNS
_FREE, _FREE_TWO = _FAST + 1, _FAST + 5
_WIDTH = _FREE + 8
_BEARING = _WIDTH  # one more where the ground shakes
# and of what comes out, in the columns of what went in: force and moment on the first, elastic energy, overlap over
# the smaller radius; force and moment on the second, dissipated, excess
_ON_ONE, _ELASTIC, _RATIO = 0, 6, 7
_ON_TWO, _DISSIPATED, _EXCESS = 8, 14, 15

_numbers = reader("s, k", "s[{}, k]", _TABLE)


@law(forceinline=True)
def _shaken_numbers(s, k):
    return lowered(_numbers(s, k), s[_BEARING, k])


@functools.cache
def pair_loop(scheme: Scheme) -> Any:
    """The compiled loop for one scheme: ``pair_forces``."""
    rescale, offset, shaken = scheme.rescale, scheme.offset, scheme.shaken
    # chosen here, not in the loop: a loop without vibration keeps its bits
    numbers_at, width = (_shaken_numbers, _WIDTH + 1) if shaken else (_numbers, _WIDTH)
    columns = PAIR_COLUMNS if scheme.cohesion != 0 else NORMAL.stop  # that its contacts read

    @inner_kernel(fastmath=True, forceinline=True)
    def apply_laws(count, s, dt):
        """The laws on ``count`` contacts in the columns of ``s``: positions, velocities, histories, tables in; forces,
        energies, histories out."""
        for k in range(count):
            way = (
                s[_POSITION_TWO, k] - s[_POSITION, k],
                s[_POSITION_TWO + 1, k] - s[_POSITION + 1, k],
                s[_POSITION_TWO + 2, k] - s[_POSITION + 2, k],
            )
            ri, rj = s[_POSITION + RADIUS, k], s[_POSITION_TWO + RADIUS, k]
            one = Ball(ri, s[_ONE + WX, k], s[_ONE + WY, k], s[_ONE + WZ, k])
            two = Ball(rj, s[_TWO + WX, k], s[_TWO + WY, k], s[_TWO + WZ, k])
            mi, mj = s[_ONE + MASS, k], s[_TWO + MASS, k]
            more = s[_EIGHTH, k] if offset != 0 else 0.0
            velocity = s[_TWO, k] - s[_ONE, k], s[_TWO + 1, k] - s[_ONE + 1, k], s[_TWO + 2, k] - s[_ONE + 2, k]
            kinematics, l1, l2 = grain_kinematics(way, velocity, one, two, more)
            k_n = min(s[_ONE + STIFFNESS, k], s[_TWO + STIFFNESS, k])
            inv_product = 1.0 / ((mi + mj) * (ri + rj))  # one division for two
            reduced, radius = mi * mj * (ri + rj) * inv_product, ri * rj * (mi + mj) * inv_product
            numbers = numbers_at(s, k)
            springs = Springs(
                s[_SLIP, k],
                s[_SLIP + 1, k],
                s[_SLIP + 2, k],
                s[_ROLL, k],
                s[_ROLL + 1, k],
                s[_ROLL + 2, k],
                s[_TWIST, k],
                s[_TOUCHING, k],
                s[_EIGHTH, k],
            )
            limit = s[_FAST, k]
            bodies = Bodies(k_n, reduced, radius, ri, rj, max(limit, 0.0))
            fn, tx, ty, tz, mx, my, mz, elastic_energy, dissipated_energy, beyond, h = contact(
                kinematics, bodies, numbers, springs, dt, scheme
            )
            nx, ny, nz, overlap = kinematics.nx, kinematics.ny, kinematics.nz, kinematics.overlap
            tx -= fn * nx
            ty -= fn * ny
            tz -= fn * nz
            cx, cy, cz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
            s[_ON_ONE, k], s[_ON_ONE + 1, k], s[_ON_ONE + 2, k] = tx, ty, tz
            s[_ON_ONE + TX, k], s[_ON_ONE + TY, k], s[_ON_ONE + TZ, k] = l1 * cx + mx, l1 * cy + my, l1 * cz + mz
            s[_ON_TWO, k], s[_ON_TWO + 1, k], s[_ON_TWO + 2, k] = -tx, -ty, -tz
            s[_ON_TWO + TX, k], s[_ON_TWO + TY, k], s[_ON_TWO + TZ, k] = l2 * cx - mx, l2 * cy - my, l2 * cz - mz
            s[_ELASTIC, k], s[_DISSIPATED, k], s[_EXCESS, k] = elastic_energy, dissipated_energy, beyond
            s[_RATIO, k] = overlap / min(ri, rj) if limit < 0.0 else 0.0
            s[_SLIP, k], s[_SLIP + 1, k], s[_SLIP + 2, k] = h.sx, h.sy, h.sz
            s[_ROLL, k], s[_ROLL + 1, k], s[_ROLL + 2, k], s[_TWIST, k] = h.ax, h.ay, h.az, h.phi
            s[_TOUCHING, k] = h.flag
            if rescale != 0:
                s[_EIGHTH, k] = h.reference_stiffness

    @inner_kernel(fastmath=True)
    def part(i, j, e, X, V, kind, hist, table):
        """Clear the history of a pair that does not touch; the energy that its springs lose."""
        ri, rj = X[i, RADIUS], X[j, RADIUS]
        lost = 0.0
        if hist[e, TOUCHING] != 0.0:
            lost = released(
                hist[e], min(V[i, STIFFNESS], V[j, STIFFNESS]), ri * rj / (ri + rj), table[kind[i], kind[j]], rescale
            )
            for c in range(HISTORY):
                hist[e, c] = 0.0
            if rescale != 0 or (offset != 0 and hist[e, OFFSET] > 0.0):
                hist[e, OFFSET] = 0.0
            if offset != 0:
                hist[e, USUAL] = 0.0
        if offset != 0 and hist[e, OFFSET] < 0.0:
            x, y, z = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            if x * x + y * y + z * z >= (ri + rj) * (ri + rj):
                hist[e, OFFSET] = 0.0
        return lost

    @kernel(fastmath=True)
    def pair_forces(chunk, grains, listed, step, halo, report):
        """Forces and torques of all pairs whose first grain lies in the rows of a chunk.

        In, as plain tuples: ``Chunk``, ``Grains`` (positions, predicted velocities, species, returned), ``Listed``,
        ``Step`` of ``dem.contact.contact_scheme``. Out: ``F`` of the chunk's own rows, set here; contributions to
        grains at and beyond ``chunk.hi`` in ``halo`` (n, 6), of which rows from there on must be zero; histories and
        ``known``; ``report`` (REPORT,). Returns the highest grain index that was written, so that only that part of
        the halo need be added.
        """
        chunk, grains, listed, step = Chunk(*chunk), Grains(*grains), Listed(*listed), Step(*step)
        lo, hi, begin, end = chunk.lo, chunk.hi, chunk.begin, chunk.end
        X, V, F, kind, returned = grains.X, grains.V, grains.F, grains.kind, grains.returned
        first, col, known, hist, table, bearing = listed
        dt, over_speed, warn = step.dt, step.over_speed, step.warn
        s = np.empty((width, BLOCK))
        entry, one, two = (
            np.empty(BLOCK + WIDE, np.int32),
            np.empty(BLOCK + WIDE, np.int32),
            np.empty(BLOCK + WIDE, np.int32),
        )
        entries, left, right, near = (
            np.empty(SEGMENT, np.int32),
            np.empty(SEGMENT, np.int32),
            np.empty(SEGMENT, np.int32),
            np.empty(SEGMENT, np.int8),
        )
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
        elastic, dissipated, excess = 0.0, 0.0, 0.0
        contacts, over, last = 0, 0, hi - 1
        worst, worst_i, worst_j = 0.0, -1, -1
        at = begin
        while at < end:
            m = 0
            while at < end and m <= BLOCK - SEGMENT:
                many = min(end - at, SEGMENT)
                for k in range(many):
                    entries[k] = at + k
                    left[k], right[k] = first[entries[k]], col[entries[k]]
                for k in range(at + many, min(at + 2 * many, end)):  # what the next segment reads
                    prefetch_row(X, col[k])
                for k in range(many, SEGMENT):
                    left[k], right[k], near[k] = lo, lo, 0
                for k in range(0, many, LANES):
                    take_row_pairs(X, left, right, k, s, _FREE)
                separated = 0
                for k in range(many):
                    x, y, z = (
                        s[_FREE_TWO, k] - s[_FREE, k],
                        s[_FREE_TWO + 1, k] - s[_FREE + 1, k],
                        s[_FREE_TWO + 2, k] - s[_FREE + 2, k],
                    )
                    touch = s[_FREE + RADIUS, k] + s[_FREE_TWO + RADIUS, k]
                    if offset != 0:
                        touch += hist[entries[k], OFFSET]
                    near[k] = x * x + y * y + z * z < touch * touch
                for k in range(many):
                    separated += known[at + k] & (1 - near[k])
                if separated > 0:
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
                take_row_pairs(X, one, two, k, s, _POSITION)
                take_rows(V, one, k, s, _ONE)
                take_rows(V, two, k, s, _TWO)
                take_rows(hist, entry, k, s, _HISTORY)
            if rescale != 0 or offset != 0:
                for k in range(filled):
                    s[_EIGHTH, k] = hist[entry[k], REFERENCE_STIFFNESS]
            if shaken != 0:
                for k in range(filled):
                    s[_BEARING, k] = min(bearing[one[k]], bearing[two[k]])
            if some_returned:
                for k in range(filled):
                    i, j = one[k], two[k]
                    s[_FAST, k] = -1.0
                    if returned[i] + returned[j] > 0:
                        mi, mj = V[i, MASS], V[j, MASS]
                        stiffness = min(V[i, STIFFNESS], V[j, STIFFNESS])
                        s[_FAST, k] = (
                            over_speed
                            * (X[i, RADIUS] + X[j, RADIUS])
                            * math.sqrt(0.5 * stiffness * (mi + mj) / (mi * mj))
                        )
            if mixed:
                for k in range(filled):
                    pair[k] = kind[one[k]] * table.shape[1] + kind[two[k]]
                for k in range(0, filled, LANES):
                    take_rows(of_pair, pair, k, s, _TABLE)
                for c in range(LANES, columns):
                    for k in range(filled):
                        s[_TABLE + c, k] = of_pair[pair[k], c]
            apply_laws(filled, s, dt)
            contacts += m
            largest, furthest = 0.0, 0
            for k in range(m):
                elastic += s[_ELASTIC, k]
                dissipated += s[_DISSIPATED, k]
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
                        halo[j, c] += s[_ON_TWO + c, k]
            for k in range(m // LANES * LANES, m):
                for c in range(HISTORY):
                    hist[entry[k], c] = s[_HISTORY + c, k]
            if rescale != 0:
                for k in range(m):
                    hist[entry[k], REFERENCE_STIFFNESS] = s[_EIGHTH, k]
        report[ELASTIC], report[DISSIPATED], report[EXCESS], report[CONTACTS] = elastic, dissipated, excess, contacts
        report[OVERLAP], report[OVERLAP_I], report[OVERLAP_J], report[OVER_WARN] = worst, worst_i, worst_j, over
        return last

    return pair_forces
