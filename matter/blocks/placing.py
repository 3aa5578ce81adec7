"""Where blocks lie: random sequential addition, the largest first (Widom 1966), each wholly in the ground and clear of
those before it.

The listed blocks come first. A block that finds no place in ``TRIES`` tries is left out and counted as ``unplaced``:
with a wide range of sizes volume fractions of 0.5 are reached, equal balls jam at 0.38.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from matter.blocks import block_ground, ellipsoids, size_laws
from matter.case.block_tables import Blocks
from matter.case.body import Target
from matter.errors import InputError

SOURCES = ("Widom1966",)
TRIES = 4000
SHORT = 0.02
"""Part of the blocks' volume that may find no place."""
_BATCH = 40
_CELLS = 2_000_000


class Placing(NamedTuple):
    """The blocks of a target: ``centre`` (n, 3) and full axes ``size`` (n, 3) [m], the ``listed`` ones first, then by
    falling size; ``ground_volume`` [m^3] that holds them, and how many of the ``drawn`` found no place."""

    material: str
    centre: np.ndarray
    size: np.ndarray
    listed: int
    ground_volume: float
    within: float | None
    drawn: int
    unplaced: int

    @property
    def volume(self) -> np.ndarray:
        """Volume (n,) [m^3]."""
        return math.pi / 6.0 * self.size.prod(axis=1)

    @property
    def fraction(self) -> float:
        """Volume of the blocks over that of the ground that holds them."""
        return float(self.volume.sum()) / self.ground_volume

    @property
    def saturated(self) -> bool:
        """Whether there was no room for all that were drawn."""
        return self.unplaced > 0

    @property
    def power(self) -> float:
        """Index of a power law that fits the drawn blocks best, n / sum ln(D / smallest): of a law cut at its largest
        a little above its own."""
        diameter = self.size[self.listed :, 0]
        if len(diameter) < 2:
            return math.nan
        return len(diameter) / max(float(np.log(diameter / diameter.min()).sum()), 1e-300)


def of_target(target: Target) -> Placing | None:
    """The blocks of a target; None where it has none. Raises ``InputError``: a listed block sticks out or overlaps
    another, a block larger than the ground, no room."""
    if not target.blocks or not (target.blocks[0].placed or target.blocks[0].volume_fraction):
        return None
    return _placing(target)


@lru_cache(maxsize=4)
def _placing(target: Target) -> Placing:
    table = target.blocks[0]
    holds = block_ground.holding_blocks(target, table.within)
    centre, half = _listed(table, holds)
    listed_volume = 4.0 / 3.0 * math.pi * float(half.prod(axis=1).sum())
    asked = (table.volume_fraction or 0.0) * holds.volume
    if table.law != "list" and table.placed and listed_volume > asked:
        raise InputError(
            f"[target.blocks] volume_fraction: the blocks of placed alone are {listed_volume / holds.volume:.3g} of "
            f"the ground's volume, more than {table.volume_fraction:g}"
        )
    streams = [np.random.default_rng(s) for s in np.random.SeedSequence([table.seed, 49]).spawn(2)]
    diameters = size_laws.drawn(table, asked - listed_volume, streams[0])
    if len(diameters) and 0.5 * diameters[0] >= _deepest(holds):
        raise InputError(
            f"[target.blocks] largest: a block of {diameters[0]:.4g} m has no room in the ground, which is "
            f"{2.0 * _deepest(holds):.4g} m thick"
        )
    found, halves, unplaced = _added(diameters, centre, half, holds, streams[1])
    placing = Placing(
        table.material, found, 2.0 * halves, len(centre), holds.volume, table.within, len(diameters), unplaced
    )
    if table.law != "list" and placing.fraction < (1.0 - SHORT) * asked / holds.volume:
        raise InputError(
            f"[target.blocks] volume_fraction: {table.volume_fraction:g} was asked for and {placing.fraction:.3g} "
            f"found room; the largest that works with these sizes is about {0.99 * placing.fraction:.2f}"
        )
    return placing


