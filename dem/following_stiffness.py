"""Springs that become softer as the contacts of a collapse become slower, and the step longer with them.

The overlap of a collision goes as v sqrt(m / k_n), that of a load as F / k_n. Every half contact time the bed is looked at: v sqrt(m_red / k_n) of
the fastest approach among listed grains, and the deepest overlap, both over the smaller radius. k_n of all grains is then multiplied by one
factor so that the first, as the largest of the last ``MEMORY`` looks, just stays below x_max (``static_overlap``) and the second below half of
``overlap_stop`` (a few wedged grains carry more than ten times the mean force); k_n is never above its start nor below what carries the bed,
g rho H r / x_max, and falls by at most a half at once. The time step follows as 1 / sqrt(k_n).

Forces are continuous through a change by q: the overlap x of each contact becomes x / q by an offset to it, kept in the contact's history (its
grains do not move), and all springs are divided by q. The contact ends where its offset overlap does; then the offset is forgotten, a negative
one (left by a stiffening) when the grains part. What the springs hold after the change less what they held before is booked.

Source: k_n and step for the speeds at hand: Schwartz, Richardson & Michel 2012, Granular Matter 14, 363; the rescaling of history is this project's own.
"""

from __future__ import annotations

import numpy as np

from dem.assembly import Assembly
from matter.jit import kernel

MEMORY = 20
"""Looks whose largest overlaps count: ten contact times."""


class Following:
    """The decision when to change the stiffness of one bed; ``floor_pressure`` g rho H [Pa] of its load."""

    def __init__(self, bed: Assembly, floor_pressure: float):
        self.bed, contact = bed, bed.contact
        self.target = contact.static_overlap
        carries = floor_pressure * bed.X[:, 3] / contact.static_overlap
        shell = contact.shell
        if contact.cohesion == "zhang":
            carries = np.maximum(carries, shell.cohesion * shell.shape**2 * bed.X[:, 3] / contact.static_overlap)
        usual = bed.returned == 0
        ratio = (carries / bed.V[:, 7])[usual] if usual.any() else np.ones(1)
        self.lowest = float(min(1.0, ratio.max()))
        self.stop = 0.5 * contact.overlap_stop
        self.every = max(1, contact.steps_per_contact // 2)
        self.seen: list[tuple[float, float]] = []

    def see(self) -> None:
        """After every step: look at the bed when it is time to, and change the stiffness when it pays."""
        bed = self.bed
        if bed.steps % self.every:
            return
        self.seen = [*self.seen[1 - MEMORY :], self._overlaps()]
        if len(self.seen) < MEMORY:
            return
        approach, deepest = np.array(self.seen).max(axis=0)
        factor = max((approach / self.target) ** 2, deepest / self.stop, 0.5)
        q = min(1.0, max(self.lowest, bed.softness * factor)) / bed.softness
        if not 0.8 < q < 1.1:
            rescale(bed, q)
            self.seen = [(a / q**0.5, d / q) for a, d in self.seen]

    def _overlaps(self) -> tuple[float, float]:
        """Overlaps over the smaller radius, returned grains left out: of the fastest approach, and the deepest."""
        bed = self.bed
        return float(np.sqrt(fastest_approach(bed.row, bed.col, bed.returned, bed.X, bed.W, bed.V))), bed.worst

    def state(self) -> dict[str, np.ndarray]:
        """What a checkpoint must hold besides the bed."""
        return {"following": np.array(self.seen).reshape(-1, 2)}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take over what ``state`` gave."""
        self.seen = [(float(a), float(d)) for a, d in arrays["following"]]


@kernel
def fastest_approach(row, col, returned, X, W, V):
    """Largest (v sqrt(m / k_n) / r)^2 of an approach among listed pairs: reduced mass, the smaller k_n and radius; returned grains are left out."""
    largest = 0.0
    for i in range(row.shape[0] - 1):
        for e in range(row[i], row[i + 1]):
            j = col[e]
            dx, dy, dz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            closing = dx * (W[i, 0] - W[j, 0]) + dy * (W[i, 1] - W[j, 1]) + dz * (W[i, 2] - W[j, 2])
            if closing <= 0.0 or returned[i] != 0 or returned[j] != 0:
                continue
            m = V[i, 6] * V[j, 6] / (V[i, 6] + V[j, 6])
            r = min(X[i, 3], X[j, 3])
            largest = max(largest, closing * closing / (dx * dx + dy * dy + dz * dz) * m / (min(V[i, 7], V[j, 7]) * r * r))
    return largest


def rescale(bed: Assembly, q: float) -> None:
    """Multiply k_n of all grains by ``q`` with all forces of springs unchanged; the step goes as 1 / sqrt(q)."""
    before = _energy(bed)
    first, second, _ = bed.touching()
    here = np.flatnonzero(bed.hist[:, 7] != 0.0)
    d = np.linalg.norm(bed.X[second, :3] - bed.X[first, :3], axis=1)
    bed.hist[here, 8] += (bed.X[first, 3] + bed.X[second, 3] + bed.hist[here, 8] - d) * (1.0 / q - 1.0)
    grain, wall, overlap = bed.wall_overlaps()
    bed.wall_history[grain, wall, 8] += overlap * (1.0 / q - 1.0)
    step = bed.dt / np.sqrt(q)
    for history, at in ((bed.hist, (here,)), (bed.wall_history, (grain, wall))):
        rows = history[at]
        rows[:, :7] /= q
        rows[:, 7] = 1.0 + (rows[:, 7] - 1.0) * bed.dt / step
        history[at] = rows
    bed.V[:, 7] *= q
    bed.softness *= q
    bed.change_step(float(step))
    after = _energy(bed)
    bed.stiffness_energy += after - before
    bed.elastic += after - before
    bed.worst /= q
    bed.evaluate_all()


def _energy(bed: Assembly) -> float:
    """Energy of all springs [J], with the pull of a constant cohesion."""
    first, second, h = bed.touching()
    x = bed.X[first, 3] + bed.X[second, 3] + h[:, 8] - np.linalg.norm(bed.X[second, :3] - bed.X[first, :3], axis=1)
    r = bed.X[first, 3] * bed.X[second, 3] / (bed.X[first, 3] + bed.X[second, 3])
    pairs = _springs(x, h, np.minimum(bed.V[first, 7], bed.V[second, 7]), r, bed.pair_table[bed.kind[first], bed.kind[second]])
    grain, wall, x = bed.wall_overlaps()
    walls = _springs(x, bed.wall_history[grain, wall], bed.V[grain, 7], bed.X[grain, 3], bed.wall_tables[wall, bed.kind[grain]])
    return pairs + walls


def _springs(x: np.ndarray, h: np.ndarray, k: np.ndarray, radius: np.ndarray, table: np.ndarray) -> float:
    arm2, kt = (table[:, 3] * radius) ** 2, k * table[:, 6]
    energy = k * x**2 + kt * np.sum(h[:, :3] ** 2, axis=1) + k * arm2 * np.sum(h[:, 3:6] ** 2, axis=1) + 2.0 * kt * arm2 * h[:, 6] ** 2
    return float(np.sum(0.5 * energy - table[:, 8] * 4.0 * arm2 * x))
