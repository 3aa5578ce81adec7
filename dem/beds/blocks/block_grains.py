"""Which blocks of ``blocks.h5`` are grains of a bed, and where.

A block becomes one large grain, a sphere of its volume and mass, when it has particles of its own in the shock stage,
is at least ``LEAST`` times as large as the grains about it, and its sphere lies inside the container, or the body,
out of whose surface it may stand as far as other grains do (``dem.beds.solid_packing.PROUD``). All others are part of
the ground: their mass is in the grains. What is lost of an ellipsoid is its shape: how it lies, rolls, and interlocks.

Spheres of ellipsoids close to each other can overlap where these do not. Such pairs are moved apart, each in the
inverse ratio of its mass, until they touch.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from dem.beds import bed_measures, solid_packing
from dem.beds.grading import Grading
from matter.blocks.placing import Placing
from matter.errors import InputError
from matter.geometry.ground_region import Upright
from matter.particles import Particles
from matter.solids.distance import Distance
from matter.wording import readable

LEAST = 2.0
"""Radius of the smallest block that becomes a grain over that of the grains about it."""
ALONG = 0.6
"""Width of the layer about a block that stays empty of grain centres beyond its radius, in mean radii: as along walls
(``dem.beds.loose_packing``)."""
HEAVIEST = 0.9
"""Most of the ground's mass that may be in blocks."""
_CLEAR = 3.0
_ROUNDS = 400


