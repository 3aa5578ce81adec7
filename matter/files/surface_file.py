"""Surfaces of triangles with values at their corners: one HDF5 file that h5py, pyvista and ParaView open.

As in ``matter.files.snapshot``: ``/surface/<field>`` holds arrays with ``unit`` and ``meaning``, ``/VTKHDF`` an
unstructured grid (version 1.0, which ParaView 5.11 reads) of triangles whose arrays are hard links to them.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter.files import archive

_TRIANGLE = 5
"""VTK's number for a triangle."""


def write(
    path: Path,
    position: np.ndarray,
    triangles: np.ndarray,
    fields: Mapping[str, tuple[np.ndarray, str, str]],
    attributes: Mapping[str, Any] | None = None,
) -> None:
    """Write corners ``position`` (n, 3) [m], ``triangles`` (m, 3) and ``fields`` (array (n,) or (n, 3), unit,
    meaning); the file is whole or absent."""
    import h5py

    n, m = len(position), len(triangles)
    with archive.replacing_hdf5(Path(path), position.nbytes * (2 + len(fields)) + triangles.nbytes * 2) as file:
        for name, value in (attributes or {}).items():
            file.attrs[name] = value
        group = file.create_group("surface")
        arrays = {"place": (position, "m", "corner of the triangles"), **fields}
        for name, (array, unit, meaning) in arrays.items():
            dataset = group.create_dataset(name, data=np.asarray(array), compression="gzip", compression_opts=1)
            dataset.attrs["unit"], dataset.attrs["meaning"] = unit, meaning
        vtk = file.create_group("VTKHDF", track_order=True)
        vtk.attrs["Version"] = np.array([1, 0], dtype=np.int64)
        vtk.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len(b"UnstructuredGrid")))
        for name, count in (("NumberOfPoints", n), ("NumberOfCells", m), ("NumberOfConnectivityIds", 3 * m)):
            vtk.create_dataset(name, data=np.array([count], dtype=np.int64))
        vtk["Points"] = group["place"]
        values = vtk.create_group("PointData")
        for name in fields:
            values[name] = group[name]
        vtk.create_dataset("Connectivity", data=np.asarray(triangles, dtype=np.int64).ravel(), compression="gzip")
        vtk.create_dataset("Offsets", data=3 * np.arange(m + 1, dtype=np.int64), compression="gzip")
        vtk.create_dataset("Types", data=np.full(m, _TRIANGLE, dtype=np.uint8), compression="gzip")
