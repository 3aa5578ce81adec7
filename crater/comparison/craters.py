"""Craters to be compared: what a run folder, a profile or an observation holds, and which of a run's craters is like
the others.

A run holds several: transient at the maxima of volume, depth and diameter, and final. An observation says of which
kind it is; a run is set against it by the crater of that kind, taken at the moment that the observation names
(``at``), else at the maximum of volume.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from crater.comparison import observations
from crater.ground import radial_profile
from crater.ground.datum import Datum
from crater.ground.radial_profile import Profile
from crater.results import column_labels, measurement_config
from matter.errors import InputError
from matter.files import archive
from matter.wording.crater_measures import COMPARED, MOMENTS

STAGES = ("transient", "final")
STAGE_OF_KIND = {"transient": "transient", "final": "final", "laboratory": "final", "zones": "final", "trend": "final"}
"""The stage of a crater that an observation of a kind is of."""
PROFILES = {
    "final": "profile.csv",
    "transient/volume": "profile_transient.csv",
    "transient/depth": "profile_transient_depth.csv",
}
"""Files of a run's crater stage that hold the profiles of its craters."""
Values = dict[str, tuple[float, float, float]]


@dataclass
class Crater:
    """One crater of a comparison: ``values`` maps a measure to (value, minus, plus) [SI], NaN where no error is known;
    ``profile`` may be missing.

    ``stage`` is transient, final or empty where nobody says; ``at`` the maximum at which a transient one is taken;
    ``title`` and ``when`` say it for people. ``snapshot`` and ``datum`` (axis through the crater) are known for
    craters of runs.
    """

    name: str
    values: Values
    profile: Profile | None
    source: str = ""
    notes: list[str] = field(default_factory=list)
    zones: tuple[observations.Zone, ...] = ()
    stage: str = ""
    at: str = ""
    title: str = ""
    when: str = ""
    snapshot: Path | None = None
    datum: Datum | None = None

    @property
    def label(self) -> str:
        """Name and stage, for legends and headers; a name that says the stage is only told the moment."""
        title = (
            self.title.removeprefix(self.stage).strip(", ")
            if self.stage and self.stage in self.name.lower()
            else self.title
        )
        return self.name if not title or title in self.name else f"{self.name}: {title}"


@dataclass
class Item:
    """What one argument of a comparison holds: the craters of a run (``is_run``), or the one of a profile or an
    observation."""

    text: str
    craters: list[Crater]
    is_run: bool = False
    reasons: Mapping[str, str] = field(default_factory=dict)

    def crater(self, stage: str, at: str = "") -> Crater | None:
        """The crater of a stage, at the maximum ``at`` of a transient one (its volume where ``at`` is empty or not
        held)."""
        mine = [crater for crater in self.craters if crater.stage == stage]
        return next((crater for crater in mine if crater.at == at), mine[0] if mine else None)


def load(item: str, stage: str | None = None) -> Crater:
    """One crater by run folder, ``6_crater`` folder, profile CSV, observation file (TOML) or the name of an
    observation that ships with the project.

    Of a run its ``stage``, by default the final crater. Raises ``InputError`` saying what was looked for, or that the
    run holds no crater of that stage.
    """
    held = holdings(item)
    if not held.is_run:
        return held.craters[0]
    return _demanded(held, stage, "") if stage else held.crater("final") or held.craters[0]


def holdings(item: str) -> Item:
    """Everything that an argument of a comparison holds; raises ``InputError`` saying what was looked for."""
    path = Path(item)
    if path.is_dir():
        folder = path / "6_crater" if (path / "6_crater").is_dir() else path
        if not (folder / "measures.json").is_file():
            raise InputError(
                f"{item} holds no measured crater (no 6_crater/measures.json): run the stage 'crater' first"
            )
        return _of_run(item, path if folder != path else _run_of(folder), folder)
    if path.is_file() and path.suffix == ".toml":
        return Item(item, [_of_observation(observations.read(path))])
    if path.is_file():
        return Item(item, [_of_file(path)])
    if item in observations.names():
        return Item(item, [_of_observation(observations.load(item))])
    raise InputError(
        f"{item!r} is neither a run folder, nor a profile, nor an observation (known: "
        f"{', '.join(observations.names())})"
    )


