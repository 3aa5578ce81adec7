"""The grains of a bed about its blocks: where blocks come to lie, and where they were.

Grains in which a block comes to lie that has moved are made smaller, down to half of their radius, or taken out. Where
a block was that has moved or is broken, its sphere is filled: by the closest packing of grains of ``SIZES`` of those
about it, in the best of ``TRIALS`` positions, that touches nothing. Small spheres are not filled as the ground is: it
is looser there until it comes down.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from handoff.domains.domain import Domain
from handoff.source.hydrostatic import Column
from handoff.transfer import bulking, carve
from handoff.transfer.blocks import whole_blocks
from handoff.transfer.blocks.whole_blocks import WholeBlocks
from matter.particles import Particles
from matter.points.packing import hexagonal

TRIALS = 60
SIZES = (1.0, 0.9, 0.8)
"""Radii of the grains in the place of a block, over the mean of those about it: the one that fills it best."""
_LEAST = 0.5
_ABOUT = 20


def set_apart(
    source: Particles, bed: Particles, region: Domain, column: Column
) -> tuple[Particles, WholeBlocks | None]:
    """The bed without its blocks, and those of them that are whole; the bed as it is and None where none of its grains
    is a block. Raises ``InputError``."""
    if "block" not in bed:
        return bed, None
    mine = bed.block >= 0
    large = bed.select(mine)
    blocks = whole_blocks.found(source, large, region, column)
    plain = Particles({name: bed[name][~mine] for name in bed if name != "block"}, bed.attributes)
    radius, stays = _making_room(plain, blocks)
    tables = carve.surviving_tables(_of(bed, plain), stays)
    before, plain = plain.select(stays), plain.select(stays)
    plain["radius"] = radius[stays]
    tables = bulking.contacts_kept(tables, before, plain.radius, region)
    empty = _holes(large, blocks)
    fragments = _fragments(plain, large.select(empty), blocks, int(bed.identity.max()) + 1)
    if len(fragments):
        plain = Particles({name: np.concatenate([plain[name], fragments[name]]) for name in plain}, bed.attributes)
    plain.tables = tables
    holes = float(np.sum(4.0 / 3.0 * math.pi * large.radius[empty] ** 3))
    told = {
        "taken_out": int((~stays).sum()), "made_smaller": int((radius[stays] < before.radius).sum()),
        "put_in": len(fragments), "holes": int(empty.sum()), "holes_m3": holes,
        "put_in_m3": float(np.sum(4.0 / 3.0 * math.pi * fragments.radius**3)) if len(fragments) else 0.0,
    }  # fmt: skip
    return plain, replace(blocks, filled=told)


def _of(bed: Particles, plain: Particles) -> Particles:
    """The grains ``plain`` with the tables of the whole bed."""
    return Particles(plain, plain.attributes, bed.tables)


def _making_room(plain: Particles, blocks: WholeBlocks) -> tuple[np.ndarray, np.ndarray]:
    """Radius (n,) [m] of the grains beside the blocks that have moved, and which of them stay."""
    radius, stays = plain.radius.copy(), np.ones(len(plain), dtype=bool)
    moved = blocks.grains.select(~blocks.in_place)
    for centre, size in zip(moved.position, moved.radius):
        gap = np.linalg.norm(plain.position - centre, axis=1) - size
        radius = np.where(gap < radius, gap * (1.0 - 1e-9), radius)
    stays = radius >= _LEAST * plain.radius
    return np.where(stays, radius, plain.radius), stays


def _holes(large: Particles, blocks: WholeBlocks) -> np.ndarray:
    """Which blocks of the bed (b,) are no longer where they were."""
    return ~np.isin(large.block, blocks.grains.block[blocks.in_place])


def _fragments(plain: Particles, former: Particles, blocks: WholeBlocks, first: int) -> Particles:
    """Grains at rest in the spheres of ``former`` blocks; identities from ``first`` on."""
    tree, rng = cKDTree(plain.position), np.random.default_rng(0)
    centres, sizes, rows = [np.empty((0, 3))], [np.empty(0)], [np.empty(0, dtype=int)]
    for k in range(len(former)):
        about = tree.query(former.position[k], k=min(_ABOUT, tree.n))[1]
        mean, sphere = float(plain.radius[about].mean()), float(former.radius[k])
        tried = [(part * mean, _packed(part * mean, sphere, rng)) for part in SIZES]
        size, points = max(tried, key=lambda one: len(one[1]) * one[0] ** 3)
        points = former.position[k] + points
        points = points[_clear_of(points, size, blocks.grains)]
        centres.append(points)
        sizes.append(np.full(len(points), size))
        rows.append(np.full(len(points), k))
    position, radius, row = np.concatenate(centres), np.concatenate(sizes), np.concatenate(rows)
    room = float(np.median(plain.mass / plain.density / plain.radius**3))
    fields = {name: former[name][row] for name in plain}
    fields |= {"identity": first + np.arange(len(row)), "position": position, "radius": radius}
    fields["mass"] = former.density[row] * room * radius**3
    if "stiffness" in plain:
        fields["stiffness"] = float(np.median(plain.stiffness / plain.radius)) * radius
    for name in ("velocity", "angular_velocity"):
        fields[name] = np.zeros((len(row), 3))
    return Particles({name: fields[name] for name in plain}, plain.attributes)


def _packed(size: float, sphere: float, rng: np.random.Generator) -> np.ndarray:
    """Centres (n, 3) [m] of grains of radius ``size`` that touch at most, in a ``sphere`` [m] about the origin."""
    lattice = hexagonal(2.0 * size * (1.0 + 1e-9) / 2.0 ** (1.0 / 6.0), sphere + 4.0 * size, rotate=False)
    best = np.zeros((1, 3))
    for turn in Rotation.random(TRIALS, random_state=rng):
        points = turn.apply(lattice) + size * rng.uniform(-2.0, 2.0, 3)
        points = points[np.linalg.norm(points, axis=1) <= sphere - size]
        best = points if len(points) > len(best) else best
    return best


def _clear_of(points: np.ndarray, size: float, blocks: Particles) -> np.ndarray:
    """Which grains (n,) of radius ``size`` [m] about these points touch no block."""
    clear = np.ones(len(points), dtype=bool)
    for centre, radius in zip(blocks.position, blocks.radius):
        clear &= np.linalg.norm(points - centre, axis=1) >= radius + size
    return clear
