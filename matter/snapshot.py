"""Snapshots: one HDF5 file per time that h5py, pyvista and ParaView all open, with nothing stored twice.

``/particles/<field>`` holds the arrays with attributes ``unit`` and ``meaning``; ``/VTKHDF`` is a PolyData of vertices whose
``Points`` and ``PointData`` are hard links to them. Facts on the whole set are attributes of the file (``time`` [s], ``stage``,
``frame``, ``materials`` ...); further tables (contact history) stand under ``/tables``.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from matter import archive
from matter.errors import InputError
from matter.particles import FIELDS, Particles

SUFFIX = ".vtkhdf"


def write(particles: Particles, path: Path) -> None:
    """Write a snapshot; the file is whole or absent. Lists and dicts among the attributes are stored as JSON text."""
    import h5py

    particles.need("position")
    count = len(particles)
    squeeze = dict(compression="gzip", compression_opts=1, shuffle=True) if count > 64 else {}
    size = sum(particles[name].nbytes for name in particles) + sum(np.asarray(table).nbytes for table in particles.tables.values())
    with archive.replacing(Path(path), size) as temporary, h5py.File(temporary, "w") as file:
        for name, value in particles.attributes.items():
            file.attrs[name] = json.dumps(value) if isinstance(value, (list, dict, tuple)) else value
        fields = file.create_group("particles")
        for name in particles:
            dataset = fields.create_dataset(name, data=particles[name], **squeeze)
            dataset.attrs["unit"], dataset.attrs["meaning"] = FIELDS[name].unit, FIELDS[name].meaning
        for name, table in particles.tables.items():
            file.create_dataset(f"tables/{name}", data=table, **(squeeze if np.size(table) > 64 else {}))
        vtk = file.create_group("VTKHDF", track_order=True)
        vtk.attrs["Version"] = np.array([2, 0], dtype=np.int64)
        vtk.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", len(b"PolyData")))
        vtk["Points"] = fields["position"]
        vtk.create_dataset("NumberOfPoints", data=np.array([count], dtype=np.int64))
        points = vtk.create_group("PointData")
        for name in particles:
            if name != "position":
                points[name] = fields[name]
        for kind in ("Vertices", "Lines", "Polygons", "Strips"):
            cells = vtk.create_group(kind)
            many = count if kind == "Vertices" else 0
            cells.create_dataset("NumberOfCells", data=np.array([1 if many else 0], dtype=np.int64))
            cells.create_dataset("NumberOfConnectivityIds", data=np.array([many], dtype=np.int64))
            cells.create_dataset("Connectivity", data=np.arange(many, dtype=np.int64), **(squeeze if many else {}))
            cells.create_dataset("Offsets", data=np.array([0, many] if many else [0], dtype=np.int64))


def read(path: Path, only: Collection[str] | None = None) -> Particles:
    """Read a snapshot, or ``only`` these of its fields (those that it has).

    Raises ``InputError`` when the file is missing, is not HDF5, or holds no ``/particles``.
    """
    import h5py

    path = Path(path)
    if not path.is_file():
        raise InputError(f"no snapshot at {path}")
    try:
        with h5py.File(path, "r") as file:
            if "particles" not in file:
                raise InputError(f"{path} holds no group '/particles': not a snapshot of this project (see import_snapshot)")
            fields = {name: dataset[()] for name, dataset in file["particles"].items() if only is None or name in only}
            tables: dict[str, np.ndarray] = {}
            if "tables" in file:
                file["tables"].visititems(lambda name, item: tables.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
            attributes = {name: _restored(value) for name, value in file.attrs.items()}
    except OSError as reason:
        raise InputError(f"{path} is not a readable HDF5 file ({reason})") from None
    return Particles(fields, attributes, tables)


def attributes(path: Path) -> dict[str, Any]:
    """The attributes of a snapshot (``time``, ``materials`` ...) without its particles. Raises ``InputError`` like ``read``."""
    import h5py

    if not Path(path).is_file():
        raise InputError(f"no snapshot at {path}")
    try:
        with h5py.File(path, "r") as file:
            return {name: _restored(value) for name, value in file.attrs.items()}
    except OSError as reason:
        raise InputError(f"{path} is not a readable HDF5 file ({reason})") from None


def _restored(value: Any) -> Any:
    value = archive._plain(value)
    if isinstance(value, str) and value[:1] in ("[", "{"):
        try:
            return json.loads(value)
        except json.JSONDecodeError:
            return value
    return value


def write_series(folder: Path, times: dict[str, float], name: str) -> None:
    """Write the ``.series`` index by which ParaView plays the snapshots of ``folder`` in time.

    ``times`` maps the file name of a snapshot to its time [s].
    """
    files = [{"name": file, "time": time} for file, time in sorted(times.items(), key=lambda item: item[1])]
    archive.write_text(folder / f"{name}{SUFFIX}.series", json.dumps({"file-series-version": "1.0", "files": files}, indent=1))


def series(folder: Path) -> list[Path]:
    """The numbered snapshots of a stage folder in order of time (``snap_0000.vtkhdf`` ...)."""
    return sorted(Path(folder).glob(f"snap_*{SUFFIX}"))
