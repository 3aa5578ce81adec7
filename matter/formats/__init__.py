"""Other codes' files as particles and back: one module per format, with ``read(path, columns) -> Reading`` or
``write(particles, path)``. What is read is checked by one module (``reading``), whatever the format.

Read: this project's own snapshots, delimited text (CSV, ASCII columns), HDF5 with named datasets, miluphcuda (HDF5 and
text), OpenSPH state files (``.ssf``), LIGGGHTS and LAMMPS text dumps. Written: LIGGGHTS and LAMMPS data files, legacy
VTK, PLY, CSV.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.files import hdf5_input, snapshot
from matter.formats import (
    delimited,
    hdf5_columns,
    lammps_data,
    lammps_dump,
    miluphcuda,
    opensph,
    plausible,
    ply_points,
    turned_frame,
    vtk_legacy,
)
from matter.formats.reading import Reading, checked
from matter.formats.words import listed, short
from matter.particles import Particles

NAMES = ("snapshot", "csv", "hdf5", "miluphcuda", "opensph", "lammps")
WRITTEN = {
    "lammps": lammps_data.write,
    "liggghts": lammps_data.write,
    "vtk": vtk_legacy.write,
    "ply": ply_points.write,
    "csv": delimited.write,
    "snapshot": snapshot.write,
}
_BY_SUFFIX = {
    ".vtkhdf": "snapshot",
    ".csv": "csv",
    ".txt": "csv",
    ".dat": "csv",
    ".tsv": "csv",
    ".ssf": "opensph",
    ".dump": "lammps",
    ".lammpstrj": "lammps",
    ".liggghts": "lammps",
}
_HDF5 = (".h5", ".hdf5", ".hdf")
_OUT_BY_SUFFIX = {
    ".lmp": "lammps",
    ".data": "lammps",
    ".liggghts": "liggghts",
    ".vtk": "vtk",
    ".ply": "ply",
    ".csv": "csv",
    snapshot.SUFFIX: "snapshot",
}
# what the stage that goes on from a snapshot cannot do without
NEEDED = {
    "handoff": ("position", "velocity", "mass", "density", "material"),
    "crater": ("position",),
}


class Found(NamedTuple):
    """Particles of a file, names of what it holds beside them, and what else is to be said (sentences)."""

    particles: Particles
    left_out: list[str]
    remarks: list[str]


def read(path: Path, form: str | None = None, columns: str | None = None, materials: str | None = None) -> Particles:
    """The particles that ``found`` finds."""
    return found(path, form, columns, materials).particles


def found(path: Path, form: str | None = None, columns: str | None = None, materials: str | None = None) -> Found:
    """What a file in one of the formats of ``NAMES`` holds (by default: the format that its name, and for HDF5 its
    content, says).

    ``columns`` names the columns of a text file without a header (``delimited``), the datasets of an HDF5 file
    (``hdf5_columns``) or the switches that miluphcuda was compiled with (``miluphcuda``); ``materials`` lists the
    names behind the material numbers, ``"ice,water"``. Raises ``InputError`` with a way out when the file cannot be
    read, or is not what it says it is (``reading``).
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"no file at {path}")
    form = form or _form_of(path, columns)
    reading = Reading(path)
    if form == "snapshot":
        particles = checked(snapshot.read(path), str(path))
    elif form == "csv":
        reading = delimited.read(path, columns)
    elif form == "hdf5":
        reading = hdf5_columns.read(_hdf5(path), columns)
    elif form == "miluphcuda":
        reading = miluphcuda.read(path, columns)
    elif form == "opensph":
        reading = opensph.read(path)
    elif form == "lammps":
        reading = lammps_dump.read(path, columns)
    else:
        raise InputError(f"unknown format {short(form)} (formats: {', '.join(NAMES)})")
    if form != "snapshot":
        particles = reading.particles()
    if materials is not None:
        plausible.named(particles, [name.strip() for name in materials.split(",")])
    return Found(particles, reading.left_out, reading.remarks)


