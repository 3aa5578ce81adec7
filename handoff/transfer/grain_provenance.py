"""What matter each grain stands for: how much of it the shock melted and boiled, its peak pressures, and where it lay
before the impact.

A grain takes these from the particles that give it their momentum: every sample point of its cell
(``handoff.transfer.carve.Samples``) belongs to a particle, whose mass lies evenly on its points; a grain of ejecta is
one particle. With the masses m_pg that a grain g so has of each particle p,

    x_g = sum_p m_pg x_p / sum_p m_pg

for the fractions above critical pressures (``matter.case.shock_phases``), the fraction of the projectile and the peak
pressure; the largest peak pressure is that of any p with m_pg > 0. First depths and distances are means over the
target's matter alone, below the bed's datum and from the axis of the impact point. A grain whose cell holds no point
takes what its nearest particle has.

The sums over grains, sum m_g x_g, are those over the particles as far as the masses m_g are those of the cells, which
are matched to the source's locally, not cell by cell (``handoff.transfer.mapping.locally_closed``): the ledger's rows
``origin_...`` say how far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handoff.domains.domain import Domain
from handoff.ledger import Ledger
from handoff.transfer import shaken_matter
from handoff.transfer.handed import Handoff
from handoff.transfer.mapping import Overlap
from matter.case import shock_phases
from matter.particles import ORIGINS, Particles

_POSITIONS = ("first_depth", "first_distance")
SUMMED = (*(name for name in ORIGINS if name != "peak_pressure_largest"), "block_fraction")
"""The fields that are means, so that their sums with the masses can be compared."""


@dataclass(frozen=True)
class Taken:
    """Which grain (row by row) has how much ``mass`` [kg] of which ``particle`` (indices in the source), for ``count``
    grains; ``target`` is that part of the mass which is not the projectile's."""

    particle: np.ndarray
    grain: np.ndarray
    mass: np.ndarray
    target: np.ndarray
    count: int

    def mean(self, values: np.ndarray, of_target: bool) -> np.ndarray:
        """Mean (count,) of ``values`` (n,) by particle over each grain; NaN of nothing."""
        weight = self.target if of_target else self.mass
        total = np.bincount(self.grain, weights=weight, minlength=self.count)
        part = np.bincount(self.grain, weights=weight * values[self.particle], minlength=self.count)
        return np.where(total > 0.0, part / np.where(total > 0.0, total, 1.0), np.nan)

    def largest(self, values: np.ndarray) -> np.ndarray:
        """Largest (count,) of ``values`` (n,) among the particles of each grain."""
        most = np.full(self.count, -np.inf)
        np.maximum.at(most, self.grain, values[self.particle])
        return most


def of_particles(source: Particles, region: Domain) -> dict[str, np.ndarray]:
    """Values (n,) by particle under the names of the grains' fields, as far as the source holds what they need; the
    largest pressure is the particle's own."""
    known: dict[str, np.ndarray] = {}
    if "peak_pressure" in source:
        above = shock_phases.shocked(source)
        known |= {field: above[key].astype(float) for field, key in shock_phases.OF_GRAINS.items()}
        known["peak_pressure_mean"] = known["peak_pressure_largest"] = source.peak_pressure
    if "block" in source:
        known["block_fraction"] = (source.block >= 0).astype(float)
    if "layer" in source:
        known["projectile_fraction"] = (source.layer < 0).astype(float)
    if "initial_position" in source:
        known["first_depth"] = -region.frame.height(source.initial_position)
        known["first_distance"] = region.frame.distance(source.initial_position)
    return known


def taken(
    source: Particles, compact: np.ndarray, held: np.ndarray, cells: Overlap, near: np.ndarray, ejecta: np.ndarray
) -> Taken:
    """What the kept grains and, behind them, the ejecta stand for: the sample points of the kept grains' ``cells``
    among the ``compact`` particles (indices in the source) with the mass inside the domain ``held`` (k,), the nearest
    of them ``near`` each grain, and the indices ``ejecta``."""
    on_points = (held / np.where(cells.per_particle > 0.0, cells.per_particle, 1.0))[cells.particle] * cells.weight
    kept = len(near)
    bare = np.flatnonzero(np.bincount(cells.grain, weights=on_points, minlength=kept) <= 0.0)
    particle = np.concatenate([compact[cells.particle], compact[near[bare]], ejecta])
    grain = np.concatenate([cells.grain, bare, kept + np.arange(len(ejecta))])
    mass = np.concatenate([on_points, source.mass[compact[near[bare]]], source.mass[ejecta]])
    some = mass > 0.0
    return _of(source, particle[some], grain[some], mass[some], kept + len(ejecta))


def one_to_one(source: Particles, indices: np.ndarray) -> Taken:
    """What grains stand for that are the particles ``indices`` themselves."""
    return _of(source, indices, np.arange(len(indices)), source.mass[indices], len(indices))


def of_groups(source: Particles, particle: np.ndarray, grain: np.ndarray, count: int) -> Taken:
    """What ``count`` grains stand for that are groups of particles (indices), each particle that of one ``grain``."""
    return _of(source, particle, grain, source.mass[particle], count)


def _of(source: Particles, particle: np.ndarray, grain: np.ndarray, mass: np.ndarray, count: int) -> Taken:
    foreign = source.layer[particle] < 0 if "layer" in source else np.zeros(len(particle), dtype=bool)
    return Taken(particle, grain, mass, np.where(foreign, 0.0, mass), count)


def give(start: Particles, source: Particles, region: Domain, taken_by: Taken) -> None:
    """Give the grains ``start`` the fields ``ORIGINS``, as far as the source knows them, and its vibration."""
    for name, values in of_particles(source, region).items():
        start[name] = (
            taken_by.largest(values)
            if name == "peak_pressure_largest"
            else taken_by.mean(values, of_target=name in _POSITIONS)
        )
    shaken_matter.give(start, source, lambda values: taken_by.mean(values, of_target=False))


def enter(ledger: Ledger, handoff: Handoff, source: Particles, region: Domain) -> None:
    """Rows on the sums over the grains against those over the particles, without a limit: what the shock marked, what
    came with the projectile, the first moments of depth, distance and pressure, and the energy of the vibration."""
    inner, start, indices = handoff.compact, handoff.start, handoff.ejecta.source
    weight = np.zeros(len(source))
    weight[inner.indices] = source.mass[inner.indices] * inner.fraction
    weight[indices] += source.mass[indices]
    if handoff.blocks is not None:
        weight += np.where(handoff.blocks.taken, source.mass, 0.0)
    shaken_matter.enter(ledger, start, source, weight)
    of_target = weight * (source.layer >= 0) if "layer" in source else weight
    fraction = 1.0 - start.projectile_fraction.astype(float) if "projectile_fraction" in start else 1.0
    for name, values in of_particles(source, region).items():
        if name not in SUMMED:
            continue
        mine, mass = (of_target, start.mass * fraction) if name in _POSITIONS else (weight, start.mass)
        size = float(mine @ np.abs(values))
        if not size > 0.0:
            continue
        before, after = float(mine @ values), float(np.nansum(mass * start[name].astype(float)))
        unit = {"first_depth": "kg m", "first_distance": "kg m", "peak_pressure_mean": "kg Pa"}.get(name, "kg")
        ledger.state(
            f"origin_{name}_rel",
            (after - before) / size,
            "1",
            f"sum of mass times it: particles {before:.6e} {unit}, grains {after:.6e} {unit}",
        )
