"""Binary dumps (``dump custom`` to a name that ends in ``.bin``) of LIGGGHTS and LAMMPS, one time step a file.

Header: time step and number of atoms (int64), triclinic flag and six boundary flags (int32), six box bounds (float64),
columns per atom and number of blocks (int32). LAMMPS (revision 2) puts before it -len, a magic string of that length,
byte order and revision (int32), after the column count the unit style, a flag with the time, the column names (each
with an int32 length or flag before it). Then, for each block, the number of values (int32) and the values (float64).
Source: dump_custom.cpp of both programs, tools/binary2txt.cpp of LAMMPS.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from matter.errors import InputError


def read(path: Path, columns: int) -> tuple[int, np.ndarray]:
    """The time step and the table (atoms, columns), in the order of the file. Raises ``InputError`` when the file is
    cut short or another's."""
    raw = path.read_bytes()
    try:
        step, table = _parsed(raw)
    except (struct.error, ValueError) as reason:
        raise InputError(f"{path} is not a whole binary dump ({reason})") from None
    if table.shape[1] != columns:
        raise InputError(f"{path} holds {table.shape[1]} columns instead of {columns}")
    return step, table


def whole(path: Path) -> bool:
    """Whether the file is there and complete."""
    if not path.is_file():
        return False
    try:
        _parsed(path.read_bytes())
    except (struct.error, ValueError):
        return False
    return True


def _parsed(raw: bytes) -> tuple[int, np.ndarray]:
    at = 0

    def take(form: str) -> tuple[int, ...]:
        nonlocal at
        values = struct.unpack_from("=" + form, raw, at)
        at += struct.calcsize("=" + form)
        return values

    (step,) = take("q")
    revision = 0
    if step < 0:
        at += -step
        _, revision = take("ii")
        (step,) = take("q")
    (count,) = take("q")
    (triclinic,) = take("i")
    at += 6 * 4 + 6 * 8 + (3 * 8 if triclinic else 0)
    (width,) = take("i")
    if revision > 1:
        (length,) = take("i")
        at += length
        (flag,) = take("b")
        at += 8 if flag else 0
        (length,) = take("i")
        at += length
    (blocks,) = take("i")
    parts = []
    for _ in range(blocks):
        (size,) = take("i")
        parts.append(np.frombuffer(raw, dtype=np.float64, count=size, offset=at))
        at += 8 * size
    table = np.concatenate(parts).reshape(-1, width)
    if len(table) != count:
        raise ValueError(f"{len(table)} of {count} atoms")
    return step, table
