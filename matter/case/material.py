"""Materials: one TOML file each, every value with its unit and every group of values with its source.

A file holds sections named after the law that uses them (``[tillotson]``, ``[von_mises]``, ``[weibull]`` ...); each
has a ``source`` in words, its ``sources`` (keys of the bibliography), and values that are unit strings (``"9.47
GPa"``; dimensionless ones ``"0.3"``; a measured curve is a list of them). This module turns a section into SI floats;
the law's own ``Parameters`` then say whether they fit. Above the sections, ``title`` and the choice of laws:
``strength = "collins"``.
"""

from __future__ import annotations

import difflib
import functools
import tomllib
from pathlib import Path
from typing import Any

from matter.case import quantity
from matter.errors import InputError

FOLDER = Path(__file__).parent.parent / "materials"
TABLES = FOLDER / "tables"
"""Where tables of equations of state lie that ship with the project."""
WORDS = ("source", "sources", "note")
"""Keys of a section that are no values."""


def names() -> list[str]:
    """Names of all materials that ship with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


@functools.cache
def load(name: str) -> dict[str, dict[str, Any]]:
    """All sections of a material, SI floats or lists of them (and the texts ``source``, ``note`` and the keys
    ``sources``).

    Raises ``InputError`` for an unknown name, with the nearest known one.
    """
    return {
        title: {key: _value(name, title, key, value) for key, value in written(name, title).items()}
        for title, body in _content(name).items()
        if isinstance(body, dict)
    }


def written(name: str, title: str) -> dict[str, Any]:
    """One section of a material as its file has it: texts with their units.

    Raises ``InputError`` for an unknown name, or when the material has no such section.
    """
    content = _content(name)
    if not isinstance(content.get(title), dict):
        sections = ", ".join(key for key, body in content.items() if isinstance(body, dict))
        raise InputError(f"material {name!r} has no [{title}] (it has {sections})")
    return content[title]


@functools.cache
def choices(name: str) -> dict[str, str]:
    """The texts above the sections of a material: ``title``, and the laws that it takes where they are not the
    defaults (``strength = "collins"``).

    Raises ``InputError`` for an unknown name, with the nearest known one.
    """
    return {key: value for key, value in _content(name).items() if isinstance(value, str)}


def reference_density(name: str) -> float:
    """rho0 [kg/m^3] of the material's equation of state: the density of the solid at rest."""
    return section(name, choices(name).get("eos", "tillotson"))["rho0"]


@functools.cache
def _content(name: str) -> dict[str, Any]:
    if name not in names():  # not by looking for the file: a name is no path
        near = difflib.get_close_matches(name, names(), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(
            f"unknown material {name!r}{hint} (known: {', '.join(names())}; to make one: "
            "docs/site/howto/own_material.md)"
        )
    try:
        return tomllib.loads((FOLDER / f"{name}.toml").read_text())
    except ValueError as reason:  # no TOML, or no UTF-8
        raise InputError(f"matter/materials/{name}.toml cannot be read: {reason}") from None


def _value(name: str, title: str, key: str, value: Any) -> Any:
    """What a key of a section holds: a text, the path of a table (``file``, beside the material's file), numbers."""
    if key in WORDS:
        return value
    try:
        if key == "file":
            return str(FOLDER / value)
        return [_number(item) for item in value] if isinstance(value, list) else _number(value)
    except (TypeError, ValueError) as reason:
        raise InputError(f"matter/materials/{name}.toml, [{title}] {key}: {reason}") from None


def _number(value: Any) -> float:
    if isinstance(value, str):
        return quantity.parse(value)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f'{value!r} is no number: write it as a text with its unit, "2700 kg/m^3" for example')
    return float(value)


def section(name: str, title: str) -> dict[str, Any]:
    """The numbers of one section of a material, in SI.

    Raises ``InputError`` when the material has no such section.
    """
    return {key: _value(name, title, key, value) for key, value in written(name, title).items() if key not in WORDS}
