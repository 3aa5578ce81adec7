"""Observed and published craters: one TOML file each in ``observed/``, every value with its error and source."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crater.ground import radial_profile
from crater.ground.radial_profile import Profile
from matter.case import quantity
from matter.errors import InputError
from matter.files import toml_input
from matter.wording.crater_measures import COMPARED, MOMENTS, UNITS

FOLDER = Path(__file__).parent.parent / "observed"


@dataclass(frozen=True)
class Zone:
    """A mapped zone or a range of a trend: ``inner`` and ``outer`` diameter [m], ``depth_over_diameter`` with its
    error where one is stated."""

    name: str
    inner: float
    outer: float
    depth_over_diameter: tuple[float, float] | None = None


@dataclass(frozen=True)
class Observation:
    """``values``: measure -> (value, minus, plus) [SI]; ``profile`` where one is published; ``kind``: transient,
    final, zones, trend or laboratory.

    ``at``: of a transient crater, the maximum (volume, depth or diameter) at which its numbers were taken, where the
    source says it. ``impact``: what made it, where that is known: ``radius``, ``mass``, ``speed``, ``gravity``,
    densities [SI].
    """

    name: str
    title: str
    kind: str
    values: dict[str, tuple[float, float, float]]
    profile: Profile | None
    source: str
    note: str
    zones: tuple[Zone, ...] = ()
    impact: dict[str, float] | None = None
    at: str = ""


KINDS = ("transient", "final", "zones", "trend", "laboratory")


def names() -> list[str]:
    """Names of all observations that ship with the project."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load(name: str) -> Observation:
    """An observation that ships with the project.

    Raises ``InputError`` for an unknown name, with the nearest known one, or a value that cannot be read.
    """
    if name not in names():
        near = difflib.get_close_matches(name, names(), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"no observed crater {name!r}{hint} (known: {', '.join(names())})")
    return read(FOLDER / f"{name}.toml")


def read(path: Path) -> Observation:
    """An observation from a file of the same form (a user's own, for example).

    Raises ``InputError`` naming the file and what cannot be read.
    """
    path = Path(path)
    try:
        content = toml_input.loads(path.read_text())
    except (OSError, ValueError) as reason:
        raise InputError(f"{path.name}: {reason}") from None
    for key in ("title", "source"):
        if not str(content.get(key, "")).strip():
            raise InputError(
                f"{path.name} states no {key}: an observation needs title, source and at least one measure, zone or "
                f"profile"
            )
    kind, at = str(content.get("kind", "final")), str(content.get("at", ""))
    for key, word, known in (("kind", kind, KINDS), ("at", at, ("", *MOMENTS))):
        if word not in known:
            near = difflib.get_close_matches(word, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise InputError(
                f"{path.name}: {key} = {word!r} is not known{hint} (known: "
                f"{', '.join(name for name in known if name)})"
            )
    values = {key: _measure(path, key, entry) for key, entry in content.get("measures", {}).items()}
    zones = tuple(_zone(path, entry) for entry in content.get("zones", ()))
    profile = _profile(path, content)
    if not values and not zones and profile is None:
        raise InputError(f"{path.name} states no measure, no zone and no profile")
    impact = {key: _number(path, f"impact.{key}", text) for key, text in content.get("impact", {}).items()} or None
    return Observation(
        path.stem,
        content["title"],
        kind,
        values,
        profile,
        content["source"],
        content.get("note", ""),
        zones,
        impact,
        at,
    )


def _number(path: Path, key: str, text: Any, unit: str = "") -> float:
    if unit == "1":
        try:
            return float(text)
        except (TypeError, ValueError):
            raise InputError(f"{path.name}: {key} = {text!r} is no number") from None
    if not isinstance(text, str):
        raise InputError(f'{path.name}: {key} = {text!r} is no text with a unit: write it like "{text} {unit or "m"}"')
    try:
        return float(quantity.parse(text, unit))
    except ValueError as reason:
        raise InputError(f"{path.name}: {key}: {reason}") from None


def _measure(path: Path, key: str, entry: Any) -> tuple[float, float, float]:
    if key not in COMPARED:
        near = difflib.get_close_matches(key, COMPARED, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"{path.name}: measure {key!r} is not known{hint} (known: {', '.join(COMPARED)})")
    if not isinstance(entry, dict) or not {"value", "minus", "plus"} <= set(entry):
        raise InputError(f"{path.name}: measure {key!r} needs value, minus and plus with units")
    value, minus, plus = (
        _number(path, f"measures.{key}.{part}", entry[part], UNITS[key]) for part in ("value", "minus", "plus")
    )
    return value, minus, plus


def _zone(path: Path, entry: dict[str, Any]) -> Zone:
    ratio = entry.get("depth_over_diameter")
    inner, outer = (_number(path, f"zones.{key}", entry.get(key, "0 m")) for key in ("inner", "outer"))
    return Zone(
        str(entry["name"]), inner, outer, None if ratio is None else (float(ratio["value"]), float(ratio["error"]))
    )


def _profile(path: Path, content: dict) -> Profile | None:
    """The profile file that the observation names, or the paraboloid of its depth and diameter where it says ``shape =
    "paraboloid"``."""
    if "profile" in content:
        return radial_profile.read_csv(path.parent / content["profile"])
    if content.get("shape") != "paraboloid":
        return None
    measures = content["measures"]
    radius = 0.5 * _measure(path, "diameter_apparent_m", measures.get("diameter_apparent_m"))[0]
    depth = _measure(path, "depth_m", measures.get("depth_m"))[0]
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
