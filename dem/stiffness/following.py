"""Springs that become softer as the contacts of a collapse become slower, and the step longer with them.

The overlap of a collision goes as v sqrt(m / k_n), that of a load as F / k_n. Every half contact time the bed is
looked at: v sqrt(m_red / k_n) of the fastest approach among listed grains, and the deepest overlap, both over the
smaller radius. k_n of all grains is then multiplied by one factor so that the first, as the largest of the last
``MEMORY`` looks, just stays below x_max (``static_overlap``) and the second below half of ``overlap_stop`` (a few
wedged grains carry more than ten times the mean force); k_n is never above its start nor below what carries the bed, g
rho H r / x_max, and falls by at most a half at once. The time step follows as 1 / sqrt(k_n).

What a change does to each spring is ``dem.stiffness.change``: energy enters only where a load lasts. What enters
beyond what the weight of the undisturbed bed would take (forces that are not yet told from weight) is summed up by its
amount. Springs soften only while that sum stays below ``BUDGET`` of the kinetic energy that the compact grains were
handed, of which every halving has an equal part, and while the weight lies in them; else they wait until waves
have died down. Springs that must stiffen always may: the stage ends as unsound above ``LIMIT``.

Ground that falls back fast presses on what lies below it for long and by more than its weight, and springs give up
energy as they stiffen under it. That comes after all softening, where no budget can foresee it: it is why a case has
to ask for springs that follow (docs/results/dem_sci).

With ``stiffness_factor`` f all springs are f times as stiff: x_max is x_max / sqrt(f) of an approach and x_max / f of
a load.

Source: k_n and step for the speeds at hand: Schwartz, Richardson & Michel 2012, Granular Matter 14, 363; the change of
springs is this project's own.
"""

from __future__ import annotations

import math

import numpy as np

from dem.contact.columns import MASS, RADIUS, STIFFNESS
from dem.grains.assembly import Assembly
from dem.stiffness import change
from matter.compilation.jit import kernel
from matter.files import checkpoint

MEMORY = 20
"""Looks whose largest overlaps count: ten contact times."""
BUDGET = 0.005
"""Largest energy that softening may put into springs beyond what the weight takes, over the kinetic energy of the
compact grains at the start."""
CARRIED = 0.75
"""Fraction of the undisturbed bed's need (a carved one weighs less) that the springs must take up in a softening,
where it counts beside ``BUDGET``."""
LIMIT = 0.01
"""The same of all changes, above which a run is unsound."""


class Following:
    """The decision when to change the stiffness of one bed; ``floor_pressure`` g rho H [Pa] of its load, ``handed``
    [J] the kinetic energy of its compact grains at the start."""

    def __init__(self, bed: Assembly, floor_pressure: float, handed: float):
        self.bed, contact = bed, bed.contact
        self.target = contact.static_overlap / math.sqrt(contact.stiffness_factor)
        loaded = contact.static_overlap / contact.stiffness_factor
        carries = floor_pressure * bed.X[:, RADIUS] / loaded
        carries = np.maximum(carries, contact.constant_pull(bed.X[:, RADIUS]) / (loaded * bed.X[:, RADIUS]))
        usual = bed.returned == 0
        ratio = (carries / bed.V[:, STIFFNESS])[usual] if usual.any() else np.ones(1)
        self.lowest = float(min(1.0, ratio.max()))
        self.stop = 0.5 * contact.overlap_stop
        self.budget = BUDGET * handed
        self.every = max(1, contact.steps_per_contact // 2)
        self.look_weight = change.look_weight(bed, self.every, contact.steps_per_contact)
        self.seen: list[tuple[float, float]] = []
        change.at_rest(bed)

    def see(self) -> None:
        """After every step: look at the bed when it is time to, and change the stiffness when it pays."""
        bed = self.bed
        if bed.steps % self.every:
            return
        change.remember(bed, self.look_weight)
        self.seen = [*self.seen[1 - MEMORY :], self._overlaps()]
        if len(self.seen) < MEMORY:
            return
        approach, deepest = np.array(self.seen).max(axis=0)
        factor = max((approach / self.target) ** 2, deepest / self.stop, 0.5)
        q = min(1.0, max(self.lowest, bed.softness * factor)) / bed.softness
        if 0.8 < q < 1.1:
            return
        if q > 1.0 or self._affordable(q):
            change.change(bed, q)
            self.seen = [(a / q**0.5, d / q) for a, d in self.seen]
        else:
            self.seen = self.seen[MEMORY // 2 :]  # ask again in five contact times

    def _affordable(self, q: float) -> bool:
        """Whether a softening by ``q`` keeps the sum of what exceeds the need of the weight within the fraction of the
        halvings so far, and the weight lies in the springs now: one that falls into soft springs later would compress
        them with energy of its own."""
        bed = self.bed
        gain, need = change.gain(bed, q), change.need_of_weight(bed, q)
        excess = abs(gain - change.taken_by_weight(bed, q, gain))
        room = self.budget * math.log(bed.softness * q) / math.log(self.lowest) - bed.stiffness_excess
        return excess <= room and (gain >= CARRIED * need or need - gain <= room)

    def _overlaps(self) -> tuple[float, float]:
        """Overlaps over the smaller radius, returned grains left out: of the fastest approach, and the deepest."""
        bed = self.bed
        return float(np.sqrt(fastest_approach(bed.row, bed.col, bed.returned, bed.X, bed.W, bed.V))), bed.worst

    def state(self) -> dict[str, np.ndarray]:
        """What a checkpoint must hold besides the bed."""
        return {"seen": np.array(self.seen).reshape(-1, 2)}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        self.seen = [(float(a), float(d)) for a, d in saved["seen"]]


@kernel
def fastest_approach(row, col, returned, X, W, V):
    """Largest (v sqrt(m / k_n) / r)^2 of an approach among listed pairs: reduced mass, the smaller k_n and radius;
    returned grains are left out."""
    largest = 0.0
    for i in range(row.shape[0] - 1):
        for e in range(row[i], row[i + 1]):
            j = col[e]
            dx, dy, dz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            closing = dx * (W[i, 0] - W[j, 0]) + dy * (W[i, 1] - W[j, 1]) + dz * (W[i, 2] - W[j, 2])
            if closing <= 0.0 or returned[i] != 0 or returned[j] != 0:
                continue
            m = V[i, MASS] * V[j, MASS] / (V[i, MASS] + V[j, MASS])
            r = min(X[i, RADIUS], X[j, RADIUS])
            largest = max(
                largest,
                closing
                * closing
                / (dx * dx + dy * dy + dz * dz)
                * m
                / (min(V[i, STIFFNESS], V[j, STIFFNESS]) * r * r),
            )
    return largest
