"""A small periodic cell of grains: simple shear at constant normal stress, and a bed that is tilted.

Both are periodic along x and y. Sheared, the cell is periodic along z too, with images that slide past each other
(Lees & Edwards 1972, J. Phys. C 5, 1921): image k above moves with k dgamma/dt L_z along x, and L_z follows the normal
stress,

    d(ln L_z)/dt = RESPONSE (sigma_zz - P) / P      [in units of 1 / (d sqrt(rho / P))]

so that the whole cell shears evenly, without a wall. Its stress is that of the contacts and of the momentum that
grains carry in their motion about the flow, m v_a v_b / V, which counts in fast shear.

Tilted, z is bounded below by grains that are held (a rough base) and open above, and gravity turns from -z towards +x.
Contacts are ``dem.contact``, the laws of the stage with Hooke's springs and without cohesion; time steps are those of
``dem.grains.grain_integrator``.

Units inside: mean diameter d = 1, density of a grain rho = 1, and P = 1 (sheared) or g = 1 (tilted). Forces and
the stress of the contacts: ``dem.trials.cell_forces``.
"""

from __future__ import annotations

import math

import numpy as np

from dem.contact.columns import HISTORY, MASS, PX, PY, PZ, RADIUS, STIFFNESS, TOUCHING, TX, VX, VY, VZ, WX, XYZ
from dem.contact.settings import Contact
from dem.grains import pair_list
from dem.trials.cell_forces import (
    CONTACTS,
    FLOW,
    FLUCTUATION,
    HEIGHT,
    STEPS,
    SUMS,
    XX,
    XZ,
    YY,
    ZZ,
    CellContacts,
    Drive,
    Frame,
    Sample,
    neighbours,
    pairs,
)
from matter.compilation.jit import kernel
from matter.errors import UnphysicalState

CELL_STIFFNESS = 150.0
"""k_n of a grain of mean size over P d, or over g rho d^3 times the grains above it: overlaps of some thousandths of a
diameter. From there on the friction angle does not depend on it."""

RESPONSE = 0.05
STEPS_PER_CONTACT = 15
SKIN = 0.12


@kernel
def _advance(steps, sample, touching, frame, drive, sums):
    """Up to ``steps`` steps, fewer when the list is used up; returns the steps done and the worst overlap. What is
    measured is added to ``sums`` (SUMS,).

    In and out: ``Sample``, of which ``held`` grains do not move, ``CellContacts``, ``Frame``.
    """
    X, V, W, A, F, held, start = sample
    period, clock, slab, gravity = frame
    rate, pressure, drag, dt = drive
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
            dx = X[i, PX] - start[i, PX] - (clock[1] - since) * X[i, PZ]
            dy, dz = X[i, PY] - start[i, PY], X[i, PZ] - start[i, PZ]
            far = max(far, dx * dx + dy * dy + dz * dz)
        clock[0] += rate * period[2] * dt
        clock[1] += rate * dt
        contacts_now, overlap = pairs(sample, touching, frame, drive, clock[0], rate * period[2], stress)
        worst = max(worst, overlap)
        volume = period[0] * period[1] * min(period[2], slab[1] - slab[0])
        kinetic, flow, mass = 0.0, 0.0, 0.0
        mxx, myy, mzz, mxz, px, pz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            if held[i]:
                continue
            m = V[i, MASS]
            inertia = 0.4 * m * X[i, RADIUS] * X[i, RADIUS]
            for c in range(3):
                A[i, c] = F[i, c] / m + gravity[c] - drag * (V[i, c] - (rate * X[i, PZ] if c == 0 else 0.0))
                A[i, WX + c] = F[i, TX + c] / inertia - drag * V[i, WX + c]
            for c in range(6):
                W[i, c] += 0.5 * dt * A[i, c]
            wx = W[i, VX] - rate * X[i, PZ]
            kinetic += 0.5 * m * (wx * wx + W[i, VY] * W[i, VY] + W[i, VZ] * W[i, VZ])
            mxx += m * wx * wx
            myy += m * W[i, VY] * W[i, VY]
            mzz += m * W[i, VZ] * W[i, VZ]
            mxz += m * wx * W[i, VZ]
            px += m * wx
            pz += m * W[i, VZ]
            flow += m * W[i, VX]
            mass += m
        if pressure > 0.0:
            # about their mean: the momentum of all grains is kept, the flow at their mean height is not at rest
            kinetic -= 0.5 * px * px / mass
            mxx -= px * px / mass
            mxz -= px * pz / mass
            stress[XX] += mxx
            stress[YY] += myy
            stress[ZZ] += mzz
            stress[XZ] += mxz
            q = min(max(RESPONSE * (stress[ZZ] / volume / pressure - 1.0), -0.05), 0.05) * dt
            for i in range(n):
                X[i, PZ] += q * X[i, PZ]
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
        self.start = self.position.copy()
        self.rate, self.pressure, self.drag, self.gravity = 0.0, 0.0, 0.0, np.zeros(3)
        self.overlap_limit = 0.5
        self.slab = np.array([-np.inf, np.inf])
        self._build()

    @property
    def position(self) -> np.ndarray:
        """Positions (n, 3), a view."""
        return self.X[:, XYZ]

    @property
    def velocity(self) -> np.ndarray:
        """Velocities (n, 3), a view."""
        return self.W[:, XYZ]

    def set_law(self, contact_law: Contact) -> None:
        """Another contact law from here on; springs start from zero."""
        self.law, self.table = contact_law, _table(contact_law)
        self.hist[:, :TOUCHING] = 0.0

    def _build(self) -> None:
        n, m = len(self.X), len(self.hist)
        old = pair_list.first_of(self.row), self.col[:m].copy(), np.ones(m, dtype=np.int8), self.hist
        while neighbours(self.X, self.period, self.clock[0], SKIN, self.row, self.col) > len(self.col):
            self.col = np.zeros(int(1.2 * self.row[-1]), dtype=np.int32)
        self.hist = np.zeros((int(self.row[-1]), HISTORY))
        known = np.zeros(len(self.hist), dtype=np.int8)
        new_index = np.arange(n, dtype=np.int32)
        pair_list.carry(0, m, old, new_index, self.row, self.col[: len(known)], self.hist, known)
        self.start = self.position.copy()

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
            touching = CellContacts(self.row, self.col, self.hist, self.table)
            drive = Drive(float(self.rate), float(self.pressure), float(self.drag), self.dt)
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
