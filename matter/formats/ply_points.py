"""Points as PLY (Turk 1994, "The PLY polygon file format"): binary, little-endian, one ``vertex`` per particle with
every field as properties.

``x y z``, then each field under its own name, components as ``velocity_x`` or ``deviatoric_stress_0``. Read by
MeshLab, CloudCompare, Blender, trimesh.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from matter.files import archive
from matter.formats.named_columns import components
from matter.particles import Particles

# PLY 1.0 knows no integers of 64 bits: identities go as doubles, exact up to 2^53
_KIND = {
    "f8": ("<f8", "double"),
    "f4": ("<f4", "float"),
    "i8": ("<f8", "double"),
    "i4": ("<i4", "int"),
    "i1": ("<i1", "char"),
}


def write(particles: Particles, path: Path) -> None:
    """Write every field. Raises ``InputError`` for particles without a position."""
    columns = [
        (label.removeprefix("position_"), values.dtype.str[1:], values) for label, _, values in components(particles)
    ]
    table = np.empty(len(particles), dtype=[(label, _KIND[kind][0]) for label, kind, _ in columns])
    for label, _, column in columns:
        table[label] = column
    properties = "".join(f"property {_KIND[kind][1]} {label}\n" for label, kind, _ in columns)
    comment = (
        f"comment bolide {particles.attributes.get('stage', 'particles')}, SI, time "
        f"{particles.attributes.get('time', 0.0)!r} s\n"
    )
    with archive.replacing(Path(path)) as temporary, open(temporary, "wb") as file:
        file.write(
            f"ply\nformat binary_little_endian 1.0\n{comment}element vertex "
            f"{len(particles)}\n{properties}end_header\n".encode()
        )
        file.write(table.tobytes())
