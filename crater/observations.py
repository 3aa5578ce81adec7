"""Observed and published craters: one TOML file each in ``observed/``, every value with its error and source."""

from __future__ import annotations

import difflib
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crater.radial_profile import Profile
from matter import quantity
from matter.errors import InputError

FOLDER = Path(__file__).parent / "observed"


@dataclass(frozen=True)
class Observation:
    """``values``: measure -> (value, minus, plus) [SI]; ``profile`` where one is published; ``kind``: transient or final."""

    name: str
    title: str
    kind: str
    values: dict[str, tuple[float, float, float]]
    profile: Profile | None
    source: str
    note: str


def names() -> list[str]:
    """Names of all observations that ship with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str) -> Observation:
    """Read an observation.

    Raises ``InputError`` for an unknown name, with the nearest known one, or a value that cannot be read.
    """
    path = FOLDER / f"{name}.toml"
    if not path.is_file():
        near = difflib.get_close_matches(name, names(), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"no observed crater {name!r}{hint} (known: {', '.join(names())})")
    content = tomllib.loads(path.read_text())
    try:
        values = {}
        for key, entry in content.get("measures", {}).items():
            parts = [quantity.parse(entry[part]) for part in ("value", "minus", "plus")]
            values[key] = (parts[0], parts[1], parts[2])
    except (KeyError, ValueError) as reason:
        raise InputError(f"{path.name}: measure {key!r} needs value, minus and plus with units ({reason})") from None
    return Observation(name, content["title"], content.get("kind", "final"), values, _profile(content), content["source"], content.get("note", ""))


def _profile(content: dict) -> Profile | None:
    """The observation's profile, or the paraboloid that its depth and diameter imply where the file says ``shape = "paraboloid"``."""
    if content.get("shape") != "paraboloid":
        return None
    measures = content["measures"]
    radius = 0.5 * quantity.parse(measures["diameter_apparent_m"]["value"])
    depth = quantity.parse(measures["depth_m"]["value"])
    r = np.linspace(0.0, radius, 60)
    nothing = np.full(60, np.nan)
    return Profile(
        r,
        depth * ((r / radius) ** 2 - 1.0),
        nothing,
        nothing,
        np.zeros(60, dtype=int),
        {"of": "paraboloid of the published depth and diameter"},
    )
