"""A change of k_n by one factor for all grains: what carries weight keeps its force, what moves keeps its energy.

A spring under the force F = k_n x holds F^2 / (2 k_n). If every spring kept its force through a change of k_n by q,
every loaded spring's energy would be divided by q: a wave in the contacts, or a collision that the change finds half
way, would go on with energy that nothing has given them. If every spring kept its energy, a bed at rest would lose its
balance. So the force of each contact is split into the part W that it carries for long, F's running mean over
``MEMORY`` crossings of the bed by a wave, at most F itself, and the rest; with w = W / F

    F' = p F,   p^2 = w^2 + q (1 - w^2),   x' = p x / q,   E' = E (w^2 / q + 1 - w^2):

a contact at rest (w = 1) keeps its force, one that has just begun (w = 0) its energy, and beyond what W takes, W^2 / 2
(1 / (q k_n) - 1 / k_n), no contact gains or loses anything. Tangential, rolling and twisting springs take the same p,
so that each stays as far from its Coulomb limit as it was. Grains do not move: the overlap changes by an offset, kept
in the contact's history. The contact ends where its offset overlap does; then the offset is forgotten, a negative one
(left by a stiffening) when the grains part.

Source: this project's own; F^2 / (2 k_n) is the energy of a linear spring.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dem.contact import contact
from dem.contact.columns import OFFSET, RADIUS, STIFFNESS, TOUCHING, USUAL
from dem.grains.assembly import Assembly
from matter.compilation.jit import kernel

MEMORY = 4.0
"""Crossings of the bed by a wave over which a force counts as lasting."""
_CROSSING = 0.45
"""Contact times pi sqrt(m / 2 k_n) in which a wave, 2 r sqrt(k_n / m), passes a grain: sqrt(2) / pi."""


class LoadedContacts(NamedTuple):
    """Contacts of one kind (pairs or walls): ``history[at]`` their rows; overlap [m] with its offset, k_n [N/m], R
    [m], rows of the contact table, and the ``pull`` [N] of cohesion, which is constant where springs can change."""

    history: np.ndarray
    at: tuple[np.ndarray, ...]
    overlap: np.ndarray
    stiffness: np.ndarray
    radius: np.ndarray
    table: np.ndarray
    pull: np.ndarray

    def energy(self, q: float = 1.0, stretch: np.ndarray | float = 1.0) -> float:
        """Energy of the springs [J] with k_n times ``q`` and all displacements times ``stretch``, with the pull of a
        constant cohesion."""
        k, x, h = self.stiffness * q, self.overlap * stretch, self.history[self.at]
        turned = contact.turned_energy(h, k, self.radius, self.table)
        return float(np.sum(0.5 * k * x**2 + stretch**2 * turned - self.pull * x))

    def stretches(self, q: float) -> np.ndarray:
        """x' / x of each contact in a change by ``q``: p / q."""
        force = self.stiffness * self.overlap
        lasting = np.minimum(self.history[self.at][:, USUAL], force)
        w2 = np.divide(lasting, force, out=np.zeros_like(force), where=force > 0.0) ** 2
        return np.sqrt(w2 + q * (1.0 - w2)) / q


def loaded(bed: Assembly) -> tuple[LoadedContacts, LoadedContacts]:
    """The contacts among grains, and those with walls."""
    here = np.flatnonzero(bed.hist[:, TOUCHING] != 0.0)
    first, second = bed.first[here], bed.col[here]
    x1, x2 = bed.X[first], bed.X[second]
    overlap = x1[:, RADIUS] + x2[:, RADIUS] + bed.hist[here, OFFSET] - np.linalg.norm(x2[:, :3] - x1[:, :3], axis=1)
    radius = x1[:, RADIUS] * x2[:, RADIUS] / (x1[:, RADIUS] + x2[:, RADIUS])
    stiffness = np.minimum(bed.V[first, STIFFNESS], bed.V[second, STIFFNESS])
    rows = bed.pair_table[bed.kind[first], bed.kind[second]]
    pairs = LoadedContacts(
        bed.hist, (here,), overlap, stiffness, radius, rows, contact.pulls(radius, rows, bed.scheme)
    )
    grain, wall, overlap = bed.wall_overlaps()
    radius, rows = bed.X[grain, RADIUS], bed.wall_tables[wall, bed.kind[grain]]
    walls = LoadedContacts(
        bed.wall_history,
        (grain, wall),
        overlap,
        bed.V[grain, STIFFNESS],
        radius,
        rows,
        contact.pulls(radius, rows, bed.scheme),
    )
    return pairs, walls


