"""A small periodic cell of grains: simple shear at constant normal stress, and a bed that is tilted.

Both are periodic along x and y. Sheared, the cell is periodic along z too, with images that slide past each other
(Lees & Edwards 1972, J. Phys. C 5, 1921): image k above moves with k dgamma/dt L_z along x, and L_z follows the normal
stress,

    d(ln L_z)/dt = RESPONSE (sigma_zz - P) / P      [in units of 1 / (d sqrt(rho / P))]

so that the whole cell shears evenly, without a wall. Tilted, z is bounded below by grains that are held (a rough base)
and open above, and gravity turns from -z towards +x. Contacts are ``dem.contact``, the laws of the stage with Hooke's
springs and without cohesion; time steps are those of ``dem.integrator``.

Units inside: mean diameter d = 1, density of a grain rho = 1, and P = 1 (sheared) or g = 1 (tilted). The stress of the
contacts is sigma_ab = (1/V) sum f_a b_b, compression positive (Christoffersen, Mehrabadi & Nemat-Nasser 1981, J. Appl.
Mech. 48, 339).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dem import contacts
from dem.columns import (
    HISTORY,
    MASS,
    RADIUS,
    ROLL,
    SLIP,
    STIFFNESS,
    TOUCHING,
    TWIST,
    TX,
    TY,
    TZ,
    WX,
    WY,
    WZ,
)
from dem.contact import Bodies, Springs, contact, numbers_of
from dem.contact_settings import Contact
from dem.laws.tangential_spring import RULES
from dem.meeting import Ball, meeting_of_grains
from dem.scheme import Scheme
from matter.errors import UnphysicalState
from matter.jit import kernel

SOURCES = ("Christoffersen1981",)

RESPONSE = 0.05
STEPS_PER_CONTACT = 15
SKIN = 0.12

# what a stretch of steps sums: stress xx yy zz xz (from contacts), kinetic energy of fluctuations, contacts, height,
# mean velocity along x, time steps
XX, YY, ZZ, XZ, FLUCTUATION, CONTACTS, HEIGHT, FLOW, STEPS = range(9)
SUMS = 9


class Sample(NamedTuple):
    """Grains of the cell: tables ``X``, ``V``, ``W``, ``A``, ``F`` (``dem.columns``), which are ``held`` (n,), and
    places at the last list ``start`` (n, 3)."""

    X: np.ndarray
    V: np.ndarray
    W: np.ndarray
    A: np.ndarray
    F: np.ndarray
    held: np.ndarray
    start: np.ndarray


class Touching(NamedTuple):
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
    """``rate`` of shear, ``pressure`` (0: heights are kept), ``drag``, ``dt``; ``rule`` of sliding and attractive
    ``tail`` of the contacts."""

    rate: float
    pressure: float
    drag: float
    dt: float
    rule: int
    tail: bool


@kernel
def neighbours(X, period, shift, skin, row, col):
    """The half list of a periodic cell by trying all pairs (the cell is small); returns the number of pairs."""
    n, found = X.shape[0], 0
    for i in range(n):
        row[i] = found
        for j in range(i + 1, n):
            dx, dy, dz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            k = np.rint(dz / period[2])
            dz -= k * period[2]
            dx -= k * shift
            dx -= np.rint(dx / period[0]) * period[0]
            dy -= np.rint(dy / period[1]) * period[1]
            reach = X[i, RADIUS] + X[j, RADIUS] + skin
            if dx * dx + dy * dy + dz * dz < reach * reach:
                if found < col.shape[0]:
                    col[found] = j
                found += 1
    row[n] = found
    return found


@kernel(fastmath=True)
def _pairs(sample, touching, frame, drive, shift, slide, stress):
    """Forces of all pairs: ``F`` and the histories; sums f_a b_b of those in the slab into ``stress`` (xx yy zz xz);
    returns contacts and worst overlap.

    ``shift`` [d] and ``slide`` [sqrt(P / rho)]: place and velocity along x of the image above.
    """
    X, V, F = sample.X, sample.V, sample.F
    row, col, hist, table = touching
    period, slab = frame.period, frame.slab
    scheme = Scheme(0, 0, 0, 0, 0, 0, drive.rule, 0, 0, 0)  # the first law of each family, no cohesion
    numbers = numbers_of(table, 0, 0)
    n = X.shape[0]
    F[:] = 0.0
    sxx, syy, szz, sxz, found = 0.0, 0.0, 0.0, 0.0, 0
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
            meeting, l1, l2 = meeting_of_grains((nx, ny, nz), velocity, one, two, 0.0)
            nx, ny, nz, overlap = meeting.nx, meeting.ny, meeting.nz, meeting.overlap
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
            fn, tx, ty, tz, mx, my, mz, _, _, _, h = contact(
                meeting, bodies, numbers, springs, drive.dt, drive.tail, scheme
            )
            hist[e, SLIP], hist[e, SLIP + 1], hist[e, SLIP + 2] = h.sx, h.sy, h.sz
            hist[e, ROLL], hist[e, ROLL + 1], hist[e, ROLL + 2], hist[e, TWIST], hist[e, TOUCHING] = (
                h.ax,
                h.ay,
                h.az,
                h.phi,
                h.flag,
            )
            found += 1
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
    return found, worst


@kernel
def _advance(steps, sample, touching, frame, drive, sums):
    """Up to ``steps`` steps, fewer when the list is used up; returns the steps done and the worst overlap. What is
    measured is added to ``sums`` (SUMS,).

    In and out: ``Sample``, of which ``held`` grains do not move, ``Touching``, ``Frame``.
    """
    X, V, W, A, F, held, start = sample
    period, clock, slab, gravity = frame
    rate, pressure, drag, dt, _, _ = drive
    n = X.shape[0]
    stress = np.zeros(4)
    worst = 0.0
    since = clock[1]
    for step in range(steps):
        far = 0.0
        for i in range(n):
            if held[i]:
                continue
            for c in range(6):
                W[i, c] += 0.5 * dt * A[i, c]
                V[i, c] = W[i, c] + 0.5 * dt * A[i, c]
            for c in range(3):
                X[i, c] += dt * W[i, c]
            dx = X[i, 0] - start[i, 0] - (clock[1] - since) * X[i, 2]
            dy, dz = X[i, 1] - start[i, 1], X[i, 2] - start[i, 2]
            far = max(far, dx * dx + dy * dy + dz * dz)
        clock[0] += rate * period[2] * dt
        clock[1] += rate * dt
        contacts_now, overlap = _pairs(sample, touching, frame, drive, clock[0], rate * period[2], stress)
        worst = max(worst, overlap)
        volume = period[0] * period[1] * min(period[2], slab[1] - slab[0])
        kinetic, flow, mass = 0.0, 0.0, 0.0
        for i in range(n):
            if held[i]:
                continue
            m = V[i, MASS]
            inertia = 0.4 * m * X[i, RADIUS] * X[i, RADIUS]
            for c in range(3):
                A[i, c] = F[i, c] / m + gravity[c] - drag * (V[i, c] - (rate * X[i, 2] if c == 0 else 0.0))
                A[i, WX + c] = F[i, TX + c] / inertia - drag * V[i, WX + c]
            for c in range(6):
                W[i, c] += 0.5 * dt * A[i, c]
            wx = W[i, 0] - rate * X[i, 2]
            kinetic += 0.5 * m * (wx * wx + W[i, 1] * W[i, 1] + W[i, 2] * W[i, 2])
            flow += m * W[i, 0]
            mass += m
        if pressure > 0.0:
            q = min(max(RESPONSE * (stress[ZZ] / volume / pressure - 1.0), -0.05), 0.05) * dt
            for i in range(n):
                X[i, 2] += q * X[i, 2]
            period[2] += q * period[2]
        for c in range(4):
            sums[c] += stress[c] / volume
        sums[FLUCTUATION] += kinetic / n
        sums[CONTACTS] += contacts_now
        sums[HEIGHT] += period[2]
        sums[FLOW] += flow / mass
        sums[STEPS] += 1.0
        # neighbours also part by the shear itself, over at most a diameter and a half of height
        if 2.0 * math.sqrt(far) + 1.5 * abs(clock[1] - since) > SKIN:
            return step + 1, worst
    return steps, worst


def _table(contact_law: Contact) -> np.ndarray:
    """Parameters of two solid grains: springs of constant stiffness and no cohesion, whatever the case takes."""
    return np.ascontiguousarray(
        contact_law.model_copy(update={"normal": "hooke", "tangential": "spring", "cohesion": "none"}).pair_table()[
            :1, :1
        ]
    )


class Cell:
    """Grains in a periodic cell under one contact law.

    ``x`` (n, 3) positions, ``radius`` (n,), ``period`` (3,): z counts only where the images slide. ``stiffness``: k_n
    of a grain of mean size. ``slab`` (2,): heights between which the stress is measured; everywhere at first.
    """

    def __init__(
        self,
        x: np.ndarray,
        radius: np.ndarray,
        period: np.ndarray,
        contact_law: Contact,
        stiffness: float,
        held: np.ndarray | None = None,
    ):
        n = len(x)
        self.period = np.array(period, dtype=float)
        self.law, self.table = contact_law, _table(contact_law)
        self.X = np.column_stack([x, radius])
        self.W = np.zeros((n, 6))
        mass = math.pi / 6.0 * (2.0 * radius) ** 3
        self.V = np.column_stack([self.W, mass, stiffness * 2.0 * radius])
        self.A, self.F = np.zeros((n, 6)), np.zeros((n, 6))
        self.held = np.zeros(n, dtype=np.bool_) if held is None else held
        self.clock = np.zeros(2)
        self.dt = math.pi * math.sqrt(0.5 * float(np.min(mass / self.V[:, STIFFNESS]))) / STEPS_PER_CONTACT
        self.row, self.col, self.hist = (
            np.zeros(n + 1, dtype=np.int64),
            np.zeros(12 * n, dtype=np.int32),
            np.zeros((0, HISTORY)),
        )
        self.start = self.X[:, :3].copy()
        self.rate, self.pressure, self.drag, self.gravity = 0.0, 0.0, 0.0, np.zeros(3)
        self.overlap_limit = 0.5
        self.slab = np.array([-np.inf, np.inf])
        self._build()

    def set_law(self, contact_law: Contact) -> None:
        """Another contact law from here on; springs start anew."""
        self.law, self.table = contact_law, _table(contact_law)
        self.hist[:, :TOUCHING] = 0.0

    def _build(self) -> None:
        touch = np.flatnonzero(self.hist[:, TOUCHING] != 0.0) if len(self.hist) else np.zeros(0, dtype=np.int64)
        first = np.repeat(np.arange(len(self.X)), np.diff(self.row))[touch] if len(touch) else touch
        second, old = self.col[touch].astype(np.int64), self.hist[touch]
        while neighbours(self.X, self.period, self.clock[0], SKIN, self.row, self.col) > len(self.col):
            self.col = np.zeros(int(1.2 * self.row[-1]), dtype=np.int32)
        self.hist = np.zeros((int(self.row[-1]), HISTORY))
        contacts.carry(first, second, old, self.row, self.col, self.hist)
        self.start = self.X[:, :3].copy()

    def run(self, steps: int) -> dict[str, float]:
        """Advance and return means over these steps: stresses ``xx yy zz xz``, ``fluctuation`` (kinetic energy of a
        grain), ``coordination``, ``height``, ``flow`` (mean velocity along x) and ``fraction`` (grain volume over cell
        volume).

        Raises ``UnphysicalState`` when grains overlap by half a radius: the cell has burst.
        """
        sums = np.zeros(SUMS)
        left = steps
        while left > 0:
            sample = Sample(self.X, self.V, self.W, self.A, self.F, self.held, self.start)
            touching = Touching(self.row, self.col, self.hist, self.table)
            drive = Drive(
                float(self.rate),
                float(self.pressure),
                float(self.drag),
                self.dt,
                RULES[self.law.sliding],
                self.law.attractive_tail,
            )
            done, worst = _advance(
                left, sample, touching, Frame(self.period, self.clock, self.slab, self.gravity), drive, sums
            )
            left -= done
            if worst > self.overlap_limit or not np.isfinite(self.X).all():
                raise UnphysicalState(
                    f"the periodic cell has burst: grains overlap by {worst:.3g} radii after a strain of "
                    f"{self.clock[1]:.3g}"
                )
            if left > 0:
                self._build()
        mean = sums / sums[STEPS]
        volume = math.pi / 6.0 * float(np.sum((2.0 * self.X[:, RADIUS]) ** 3))
        names = ("xx", "yy", "zz", "xz", "fluctuation", "contacts", "height", "flow")
        out = dict(zip(names, mean.tolist()))
        out["coordination"] = 2.0 * out.pop("contacts") / len(self.X)
        out["fraction"] = volume / float(self.period[0] * self.period[1] * out["height"])
        return out
