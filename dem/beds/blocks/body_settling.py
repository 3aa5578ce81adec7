"""A whole body with blocks settles as any other (``dem.beds.solid_settling``), but that blocks are in place first.

They are held while the grains between them come apart; from ``grip`` on they are grains like the others. As a loose
body sinks onto its contacts, they begin as much further out in proportion (``dem.beds.solid_packing.SINKS``), so that
they come to rest where they are listed. Grains and blocks together have the mass, the centre of mass and the principal
axes of the body.
"""

from __future__ import annotations

import numpy as np

from dem.beds import solid_masses, solid_packing, solid_settling
from dem.beds.blocks import block_grains
from dem.beds.blocks.block_grains import BlockGrains
from dem.beds.solid_body import SolidBody
from dem.beds.solid_settling import SolidSettling
from dem.contact.settings import Contact
from matter.errors import InputError
from matter.particles import Particles
from matter.points.regions import Interior

SAMPLES = 200_000
"""Points by which the part of a body that blocks take is counted: to 0.1 % of it."""


def lifted(blocks: BlockGrains) -> BlockGrains:
    """The blocks where they begin."""
    return blocks._replace(position=(1.0 + solid_packing.SINKS) * blocks.position)


def between(radius: np.ndarray, body: SolidBody, blocks: BlockGrains) -> np.ndarray:
    """Those of the grains, by their radii (n,) [m], that fill what the blocks and the layers about them leave of the
    body, as densely as all of them fill the whole."""
    points = Interior(body.solid, body.distance).random_points(np.random.default_rng(0), SAMPLES)
    room = 1.0 - float(blocks.keeps_out(points, np.full(SAMPLES, float(radius.mean()))).mean())
    return radius[: round(room * len(radius))]


class BodyBlockSettling(SolidSettling):
    """The settling of a loose body whose last grains are its ``blocks``, where they begin."""

    def __init__(
        self, points: np.ndarray, radius: np.ndarray, body: SolidBody, contact: Contact, limit: float,
        sinks: float, blocks: BlockGrains,
    ):  # fmt: skip
        self.blocks, self.first = blocks, len(points)
        block_grains.refuse_heavy(blocks, body.mass, "body")
        super().__init__(points, radius, body, contact, limit, sinks)

    def initial_grains(self, points: np.ndarray, radius: np.ndarray) -> Particles:
        """Grains between the blocks, and the blocks behind them."""
        return super().initial_grains(
            np.concatenate([points, self.blocks.position]), np.concatenate([radius, self.blocks.radius])
        )

    def _begin(self, grains: Particles) -> None:
        super()._begin(grains)
        self._keep_blocks()

    def step(self) -> None:
        """One step of the present phase."""
        super().step()
        self._keep_blocks()

    def _keep_blocks(self) -> None:
        """Keep blocks still while the grains between them come apart."""
        if self.plan[self.phase].fire:
            still = self.bed.identity >= self.first
            self.bed.W[still] = 0.0
            self.bed.A[still] = 0.0

    def _weighed(self, position: np.ndarray, radius: np.ndarray, grains: Particles) -> Particles:
        """The grains with mass, bulk density and stiffness for these positions and radii; blocks with those that they
        are listed with. Raises ``InputError`` where no grain could make up for blocks that lie to one side."""
        blocks, body, contact = self.blocks, self.ground, self.contact
        plain = np.arange(len(radius)) < self.first
        radius = np.concatenate([radius[plain], blocks.radius])
        mass, self.correction = solid_masses.matched(position, radius, body, blocks.mass)
        if not (mass > 0.0).all():
            raise InputError(
                "[target.blocks] the blocks lie so much to one side that grains cannot make up for it: lower "
                "volume_fraction, or leave out within"
            )
        fields = dict(grains)
        fields.update(
            radius=radius,
            mass=mass,
            density=np.concatenate([np.full(self.first, body.density), blocks.mass / blocks.volume]),
            stiffness=solid_settling.stiffness(radius, mass, body, contact),
            material=np.where(plain, 0, materials(body, blocks).index(blocks.material)),
            species=np.where(plain, contact.species_of(body.material), contact.species_of(blocks.material)),
        )
        return Particles(fields, grains.attributes, grains.tables)


def materials(body: SolidBody, blocks: BlockGrains) -> list[str]:
    """Names of the materials of a body with blocks."""
    return list(dict.fromkeys([body.material, blocks.material]))
