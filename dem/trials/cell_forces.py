"""The half list of a periodic cell and the forces of its pairs, over images that slide (``dem.trials.shear_cell``).

The stress of the contacts is sigma_ab = (1/V) sum f_a b_b, compression positive (Christoffersen, Mehrabadi &
Nemat-Nasser 1981, J. Appl. Mech. 48, 339).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dem.contact.columns import HISTORY, MASS, RADIUS, ROLL, SLIP, STIFFNESS, TOUCHING, TWIST, TX, TY, TZ, WX, WY, WZ
from dem.contact.contact import Bodies, Springs, contact, numbers_of
from dem.contact.contact_scheme import Scheme
from dem.contact.kinematics import Ball, grain_kinematics
from matter.compilation.jit import inner_kernel, kernel

SOURCES = ("Christoffersen1981",)

# what a stretch of steps sums: stress xx yy zz xz (from contacts), kinetic energy of fluctuations, contacts, height,
# mean velocity along x, time steps
XX, YY, ZZ, XZ, FLUCTUATION, CONTACTS, HEIGHT, FLOW, STEPS = range(9)
SUMS = 9


class Sample(NamedTuple):
    """Grains of the cell: tables ``X``, ``V``, ``W``, ``A``, ``F`` (``dem.contact.columns``), which are ``held`` (n,),
    and positions at the last list ``start`` (n, 3)."""

    X: np.ndarray
    V: np.ndarray
    W: np.ndarray
    A: np.ndarray
    F: np.ndarray
    held: np.ndarray
    start: np.ndarray


class CellContacts(NamedTuple):
    """The half list ``row`` (n + 1,), ``col`` (m,), histories ``hist`` (m, 8), and ``table`` (1, 1, columns) the
    numbers of every contact."""

    row: np.ndarray
    col: np.ndarray
    hist: np.ndarray
    table: np.ndarray


class Frame(NamedTuple):
    """``period`` (3,) [d]; ``clock`` (2,): slide of the images [d] and strain so far; ``slab`` (2,): heights between
    which contacts count for the stress; ``gravity`` (3,)."""

    period: np.ndarray
    clock: np.ndarray
    slab: np.ndarray
    gravity: np.ndarray


class Drive(NamedTuple):
    """``rate`` of shear, ``pressure`` (0: heights are kept), ``drag``, ``dt``."""

    rate: float
    pressure: float
    drag: float
    dt: float


@kernel
def neighbours(X, period, shift, skin, row, col):
    """The half list of a periodic cell by trying all pairs (the cell is small); returns the number of pairs."""
    n, count = X.shape[0], 0
    for i in range(n):
        row[i] = count
        for j in range(i + 1, n):
            dx, dy, dz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            k = np.rint(dz / period[2])
            dz -= k * period[2]
            dx -= k * shift
            dx -= np.rint(dx / period[0]) * period[0]
            dy -= np.rint(dy / period[1]) * period[1]
            reach = X[i, RADIUS] + X[j, RADIUS] + skin
            if dx * dx + dy * dy + dz * dz < reach * reach:
                if count < col.shape[0]:
                    col[count] = j
                count += 1
    row[n] = count
    return count


@inner_kernel(fastmath=True)
def pairs(sample, touching, frame, drive, shift, slide, stress):
    """Forces of all pairs: ``F`` and the histories; sums f_a b_b of those in the slab into ``stress`` (xx yy zz xz);
    returns contacts and worst overlap.

    ``shift`` [d] and ``slide`` [sqrt(P / rho)]: position and velocity along x of the image above.
    """
    X, V, F = sample.X, sample.V, sample.F
    row, col, hist, table = touching
    period, slab = frame.period, frame.slab
    scheme = Scheme(0, 0, 0, 0, 0, 0, 0, 0, 0)  # the first law of each family, no cohesion
    numbers = numbers_of(table, np.int64(0), np.int64(0))
    n = X.shape[0]
    F[:] = 0.0
    sxx, syy, szz, sxz, count = 0.0, 0.0, 0.0, 0.0, 0
    worst = 0.0
    for i in range(n):
        ri, mi, ki = X[i, RADIUS], V[i, MASS], V[i, STIFFNESS]
        for e in range(row[i], row[i + 1]):
            j = col[e]
            nx, ny, nz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            image = np.rint(nz / period[2])
            nz -= image * period[2]
            nx -= image * shift
            nx -= np.rint(nx / period[0]) * period[0]
            ny -= np.rint(ny / period[1]) * period[1]
            rj = X[j, RADIUS]
            d2 = nx * nx + ny * ny + nz * nz
            if d2 >= (ri + rj) * (ri + rj):
                if hist[e, TOUCHING] != 0.0:
                    for c in range(HISTORY):
                        hist[e, c] = 0.0
                continue
            bx, by, bz = nx, ny, nz
            mj = V[j, MASS]
            velocity = V[j, 0] - V[i, 0] - image * slide, V[j, 1] - V[i, 1], V[j, 2] - V[i, 2]
            one, two = Ball(ri, V[i, WX], V[i, WY], V[i, WZ]), Ball(rj, V[j, WX], V[j, WY], V[j, WZ])
            kinematics, l1, l2 = grain_kinematics((nx, ny, nz), velocity, one, two, 0.0)
            nx, ny, nz, overlap = kinematics.nx, kinematics.ny, kinematics.nz, kinematics.overlap
            springs = Springs(
                hist[e, SLIP],
                hist[e, SLIP + 1],
                hist[e, SLIP + 2],
                hist[e, ROLL],
                hist[e, ROLL + 1],
                hist[e, ROLL + 2],
                hist[e, TWIST],
                hist[e, TOUCHING],
                0.0,
            )
            bodies = Bodies(min(ki, V[j, STIFFNESS]), mi * mj / (mi + mj), ri * rj / (ri + rj), ri, rj, 0.0)
            fn, tx, ty, tz, mx, my, mz, _, _, _, h = contact(kinematics, bodies, numbers, springs, drive.dt, scheme)
            hist[e, SLIP], hist[e, SLIP + 1], hist[e, SLIP + 2] = h.sx, h.sy, h.sz
            hist[e, ROLL], hist[e, ROLL + 1], hist[e, ROLL + 2], hist[e, TWIST] = h.ax, h.ay, h.az, h.phi
            hist[e, TOUCHING] = h.flag
            count += 1
            worst = max(worst, overlap / min(ri, rj))
            tx -= fn * nx
            ty -= fn * ny
            tz -= fn * nz
            middle = X[i, 2] + 0.5 * bz
            if slab[0] < middle < slab[1]:
                sxx -= tx * bx
                syy -= ty * by
                szz -= tz * bz
                sxz -= 0.5 * (tx * bz + tz * bx)
            cx, cy, cz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
            F[i, 0] += tx
            F[i, 1] += ty
            F[i, 2] += tz
            F[i, TX] += l1 * cx + mx
            F[i, TY] += l1 * cy + my
            F[i, TZ] += l1 * cz + mz
            F[j, 0] -= tx
            F[j, 1] -= ty
            F[j, 2] -= tz
            F[j, TX] += l2 * cx - mx
            F[j, TY] += l2 * cy - my
            F[j, TZ] += l2 * cz - mz
    stress[XX], stress[YY], stress[ZZ], stress[XZ] = sxx, syy, szz, sxz
    return count, worst