def chosen(items: Sequence[Item], stage: str | None = None) -> tuple[list[Crater], str]:
    """The craters to compare, like with like, and a sentence on how they were chosen (empty where there was nothing to
    choose).

    ``stage`` chooses for every run. Else the observations and profiles decide, each run showing one crater for every
    kind among them; else the final craters where every run has one, else the transient ones. Raises ``InputError`` for
    a run without a crater of the chosen ``stage``.
    """
    if stage is not None and stage not in STAGES:
        raise InputError(f"--stage {stage!r} is not known: take transient or final")
    others = [crater for item in items if not item.is_run for crater in item.craters if crater.stage]
    runs = [item for item in items if item.is_run]
    if stage is not None:
        at = next((crater.at for crater in others if crater.stage == stage and crater.at), "")
        wanted, said = [(stage, at)], f"--stage {stage}: of every run its {stage} crater"
    elif others:
        wanted = list(dict.fromkeys((crater.stage, crater.at) for crater in others))
        said = "of every run the crater of the stage that it is compared with"
    else:
        common = [name for name in ("final", "transient") if all(item.crater(name) for item in runs)]
        wanted = [(common[0], "")] if common else []
        said = (
            f"{common[0]} with {common[0]}: every run has one"
            if common
            else "no stage is common to all runs: each shows what it has, without ratios"
        )
    picked: list[Crater] = []
    for item in items:
        if not item.is_run:
            picked += item.craters
        elif stage is not None:
            picked.append(_demanded(item, *wanted[0]))
        else:
            picked += _matching(item, wanted)
    return picked, said if runs else ""


def _demanded(item: Item, stage: str, at: str) -> Crater:
    demanded = item.crater(stage, at)
    if demanded is None:
        why = item.reasons.get(stage, "")
        have = ", ".join(dict.fromkeys(crater.stage for crater in item.craters)) or "none"
        raise InputError(f"{item.text} holds no {stage} crater{f' ({why})' if why else ''}; it has: {have}")
    return demanded


def _matching(item: Item, wanted: Sequence[tuple[str, str]]) -> list[Crater]:
    craters: list[Crater] = []
    for stage, at in wanted:
        crater = item.crater(stage, at)
        if crater is not None and crater not in craters:
            craters.append(crater)
    if not craters:
        craters = [item.crater("final") or item.craters[0]]
        missing = " or ".join(dict.fromkeys(stage for stage, _ in wanted))
        if missing:
            craters[0].notes.append(f"this run holds no {missing} crater; what it has is shown without ratios")
    return craters


def reference_of(crater: Crater, craters: Sequence[Crater]) -> Crater | None:
    """The first crater that ``crater`` may be set against: of its stage, or where one of the two does not say its
    stage; None for the first itself."""
    first = next(other for other in craters if not other.stage or not crater.stage or other.stage == crater.stage)
    return None if first is crater else first


def _of_observation(known: observations.Observation) -> Crater:
    stage = STAGE_OF_KIND.get(known.kind, "")
    title = f"transient, maximum {known.at}" if stage == "transient" and known.at else known.kind
    return Crater(
        known.title, known.values, known.profile, known.source, [known.note] if known.note else [], known.zones,
        stage=stage, at=known.at, title=title, when="as published",
    )  # fmt: skip


def _run_of(folder: Path) -> Path:
    named = Path(os.path.abspath(folder))  # not resolved: a run's stages may be links to where they lie
    return named.parent if named.name == "6_crater" else folder


def _of_run(item: str, run: Path, folder: Path) -> Item:
    content = archive.read_json(folder / "measures.json")
    if content.get("single_snapshot"):
        return Item(item, [_single(run, folder, content["final"])])
    craters = []
    for label, entry in _separate(content):
        crater = Crater(
            run.resolve().name,
            values_of(entry),
            _profile(folder, label.key),
            str(folder),
            stage=label.stage,
            title=label.title,
            when=label.when,
        )
        crater.at = label.key.partition("/")[2]
        _add_site(crater, run, entry)
        if label.stage == "final" and "diameter_apparent_m" not in crater.values:
            crater.notes.append(f"no final diameter: {_reason(entry)}")
        if label.stage == "final" and entry.get("settled") is False:
            crater.notes.append(f"not at rest: {entry.get('settled_reason', '')}")
        if crater.profile is None and label.key in PROFILES:
            crater.notes.append(f"no {PROFILES[label.key]} in {folder.name}: 'run_case ... --from crater' makes it")
        craters.append(crater)
    reasons = {stage: _reason(content.get(stage, {})) for stage in STAGES}
    if not craters:
        raise InputError(
            f"{item} holds no measured crater: "
            f"{'; '.join(reason for reason in reasons.values() if reason) or 'measures.json is empty'}"
        )
    return Item(item, craters, True, reasons)