def convert(
    file: Path,
    out: Path,
    form: str | None = None,
    columns: str | None = None,
    materials: str | None = None,
    origin: Sequence[float] | None = None,
    up: Sequence[float] | None = None,
    time: float | None = None,
) -> list[str]:
    """Write another code's file as a snapshot, its frame turned by ``origin`` [m] and ``up`` (``turned_frame``), at
    ``time`` [s] after the impact; sentences that say what was taken, what was left out and what no stage can use.

    Raises ``InputError`` as ``found`` and ``save`` do.
    """
    what = found(Path(file), form, columns, materials)
    particles = what.particles
    sentences = _report(what, time)
    if origin is not None or up is not None:
        particles = turned_frame.placed(particles, origin or (0.0, 0.0, 0.0), up or (0.0, 0.0, 1.0))
    if time is not None:
        particles.attributes["time"] = time
    save(particles, Path(out))
    sentences += [
        f"cannot be used by {stage}: missing {', '.join(names)}" for stage, names in lacking(particles).items()
    ]
    return sentences + plausible.unknown_materials(particles)


def _report(what: Found, time: float | None) -> list[str]:
    """What was taken, at which time, and what was left out; ``time`` [s] is what was given by hand for it."""
    told = what.particles.attributes.get("time")
    if time is None:
        when = "no time was read, 0 s is taken (--time)" if told is None else f"time {told:g} s"
    else:
        when = f"time {time:g} s" + (f" in place of the file's {told:g} s" if told not in (None, time) else "")
    return [f"{len(what.particles)} particles, {', '.join(what.particles)}; {when}", *beside(what)]


def beside(what: Found) -> list[str]:
    """Sentences on what a file holds beside its particles."""
    return ([f"left out: {listed(what.left_out)}"] if what.left_out else []) + what.remarks


def _form_of(path: Path, columns: str | None) -> str:
    suffix = path.suffix.lower()
    if suffix in _HDF5:
        return "hdf5" if columns else _kind_of_hdf5(_hdf5(path))
    form = _BY_SUFFIX.get(suffix) or ("lammps" if path.name.startswith("dump") else None)
    if form is None:
        raise InputError(f"{path}: name the format with --format (formats: {', '.join(NAMES)})")
    return form


def _hdf5(path: Path) -> Path:
    import h5py

    if not h5py.is_hdf5(path):
        raise InputError(f"{path} is not an HDF5 file")
    return path


def _kind_of_hdf5(path: Path) -> str:
    with hdf5_input.opened(path) as file:
        names = set(file)
    return "snapshot" if {"particles", "VTKHDF"} <= names else "miluphcuda" if miluphcuda.is_one(names) else "hdf5"


def lacking(particles: Particles) -> dict[str, list[str]]:
    """Stage -> fields of ``NEEDED`` that these particles do not carry; empty where nothing is missing."""
    missing = {stage: [name for name in names if name not in particles] for stage, names in NEEDED.items()}
    return {stage: names for stage, names in missing.items() if names}


def save(particles: Particles, path: Path) -> None:
    """Write imported particles as a snapshot; refuses a name that ParaView would not recognise, and values that no
    particle can have (``plausible``)."""
    if Path(path).suffix != snapshot.SUFFIX:
        raise InputError(f"--out {path}: the name has to end in {snapshot.SUFFIX}")
    particles.need("position")
    plausible.check(particles)
    particles.attributes.setdefault("time", 0.0)
    snapshot.write(particles, path)


def export(particles: Particles, path: Path, form: str | None = None) -> str:
    """Write particles for another program, in one of the formats of ``WRITTEN`` (by default: what the name says); the
    format taken.

    Raises ``InputError`` for an unknown format, for fields that the format needs and the particles lack, and for
    values that are not finite.
    """
    form = form or _OUT_BY_SUFFIX.get(Path(path).suffix.lower())
    if form not in WRITTEN:
        ends = ", ".join(f"{suffix} {name}" for suffix, name in _OUT_BY_SUFFIX.items())
        raise InputError(
            f"--out {path}: name the format with --format (formats: {', '.join(WRITTEN)}; by the name's end: {ends})"
        )
    for name in particles:
        bad = plausible.not_finite(name, particles[name])
        if bad.any():
            raise InputError(
                f"field {name!r} has {int(np.count_nonzero(bad))} values that are not finite: no other program could "
                f"read them"
            )
    WRITTEN[form](particles, Path(path))
    return form
