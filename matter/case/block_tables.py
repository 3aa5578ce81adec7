"""Blocks in the ground, ``[[target.blocks]]``: of what, how large, how many, and which of them lie where.

[[target.blocks]]
material = "gabbro"
law = "power_law"
index = 2.65
smallest = "0.5 m"
largest = "6 m"
volume_fraction = 0.3

[[target.blocks.placed]]
at = ["3 m", "0 m"]
depth = "4 m"
size = ["5 m", "4 m", "3 m"]
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from matter.case.model import Model, known_material
from matter.case.quantity import Length, PositiveLength

KEYS = {
    "power_law": ("index", "smallest", "largest"),
    "weibull": ("scale", "shape", "smallest", "largest"),
    "equal": ("largest",),
    "list": (),
}
"""Keys that say the sizes of each law."""


class PlacedBlock(Model):
    """One block whose place is known, ``[[target.blocks.placed]]``."""

    at: tuple[Length, Length]
    """Where the centre is from the impact point: along the flight seen from above, and across it to the left."""
    depth: PositiveLength
    """How deep the centre lies below the surface above it."""
    size: tuple[PositiveLength, PositiveLength, PositiveLength]
    """Full axes of the ellipsoid along the flight, across it and up."""


class Blocks(Model):
    """One population of blocks, ``[[target.blocks]]``. Those that are drawn are balls."""

    material: str
    """Material of the blocks. It must not be the projectile's; its strength, pores and flaws are its own
    (``[sph.materials.<name>]``)."""
    law: Literal["power_law", "weibull", "equal", "list"]
    """How the diameters D of the blocks in a volume are distributed. ``power_law``: N(>D) goes as D^-index;
    ``weibull``: as exp(-(D / scale)^shape); both end at ``smallest`` and ``largest``. ``equal``: all are
    ``largest``. ``list``: only the blocks of ``placed``. Counts on a surface are not counts in a volume."""
    index: Annotated[float, Field(gt=0, le=6)] | None = None
    """Index of the power law, 2.65 of the blocks on Ryugu (Michikami & Hagermann 2021)."""
    scale: PositiveLength | None = None
    """Diameter above which 37 % of the blocks of a Weibull law would lie, were it not cut."""
    shape: Annotated[float, Field(gt=0, le=10)] | None = None
    """Exponent of the Weibull law."""
    smallest: PositiveLength | None = None
    """Diameter of the smallest block; what is smaller belongs to the ground between."""
    largest: PositiveLength | None = None
    """Diameter of the largest block, or of all equal ones."""
    volume_fraction: Annotated[float, Field(ge=0, lt=0.64)] | None = None
    """Volume of all blocks, placed ones too, over that of the ground that holds them. The density of the ground as a
    whole is that of its material: what lies between dense blocks becomes lighter."""
    within: PositiveLength | None = None
    """Blocks lie within this distance of the impact point; by default in the whole target. Beyond it the ground is
    the mixture."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of sizes and places."""
    placed: tuple[PlacedBlock, ...] = ()
    """Blocks whose places are known: they go in first, and the law fills up to ``volume_fraction``."""

    _known = field_validator("material")(known_material)

    @model_validator(mode="after")
    def _complete(self) -> Blocks:
        if self.law == "list" and not self.placed:
            raise ValueError('placed: law = "list" needs at least one [[target.blocks.placed]]')
        needed = (*KEYS[self.law], *(() if self.law == "list" else ("volume_fraction",)))
        for key in ("index", "scale", "shape", "smallest", "largest", "volume_fraction"):
            given = getattr(self, key) is not None
            if given and key not in needed:
                raise ValueError(f'{key}: law = "{self.law}" does not take it')
            if not given and key in needed:
                raise ValueError(f'{key}: law = "{self.law}" needs it')
        if self.smallest is not None and self.largest is not None and self.smallest >= self.largest:
            raise ValueError(
                f"smallest: {self.smallest:.4g} m is not below largest, {self.largest:.4g} m; equal sizes are "
                'law = "equal"'
            )
        return self
