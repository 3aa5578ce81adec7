"""Legacy VTK files (``.vtk``, version 3.0, binary): points with every field, one vertex each. Read by ParaView, VisIt,
pyvista and older tools.

Layout as in the VTK user's guide, "VTK file formats": big-endian, ``POLYDATA`` with ``POINTS``, ``VERTICES`` and
``POINT_DATA``; vectors as ``VECTORS``, everything else as arrays of ``FIELD``. Snapshots of this project open in
ParaView as they are: this is for programs that read no VTKHDF.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from matter.errors import InputError
from matter.files import archive
from matter.particles import FIELDS, Particles

_NAMES = {"f8": "double", "f4": "float", "i8": "vtktypeint64", "i4": "int", "i1": "char"}


def write(particles: Particles, path: Path) -> None:
    """Write every field. Raises ``InputError`` for particles without a position, and for more than a 32-bit index can
    count."""
    particles.need("position")
    count = len(particles)
    if count >= 2**31:
        raise InputError(f"{count} particles are more than a legacy VTK file can hold")
    title = (
        f"bolide {particles.attributes.get('stage', 'particles')}, t = {particles.attributes.get('time', 0.0)!r} s, SI"
    )
    others = [name for name in particles if name != "position"]
    vectors = [name for name in others if FIELDS[name].shape == (3,)]
    plain = [name for name in others if name not in vectors]
    with archive.replacing(Path(path)) as temporary, open(temporary, "wb") as file:
        file.write(
            f"# vtk DataFile Version 3.0\n{title[:255]}\nBINARY\nDATASET POLYDATA\nPOINTS {count} double\n".encode()
        )
        _numbers(file, particles.position, "f8")
        file.write(f"VERTICES {count} {2 * count}\n".encode())
        _numbers(file, np.column_stack([np.ones(count), np.arange(count)]), "i4")
        file.write(f"POINT_DATA {count}\n".encode())
        for name in vectors:
            file.write(f"VECTORS {name} double\n".encode())
            _numbers(file, particles[name], "f8")
        if plain:
            file.write(f"FIELD FieldData {len(plain)}\n".encode())
        for name in plain:
            kind = particles[name].dtype.str[1:]
            width = int(np.prod(FIELDS[name].shape, dtype=int))
            file.write(f"{name} {width} {count} {_NAMES[kind]}\n".encode())
            _numbers(file, particles[name], kind)


def _numbers(file, values: np.ndarray, kind: str) -> None:
    file.write(np.ascontiguousarray(values, dtype=f">{kind}").tobytes())
    file.write(b"\n")
