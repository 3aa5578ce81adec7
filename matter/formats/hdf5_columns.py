"""Any HDF5 file whose particles stand in datasets: named by hand, or by their own names.

``columns`` maps names to datasets: ``"position=PartType0/Coordinates [km], velocity=PartType0/Velocities [km/s],
m=PartType0/Masses [1e10 kg]"``. The left side is a field or a column name of ``columns.slots`` (``x``, ``rho``, ``u``
...), the unit belongs to the dataset and is SI without one. Vectors are datasets of shape (n, 3), stresses (n, 6) as
xx xy xz yy yz zz or (n, 9). Without ``columns`` every dataset whose own name is known is taken.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from matter import hdf5_input
from matter.errors import InputError
from matter.formats import columns as named
from matter.particles import FIELDS, Particles

_NINE = (0, 1, 2, 4, 5, 8)


def read(path: Path, columns: str | None = None) -> Particles:
    """Particles of an HDF5 file. Raises ``InputError`` naming the datasets that are there."""
    import h5py

    with hdf5_input.opened(path) as file:
        there: dict[str, h5py.Dataset] = {}
        file.visititems(
            lambda name, item: (
                there.update({name: item}) if isinstance(item, h5py.Dataset) and item.ndim in (1, 2) else None
            )
        )
        wanted = _given(columns, there, str(path)) if columns else _guessed(there, str(path))
        parts: dict[tuple[str, int | None], np.ndarray] = {}
        for name, dataset, unit in wanted:
            _take(parts, name, hdf5_input.array(file, dataset), unit, f"{path}: {dataset}")
        time = file.attrs.get("time")
    lengths = {len(values) for values in parts.values()}
    if len(lengths) > 1:
        raise InputError(
            f"{path}: the datasets {', '.join(dataset for _, dataset, _ in wanted)} differ in length: "
            f"{sorted(lengths)}"
        )
    particles = named.joined(parts, str(path))
    if time is not None:
        particles.attributes["time"] = float(np.ravel(time)[0])
    return particles


def _given(columns: str, there, source: str) -> list[tuple[str, str, str]]:
    """(name, dataset, unit) for each entry ``name = dataset [unit]``."""
    rows = []
    for entry in columns.split(","):
        match = re.fullmatch(r"\s*([^=\s]+)\s*=\s*/?([^\[\]]+?)\s*(?:\[(.*)\])?\s*", entry)
        if match is None:
            raise InputError(
                f"--columns {entry.strip()!r}: write 'position=PartType0/Coordinates [km]', entries between commas"
            )
        name, dataset, unit = match.group(1).lower(), match.group(2), match.group(3) or ""
        if dataset not in there:
            raise InputError(f"{source} holds no dataset {dataset!r} (there are: {', '.join(there) or 'none'})")
        rows.append((name, dataset, unit))
    return rows


def _guessed(there, source: str) -> list[tuple[str, str, str]]:
    known = named.slots()
    rows = [
        (name, dataset, "")
        for dataset in there
        for name in [dataset.rpartition("/")[2].lower()]
        if name in FIELDS or name in known
    ]
    if not any(name in ("position", "x") for name, _, _ in rows):
        raise InputError(
            f"{source}: no dataset is named like a position; say which is what with --columns 'position=A/B "
            f"[km],m=A/C' "
            f"(there are: {', '.join(there) or 'none'})"
        )
    return rows


def _take(parts: dict, name: str, values: np.ndarray, unit: str, where: str) -> None:
    """Enter a dataset (SI) under its field and component."""
    known = named.slots()
    field, component = known.get(name, (name, None))
    if field not in FIELDS:
        raise InputError(f"{where}: unknown field {name!r} (known: {', '.join(dict.fromkeys([*FIELDS, *known]))})")
    entry = FIELDS[field]
    values = values * named.factor(unit, entry.unit, where) if unit else values
    if not entry.shape or component is not None:
        if values.ndim == 2 and values.shape[1] == 1:
            values = values[:, 0]
        if values.ndim != 1:
            raise InputError(f"{where}: {name} is one number per particle, the dataset has shape {values.shape}")
        parts[field, component] = values
        return
    if entry.shape == (6,) and values.ndim == 2 and values.shape[1] == 9:
        values = values[:, _NINE]
    if values.ndim != 2 or values.shape[1:] != entry.shape:
        raise InputError(
            f"{where}: {field} needs a dataset of shape (n, {entry.shape[0]}), this one has {values.shape}"
        )
    for k in range(entry.shape[0]):
        parts[field, k] = values[:, k]
