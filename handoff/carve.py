"""Carving: which grains of the settled bed stay, and the points that carry volumes from one cloud to the other.

A grain stays when its centre lies inside the surface (the partial-overlap rule: a grain that the surface cuts stays with its larger half).
Grains do not move, so the contacts among grains that stay are untouched and their history is kept.

``Samples`` are quasi-random points of even density in the bed's domain. Each belongs to the nearest compact source particle and to the
nearest grain of the uncarved bed, so that sums over points compare the two clouds on the same small volumes: that of a grain's cell gives
the volume which the grain stands for, walls and free surfaces included, without a tessellation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import qmc

from handoff.domain import Domain
from matter.alpha_shape import OffsetShape
from matter.errors import InputError
from matter.particles import Particles

_POINTS_PER_GRAIN = 16
_PACKING_RADII = 2.6


@dataclass(frozen=True)
class Samples:
    """``position`` (s, 3) [m], each standing for ``volume`` [m^3]; ``inside`` (s,) the surface; ``particle`` (s,) nearest compact source
    particle (place among the compact ones), ``grain`` (s,) nearest grain of the uncarved bed."""

    position: np.ndarray
    volume: float
    inside: np.ndarray
    particle: np.ndarray
    grain: np.ndarray


def check(bed: Particles) -> None:
    """Refuse a bed that lacks a field or holds values that are not finite. Raises ``InputError``."""
    bed.need("identity", "position", "mass", "radius", "material")
    for name in ("position", "mass", "radius"):
        if not np.all(np.isfinite(bed[name])):
            raise InputError(f"the bed's field {name!r} is not finite for some grains")
    if np.any(bed.mass <= 0.0) or np.any(bed.radius <= 0.0):
        raise InputError("the bed has grains of no mass or no radius")
    if len(bed) < 16:
        raise InputError(f"the bed has {len(bed)} grains: too few to carry a crater")


def sample(domain: Domain, surface: OffsetShape, compact: cKDTree, grains: cKDTree) -> Samples:
    """Sample the domain with some ``_POINTS_PER_GRAIN`` points per grain (a power of two in all)."""
    power = int(np.ceil(np.log2(_POINTS_PER_GRAIN * grains.n)))
    position = domain.points(qmc.Sobol(3, scramble=True, rng=3).random_base2(power))
    return Samples(
        position,
        domain.volume / len(position),
        surface.contains(position),
        compact.query(position, workers=-1)[1],
        grains.query(position, workers=-1)[1],
    )


def grain_volumes(bed: Particles, samples: Samples, grains: cKDTree) -> np.ndarray:
    """Volume that each grain of the uncarved bed stands for [m^3]: its own volume over the packing fraction around it.

    Every cell, measured with the sample points, is divided among the grains within 2.6 mean radii in proportion to their solid volume:
    V_g = v_g sum_j c_j / s_j, with c_j the cell of grain j and s_j the solid volume around j. The sum over all grains is the domain's volume.
    """
    solid = 4.0 / 3.0 * np.pi * bed.radius**3
    cell = np.bincount(samples.grain, minlength=len(bed)) * samples.volume
    pairs = grains.query_pairs(_PACKING_RADII * float(bed.radius.mean()), output_type="ndarray")

    def around(values: np.ndarray) -> np.ndarray:
        total = values + np.bincount(pairs[:, 0], weights=values[pairs[:, 1]], minlength=len(bed))
        return total + np.bincount(pairs[:, 1], weights=values[pairs[:, 0]], minlength=len(bed))

    return solid * around(cell / around(solid))


def keep(bed: Particles, surface: OffsetShape, domain: Domain) -> np.ndarray:
    """(n,) whether each grain stays. Raises ``InputError`` when none does."""
    stays = surface.contains(bed.position)
    if not stays.any():
        raise InputError("no grain of the bed lies inside the compact material: do source and bed share a frame and a datum?")
    return stays


def surviving_tables(bed: Particles, stays: np.ndarray) -> dict[str, np.ndarray]:
    """The bed's tables with the contacts of removed grains taken out.

    A table ``<name>pair`` holds grain identities (both columns) or, as ``<name>wall_pair``, an identity and a wall number; ``<name>history``
    or ``<name>wall_history`` has one row for each row of it. Other tables pass unchanged.
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
