"""What a column of measures is of: the stage, the moment and the time, in the same words on the page, the terminal and in comparisons.

A crater is *transient* at the first maximum of its volume, depth or diameter, and *final* only where it has come to rest; anything else is the last
snapshot, and its head says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from matter import readable

MOMENTS = ("volume", "depth", "diameter")
"""Moments of the transient crater, as ``measures.json`` names them: ``at_maximum_volume`` ..."""
METHODS = {"sph": "SPH", "dem": "grains"}


class Head(NamedTuple):
    """``key`` of the column (``transient/volume``, ``final``), its ``stage`` (transient or final), and two lines: what it is, and when."""

    key: str
    stage: str
    title: str
    when: str

    @property
    def line(self) -> str:
        """Both lines as one."""
        return f"{self.title}, {self.when}" if self.when else self.title


def transient(moments: list[str], time: float | None, method: str, growing: list[str]) -> Head:
    """Head of the transient crater at the maxima of ``moments`` (they may fall on one snapshot); ``growing``: those of them that still grow at the end."""
    words = " and ".join(moments)
    if growing:
        title = f"last snapshot, {' and '.join(growing)} still growing"
    else:
        title = f"transient, maximum {words}"
    return Head(f"transient/{moments[0]}", "transient", title, _when(time, METHODS.get(method, method)))


def final(entry: Mapping[str, Any]) -> Head:
    """Head of the ``final`` entry of ``measures.json``: *final* where it is settled (or the file is too old to say), else the last snapshot and its state."""
    title = "final" if entry.get("settled", True) else f"last snapshot, {entry.get('state', 'not known to be at rest')}"
    return Head("final", "final", title, _when(_time(entry), str(entry.get("from", ""))))


def columns(measures: Mapping[str, Any], moments: tuple[str, ...] = ("volume", "depth")) -> list[tuple[Head, Mapping[str, Any]]]:
    """Heads and entries of ``measures.json`` for these ``moments`` and the final crater; moments that fall on one snapshot share a column."""
    found: list[tuple[Head, Mapping[str, Any]]] = []
    held = measures.get("transient", {})
    groups: dict[float | None, list[str]] = {}
    for moment in moments:
        entry = held.get(f"at_maximum_{moment}")
        if isinstance(entry, Mapping):
            groups.setdefault(_time(entry), []).append(moment)
    for time, names in groups.items():
        entry = held[f"at_maximum_{names[0]}"]
        growing = [name for name in names if held[f"at_maximum_{name}"].get("growing")]
        found.append((transient(names, time, str(entry.get("stage", "")), growing), entry))
    if not groups and any(isinstance(cell, Mapping) and isinstance(cell.get("value"), (int, float)) for cell in held.values()):
        found.append((Head("transient/volume", "transient", "transient", _when(_time(held), "")), held))
    last = measures.get("final", {})
    if any(isinstance(cell, Mapping) and "value" in cell for cell in last.values()):
        found.append((final(last), last))
    return found


def _time(entry: Mapping[str, Any]) -> float | None:
    cell = entry.get("time_s")
    value = cell.get("value") if isinstance(cell, Mapping) else None
    return None if value is None else float(value)


def _when(time: float | None, what: str) -> str:
    return ", ".join(part for part in (readable.clock(time) if time is not None else "", what) if part)
