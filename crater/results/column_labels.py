"""What a column of measures is of: the stage, the moment and the time, in the same words on the page, the terminal and
in comparisons.

A crater is *transient* at the first maximum of its volume, depth or diameter, and *final* only where it has come to
rest; anything else is the last snapshot, and its head says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from matter.wording import readable
from matter.wording.crater_measures import MAXIMA, MOMENTS

METHODS = {"sph": "SPH", "dem": "grains"}


class ColumnLabel(NamedTuple):
    """``key`` of the column (``transient/volume``, ``final``), its ``stage`` (transient or final), and two lines: what
    it is, and when."""

    key: str
    stage: str
    title: str
    when: str

    @property
    def line(self) -> str:
        """Both lines as one."""
        return f"{self.title}, {self.when}" if self.when else self.title


class Moment(NamedTuple):
    """One maximum of the transient crater: ``of`` volume, depth or diameter, ``time`` [s], stage (sph, dem), whether
    it still grows, and what was measured."""

    of: str
    time: float | None
    stage: str
    growing: bool
    measured: Any


def transient(moments: Sequence[str], time: float | None, stage: str, growing: Sequence[str] = ()) -> ColumnLabel:
    """Label of the transient crater at the maxima of ``moments`` (they may fall on one snapshot); ``growing``: those
    of them that still grow at the end."""
    title = f"last snapshot, {_listed(growing)} still growing" if growing else f"transient, maximum {_listed(moments)}"
    return ColumnLabel(f"transient/{moments[0]}", "transient", title, when(time, METHODS.get(stage, stage)))


def _listed(names: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(names[:-1]), names[-1]) if part)


def final(entry: Mapping[str, Any]) -> ColumnLabel:
    """Label of the ``final`` entry of ``measures.json``: *final* where it is settled (or the file is too old to say),
    else the last snapshot and its state."""
    title = (
        "final" if entry.get("settled", True) else f"last snapshot, {entry.get('state', 'not known to be at rest')}"
    )
    return ColumnLabel("final", "final", title, when(_time(entry), str(entry.get("from", ""))))


def when(time: float | None, what: str) -> str:
    """Time and what it is of: ``7.0 min, SPH``."""
    return ", ".join(part for part in (readable.clock(time) if time is not None else "", what) if part)


def arranged(moments: Sequence[Moment], end: float | None = None) -> list[tuple[ColumnLabel, Any]]:
    """Columns of the transient crater: maxima that fall on one snapshot share one; what still grows at the time
    ``end`` [s] of the last column has none."""
    groups: dict[float | None, list[Moment]] = {}
    for moment in moments:
        groups.setdefault(moment.time, []).append(moment)
    labels = []
    for time, group in groups.items():
        growing = [moment.of for moment in group if moment.growing]
        if len(growing) == len(group) and time is not None and time == end:
            continue
        labels.append((transient([moment.of for moment in group], time, group[0].stage, growing), group[0].measured))
    return labels


def columns(
    measures: Mapping[str, Any], moments: tuple[str, ...] = MOMENTS
) -> list[tuple[ColumnLabel, Mapping[str, Any]]]:
    """Heads and entries of ``measures.json`` for these ``moments`` and the final crater."""
    held, last = measures.get("transient", {}), measures.get("final", {})
    seen = []
    for name in moments:
        entry = held.get(f"at_maximum_{name}")
        if isinstance(entry, Mapping) and _exists(entry.get(MAXIMA[name])):
            seen.append(Moment(name, _time(entry), str(entry.get("stage", "")), bool(entry.get("growing")), entry))
    has_last = any(isinstance(cell, Mapping) and "value" in cell for cell in last.values())
    labels = arranged(seen, _time(last) if has_last else None)
    if not seen and any(
        isinstance(cell, Mapping) and isinstance(cell.get("value"), (int, float)) for cell in held.values()
    ):
        labels.append((ColumnLabel("transient/volume", "transient", "transient", when(_time(held), "")), held))
    return [*labels, (final(last), last)] if has_last else labels


def _exists(cell: Any) -> bool:
    """Whether a measure has a value above zero, or is not in the file: a trough that looks widest has none."""
    return not isinstance(cell, Mapping) or (cell.get("value") or 0.0) > 0.0


def _time(entry: Mapping[str, Any]) -> float | None:
    cell = entry.get("time_s")
    value = cell.get("value") if isinstance(cell, Mapping) else None
    return None if value is None else float(value)