def energy(bed: Assembly) -> float:
    """Energy of all springs [J]."""
    return sum(kind.energy() for kind in loaded(bed))


def gain(bed: Assembly, q: float) -> float:
    """Energy [J] that a change of k_n by ``q`` would put into the springs now."""
    return sum(kind.energy(q, kind.stretches(q)) - kind.energy() for kind in loaded(bed))


def change(bed: Assembly, q: float) -> None:
    """Multiply k_n of all grains by ``q``; the step goes as 1 / sqrt(q). What it puts into the springs is booked: what
    the weight can have taken in ``bed.weight_energy``, the rest by its amount in ``bed.stiffness_excess``, both
    together in ``bed.stiffness_energy``."""
    step, put_in = bed.dt / np.sqrt(q), 0.0
    for kind in loaded(bed):
        stretch = kind.stretches(q)
        put_in += kind.energy(q, stretch) - kind.energy()
        rows = kind.history[kind.at]
        rows[:, :TOUCHING] *= stretch[:, None]
        rows[:, TOUCHING] = 1.0 + (rows[:, TOUCHING] - 1.0) * bed.dt / step
        rows[:, OFFSET] += kind.overlap * (stretch - 1.0)
        kind.history[kind.at] = rows
    by_weight = taken_by_weight(bed, q, put_in)
    bed.weight_energy += by_weight
    bed.stiffness_excess += abs(put_in - by_weight)
    bed.V[:, STIFFNESS] *= q
    bed.softness *= q
    bed.change_step(float(step))
    bed.stiffness_energy += put_in
    bed.elastic += put_in
    bed.worst /= q


def need_of_weight(bed: Assembly, q: float) -> float:
    """Energy [J] that the springs of the undisturbed bed at rest would take up in a change of k_n by ``q``: E_rest (1
    / q - 1), E_rest at the present k_n."""
    return bed.rest_energy / bed.softness * (1.0 / q - 1.0)


def taken_by_weight(bed: Assembly, q: float, put_in: float) -> float:
    """What of the energy ``put_in`` [J] by a change of k_n by ``q`` the weight can have taken: at most its need; a bed
    that has lost grains takes less."""
    most = need_of_weight(bed, q)
    return min(max(put_in, min(0.0, most)), max(0.0, most))


def at_rest(bed: Assembly) -> None:
    """Declare every force of the moment lasting: a bed that has settled. Its springs' energy is what the weight needs
    at this stiffness."""
    remember(bed, 1.0)
    bed.softness, bed.rest_energy = 1.0, energy(bed)


def look_weight(bed: Assembly, every: int, steps_per_contact: int) -> float:
    """Weight of one look in the running mean, for looks ``every`` so many steps; a bed of N grains is N^(1/3)
    across."""
    crossing = _CROSSING * max(bed.active, 1) ** (1.0 / 3.0) * steps_per_contact
    return min(1.0, every / (MEMORY * crossing))


def remember(bed: Assembly, weight: float) -> None:
    """Take the present forces into the running means of all contacts with this ``weight``."""
    _remember(bed.row, bed.col, bed.X, bed.V, bed.hist, weight)
    grain, wall, overlap = bed.wall_overlaps()
    usual = bed.wall_history[grain, wall, USUAL]
    bed.wall_history[grain, wall, USUAL] = usual + weight * (bed.V[grain, STIFFNESS] * overlap - usual)


@kernel
def _remember(row, col, X, V, hist, weight):
    for i in range(row.shape[0] - 1):
        for e in range(row[i], row[i + 1]):
            if hist[e, TOUCHING] == 0.0:
                continue
            j = col[e]
            dx, dy, dz = X[j, 0] - X[i, 0], X[j, 1] - X[i, 1], X[j, 2] - X[i, 2]
            overlap = X[i, RADIUS] + X[j, RADIUS] + hist[e, OFFSET] - math.sqrt(dx * dx + dy * dy + dz * dz)
            hist[e, USUAL] += weight * (min(V[i, STIFFNESS], V[j, STIFFNESS]) * overlap - hist[e, USUAL])