class BlockGrains(NamedTuple):
    """The blocks that are grains: their ``number`` (b,) in ``blocks.h5``, ``position`` (b, 3) [m], ``radius`` and
    ``mass`` (b,) [m, kg], the name of their ``material``; of the file its ``digest`` and how many it holds."""

    number: np.ndarray
    position: np.ndarray
    radius: np.ndarray
    mass: np.ndarray
    material: str
    digest: str
    listed: int

    @property
    def volume(self) -> np.ndarray:
        """Volume (b,) [m^3]."""
        return 4.0 / 3.0 * math.pi * self.radius**3

    def covers(self, points: np.ndarray, beyond: np.ndarray | float) -> np.ndarray:
        """Which of these points (n, 3) lie in a block or less than ``beyond`` (n,) [m] from its surface."""
        found = np.zeros(len(points), dtype=bool)
        for centre, radius in zip(self.position, self.radius):
            found |= np.linalg.norm(points - centre, axis=1) < radius + beyond
        return found

    def keeps_out(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Where no grain (n,) of these radii may begin: in a block, or in the layer about it."""
        return self.covers(points, ALONG * radius)


def refuse_heavy(blocks: BlockGrains, whole: float, name: str) -> None:
    """Raise ``InputError`` where the blocks leave too little of the mass ``whole`` [kg] of the ``name``."""
    heavy = float(blocks.mass.sum())
    if heavy > HEAVIEST * whole:
        raise InputError(
            f"[target.blocks] blocks of {heavy:.4g} kg leave too little of the {name}'s {whole:.4g} kg for grains: "
            "lower volume_fraction"
        )


def of_ground(blocks: Particles, digest: str, container: Upright, sizes: Grading) -> BlockGrains:
    """The blocks that are grains in this container, between grains of these sizes. Raises ``InputError`` where they
    find no room as spheres."""
    return _chosen(blocks, digest, fits(blocks.position, blocks.radius, container, sizes))


def of_body(blocks: Particles, digest: str, distance: Distance, mean: float) -> BlockGrains:
    """The blocks that are grains of a whole body, by the ``distance`` from its surface, between grains of the ``mean``
    radius [m]. Raises ``InputError`` where they find no room as spheres."""
    return _chosen(blocks, digest, fits_body(blocks.position, blocks.radius, distance, mean))


def _chosen(blocks: Particles, digest: str, fit: np.ndarray) -> BlockGrains:
    chosen = np.flatnonzero((blocks.resolved == 1) & fit)
    name = str(blocks.attributes["materials"][0])
    found = BlockGrains(
        chosen, blocks.position[chosen], blocks.radius[chosen], blocks.mass[chosen], name, digest, len(blocks)
    )
    return found._replace(position=_apart(found))


def fits(x: np.ndarray, r: np.ndarray, container: Upright, sizes: Grading) -> np.ndarray:
    """Which spheres (n,) at x (n, 3) of radius r (n,) [m] are large enough and lie inside the container."""
    below = x[:, 2] - container.floor if container.shape != "bowl" else np.full(len(r), np.inf)
    return (r >= LEAST * sizes.local(x)) & (x[:, 2] < 0.0) & (container.side_depth(x) >= r) & (below >= r)


def fits_body(x: np.ndarray, r: np.ndarray, distance: Distance, mean: float) -> np.ndarray:
    """Which spheres (n,) at x (n, 3) of radius r (n,) [m] are large enough and lie inside the body."""
    return np.asarray((r >= LEAST * mean) & (distance.at(x)[0] >= r - solid_packing.PROUD * mean))


def worded(placing: Placing, fit: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> str:
    """What becomes of the blocks of a target in words, for ``--check``; ``fit``: whether spheres at x (n, 3) of radius
    r (n,) [m] can be grains."""
    r = np.cbrt(0.75 / math.pi * placing.volume)
    some = fit(placing.centre, r)
    smallest = f", the smallest of {readable.length(float(r[some].min()))} radius" if some.any() else ""
    return (
        f"of {len(r):,} block{'s' * (len(r) > 1)} {int(some.sum()):,} can be large grains{smallest}: those with "
        f"particles of their own in the shock stage, {LEAST:g} radii of the grains about them and inside the bed; the "
        "mass of the others is in the grains"
    )


def _apart(blocks: BlockGrains) -> np.ndarray:
    """Centres (b, 3) [m] at which no two spheres overlap."""
    x, r = blocks.position.copy(), blocks.radius
    one, other = np.triu_indices(len(r), 1)
    for _ in range(_ROUNDS):
        way = x[other] - x[one]
        distance = np.linalg.norm(way, axis=1)
        hit = np.flatnonzero(distance < (r[one] + r[other]) * (1.0 - 1e-9))
        if len(hit) == 0:
            return x
        for k in hit:
            i, j = one[k], other[k]
            way_now = x[j] - x[i]
            d = float(np.linalg.norm(way_now))
            step = (r[i] + r[j] - d) * way_now / max(d, 1e-300)
            part = blocks.mass[j] / (blocks.mass[i] + blocks.mass[j])
            x[i] -= part * step
            x[j] += (1.0 - part) * step
    raise InputError("[target.blocks] the blocks find no room as spheres of their volume: lower volume_fraction")


def facts(blocks: BlockGrains, grains: Particles, mass: float) -> dict[str, Any]:
    """What the bed's report says of its blocks once ``grains`` with the field ``block`` have settled, ``mass`` [kg]
    that of the ground: how many are grains, and how far they moved while it settled."""
    if len(blocks.number) == 0:
        return {"grains": 0, "listed": blocks.listed}
    mine = np.flatnonzero(grains.block >= 0)
    order = mine[np.argsort(grains.block[mine])]
    way = np.linalg.norm(grains.position[order] - blocks.position, axis=1) / blocks.radius
    return {
        "grains": len(mine),
        "listed": blocks.listed,
        "smallest_radius_m": float(blocks.radius.min()),
        "largest_radius_m": float(blocks.radius.max()),
        "mass_kg": float(blocks.mass.sum()),
        "mass_share": float(blocks.mass.sum()) / mass,
        "largest_way_over_radius": float(way.max()),
        "mean_way_over_radius": float(way.mean()),
        "ways_m": (grains.position[order] - blocks.position).tolist(),
    }


def packing_fraction(position: np.ndarray, radius: np.ndarray, inner: np.ndarray, block: np.ndarray) -> float:
    """Solid fraction of the grains ``inner`` (n,) that are clear of blocks; nan without any. ``block`` (n,): -1 of
    grains that are none."""
    plain, x, r = block < 0, position[block < 0], radius[block < 0]
    clear = inner[plain].copy()
    for centre, size in zip(position[~plain], radius[~plain]):
        clear &= np.linalg.norm(x - centre, axis=1) > size + _CLEAR * r
    return bed_measures.bulk_fraction_where(x, r, clear)
