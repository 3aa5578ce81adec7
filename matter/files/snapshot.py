"""Snapshots: one HDF5 file per time that h5py, pyvista and ParaView all open, with nothing stored twice.

``/particles/<field>`` holds the arrays with attributes ``unit`` and ``meaning``; ``/VTKHDF`` is an unstructured grid
of one vertex cell per particle, whose ``Points`` and ``PointData`` are hard links to them. Facts on the whole set are
attributes of the file (``time`` [s], ``stage``, ``frame``, ``materials`` ...) and, where they are numbers or words,
field data for ParaView; further tables (contact history) stand under ``/tables``.

Why an unstructured grid, version 1.0: ParaView 5.11 (Debian 12) knows no other points in VTKHDF; newer ones and
pyvista read it alike. Files of before held one polygonal cell for all particles, which no threshold could take apart;
they are still read.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import archive, hdf5_input
from matter.particles import ALIASES, FIELDS, Particles

SUFFIX = ".vtkhdf"
_VERTEX = 1
"""VTK's number for a cell of one point."""
_CHUNK = 1 << 17


def write(particles: Particles, path: Path) -> None:
    """Write a snapshot; the file is whole or absent. Lists and dicts among the attributes are stored as JSON text."""
    particles.need("position")
    count = len(particles)
    squeeze = dict(compression="gzip", compression_opts=1, shuffle=True) if count > 64 else {}
    size = sum(particles[name].nbytes for name in particles) + sum(
        np.asarray(table).nbytes for table in particles.tables.values()
    )
    with archive.replacing_hdf5(Path(path), size) as file:
        for name, value in particles.attributes.items():
            file.attrs[name] = json.dumps(value) if isinstance(value, (list, dict, tuple)) else value
        fields = file.create_group("particles")
        for name in particles:
            dataset = fields.create_dataset(name, data=particles[name], **squeeze)
            dataset.attrs["unit"], dataset.attrs["meaning"] = FIELDS[name].unit, FIELDS[name].meaning
        for name, table in particles.tables.items():
            file.create_dataset(f"tables/{name}", data=table, **(squeeze if np.size(table) > 64 else {}))
        _write_vtk(file, fields, particles, squeeze)


def _write_vtk(file, fields, particles: Particles, squeeze: dict[str, Any]) -> None:
    """The group that VTK reads: links to ``fields``, one vertex cell for each particle, the file's facts as field
    data."""
    import h5py

    count = len(particles)
    vtk = file.create_group("VTKHDF", track_order=True)
    vtk.attrs["Version"] = np.array([1, 0], dtype=np.int64)
    vtk.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len(b"UnstructuredGrid")))
    for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
        vtk.create_dataset(name, data=np.array([count], dtype=np.int64))
    vtk["Points"] = fields["position"]
    points = vtk.create_group("PointData")
    for name in particles:
        if name != "position":
            points[name] = fields[name]
    # a count from 0 upwards shrinks to a tenth of a byte per particle when its chunks are large
    large = {**squeeze, "chunks": (min(count, _CHUNK),)} if squeeze else {}
    vtk.create_dataset("Connectivity", data=np.arange(count, dtype=np.int64), **large)
    vtk.create_dataset("Offsets", data=np.arange(count + 1, dtype=np.int64), **large)
    vtk.create_dataset("Types", data=np.full(count, _VERTEX, dtype=np.uint8), **large)
    facts = vtk.create_group("FieldData", track_order=True)
    for name, value in _facts(particles.attributes).items():
        facts.create_dataset(name, data=value, dtype=h5py.string_dtype("ascii") if value.dtype == object else None)


