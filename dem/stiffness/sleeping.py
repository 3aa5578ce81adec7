"""Sleeping grains: what has come to rest is skipped until something near it moves or pushes.

A grain that has been slow (speed and r times spin below ``SLOW`` sqrt(g r)) for a time of ``PATIENCE`` sqrt(r / g),
and whose listed neighbours have been so too, falls asleep: it stays exactly where it is. What starts to slide at a > 2
``SLOW`` g is too fast by then. A row of the pair list is evaluated only when a grain of it is awake or has an awake
grain in the list, so the forces on every sleeper next to a moving grain are complete at every step. It wakes when its
acceleration would change by more than ``WAKE`` g in the mean over ``MEMORY`` sqrt(r / g) (an impact that would give it
a speed of ``WAKE`` ``MEMORY`` sqrt(g r) does that at once), and takes part from the next step on; the waves that run
through a bed after an impact average out. Deep inside a sleeping region nothing can change.

Balances: the speed that is lost in falling asleep is booked as an impulse and as damping, and what holds a sleeper
(-F) as an external force, so momentum, angular momentum and energy are accounted for as without sleep.
"""

from __future__ import annotations

import numpy as np

from dem.contact.columns import ANGULAR_IMPULSE, DRAGGED, IMPULSE, MASS, RADIUS, WX
from dem.grains.assembly import Assembly
from matter.compilation.jit import kernel

EVERY = 10
"""Steps between two looks."""
SLOW = 0.02
"""Largest speed, over sqrt(g r), of a grain about to sleep."""
PATIENCE = 0.5
"""Time for which a grain must have been slow, over sqrt(r / g)."""
WAKE = 0.05
"""Mean change of acceleration, over g, that wakes a grain."""
MEMORY = 0.25
"""Time of that mean, over sqrt(r / g)."""


@kernel
def _restless(row, col, calm, restless):
    """Mark in ``restless`` the grains that are not calm or are listed with one that is not."""
    for i in range(row.shape[0] - 1):
        if calm[i] == 0:
            restless[i] = 1
        for e in range(row[i], row[i + 1]):
            if calm[i] == 0:
                restless[col[e]] = 1
            elif calm[col[e]] == 0:
                restless[i] = 1


def look(bed: Assembly) -> None:
    """Let grains fall asleep, at a full step."""
    n = bed.active
    x, v = bed.X[:n], bed.W[:n]
    g = bed.gravity.strength(np.sqrt(np.einsum("ij,ij->i", x[:, :3], x[:, :3])))
    r2 = x[:, RADIUS] ** 2
    speed2 = np.einsum("ij,ij->i", v[:, :3], v[:, :3]) + r2 * np.einsum("ij,ij->i", v[:, WX:], v[:, WX:])
    bed.quiet[:n] = np.where(speed2 < SLOW**2 * g * x[:, RADIUS], bed.quiet[:n] + EVERY * bed.dt, 0.0)
    bed.quiet[n:] = 0.0
    unit = np.sqrt(x[:, RADIUS] / np.maximum(g, 1e-300))
    bed.wake, bed.memory = WAKE, max(MEMORY * float(np.mean(unit)), bed.dt)
    calm = (bed.quiet[:n] >= PATIENCE * unit) | (bed.asleep[:n] != 0)
    restless = np.zeros(n, dtype=np.int8)
    _restless(bed.row, bed.col, calm, restless)
    falling = np.flatnonzero(calm & (restless == 0) & (bed.asleep[:n] == 0))
    if len(falling):
        lay(bed, falling)
        bed.survey()


def lay(bed: Assembly, which: np.ndarray) -> None:
    """Stop the grains ``which`` (indices) and book what they lose."""
    m, r, x, w = bed.mass[which], bed.X[which, RADIUS], bed.X[which, :3], bed.W[which]
    p, spin = m[:, None] * w[:, :3], (0.4 * m * r**2)[:, None] * w[:, WX:]
    bed.report[DRAGGED] += 0.5 * float(np.einsum("ij,ij->", p, w[:, :3]) + np.einsum("ij,ij->", spin, w[:, WX:]))
    bed.report[IMPULSE] -= p.sum(axis=0)
    bed.report[ANGULAR_IMPULSE] -= (np.cross(x, p) + spin).sum(axis=0)
    f = bed.F[which]
    bed.E[which, :3] = -f[:, :3]
    bed.E[which, WX:] = -np.cross(x, f[:, :3]) - f[:, WX:]
    bed.W[which] = 0.0
    bed.V[which, :MASS] = 0.0
    bed.rest[which, :3], bed.rest[which, WX:] = bed.A[which, :3], 0.4 * r[:, None] * bed.A[which, WX:]
    bed.A[which] = 0.0
    bed.held[which] = 0.0
    bed.asleep[which] = 1
