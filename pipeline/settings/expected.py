"""``expected.toml`` beside a shipped case: what each preset came to, with which errors, measured how, and whether a
run agrees.

One table per preset, in it one per crater (``transient``, at its largest volume; ``transient_at_maximum_depth``;
``final``) and measure:

    [quick]
    command = "run_case cases/valhalla_980km --preset quick --errors"
    commit = "..."
    ...
    [quick.final.diameter_apparent_m]
    value = "553 km"        # mean over the draws
    measuring = "14 km"     # how well one run's crater can be read off
    draws = "16 km"         # standard deviation over draws of particles and grains
    handoff = "40 km"       # by handing over half and twice as late
    alpha = "3 km"          # by two thirds and one and a half of the handoff's alpha
    size = "10 km"          # by a ladder of coarser runs

The last four are the parts of the chain error (``crater.chain``); what was not measured is left out.
``studies/chain_error.py`` writes the file. A run is held against it only where the values that decide its
result are those of the shipped case and preset.
"""

from __future__ import annotations

import json
import math
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar

from pydantic import Field, ValidationError, field_validator, model_validator

from crater.measures.chain import PARTS
from crater.settings import of_each_measure
from matter.case.body import Model
from matter.case.identity_fields import identity_fields
from matter.case.quantity import REQUIRED
from matter.errors import InputError
from matter.files import toml_input
from matter.wording.crater_measures import BY_NAME, COMPARED, UNITS
from pipeline.case import read as cases
from pipeline.case import stages, toml_lines
from pipeline.case.complaints import complaints, dotted
from pipeline.settings import checking
from pipeline.store import folder

FILE = "expected.toml"
NO_PRESET = "case"
"""Name of the table of a case without presets."""
AGREES = 2.0
"""A run agrees with what is expected within this many standard errors."""
Q = TypeVar("Q")


class Expectation(Model, Generic[Q]):
    """One measure: its expected value and the parts of its error."""

    value: Q
    """Mean over the draws."""
    measuring: Q
    """How well one run's crater can be read off."""
    draws: Q | None = None
    """Standard deviation over draws of particles and grains."""
    handoff: Q | None = None
    """What an earlier and a later handoff change."""
    alpha: Q | None = None
    """What a smaller and a larger alpha of the handoff change."""
    size: Q | None = None
    """What the number of particles and grains changes."""

    @model_validator(mode="after")
    def _errors_have_a_size(self) -> Expectation:
        for name in ("measuring", *PARTS):
            if (error := getattr(self, name)) is not None and error < 0.0:
                raise ValueError(f"{name} is an error and must be at least 0")
        return self

    @property
    def chain(self) -> float | None:
        """The chain error: its parts in quadrature; None where none was measured."""
        parts = [getattr(self, name) for name in PARTS if getattr(self, name) is not None]
        return math.hypot(*parts) if parts else None


Crater = of_each_measure("Crater", "The expected measures of one crater.", lambda quantity, row: Expectation[quantity])  # type: ignore[valid-type]


class Preset(Model):
    """What one preset of a case came to."""

    command: str
    """The command that measured it."""
    commit: str
    """The commit of the program that measured it."""
    measured: str
    """The day on which it was measured."""
    members: Annotated[int, Field(ge=1)]
    """Number of draws of the grains."""
    shocks: Annotated[int, Field(ge=1)]
    """Number of draws of the shock stage among them."""
    transient: Crater = Crater()  # type: ignore[valid-type]
    """The transient crater at its largest volume."""
    transient_at_maximum_depth: Crater = Crater()  # type: ignore[valid-type]
    """The transient crater where it is deepest."""
    final: Crater = Crater()  # type: ignore[valid-type]
    """The final crater."""

    @field_validator("command", "commit", "measured")
    @classmethod
    def _said(cls, text: str) -> str:
        if not text.strip():
            raise ValueError("must not be empty")
        return text


CRATERS = ("transient", "transient_at_maximum_depth", "final")


@lru_cache(maxsize=8)
def _read(file: Path, stamp: int) -> dict[str, Preset]:
    text, content = toml_input.read(file)
    lines, faults, presets = toml_lines.key_lines(text), [], {}
    for name, table in content.items():
        try:
            presets[name] = Preset.model_validate(table, context=REQUIRED)
        except ValidationError as error:
            for path, message in complaints(Preset, error):
                line = toml_lines.line_of((name, *path), lines)
                faults.append(f"  {file.name}{f':{line}' if line else ''}  {dotted((name, *path))}: {message}")
    if faults:
        raise InputError(
            f"{file} cannot be used, {len(faults)} error{'s' if len(faults) > 1 else ''}:\n" + "\n".join(faults)
        )
    return presets


def read(case_folder: Path) -> dict[str, Preset]:
    """The expectations beside a case, by preset; empty where there is no file. Raises ``InputError`` with every
    mistake and its line."""
    file = Path(case_folder) / FILE
    return _read(file, file.stat().st_mtime_ns) if file.is_file() else {}


def _shipped(case: cases.Case) -> tuple[Path, str | None] | None:
    """File and preset of the shipped case behind ``case``; of a run that goes on those that it was begun with. None
    where there is no such file."""
    file, preset = case.file, case.preset
    if case.run is not None:
        begun = folder.record(case.run / "provenance.json").get("case", {})
        file, preset = Path(str(begun.get("file", ""))), begun.get("preset")
    return (file, preset) if file.name == "case.toml" and file.is_file() else None


def expected_result(case: cases.Case) -> Preset | None:
    """What is expected of a case with its preset; None where nothing is. Raises ``InputError``."""
    shipped = _shipped(case)
    return read(shipped[0].parent).get(shipped[1] or NO_PRESET) if shipped is not None else None


