"""Springs that become softer as the contacts of a collapse become slower, and the step longer with them.

The overlap of a collision goes as v sqrt(m / k_n), that of a load as F / k_n: while the deepest overlap stays below x_max (``static_overlap``),
k_n may fall by that ratio. Every ``WINDOW`` contact times k_n of all grains is multiplied by one factor: deepest overlap of the last
windows over x_max, between 1/2 and 2, with k_n never above its start nor below what carries the bed, g rho H r / x_max. The time
step follows as 1 / sqrt(k_n).

Forces are continuous through a change by q: the overlap x of each contact becomes x / q by an offset to it, kept in the contact's history (its
grains do not move), and all springs are divided by q. The contact ends where its offset overlap does; then the offset is forgotten, a negative
one (left by a stiffening) when the grains part. What the springs hold after the change less what they held before is booked.

Source: k_n and step for the speeds at hand: Schwartz, Richardson & Michel 2012, Granular Matter 14, 363; the rescaling of history is this project's own.
"""

from __future__ import annotations

import numpy as np

from dem.assembly import Assembly

WINDOW = 4
"""Contact times between two decisions."""
MEMORY = 5
"""Windows whose deepest overlap counts."""


class Following:
    """The decision when to change the stiffness of one bed; ``floor_pressure`` g rho H [Pa] of its load."""

    def __init__(self, bed: Assembly, floor_pressure: float):
        self.bed, contact = bed, bed.contact
        self.target = contact.static_overlap
        carries = floor_pressure * bed.X[:, 3] / contact.static_overlap * contact.stiffness_factor
        shell = contact.shell
        if contact.cohesion == "zhang":
            carries = np.maximum(carries, shell.cohesion * shell.shape**2 * bed.X[:, 3] / contact.static_overlap)
        usual = bed.returned == 0
        ratio = (carries / bed.V[:, 7])[usual] if usual.any() else np.ones(1)
        self.lowest = float(min(1.0, ratio.max()))
        self.deepest = [0.0] * MEMORY
        self.every = WINDOW * contact.steps_per_contact
        self.countdown = self.every * MEMORY

    def see(self) -> None:
        """After every step: remember the deepest overlap, and decide when a window is over."""
        self.deepest[-1] = max(self.deepest[-1], self.bed.worst)
        self.countdown -= 1
        if self.countdown > 0:
            return
        self.countdown = self.every
        found = max(self.deepest) / self.target
        self.deepest = [*self.deepest[1:], 0.0]
        wanted = self.bed.softness * (max(0.5, found) if found < 1.0 else min(2.0, found * found))
        wanted = min(1.0, max(self.lowest, wanted))
        if not 0.8 < wanted / self.bed.softness < 1.1:
            q = wanted / self.bed.softness
            rescale(self.bed, q)
            self.deepest = [x / q for x in self.deepest]

    def state(self) -> dict[str, float]:
        """What a checkpoint must hold besides the bed."""
        return {"following_countdown": float(self.countdown), **{f"following_{k}": x for k, x in enumerate(self.deepest)}}

    def restore(self, saved: dict[str, float]) -> None:
        """Take over what ``state`` gave."""
        self.countdown = int(saved["following_countdown"])
        self.deepest = [float(saved[f"following_{k}"]) for k in range(MEMORY)]


def rescale(bed: Assembly, q: float) -> None:
    """Multiply k_n of all grains by ``q`` with all forces of springs unchanged; the step goes as 1 / sqrt(q)."""
    before = _energy(bed)
    first, second, _ = bed._touching()
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
    first, second, h = bed._touching()
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
