"""Which blocks of the bed are whole at the handover, and the one grain that each of them becomes.

Of the particles of a block (``matter.blocks.block_bodies``), whose mean damage is below ``WHOLE``:

    mass  M = sum m,   velocity  v = sum m v_i / M,   spin  w = L / (2/5 M R^2)

R is the radius of the block's volume at rest. A grain that lies within ``IN_PLACE`` of its radius of the particles'
centre of mass stays where the bed has it, with its contacts; any other is placed at that centre. The mean damage says
nothing on pieces: a block of two halves with a crack between them is whole.

A block that leaves for good takes no part in the collapse. Of a whole body that is one above the surface, clear of it:
ground that flows faster than escape does so in contact with what is about it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from handoff.domains.domain import Domain
from handoff.domains.whole_body import WholeBody
from handoff.source import free_flight
from handoff.source.hydrostatic import Column
from handoff.transfer import correction
from handoff.transfer.ejecta import BOOKED, past_edge
from matter.blocks import block_bodies
from matter.errors import InputError
from matter.particles import Particles

IN_PLACE = 0.1
"""Distance of a block's grain from its particles' centre of mass, over its radius, up to which it stays in place."""
SMALLEST = 0.5
"""Least radius of a block, over that of its volume, where two of them lie close together."""


@dataclass(frozen=True)
class WholeBlocks:
    """``grains`` that are whole blocks, with the field ``block``, in the order of ``block``; which of them stays
    ``in_place`` (b,); which particles of the source are ``taken`` (n,) by them; sums over these particles ``before``
    and over the grains ``after``. ``broken``: (k,) the blocks of the bed that are not whole; ``damage`` of all
    (whole, then broken). ``filled``: what was put where blocks were, in words of ``block_room``."""

    grains: Particles
    in_place: np.ndarray
    taken: np.ndarray
    before: correction.Sums
    after: correction.Sums
    broken: np.ndarray
    damage: np.ndarray
    filled: dict[str, Any]

    def as_table(self) -> dict[str, Any]:
        """Plain values: of each whole block where it lies and how it moves, and which are broken."""
        g, count = self.grains, len(self.grains)
        whole = [
            {
                "block": int(g.block[k]),
                "damage": float(self.damage[k]),
                "in_place": bool(self.in_place[k]),
                "position_m": g.position[k].tolist(),
                "velocity_m_s": g.velocity[k].tolist(),
                "mass_kg": float(g.mass[k]),
            }
            for k in range(count)
        ]
        broken = [
            {"block": int(number), "damage": float(damage)} for number, damage in zip(self.broken, self.damage[count:])
        ]
        return {"whole": whole, "broken": broken, **self.filled}

    def rows_of(self, particle: np.ndarray, source: Particles) -> np.ndarray:
        """The row among ``grains`` of each of these particles (indices), all of whole blocks."""
        return np.searchsorted(self.grains.block, source.block[particle])


def found(source: Particles, large: Particles, region: Domain, column: Column) -> WholeBlocks:
    """The whole ones among the blocks that are grains of the bed, ``large``. Raises ``InputError``: the source lacks
    damage or blocks, or holds no particle of one."""
    source.need("block", "damage")
    large = large.select(np.argsort(large.block))
    number, count = large.block, int(max(large.block.max(), source.block.max())) + 1
    position, velocity = source.position, source.velocity
    values = np.concatenate([position, velocity, source.damage[:, None]], axis=1)
    mean = block_bodies.means(source.block, count, source.mass, values)
    centre, drift, damage = np.split(mean, (3, 6), axis=1)
    damage = damage[number, 0]
    absent = number[~np.isfinite(damage)]
    if len(absent):
        raise InputError(
            f"the source holds no particle of block {absent[0]}, which is a grain of the bed ({len(absent)} such "
            "blocks): do source and bed have the same blocks?"
        )
    whole = damage < block_bodies.WHOLE
    grains = large.select(whole)
    mine = np.isin(source.block, grains.block)
    block = np.where(mine, source.block, -1)
    angular = block_bodies.spins(block, count, source.mass, position, velocity, centre, drift)[grains.block]
    mass = block_bodies.masses(block, count, source.mass)[grains.block]
    way = np.linalg.norm(centre[grains.block] - grains.position, axis=1)
    in_place = way <= IN_PLACE * grains.radius
    grains["position"] = np.where(in_place[:, None], grains.position, centre[grains.block])
    grains["velocity"], grains["mass"] = drift[grains.block], mass
    grains["radius"] = _fitted(grains.position, grains.radius, in_place)
    grains["angular_velocity"] = angular / (0.4 * mass * grains.radius**2)[:, None]
    grains["density"] = mass / (4.0 / 3.0 * np.pi * grains.radius**3)
    x, v = grains.position, grains.velocity
    beyond = past_edge(x, region) | free_flight.escapes(region, column, x, v)
    if isinstance(region, WholeBody):
        beyond &= region.frame.height(x) > grains.radius
    grains["state"] = np.where(beyond, BOOKED, 0)
    grains["headroom"] = np.zeros(len(grains))
    pace = region.pace(position[mine], velocity[mine])
    before = correction.sums(source.mass[mine], position[mine], velocity[mine], pace=pace)
    after = correction.sums(mass, x, v, grains.radius, grains.angular_velocity, region.pace(x, v))
    order = np.concatenate([np.flatnonzero(whole), np.flatnonzero(~whole)])
    return WholeBlocks(grains, in_place, mine, before, after, number[~whole], damage[order], {})


def _fitted(position: np.ndarray, radius: np.ndarray, in_place: np.ndarray) -> np.ndarray:
    """Radii (b,) at which no block that has moved overlaps another: the smaller of two yields. Raises
    ``InputError``."""
    r = radius.copy()
    one, other = np.triu_indices(len(r), 1)
    some = ~(in_place[one] & in_place[other])
    for i, j in zip(one[some], other[some]):
        distance = float(np.linalg.norm(position[i] - position[j]))
        small, large = (i, j) if r[i] < r[j] else (j, i)
        if distance < r[i] + r[j]:
            r[small] = (distance - r[large]) * (1.0 - 1e-9)
            if r[small] < SMALLEST * radius[small]:
                raise InputError(
                    f"two whole blocks lie in one another {distance:.4g} m apart (radii {radius[i]:.4g} and "
                    f"{radius[j]:.4g} m): take another moment of the handover ([handoff] time)"
                )
    return r
