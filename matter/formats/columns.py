"""Columns of numbers as particle fields: the names that other codes use, and units in square brackets."""

from __future__ import annotations

import re

import numpy as np

from matter import quantity
from matter.errors import InputError
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
    "alpha": "distention",
    "type": "material",
    "mat": "material",
    "cs": "sound_speed",
}
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
    for field, short in _VECTORS.items():
        names |= {column: (field, k) for k, column in enumerate(short.split())}
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


def assemble(names: list[str], table: np.ndarray, source: str) -> Particles:
    """Particles from a table with one column per name.

    A name may carry a unit, ``"x [km]"``; without one it is SI. Columns named ``-`` are left out, unknown ones are an
    error, as are vectors with a component missing.
    """
    known, parts = slots(), {}
    for k, text in enumerate(names):
        name, unit = _split(text)
        if name == "-":
            continue
        if name not in known:
            raise InputError(
                f"{source}: unknown column {text!r}; name it '-' to leave it out (known: {', '.join(known)})"
            )
        parts[known[name]] = table[:, k] * factor(unit, FIELDS[known[name][0]].unit, f"{source}: column {text!r}")
    return joined(parts, source)


def joined(parts: dict[tuple[str, int | None], np.ndarray], source: str) -> Particles:
    """Particles from columns (n,) by field and component (None for scalars), in SI; identities are counted where there
    are none.

    Raises ``InputError`` for a vector that lacks a component and for particles without a position.
    """
    fields = {}
    for field in dict.fromkeys(field for field, _ in parts):
        shape = FIELDS[field].shape
        if not shape:
            fields[field] = parts[field, None]
            continue
        missing = [k for k in range(shape[0]) if (field, k) not in parts]
        if missing:
            raise InputError(f"{source}: {field} lacks component {', '.join(map(str, missing))}")
        fields[field] = np.column_stack([parts[field, k] for k in range(shape[0])])
    particles = Particles(fields)
    particles.need("position")
    if "identity" not in particles:
        particles["identity"] = np.arange(len(particles))
    return particles


def _split(text: str) -> tuple[str, str]:
    match = re.fullmatch(r"\s*([^\[\]]*?)\s*(?:\[(.*)\])?\s*", text)
    return (match.group(1).lower(), match.group(2) or "") if match else (text, "")


def factor(unit: str, si: str, where: str) -> float:
    """What a value in ``unit`` is multiplied with to be in ``si``; 1 without a unit. Raises ``InputError`` for another
    dimension."""
    if not unit:
        return 1.0
    try:
        # "1e10 kg" is a unit too
        return quantity.parse(unit if unit[0].isdigit() else f"1 {unit}", "" if si == "1" else si)
    except ValueError as reason:
        raise InputError(f"{where}: {reason}") from None
