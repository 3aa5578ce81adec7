"""A bed with blocks settles as any other (``dem.beds.flat_settling``), but that blocks are in place first.

They are held while the grains between them come apart and grow; from ``sink`` on they are grains like the others. As
the ground closes up while it comes down, they begin higher in proportion, so that they come to rest where they are
listed. Grains and blocks together weigh what the ground does.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dem.beds import bed_measures, flat_settling
from dem.beds.blocks import block_grains
from dem.beds.blocks.block_grains import BlockGrains
from dem.beds.flat_settling import FlatSettling
from dem.beds.loose_packing import FEWEST, LooseBed, begins
from matter.geometry.ground_region import Upright
from matter.particles import Particles

HELD = ("pack", "grow")
"""Phases in which blocks are held."""


@dataclass(frozen=True)
class LooseRoundBlocks(LooseBed[Upright]):
    """How a loose bed begins about ``blocks``, in the domain ``begun`` that is raised as without them."""

    blocks: BlockGrains
    begun: Upright

    @staticmethod
    def about(loose: LooseBed[Upright], blocks: BlockGrains, radius: np.ndarray) -> LooseRoundBlocks:
        """A loose bed of grains of these radii before any made room, with ``blocks``."""
        begun = loose.raised(radius)
        lifted = blocks.position.copy()
        stretch = loose.mean(loose.fraction) / loose.mean(begins(loose.fraction))
        lifted[:, 2] = begun.floor + (lifted[:, 2] - begun.floor) * stretch
        return LooseRoundBlocks(loose.ground, loose.domain, loose.fraction, blocks._replace(position=lifted), begun)

    def raised(self, radius: np.ndarray) -> Upright:
        """The domain in which the bed begins."""
        return self.begun

    def between(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Which of the grains (n,) lie between the blocks; the others make room for them."""
        return ~self.blocks.keeps_out(points, radius)

    def growth(self, grains: Particles, raised: Upright) -> np.ndarray:
        """Factors (n,) on the radii with which the bulk between the blocks is filled as it begins; 1 of blocks."""
        plain = grains.identity < len(grains) - len(self.blocks.number)
        x, r = grains.position, grains.radius
        mean = float(r[plain].mean())
        block = np.where(plain, -1, 0)
        margin = bed_measures.BULK_MARGIN * mean
        wanted = self.mean(begins(self.fraction))
        inner = plain & (raised.depth_inside(x) > margin)
        found = block_grains.packing_fraction(x, r, inner, block) if inner.sum() >= FEWEST else float("nan")
        if not np.isfinite(found):
            room = self.filled(raised, mean) - float(
                np.sum(4.0 / 3.0 * np.pi * (self.blocks.radius + block_grains.ALONG * mean) ** 3)
            )
            found = float(np.sum(4.0 / 3.0 * np.pi * r[plain] ** 3)) / room
        return np.where(plain, (wanted / found) ** (1.0 / 3.0), 1.0)


class BlockSettling(FlatSettling):
    """The settling of a bed whose last grains are the blocks of ``loose.blocks``."""

    def __init__(
        self, points: np.ndarray, radius: np.ndarray, loose: LooseRoundBlocks, limit: float, contact: Any, speed: Any
    ):
        self.blocks, self.first = loose.blocks, len(points)
        ground, container = loose.ground, loose.domain
        block_grains.refuse_heavy(self.blocks, bed_measures.ground_mass(ground, container), "ground")  # type: ignore[arg-type]
        super().__init__(points, radius, ground, container, contact, limit, False, speed, loose)  # type: ignore[arg-type]

    def mine(self, identity: np.ndarray) -> np.ndarray:
        """Which of these grains (n,) are blocks."""
        return np.asarray(identity >= self.first)

    def initial_grains(self, points: np.ndarray, radius: np.ndarray) -> Particles:
        """Grains between the blocks, and the blocks behind them."""
        return super().initial_grains(
            np.concatenate([points, self.blocks.position]), np.concatenate([radius, self.blocks.radius])
        )

    def step(self) -> None:
        """One step of the present phase."""
        super().step()
        if self.plan[self.phase].name in HELD:
            held = self.mine(self.bed.identity)
            self.bed.W[held] = 0.0
            self.bed.A[held] = 0.0

    def over(self, grains: Particles) -> np.ndarray:
        """Which of these grains are headroom: no block."""
        return super().over(grains) & ~self.mine(grains.identity)

    def matched(self, grains: Particles, bed: Any) -> Particles:
        """As without blocks, but that these have the mass and material that they are listed with, and all others weigh
        what the ground does without them."""
        found = super().matched(grains, bed)
        mine = self.mine(found.identity)
        row = found.identity[mine] - self.first
        mass, material, species, density = (
            np.array(found[name], dtype=float) for name in ("mass", "material", "species", "density")
        )
        if bed is not None:
            below = ~mine & (found.position[:, 2] <= 0.0)
            whole = bed_measures.ground_mass(self.ground, self.container)
            mass[~mine] *= (whole - float(self.blocks.mass[row].sum())) / float(mass[below].sum())
        names = materials(self.ground.materials, self.blocks)
        mass[mine], material[mine] = self.blocks.mass[row], names.index(self.blocks.material)
        species[mine] = self.contact.species_of(self.blocks.material)
        density[mine] = (self.blocks.mass / self.blocks.volume)[row]
        floor = float(self.ground.pressure(np.array(self.container.floor)))
        fields = dict(found)
        fields.update(mass=mass, material=material, species=species, density=density)
        fields["stiffness"] = flat_settling.stiffness(found.radius, mass, self.contact, floor, self.speed)
        return Particles(fields, found.attributes, found.tables)


def materials(ground: tuple[str, ...], blocks: BlockGrains) -> list[str]:
    """Names of the materials of a bed with blocks."""
    return list(dict.fromkeys([*ground, blocks.material]))
