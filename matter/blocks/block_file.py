"""``blocks.h5``: the blocks of a target as a snapshot of ellipsoids, in the frame of the run.

A point each, with ``size``, its full axes along x, y and z: ParaView's reader for VTKHDF and a glyph scaled by
``size`` show them. The listed ones come first, then the drawn ones by falling size; ``block`` of a particle of the
shock stage is the identity here.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np

from matter.blocks.placing import Placing
from matter.case.body import Target
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles

NAME = "blocks.h5"
DIGEST = "blocks_sha256"
"""Key of ``target.json``, and attribute of beds, that holds the ``digest`` of the blocks."""


def particles(target: Target, placing: Placing, density: float, resolved: np.ndarray | None = None) -> Particles:
    """The blocks with their masses; ``density`` [kg/m^3] at rest of their material, ``resolved`` (n,) which of them
    have particles of their own (None: all)."""
    table = target.blocks[0]
    volume = placing.volume
    fields = {
        "identity": np.arange(len(volume)),
        "position": placing.centre,
        "size": placing.size,
        "radius": np.cbrt(0.75 / math.pi * volume),
        "mass": density * volume,
        "material": np.zeros(len(volume), dtype=np.int32),
        "resolved": np.ones(len(volume), dtype=np.int8) if resolved is None else resolved,
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


def digest(blocks: Particles) -> str:
    """Hash of sizes, places, masses and of what is resolved, by which stages know that they hold the same blocks."""
    columns = [np.ascontiguousarray(blocks[name]).tobytes() for name in ("position", "size", "mass", "resolved")]
    return hashlib.sha256(b"".join(columns)).hexdigest()


def of_target(target_json: Path) -> Particles | None:
    """The blocks beside a ``target.json``; None where it knows of none. Raises ``InputError`` where the file is
    missing, damaged, or another than the shock stage had."""
    known = archive.read_json(target_json).get(DIGEST)
    if known is None:
        return None
    blocks = read(target_json.parent)
    if digest(blocks) != known:
        raise InputError(
            f"{target_json.parent / NAME}: not the blocks that {target_json.name} beside it was written with"
        )
    return blocks


def read(folder: Path) -> Particles:
    """The blocks of a folder. Raises ``InputError`` where the file is missing, damaged, or lacks a field."""
    path = Path(folder) / NAME
    blocks = snapshot.read(path)
    try:
        blocks.need("position", "size", "mass", "radius", "material", "resolved")
    except InputError as reason:
        raise InputError(f"{path}: {reason}") from None
    return blocks