def as_shipped(case: cases.Case) -> bool:
    """Whether the values that decide a result are those of the case's file and preset: nothing from elsewhere, no
    ``--set`` that changes one."""
    shipped = _shipped(case)
    if case.outside or shipped is None:
        return False
    if case.run is None and not case.overrides:
        return True
    # what a run was begun with holds its chain error
    carried = {("crater", "chain")} if case.run is not None else set()
    try:
        return _identity_fields(cases.read(*shipped), carried) == _identity_fields(case, carried)
    except InputError:
        return False  # what is wrong with the case is said where it is composed


def _identity_fields(case: cases.Case, carried: set[tuple[str, str]]) -> dict[str, Any]:
    settings = checking.settings_of(case)
    return {
        stage: {key: value for key, value in identity_fields(one).items() if (stage, key) not in carried}
        for stage, one in settings.items()
    }


def chain_of(case: cases.Case) -> dict[str, Any]:
    """The chain errors that a case's measures are to carry, as the crater stage's table ``chain``; empty where none is
    known.

    A run that goes on keeps those that it was begun with.
    """
    expected = expected_result(case) if case.run is None else None
    if expected is None or not as_shipped(case):
        return {}
    table: dict[str, Any] = {}
    held = set()
    for crater in CRATERS:
        for name in COMPARED:
            entry = getattr(getattr(expected, crater), name)
            if entry is not None and entry.chain is not None:
                table.setdefault(crater, {})[name] = f"{entry.chain!r} {UNITS[name]}"
                held |= {part for part in PARTS if getattr(entry, part) is not None}
    return {**table, "holds": [part for part in PARTS if part in held]} if table else {}


class Verdict(Model):
    """A measure of a run beside what is expected of it [SI]."""

    crater: str
    measure: str
    value: float
    sigma: float
    expected: float
    deviation: float
    """Difference over ``sigma``."""

    @property
    def agrees(self) -> bool:
        """Whether they agree."""
        return abs(self.deviation) <= AGREES


def verdicts(expected: Preset, measures: dict[str, Any]) -> list[Verdict]:
    """Every expected measure that a run has (``values``); the error is that of one run about the mean: measuring and
    chain in quadrature."""
    rows = []
    for crater in CRATERS:
        mine = measures.get(crater, {})
        for name in COMPARED:
            entry, value = getattr(getattr(expected, crater), name), (mine.get(name) or {}).get("value")
            if entry is None or value is None:
                continue
            sigma = math.hypot(entry.measuring, entry.chain or 0.0)
            deviation = (value - entry.value) / sigma if sigma > 0.0 else (0.0 if value == entry.value else math.inf)
            rows.append(
                Verdict(
                    crater=crater, measure=name, value=value, sigma=sigma, expected=entry.value, deviation=deviation
                )
            )
    return rows


def _crater(measures: dict[str, Any], crater: str) -> dict[str, Any]:
    if crater == "transient_at_maximum_depth":
        return (measures.get("transient") or {}).get("at_maximum_depth") or {}
    return measures.get(crater) or {}


def values(run: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """The measures of a finished run by crater and name; empty where the crater was not measured."""
    path = stages.folder(run, "crater") / "measures.json"
    if not path.is_file():
        return {}
    measures = json.loads(path.read_text())
    return {
        crater: {name: _crater(measures, crater)[name] for name in COMPARED if name in _crater(measures, crater)}
        for crater in CRATERS
    }


_WORDS = {"transient": "transient", "transient_at_maximum_depth": "transient, where deepest", "final": "final"}


def _settled(run: Path) -> bool:
    """Whether the crater of the run's last snapshot had come to rest (``crater.results.rest``)."""
    measures = json.loads((stages.folder(run, "crater") / "measures.json").read_text())
    return bool((measures.get("final") or {}).get("settled", True))


def scale(measure: str, value: float) -> tuple[float, str]:
    """Factor from SI and the unit that a measure of such a size is written in: km for what is kilometres large, none
    for a ratio."""
    if UNITS[measure] == "1":
        return 1.0, ""
    if UNITS[measure] == "m^3":
        return (1e-9, "km^3") if value >= 1e8 else (1.0, "m^3")
    return (1e-3, "km") if value >= 2e3 else (1.0, "m")


def text(case: cases.Case, run: Path) -> str:
    """How a finished run stands against what is expected of its case and preset, a line per measure; empty where
    nothing is expected."""
    expected, measures = expected_result(case), values(run)
    if expected is None or not measures:
        return ""
    _, preset = _shipped(case) or (None, None)
    named = f"preset {preset} of {case.name}" if preset else case.name
    if not as_shipped(case):
        return f"not compared with {FILE}: the settings of this run are not those of {named}"
    lines = [f"against {FILE}, {named} ({expected.members} draws, commit {expected.commit[:8]}, {expected.measured}):"]
    words = {**_WORDS, "final": _WORDS["final"] if _settled(run) else "last snapshot (no final crater)"}
    for one in verdicts(expected, measures):
        factor, unit = scale(one.measure, one.expected)
        unit, name = f" {unit}".rstrip(), f"{words[one.crater]} {BY_NAME[one.measure].noun}"
        said = "agrees" if one.agrees else f"differs by {abs(one.deviation):.1f} sigma"
        lines.append(
            f"  {name:<44} {one.value * factor:.4g}{unit}, expected {one.expected * factor:.4g} +- "
            f"{one.sigma * factor:.2g}{unit}: {said}"
        )
    return "\n".join(lines)