def _facts(attributes: dict[str, Any]) -> dict[str, np.ndarray]:
    """Numbers and words among the attributes as arrays of field data, ``time`` under the name that VTK looks for.

    Tables of numbers (``domain``) are taken apart, deeper ones (``contact``) left to the attributes of the file.
    """
    flat = {"TimeValue" if name == "time" else name: value for name, value in attributes.items()}
    for name, value in attributes.items():
        if isinstance(value, dict) and all(isinstance(entry, (int, float)) for entry in value.values()):
            flat |= {f"{name}.{key}": entry for key, entry in value.items()}
    facts: dict[str, np.ndarray] = {}
    for name, value in flat.items():
        entries = list(value) if isinstance(value, (list, tuple, np.ndarray)) else [value]
        if entries and all(isinstance(entry, str) for entry in entries):
            words = [entry.encode("ascii", "replace").decode() for entry in entries]  # VTK converts no UTF-8
            facts[name] = np.array(words, dtype=object)
        elif entries and all(
            isinstance(entry, (bool, np.bool_, int, float, np.integer, np.floating)) for entry in entries
        ):
            numbers = np.array(entries)  # in one row: ParaView 5.11 reads no tables here
            facts[name] = numbers.astype(np.int8) if numbers.dtype == bool else numbers
    return facts


def read(path: Path, only: Collection[str] | None = None) -> Particles:
    """Read a snapshot, or ``only`` these of its fields (those that it has).

    Raises ``InputError`` when the file is missing, is not HDF5, or holds no ``/particles``.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"no snapshot at {path}")
    with hdf5_input.opened(path) as file:
        _known(file, path)
        wanted = None if only is None else {ALIASES.get(name, name) for name in only}
        fields = {
            name: hdf5_input.array(file["particles"], name)
            for name in file["particles"]
            if wanted is None or ALIASES.get(name, name) in wanted
        }
        for name in fields:
            _in_si(file["particles"][name], name, path)
        tables = hdf5_input.arrays(file["tables"], deep=True) if "tables" in file else {}
        attributes = {name: _restored(value) for name, value in file.attrs.items()}
    try:
        return Particles(fields, attributes, tables)
    except InputError as reason:
        raise InputError(f"{path}: {reason}") from None


def names(path: Path) -> set[str]:
    """The names of a snapshot's fields, without its particles. Raises ``InputError`` like ``read``."""
    if not Path(path).is_file():
        raise InputError(f"no snapshot at {path}")
    with hdf5_input.opened(path) as file:
        _known(file, path)
        return set(file["particles"])


def attributes(path: Path) -> dict[str, Any]:
    """The attributes of a snapshot (``time``, ``materials`` ...) without its particles. Raises ``InputError`` like
    ``read``."""
    if not Path(path).is_file():
        raise InputError(f"no snapshot at {path}")
    with hdf5_input.opened(path) as file:
        return {name: _restored(value) for name, value in file.attrs.items()}


def _known(file: Any, path: Path) -> None:
    if "particles" not in file or not hasattr(file["particles"], "keys"):
        raise InputError(f"{path} holds no group '/particles': not a snapshot of this project (see import_snapshot)")


def _in_si(dataset: Any, name: str, path: Path) -> None:
    """Raise ``InputError`` where a field says that it is in another unit than that of ``FIELDS``."""
    entry, unit = FIELDS.get(ALIASES.get(name, name)), archive.plain(dataset.attrs.get("unit", ""))
    if entry is not None and isinstance(unit, str) and unit not in ("", entry.unit):
        raise InputError(
            f"{path}: field {name!r} says it is in {unit[:20]!r}; snapshots are in SI, {entry.unit!r} here"
        )


def _restored(value: Any) -> Any:
    value = archive.plain(value)
    if isinstance(value, str) and value[:1] in ("[", "{"):
        try:
            return json.loads(value)
        except json.JSONDecodeError:
            return value
    return value


def write_series(folder: Path, times: dict[str, float]) -> None:
    """Write the ``.series`` index by which ParaView plays the snapshots of ``folder`` in time.

    ``times`` maps the file name of a snapshot to its time [s].
    """
    ordered = sorted(times.items(), key=lambda item: (item[1], _number(item[0])))
    files = [{"name": file, "time": time} for file, time in ordered]
    archive.write_json(folder / f"snap{SUFFIX}.series", {"file-series-version": "1.0", "files": files})


def series(folder: Path) -> list[Path]:
    """The numbered snapshots of a stage folder in order of time (``snap_0000.vtkhdf`` ...), by their numbers: after
    9999 these have five digits."""
    return sorted(Path(folder).glob(f"snap_*{SUFFIX}"), key=lambda path: (_number(path.name), path.name))


def _number(name: str) -> int:
    digits = name.partition("_")[2].partition(".")[0]
    return int(digits) if digits.isdecimal() else -1
