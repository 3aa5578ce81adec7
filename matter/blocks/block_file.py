"""``blocks.h5``: the blocks of a target as a snapshot of ellipsoids, in the frame of the run.

A point each, with ``size``, its full axes along x, y and z: ParaView's reader for VTKHDF and a glyph scaled by
``size`` show them. The listed ones come first, then the drawn ones by falling size; ``block`` of a particle of the
shock stage is the identity here.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from matter.blocks.placing import Placing
from matter.case.body import Target
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles

NAME = "blocks.h5"


def particles(target: Target, placing: Placing, density: float) -> Particles:
    """The blocks with their masses; ``density`` [kg/m^3] at rest of their material."""
    table = target.blocks[0]
    volume = placing.volume
    fields = {
        "identity": np.arange(len(volume)),
        "position": placing.centre,
        "size": placing.size,
        "radius": np.cbrt(0.75 / math.pi * volume),
        "mass": density * volume,
        "material": np.zeros(len(volume), dtype=np.int32),
    }
    attributes = {
        "time": 0.0,
        "stage": "sph",
        "frame": target.frame,
        "materials": [placing.material],
        "law": table.law,
        "seed": table.seed,
        "listed": placing.listed,
        "drawn": placing.drawn,
        "unplaced": placing.unplaced,
        "ground_volume_m3": placing.ground_volume,
        "volume_fraction": placing.fraction,
        **({} if math.isnan(placing.power) else {"index": placing.power}),
    }
    return Particles(fields, attributes)


def write(blocks: Particles, folder: Path) -> None:
    """Write ``blocks.h5`` into a folder; the file is whole or absent."""
    snapshot.write(blocks, Path(folder) / NAME)


def read(folder: Path) -> Particles:
    """The blocks of a folder. Raises ``InputError`` where the file is missing, damaged, or lacks a field."""
    path = Path(folder) / NAME
    blocks = snapshot.read(path)
    try:
        blocks.need("position", "size", "mass", "radius", "material")
    except InputError as reason:
        raise InputError(f"{path}: {reason}") from None
    return blocks
