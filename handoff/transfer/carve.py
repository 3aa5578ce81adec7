"""Carving: which grains of the settled bed stay, and the points that carry volumes from one cloud to the other.

A grain stays when its centre lies inside the surface (the partial-overlap rule: a grain that the surface cuts stays
with its larger half). Grains do not move, so the contacts among grains that stay are untouched and their history is
kept.

``Samples`` are quasi-random points of even density in the bed's domain. Each belongs to the nearest compact source
particle and to the nearest grain, so that sums over points compare the two clouds on the same small volumes, walls and
free surfaces included, without a tessellation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from handoff.domains.whole_body import WholeBody
from handoff.transfer.interpolation import matching_factor
from matter.errors import InputError
from matter.geometry.alpha_shape import OffsetShape
from matter.particles import Particles
from matter.points import sobol

_POINTS_PER_GRAIN = 8
_POINTS_PER_PARTICLE = 8
_MOST_PARTS = 64
_NEAR = 8
_LEAST_POWER = 19
_FILLED = (0.1, 1.2)


@dataclass(frozen=True)
class Samples:
    """``position`` (s, 3) [m], each standing for ``weight`` (s,) times ``volume`` [m^3]; ``inside`` (s,) the surface;
    ``particle`` (s,) nearest compact source particle (index among the compact ones), ``grain`` (s,) nearest grain of
    the uncarved bed."""

    position: np.ndarray
    volume: float
    inside: np.ndarray
    particle: np.ndarray
    grain: np.ndarray
    weight: np.ndarray

    def within(self, surface: OffsetShape) -> Samples:
        """The same points, told which of them lie inside the surface."""
        return replace(self, inside=surface.contains(self.position))


def check(bed: Particles, domain: Domain) -> None:
    """Refuse a bed that lacks a field, holds values that are not finite or does not fill its domain. Raises
    ``InputError``."""
    bed.need("identity", "position", "mass", "radius", "material")
    for name in ("position", "mass", "radius"):
        if not np.all(np.isfinite(bed[name])):
            raise InputError(f"the bed's field {name!r} is not finite for some grains")
    if np.any(bed.mass <= 0.0) or np.any(bed.radius <= 0.0):
        raise InputError("the bed has grains without a mass or a radius")
    if len(bed) < 16:
        raise InputError(f"the bed has {len(bed)} grains: too few to carry a crater")
    filled = float(np.sum(4.0 / 3.0 * np.pi * bed.radius**3)) / domain.volume
    if not _FILLED[0] < filled < _FILLED[1]:
        raise InputError(
            f"the bed's spheres take {filled:.3g} of the volume of its domain: radii and domain are in mixed units, "
            f"or the bed is not settled"
        )


def even_samples(domain: Domain, compact: cKDTree, grains: cKDTree, number: float) -> Samples:
    """Even points of the domain, at least eight per grain and half a million, none of them ``inside`` yet.

    ``number``: how many grains the domain would hold if all were as small as those at the impact.
    """
    power = max(_LEAST_POWER, int(np.ceil(np.log2(_POINTS_PER_GRAIN * max(number, grains.n)))))
    position = domain.even_points(sobol.stream(3).random_base2(power))
    nobody = np.zeros(len(position), dtype=bool)
    owner, grain = compact.query(position, workers=-1)[1], grains.query(position, workers=-1)[1]
    return Samples(position, domain.volume / len(position), nobody, owner, grain, np.ones(len(position)))


def finer(samples: Samples, domain: Domain, compact: cKDTree, grains: cKDTree, particle_volume: np.ndarray) -> Samples:
    """The same points, those among particles finer than them split until a particle owns some eight of them.

    A particle that owns no point would hand its momentum to no grain. ``particle_volume`` (n,) [m^3]; a point is
    replaced by 2 to 64 in a cube of its volume, each with its part of the weight; those that would leave the domain
    stay at the point they come from. Nothing changes where every particle is coarse.
    """
    # the finest of those around it: points beside fine particles are split too, or volume would only leave them
    around = compact.query(samples.position, k=min(_NEAR, compact.n), workers=-1)[1].reshape(len(samples.position), -1)
    number = np.ceil(_POINTS_PER_PARTICLE * samples.volume / particle_volume[around].min(axis=1)).astype(np.int64)
    number = np.where(
        number > 1, np.clip(2 ** np.ceil(np.log2(np.maximum(number, 1))).astype(np.int64), 2, _MOST_PARTS), 1
    )
    if number.max(initial=1) == 1:
        return samples
    parent = np.repeat(np.arange(len(number)), number)
    within = np.arange(len(parent)) - np.repeat(np.cumsum(number) - number, number)
    cloud = sobol.stream(4).random(_MOST_PARTS) - 0.5
    position = samples.position[parent] + np.where(
        (number[parent] > 1)[:, None], np.cbrt(samples.volume) * cloud[within], 0.0
    )
    left = domain.depth_inside(position) <= 0.0
    position[left] = samples.position[parent[left]]
    moved = number[parent] > 1
    owner, grain = samples.particle[parent], samples.grain[parent]
    owner[moved] = compact.query(position[moved], workers=-1)[1]
    grain[moved] = grains.query(position[moved], workers=-1)[1]
    return Samples(
        position, samples.volume, samples.inside[parent], owner, grain, samples.weight[parent] / number[parent]
    )


def receivers(bed: Particles, stays: np.ndarray, samples: Samples) -> np.ndarray:
    """(s,) the grain that stays and is nearest to each point inside the surface; -1 for points outside."""
    receiver = np.where(samples.inside, samples.grain, -1)
    orphan = np.flatnonzero(samples.inside & ~stays[samples.grain])
    kept = np.flatnonzero(stays)
    receiver[orphan] = kept[cKDTree(bed.position[kept]).query(samples.position[orphan], workers=-1)[1]]
    return receiver


def filled(stays: np.ndarray, grain: np.ndarray, position: np.ndarray, domain: Domain) -> np.ndarray:
    """(s,) whether the carved bed fills points (s, 3) whose nearest grain of the uncarved bed is ``grain`` (s,): where
    that ``stays``, and, on a whole body, whose bed has no grains above the datum, below it."""
    held = stays[grain]
    return held & (domain.frame.height(position) < 0.0) if isinstance(domain, WholeBody) else held


def grain_volumes(bed: Particles, stays: np.ndarray, receiver: np.ndarray, samples: Samples) -> np.ndarray:
    """Volume that each grain stands for [m^3], zero for carved ones: what it stood for in the bed, b = mass / density,
    times a local factor.

    The cell c of a grain is what lies inside the surface nearer to it than to any other grain that stays; the factor
    is that of ``interpolation.matching_factor``, c against b. The sum is the volume inside the surface, and hardly any
    volume is lost locally to the grains that the surface cuts, while no grain takes over the odd shape of its own
    cell.
    """
    kept = np.flatnonzero(stays)
    own = bed.mass[kept] / bed.density[kept] if "density" in bed else bed.radius[kept] ** 3
    cell = (
        np.bincount(receiver[receiver >= 0], weights=samples.weight[receiver >= 0], minlength=len(bed))[kept]
        * samples.volume
    )
    stands = own * matching_factor(cKDTree(bed.position[kept]), cell, own)
    volume = np.zeros(len(bed))
    volume[kept] = stands * (cell.sum() / stands.sum())
    return volume


def keep(bed: Particles, surface: OffsetShape, domain: Domain) -> np.ndarray:
    """(n,) whether each grain stays. Raises ``InputError`` when none does."""
    stays = surface.contains(bed.position)
    if not stays.any():
        raise InputError(
            "no grain of the bed lies inside the compact material: do source and bed share a frame and a datum?"
        )
    return stays


def surviving_tables(bed: Particles, stays: np.ndarray) -> dict[str, np.ndarray]:
    """The bed's tables with the contacts of removed grains taken out.

    A table ``<name>pair`` holds grain identities (both columns) or, as ``<name>wall_pair``, an identity and a wall
    number; ``<name>history`` or ``<name>wall_history`` has one row for each row of it. Other tables pass unchanged.
    """
    kept = np.sort(bed.identity[stays])
    tables = dict(bed.tables)
    for name, pair in bed.tables.items():
        if not name.endswith("pair") or pair.ndim != 2:
            continue
        members = pair[:, :1] if name.endswith("wall_pair") else pair
        rows = np.isin(members, kept, assume_unique=False).all(axis=1)
        prefix = name[: -len("pair")]
        for other in bed.tables:
            if other.startswith(prefix) and "/" not in other[len(prefix) :] and len(bed.tables[other]) == len(pair):
                if prefix.endswith("wall_") or not other[len(prefix) :].startswith("wall_"):
                    tables[other] = bed.tables[other][rows]
    return tables
