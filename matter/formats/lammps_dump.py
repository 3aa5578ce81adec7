"""LIGGGHTS and LAMMPS text dumps (``dump custom``): the last time step of the file.

The dump names its columns (``ITEM: ATOMS id type x y z vx vy vz radius``); numbers are taken as SI (``units si``).
Types count from 1 there and materials from 0 here.
"""

from __future__ import annotations

from pathlib import Path

from matter.errors import InputError
from matter.formats import columns as named
from matter.formats import numbers
from matter.particles import Particles

_HEAD = "ITEM: ATOMS"
_STEP = "ITEM: TIMESTEP"


def read(path: Path, columns: str | None = None) -> Particles:
    """Particles of the last step in a dump; columns that have no field here are left out. ``columns`` replaces the
    dump's own names."""
    lines = numbers.text(path).splitlines()
    heads = [k for k, line in enumerate(lines) if line.startswith(_HEAD)]
    if not heads:
        raise InputError(f"{path} is not a text dump: there is no line '{_HEAD} ...'")
    names = columns.split(",") if columns else lines[heads[-1]][len(_HEAD) :].split()
    known = named.slots()
    names = [name if name.split("[")[0].strip().lower() in known else "-" for name in names]
    rows = [(number, line) for number, line in enumerate(lines[heads[-1] + 1 :], heads[-1] + 2) if line.strip()]
    table = numbers.table(rows, path)
    if len(rows) == 0 or table.shape[1] != len(names):
        raise InputError(f"{path}: {len(names)} column names for {table.shape[1] if len(rows) else 0} columns")
    if "type" in names:
        table[:, names.index("type")] -= 1
    particles = named.assemble(names, table, str(path))
    steps = [int(lines[k + 1]) for k, line in enumerate(lines) if line.startswith(_STEP)]
    return Particles(dict(particles), {"stage": "dem", "step": steps[-1] if steps else 0})
