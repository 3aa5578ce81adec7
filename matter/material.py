"""Materials: one TOML file each, every value with its unit and every group of values with its source.

A file holds sections named after the law that uses them (``[tillotson]``, ``[von_mises]``, ``[weibull]`` ...); each has a ``source``
and values that are unit strings (``"9.47 GPa"``; dimensionless ones ``"0.3"``). This module turns a section into SI floats; the law's own
``Parameters`` then say whether they fit.
"""

from __future__ import annotations

import difflib
import functools
import tomllib
from pathlib import Path

from matter import quantity
from matter.errors import InputError

FOLDER = Path(__file__).parent / "materials"


def names() -> list[str]:
    """Names of all materials that ship with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


@functools.cache
def load(name: str) -> dict[str, dict[str, float | str]]:
    """All sections of a material, SI floats (and the texts ``source``, ``note``).

    Raises ``InputError`` for an unknown name, with the nearest known one.
    """
    path = FOLDER / f"{name}.toml"
    if not path.is_file():
        near = difflib.get_close_matches(name, names(), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"unknown material {name!r}{hint} (known: {', '.join(names())})")
    content = tomllib.loads(path.read_text())
    sections: dict[str, dict[str, float | str]] = {}
    for title, body in content.items():
        if isinstance(body, dict):
            sections[title] = {key: value if key in ("source", "note") else quantity.parse(value) for key, value in body.items()}
    return sections


def section(name: str, title: str) -> dict[str, float]:
    """The numbers of one section of a material, in SI.

    Raises ``InputError`` when the material has no such section.
    """
    sections = load(name)
    if title not in sections:
        raise InputError(f"material {name!r} has no [{title}] (it has {', '.join(sections)})")
    return {key: value for key, value in sections[title].items() if isinstance(value, float)}