def _separate(content: Mapping[str, Any]) -> list[tuple[column_labels.ColumnLabel, Mapping[str, Any]]]:
    """Heads and entries of every crater of a run, each transient moment by itself, at the maximum of volume first."""
    columns: dict[str, tuple[column_labels.ColumnLabel, Mapping[str, Any]]] = {}
    for moment in MOMENTS:
        for label, entry in column_labels.columns(content, (moment,)):
            columns.setdefault(label.key, (label, entry))
    return sorted(columns.values(), key=lambda pair: pair[0].stage == "final")


def _profile(folder: Path, key: str) -> Profile | None:
    path = folder / PROFILES.get(key, "")
    return radial_profile.read_csv(path) if path.is_file() else None


def _add_site(crater: Crater, run: Path, entry: Mapping[str, Any]) -> None:
    """Snapshot and datum of a run's crater, where its measures name them."""
    if isinstance(entry.get("datum"), Mapping):
        crater.datum = measurement_config.datum_of(entry["datum"])
    named = [entry["snapshot"]] if "snapshot" in entry else ["5_dem/last.vtkhdf", "2_sph/last.vtkhdf"]
    crater.snapshot = next((run / name for name in named if (run / name).is_file()), None)


def _reason(entry: Mapping[str, Any]) -> str:
    cell = entry.get("diameter_apparent_m")
    return str((cell.get("reason") if isinstance(cell, Mapping) else None) or entry.get("reason", ""))


def values_of(entry: Mapping[str, Any]) -> Values:
    """The measures of one crater as (value, minus, plus) [SI]; NaN for an error that is not stated."""
    values: Values = {}
    for name in COMPARED:
        cell = entry.get(name)
        if isinstance(cell, Mapping) and isinstance(cell.get("value"), (int, float)):
            sigma = float(cell["sigma"]) if isinstance(cell.get("sigma"), (int, float)) else math.nan
            values[name] = (float(cell["value"]), sigma, sigma)
    return values


def _single(run: Path, folder: Path, entry: Mapping[str, Any]) -> Crater:
    label = column_labels.final(entry)
    crater = Crater(
        run.resolve().name,
        values_of(entry),
        _profile(folder, "final"),
        str(folder),
        title="one snapshot",
        when=label.when,
    )
    _add_site(crater, run, entry)
    return crater


def _of_file(path: Path) -> Crater:
    """A profile: one of a run's own with the run's numbers, or any other with what can be read off its points."""
    keys = {name: key for key, name in PROFILES.items()}
    measures = path.parent / "measures.json"
    if path.name in keys and measures.is_file():
        item = _of_run(str(path), _run_of(path.parent), path.parent)
        stage, _, at = keys[path.name].partition("/")
        if not item.is_run:
            return item.craters[0]
        crater_of_run = next((crater for crater in item.craters if (crater.stage, crater.at) == (stage, at)), None)
        if crater_of_run is not None:
            return crater_of_run
    return _of_profile(path)


def _of_profile(path: Path) -> Crater:
    from crater.measures.profile_measures import measure_profile

    profile = radial_profile.read_csv(path)
    values: Values = {}
    for name, cell in measure_profile(profile).items():
        if cell.value is not None:
            sigma = cell.sigma if cell.sigma is not None else math.nan
            values[name] = (cell.value, sigma, sigma)
    stage = profile.header.get("stage", "")
    if stage not in ("", *STAGES):
        raise InputError(f"{path}: '# stage = {stage}' is not known: transient or final")
    name = path.stem if path.stem != "profile" else f"{path.parent.name}/{path.stem}"
    return Crater(
        name,
        values,
        profile,
        str(path),
        stage=stage,
        title=profile.header.get("of", stage or "profile, stage not stated"),
        when="read off its points",
    )