def _deepest(holds: block_ground.Ground) -> float:
    return float(holds.depth(holds.points(np.random.default_rng(0), 20_000)).max())


def _listed(table: Blocks, holds: block_ground.Ground) -> tuple[np.ndarray, np.ndarray]:
    """Centres and half axes (n, 3) [m] of the blocks of ``placed``. Raises ``InputError``."""
    half = np.array([one.size for one in table.placed]).reshape(-1, 3) * 0.5
    centre = np.array(
        [[*one.at, holds.surface(*one.at) - one.depth] for one in table.placed], dtype=float
    ).reshape(-1, 3)  # fmt: skip
    for i in range(len(centre)):
        least = float(holds.depth(centre[i] + half[i] * _ball(400)).min())
        if least < -1e-9 * holds.extent:
            raise InputError(
                f"[target.blocks] placed: block {i + 1} sticks out of the ground by {-least:.3g} m; blocks lie wholly "
                "in it"
            )
        for j in range(i):
            if ellipsoids.overlap(*(centre[i] - centre[j]), *half[i], *half[j]):
                raise InputError(f"[target.blocks] placed: blocks {j + 1} and {i + 1} overlap")
    return centre, half


def _ball(count: int) -> np.ndarray:
    """Points (n, 3) spread evenly on the unit ball (a spiral), with its six poles."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    azimuth = math.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - z * z)
    spiral = np.stack([ring * np.cos(azimuth), ring * np.sin(azimuth), z], axis=1)
    return np.concatenate([spiral, np.eye(3), -np.eye(3)])


def _added(
    diameters: np.ndarray, centre: np.ndarray, half: np.ndarray, holds: block_ground.Ground, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, int]:
    """Centres and half axes (n, 3) [m] of the listed and the added blocks, and how many found no place."""
    count, first = len(diameters), len(centre)
    centres, halves = np.zeros((first + count, 3)), np.zeros((first + count, 3))
    if first + count == 0:
        return centres, halves, 0
    span = 2.2 * holds.extent
    cell = max(
        float(min(half.min(initial=np.inf), 0.5 * diameters.min(initial=np.inf))) * 2.0, span / _CELLS ** (1 / 3)
    )
    head = np.full(3 * (int(span / cell) + 1,), -1, dtype=np.int64)
    low = _middle(holds) - 0.5 * span
    entry_next, entry_block = np.empty(64, dtype=np.int64), np.empty(64, dtype=np.int64)
    used, placed, unplaced = 0, 0, 0
    for i in range(first + count):
        if i < first:
            at, own = centre[i], half[i]
        else:
            own = np.full(3, 0.5 * diameters[i - first])
            table = (centres, halves, head, entry_next, entry_block, low, cell)
            found = _free_place(own, holds, table, rng)
            if found is None:
                unplaced += 1
                continue
            at = found
        centres[placed], halves[placed] = at, own
        while (after := ellipsoids.register(placed, at, own, head, entry_next, entry_block, used, low, cell)) > len(
            entry_next
        ):
            room = np.empty(2 * after, dtype=np.int64)
            entry_next, entry_block = np.concatenate([entry_next, room]), np.concatenate([entry_block, room])
        used, placed = after, placed + 1
    return centres[:placed], halves[:placed], unplaced


def _middle(holds: block_ground.Ground) -> np.ndarray:
    """Middle (3,) [m] of what holds blocks."""
    points = holds.points(np.random.default_rng(0), 20_000)
    return 0.5 * (points.min(axis=0) + points.max(axis=0))


def _free_place(own: np.ndarray, holds: block_ground.Ground, table, rng: np.random.Generator) -> np.ndarray | None:
    """A place (3,) [m] for a ball of half axes ``own`` (3,) [m] clear of all blocks and walls, or None."""
    tried = 0
    while tried < TRIES:
        trials = holds.points(rng, _BATCH)
        tried += _BATCH
        trials = np.ascontiguousarray(trials[holds.depth(trials) >= own[0]])
        if (free := ellipsoids.first_free(trials, own, *table)) >= 0:
            return trials[free]
    return None
