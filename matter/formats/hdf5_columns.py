"""Any HDF5 file whose particles stand in datasets: named by hand, or by their own names.

``columns`` maps names to datasets: ``"position=PartType0/Coordinates [km], velocity=PartType0/Velocities [km/s],
m=PartType0/Masses [1e10 kg]"``. The left side is a field or a column name of ``columns.slots`` (``x``, ``rho``, ``u``
...), the unit belongs to the dataset. Vectors are datasets of shape (n, 3), stresses (n, 6) as xx xy xz yy yz zz or
(n, 9). Without ``columns`` every dataset whose own name is known is taken, of the one group that holds positions.

A dataset without a unit of ``columns`` is in the unit that its attribute ``unit`` names, else in the system that the
file declares (``hdf5_header``: SWIFT, GADGET, GIZMO), else in SI.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from matter.errors import InputError
from matter.files import archive, hdf5_input
from matter.formats import hdf5_header
from matter.formats import named_columns as named
from matter.formats.reading import Reading
from matter.formats.words import listed, short
from matter.particles import FIELDS

_NINE = (0, 1, 2, 4, 5, 8)
_UNIT = ("unit", "units")
"""Attributes of a dataset that name its unit."""


def read(path: Path, columns: str | None = None) -> Reading:
    """What an HDF5 file holds. Raises ``InputError`` naming the datasets that are there, or the groups where several
    hold particles."""
    reading = Reading(path)
    with hdf5_input.opened(path) as file:
        there = hdf5_input.datasets(file)
        header = hdf5_header.read(file, str(path))
        wanted = _given(columns, there, str(path)) if columns else _guessed(there, str(path))
        by_hand = False
        for name, dataset, unit in wanted:
            if name not in named.slots() and name not in FIELDS:
                raise InputError(
                    f"{path}: {short(dataset)}: unknown field {short(name)} (known: "
                    f"{', '.join(dict.fromkeys([*FIELDS, *named.slots()]))})"
                )
            by_hand |= bool(unit)
            times = _times(name, unit, there[dataset], header, f"{path}: {dataset}")
            _take(reading, name, hdf5_input.array(file, dataset), times, dataset)
        hdf5_header.declare(reading, header, [dataset for _, dataset, _ in wanted], units_by_hand=by_hand)
        used = {dataset for _, dataset, _ in wanted}
        reading.leave(*(dataset for dataset in there if dataset not in used))
    return reading


def _given(columns: str, there, source: str) -> list[tuple[str, str, str]]:
    """(name, dataset, unit) for each entry ``name = dataset [unit]``."""
    rows = []
    for entry in columns.split(","):
        match = re.fullmatch(r"\s*([^=\s]+)\s*=\s*/?([^\[\]]+?)\s*(?:\[(.*)\])?\s*", entry)
        if match is None:
            raise InputError(
                f"--columns {short(entry.strip())}: write 'position=PartType0/Coordinates [km]', entries between "
                f"commas"
            )
        name, dataset, unit = match.group(1).lower(), match.group(2), match.group(3) or ""
        if dataset not in there:
            raise InputError(f"{source} holds no dataset {short(dataset)} (there are: {listed(there)})")
        rows.append((name, dataset, unit))
    return rows


def _guessed(there, source: str) -> list[tuple[str, str, str]]:
    """The datasets of known names in the one group that holds positions. Raises ``InputError`` where none does, or
    several do."""
    known = named.slots()
    rows = [
        (name, dataset, "")
        for dataset, item in there.items()
        for name in [dataset.rpartition("/")[2].lower()]
        if (name in FIELDS or name in known) and item.ndim in (1, 2)
    ]
    datasets = [dataset for name, dataset, _ in rows if known.get(name, (name,))[0] == "position"]
    groups = list(dict.fromkeys(dataset.rpartition("/")[0] for dataset in datasets))
    if not groups:
        raise InputError(
            f"{source}: no dataset is named like a position; say which is what with --columns 'position=A/B "
            f"[km],m=A/C' (there are: {listed(there)})"
        )
    if len(groups) > 1:
        first = datasets[0]
        raise InputError(
            f"{source}: {len(groups)} groups hold particles ({listed(group or '/' for group in groups)}), and one is "
            f"read at a time: name its datasets, --columns '{first.rpartition('/')[2]}={first},...', or write all "
            f"particles into one group"
        )
    return [row for row in rows if row[1].rpartition("/")[0] == groups[0]]


def _times(name: str, unit: str, item: Any, header: hdf5_header.Header, where: str) -> float:
    """What a dataset is multiplied with to be in SI."""
    field = named.slots().get(name, (name, None))[0]
    si = FIELDS[field].unit
    own = next((archive.plain(item.attrs[key]) for key in _UNIT if key in item.attrs), None)
    if not unit and isinstance(own, str) and own.strip() not in ("", "1", si):
        try:
            return named.factor(own.strip(), si, where)
        except InputError as reason:
            raise InputError(f"{reason} (its attribute says so; a unit in --columns goes before it)") from None
    if unit or isinstance(own, str):
        return named.factor(unit, si, where)
    return header.system.factor(si)


def _take(reading: Reading, name: str, values: np.ndarray, times: float, dataset: str) -> None:
    """Enter a dataset (SI) under its field and component."""
    field, component = named.slots().get(name, (name, None))
    entry, where = FIELDS[field], f"{reading.source}: {dataset}"
    values = values if times == 1.0 else values * times
    if not entry.shape or component is not None:
        if values.ndim == 2 and values.shape[1] == 1:
            values = values[:, 0]
        if values.ndim != 1:
            raise InputError(f"{where}: {name} is one number per particle, the dataset has shape {values.shape}")
        reading.take(field, values, dataset, component)
        return
    if entry.shape == (6,) and values.ndim == 2 and values.shape[1] == 9:
        values = values[:, _NINE]
    if values.ndim != 2 or values.shape[1:] != entry.shape:
        raise InputError(
            f"{where}: {field} needs a dataset of shape (n, {entry.shape[0]}), this one has {values.shape}"
        )
    reading.take(field, values, dataset)
