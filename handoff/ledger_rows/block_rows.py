"""Rows of the ledger on blocks: each whole block of the bed against its particles, from the source and the start as
they stand.

Mass, momentum and spin are summed twice over the same numbers, so that only rounding may be left: 1e-12 of a mass
(some thousand terms), 1e-10 of momenta, in which terms of either sign cancel. A block that has moved lies at its
particles' centre; one that has not may be off by a tenth of its radius, which is a fifth of the radius of the largest
grains about the smallest block. Counts are whole numbers: none may be missing.
"""

from __future__ import annotations

import numpy as np

from handoff.ledger import Ledger
from handoff.transfer.blocks import whole_blocks
from handoff.transfer.blocks.whole_blocks import WholeBlocks
from handoff.transfer.ejecta import BOOKED
from matter.blocks import block_bodies
from matter.particles import Particles
from matter.wording import readable

LIMITS = {
    "block_mass_rel": 1e-12,
    "block_momentum_rel": 1e-10,
    "block_spin_rel": 1e-10,
    "block_place_over_r": whole_blocks.IN_PLACE,
    "block_count_off": 0.5,
}


def enter(ledger: Ledger, blocks: WholeBlocks | None, source: Particles, start: Particles) -> None:
    """Enter the rows; none where the bed has no blocks."""
    if blocks is None:
        return
    grains = start.select(start.block >= 0)
    number = np.unique(grains.block)
    wanted = np.unique(source.block[blocks.taken])
    ledger.amend(
        "block_count_off",
        float(len(np.setxor1d(number, wanted)) + len(grains) - len(number)),
        f"whole blocks of the bed {len(wanted)}, grains that are blocks {len(grains)}",
        LIMITS["block_count_off"],
    )
    ledger.state("blocks_whole", float(len(grains)), "1", _told(blocks, grains))
    ledger.state("blocks_broken", float(len(blocks.broken)), "1", _replaced(blocks))
    if len(grains) == 0 or len(number) != len(grains):
        return
    for name, (value, note) in _measured(source, grains).items():
        ledger.amend(name, value, note, LIMITS[name])
    mass = float(grains.mass.sum())
    ledger.state("block_mass", mass, "kg", f"of {float(start.mass.sum()):.6g} kg in all")
    beyond = grains.select(grains.state == BOOKED)
    momentum = ", ".join(f"{p:.6g}" for p in beyond.mass @ beyond.velocity)
    told = f"{len(beyond)} whole blocks, ({momentum}) kg m/s along the axes of the bed"
    ledger.state("block_mass_beyond", float(beyond.mass.sum()), "kg", told)


def _measured(source: Particles, grains: Particles) -> dict[str, tuple[float, str]]:
    """Largest difference of any block from its particles, with a note."""
    mine = source.select(np.isin(source.block, grains.block))
    count = int(grains.block.max()) + 1
    values = np.concatenate([mine.position, mine.velocity], axis=1)
    mean = block_bodies.means(mine.block, count, mine.mass, values)[grains.block]
    mass = block_bodies.masses(mine.block, count, mine.mass)[grains.block]
    x, v = np.zeros((count, 3)), np.zeros((count, 3))
    centre, drift = np.hsplit(mean, 2)
    x[grains.block], v[grains.block] = centre, drift
    own = block_bodies.spins(mine.block, count, mine.mass, mine.position, mine.velocity, x, v)[grains.block]
    speed, arm = np.linalg.norm(mine.velocity, axis=1), np.linalg.norm(mine.position - x[mine.block], axis=1)
    loose = np.linalg.norm(mine.velocity - v[mine.block], axis=1)
    pace = block_bodies.masses(mine.block, count, mine.mass * speed)[grains.block]
    turn = block_bodies.masses(mine.block, count, mine.mass * arm * loose)[grains.block]
    momentum = np.linalg.norm(grains.mass[:, None] * grains.velocity - mass[:, None] * drift, axis=1)
    spin = (0.4 * grains.mass * grains.radius**2)[:, None] * grains.angular_velocity
    way = np.linalg.norm(grains.position - centre, axis=1) / grains.radius
    total = f"of {len(grains)} blocks the one that is furthest off; all weigh {mass.sum():.6g} kg"
    return {
        "block_mass_rel": (float(np.abs(grains.mass / mass - 1.0).max()), total),
        "block_momentum_rel": (_largest(momentum, pace), "|dp| / sum m|v| of its particles"),
        "block_spin_rel": (
            _largest(np.linalg.norm(spin - own, axis=1), turn),
            "|dL| / sum m|r||v| of its particles, about its centre of mass and against its velocity",
        ),
        "block_place_over_r": (float(way.max()), "from the centre of mass of its particles, over its radius"),
    }


def _largest(off: np.ndarray, scale: np.ndarray) -> float:
    return float(np.max(np.where(off > 0.0, off / np.maximum(scale, 1e-300), 0.0)))


def _told(blocks: WholeBlocks, grains: Particles) -> str:
    beyond = int(np.count_nonzero(grains.state == BOOKED))
    return (
        f"mean damage below {block_bodies.WHOLE:g}: {int(blocks.in_place.sum())} in place, "
        f"{int((~blocks.in_place).sum())} moved by more than {whole_blocks.IN_PLACE:g} of their radius, {beyond} of "
        "these beyond the bed"
    )


def _replaced(blocks: WholeBlocks) -> str:
    f = blocks.filled
    return (
        f"{f['put_in']} grains ({readable.volume(f['put_in_m3'])}) fill {f['holes']} places of blocks "
        f"({readable.volume(f['holes_m3'])}); beside blocks that moved {f['taken_out']} grains were taken out and "
        f"{f['made_smaller']} made smaller"
    )
