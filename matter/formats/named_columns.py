"""Columns of numbers as particle fields: the names that other codes use, and units in square brackets."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from matter.case import quantity
from matter.errors import InputError
from matter.formats.numbers import Table
from matter.formats.reading import Reading
from matter.formats.unit_system import SI, UnitSystem
from matter.formats.words import short
from matter.particles import FIELDS, Particles

_VECTORS = {
    "position": "x y z",
    "velocity": "vx vy vz",
    "angular_velocity": "omegax omegay omegaz",
    "gravity": "gx gy gz",
}
_SCALARS = {
    "id": "identity",
    "particle": "identity",
    "m": "mass",
    "rho": "density",
    "u": "specific_energy",
    "e": "specific_energy",
    "h": "smoothing_length",
    "p": "pressure",
    "r": "radius",
    "diameter": "radius",
    "alpha": "distention",
    "type": "material",
    "mat": "material",
    "cs": "sound_speed",
}
_TIMES = {"diameter": 0.5}
"""What a column is multiplied with to be its field."""
_LONGEST_UNIT = 60
_STRESS = ("sxx", "sxy", "sxz", "syy", "syz", "szz")


def slots() -> dict[str, tuple[str, int | None]]:
    """Column name (lower case) -> field and component; a field's own name works too, with ``_x`` or ``_0`` for
    components."""
    names: dict[str, tuple[str, int | None]] = {}
    for name, entry in FIELDS.items():
        if not entry.shape:
            names[name] = (name, None)
            continue
        for k in range(entry.shape[0]):
            names[f"{name}_{k}"] = (name, k)
            if entry.shape == (3,):
                names[f"{name}_{'xyz'[k]}"] = (name, k)
    for field, few in _VECTORS.items():
        names |= {column: (field, k) for k, column in enumerate(few.split())}
    names |= {column: ("deviatoric_stress", k) for k, column in enumerate(_STRESS)}
    return names | {column: (field, None) for column, field in _SCALARS.items()}


def components(particles: Particles) -> list[tuple[str, str, np.ndarray]]:
    """Every field taken apart into columns, the position first: label (``velocity_x``, ``deviatoric_stress_0``),
    field, values (n,).

    Raises ``InputError`` for particles without a position.
    """
    particles.need("position")
    columns: list[tuple[str, str, np.ndarray]] = []
    for name in ["position", *(name for name in particles if name != "position")]:
        shape = FIELDS[name].shape
        if not shape:
            columns.append((name, name, particles[name]))
        else:
            columns += [
                (f"{name}_{'xyz'[k] if shape == (3,) else k}", name, particles[name][:, k]) for k in range(shape[0])
            ]
    return columns


def enter(
    reading: Reading,
    names: Sequence[str | None],
    table: Table,
    system: UnitSystem = SI,
    own: Sequence[str] | None = None,
) -> None:
    """Enter the columns of a table, one name each, as fields; None is a column that was entered before.

    A name may carry a unit, ``"x [km]"``; without one it is in ``system``. Columns named ``-`` are left out, unknown
    ones are an error. Whole numbers (identities, materials) are read digit by digit. ``own`` are the names that the
    file itself has for its columns.
    """
    known = slots()
    for k, text in enumerate(names):
        if text is None:
            continue
        name, unit = split(text)
        where = f"{reading.source}: column {short(text)}"
        if name == "-":
            reading.leave(own[k] if own and own[k].strip() != "-" else f"column {k + 1}")
            continue
        if name not in known:
            raise InputError(
                f"{reading.source}: unknown column {short(text)}; name it '-' to leave it out (known: "
                f"{', '.join(known)})"
            )
        field, component = known[name]
        entry = FIELDS[field]
        times = factor(unit, entry.unit, where) if unit else system.factor(entry.unit)
        if times == 1.0 and np.dtype(entry.dtype).kind == "i":
            values = table.whole(k, where)
        else:
            values = table.values[:, k] * (times * _TIMES.get(name, 1.0))
        reading.take(field, values, text, component)


def split(text: str) -> tuple[str, str]:
    """Name (lower case) and unit (empty without one) of a column."""
    match = re.fullmatch(r"\s*([^\[\]]*?)\s*(?:\[(.*)\])?\s*", text)
    return (match.group(1).lower(), match.group(2) or "") if match else (text, "")


def factor(unit: str, si: str, where: str) -> float:
    """What a value in ``unit`` is multiplied with to be in ``si``; 1 without a unit. Raises ``InputError`` for another
    dimension."""
    if not unit:
        return 1.0
    if len(unit) > _LONGEST_UNIT:
        raise InputError(f"{where}: {short(unit)} is no unit")
    try:
        # "1e10 kg" is a unit too
        return quantity.parse(unit if unit[0].isdigit() else f"1 {unit}", "" if si == "1" else si)
    except ValueError as reason:
        raise InputError(f"{where}: {reason}") from None
