"""Other codes' files as particles: one module per format, each with ``read(path, columns) -> Particles``.

Supported: this project's own snapshots, delimited text (CSV, ASCII columns), LIGGGHTS and LAMMPS text dumps.
"""

from __future__ import annotations

from pathlib import Path

from matter import snapshot
from matter.errors import InputError
from matter.formats import delimited, lammps_dump
from matter.particles import Particles

NAMES = ("snapshot", "csv", "lammps")
_BY_SUFFIX = {
    ".vtkhdf": "snapshot",
    ".csv": "csv",
    ".txt": "csv",
    ".dat": "csv",
    ".tsv": "csv",
    ".dump": "lammps",
    ".lammpstrj": "lammps",
    ".liggghts": "lammps",
}
# known, and not read yet: the message says what to do instead
_NOT_READ = {
    ".h5": "HDF5 of other codes (miluphcuda) is not read yet: write its particles as CSV with named columns",
    ".hdf5": "HDF5 of other codes (miluphcuda) is not read yet: write its particles as CSV with named columns",
    ".ssf": "OpenSPH's .ssf is not read yet: write a text file with OpenSPH (save as .txt) and give --columns",
}


def read(path: Path, form: str | None = None, columns: str | None = None, materials: str | None = None) -> Particles:
    """Particles of a file in one of the formats of ``NAMES`` (by default: what its name says).

    ``columns`` names the columns of a text file without a header (see ``delimited``); ``materials`` lists the names behind the material
    numbers, ``"ice,water"``. Raises ``InputError`` with a way out when the file cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"no file at {path}")
    form = form or _BY_SUFFIX.get(path.suffix.lower()) or ("lammps" if path.name.startswith("dump") else None)
    if form is None:
        hint = _NOT_READ.get(path.suffix.lower(), "name the format with --format")
        raise InputError(f"{path}: {hint} (formats: {', '.join(NAMES)})")
    if form == "snapshot":
        particles = snapshot.read(path)
    elif form == "csv":
        particles = delimited.read(path, columns)
    elif form == "lammps":
        particles = lammps_dump.read(path, columns)
    else:
        raise InputError(f"unknown format {form!r} (formats: {', '.join(NAMES)}); miluphcuda HDF5 and OpenSPH .ssf are not read yet")
    if materials is not None:
        particles.attributes["materials"] = [name.strip() for name in materials.split(",")]
    return particles


def save(particles: Particles, path: Path) -> None:
    """Write imported particles as a snapshot; refuses a name that ParaView would not recognise, and values that are not finite."""
    import numpy as np

    if Path(path).suffix != snapshot.SUFFIX:
        raise InputError(f"--out {path}: the name has to end in {snapshot.SUFFIX}")
    particles.need("position")
    for name in particles:
        if bad := int(np.count_nonzero(~np.isfinite(particles[name]))):
            raise InputError(f"field {name!r} has {bad} values that are not finite")
    particles.attributes.setdefault("time", 0.0)
    snapshot.write(particles, path)
