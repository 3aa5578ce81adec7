"""Case files: ``case.toml`` read, overlaid, and composed into the settings of each stage, with all complaints at once.

Tables: ``[case]`` (title, source, stages), ``[target]`` with ``[[target.layers]]``, ``[impact]`` with ``[impact.projectile]``, and one table per
stage (``[nbody] [sph] [bed] [handoff] [dem] [crater]``). ``[preset.<name>.<table>]`` holds values that ``--preset <name>`` lays over them;
without the option the preset ``thesis`` is taken where the case has one. A stage's settings receive their own table and, where they
declare a field of that name, the shared ``target``, ``impact`` and ``contact`` (``[dem.contact]``).
"""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, ValidationError, field_validator

from matter.body import Impact, Model, Target
from matter.errors import InputError
from pipeline import bibliography, outside, overlay, sizes, stages, toml_lines
from pipeline.complaints import Complaint, complaints, dotted, unknown
from pipeline.left_open import FROM_ENCOUNTERS, completed
from pipeline.plain import plain
from pipeline.toml_lines import KeyPath

DEFAULT_PRESET = "thesis"
UNITS = {"units": "required"}
# filled in where the rest is in order (``pipeline.left_open``)
FOLLOWS = (("impact", "expected_transient_diameter"), ("target", "layers", 0, "thickness"), ("target", "layers", 0, "name"))
# a file from elsewhere in place of what a stage would have made
OUTSIDE = {"nbody": "impact", "sph": "snapshot", "bed": "snapshot", "dem": "snapshot"}


class CaseTable(Model):
    """What the case is."""

    title: str
    """Title of the case, on top of its pages."""
    source: str = ""
    """The publication whose numbers the case takes, in words."""
    sources: tuple[str, ...] = ()
    """Keys of the bibliography (``pipeline/references.bib``) that a run of this case cites besides those of its laws and materials."""
    stages: Annotated[tuple[Literal["nbody", "sph", "bed", "handoff", "dem", "crater"], ...], Field(min_length=1)] = (
        "nbody", "sph", "bed", "handoff", "dem", "crater",
    )  # fmt: skip
    """The stages that this case has. By default ``nbody`` where the case has its table or leaves speed or angle to it, ``sph``, then ``bed``, ``handoff`` and
    ``dem`` where there is weight and strength does not hold the crater, ``crater``."""

    @field_validator("sources")
    @classmethod
    def _known(cls, keys: tuple[str, ...]) -> tuple[str, ...]:
        if fault := bibliography.fault(keys):
            raise ValueError(fault)
        return keys


@dataclass(frozen=True)
class Case:
    """A case after its overlays; ``document`` is the composed TOML without the presets, with what it leaves open (``pipeline.left_open``), of which ``filled``
    depends on the impact. ``run``: the run folder that goes on with it, where there is one."""

    file: Path
    name: str
    preset: str | None
    overrides: tuple[str, ...]
    document: dict[str, Any]
    outside: dict[str, Path]
    lines: dict[KeyPath, int] = field(repr=False)
    preset_table: dict[str, Any] = field(repr=False)
    found: tuple[Complaint, ...] = ()
    chain: bool = True
    """Whether the crater stage gets the chain errors of the case's ``expected.toml``."""
    run: Path | None = None
    filled: tuple[KeyPath, ...] = ()
    size: str | None = None

    @property
    def title(self) -> str:
        table = self.document.get("case", {})
        return str(table.get("title", self.name)) if isinstance(table, dict) else self.name

    @property
    def stages(self) -> tuple[str, ...]:
        """The stages that this case has, in their order."""
        table = self.document.get("case", {})
        named = table.get("stages", stages.ORDER) if isinstance(table, dict) else stages.ORDER
        return tuple(stage for stage in stages.ORDER if isinstance(named, list | tuple) and stage in named)

    @property
    def sources(self) -> tuple[str, ...]:
        """Keys of the bibliography that the case names."""
        table = self.document.get("case", {})
        return tuple(table.get("sources", ())) if isinstance(table, dict) else ()

    @property
    def hash8(self) -> str:
        """Eight digits that name the run folder: composed case without its citations, preset, overrides."""
        table = self.document.get("case")
        named = {key: value for key, value in table.items() if key != "sources"} if isinstance(table, dict) else table
        document = {**self.document, "case": named} if "case" in self.document else self.document
        content = json.dumps([document, self.preset, self.overrides], sort_keys=True, default=str)
        return hashlib.sha256(content.encode()).hexdigest()[:8]

    @property
    def pinned(self) -> bool:
        """Whether the case itself says how the projectile hits."""
        impact = self.document.get("impact")
        return not isinstance(impact, dict) or all(key in impact for key in FROM_ENCOUNTERS)

    def origin(self, path: KeyPath) -> str:
        """Where the value at ``path`` came from: an option of the command or a line of the file."""
        for assignment in self.overrides:
            try:
                key = tuple(str(part) for part in overlay.parsed(assignment)[0])
            except InputError:
                continue
            if tuple(map(str, path))[: len(key)] == key:
                return f"--set {dotted(key)}"
        if _contains(self.preset_table, path):
            path = ("preset", self.preset or "", *path)
        line = toml_lines.line_of(path, self.lines)
        return f"{self.file.name}:{line}" if line else self.file.name


def _contains(table: Any, path: KeyPath) -> bool:
    for part in path:
        try:
            table = table[part]
        except (KeyError, IndexError, TypeError):
            return False
    return bool(path)


def read(where: Path, preset: str | None = None, overrides: Iterable[str] = (), size: str | None = None) -> Case:
    """Read a case: a folder with ``case.toml``, or the file itself; ``size`` takes the place of its resolution (``pipeline.sizes``).

    Complaints about overlays and files from elsewhere are kept in the case, for ``compose`` to report with the others. Raises
    ``InputError`` when there is no such file, it is not TOML, or it has no preset of that name.
    """
    where = Path(where)
    file = where / "case.toml" if where.is_dir() else where
    if not file.is_file():
        raise InputError(f"no case at {where}: give a folder that holds case.toml, or the file itself")
    try:
        text = file.read_text()
        content = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as reason:
        raise InputError(f"{file} is not valid TOML: {reason}") from None
    presets = content.pop("preset", {})
    if not isinstance(presets, dict) or not all(isinstance(table, dict) for table in presets.values()):
        raise InputError(f"{file}: presets are tables, [preset.quick.sph] for example")
    if size is not None and preset is not None:
        raise InputError(f"--size {size} and --preset {preset} both say how fine the run is: give one of them")
    if preset is None and size is None:
        preset = DEFAULT_PRESET if DEFAULT_PRESET in presets else None
    elif preset is not None and preset not in presets:
        known = f"it has {', '.join(sorted(presets))}" if presets else "it has none"
        raise InputError(f"{file} has no preset {preset!r}{stages.nearest(preset, list(presets))} ({known})")
    table = presets.get(preset, {}) if preset else {}
    document, found = _without_left_out(overlay.merged(content, table), table), []
    if size is not None:
        document = sizes.laid(document, size)
    for assignment in overrides:
        try:
            document = overlay.assigned(document, *overlay.parsed(assignment))
        except InputError as reason:
            found.append(Complaint((), str(reason)))
    name = file.resolve().parent.name if file.name == "case.toml" else file.stem
    case = Case(file, name, preset, tuple(overrides), document, {}, toml_lines.key_lines(text), table, tuple(found), size=size)
    return _completed(_outside_taken(case))


def _completed(case: Case) -> Case:
    """The case with what it leaves open."""
    document, filled, found = completed(case.document, case.name)
    if case.size and "bed" in document["case"].get("stages", ()):
        document["bed"] = {sizes.NUMBER["bed"]: sizes.SIZES[case.size], **document.get("bed", {})}
    return replace(case, document=document, filled=(*case.filled, *filled), found=(*case.found, *found))


def _opened(document: dict[str, Any], paths: Iterable[KeyPath]) -> dict[str, Any]:
    """The document without what was filled in."""
    document = json.loads(json.dumps(document, default=str))
    for path in paths:
        table: Any = document
        for part in path[:-1]:
            table = table[part]
        table.pop(path[-1], None)
    return document


def _without_left_out(document: dict[str, Any], preset: dict[str, Any]) -> dict[str, Any]:
    """The document without the case's own tables of stages that its preset leaves out (``[preset.shock.case] stages = ["sph"]``)."""
    table = preset.get("case", {})
    named = table.get("stages") if isinstance(table, dict) else None
    if not isinstance(named, list):
        return document
    return {name: content for name, content in document.items() if name not in stages.ORDER or name in named or name in preset}


def _outside_taken(case: Case) -> Case:
    """Take the files from elsewhere out of the stages' tables; a relative path starts at the case (``--set``: at the current folder)."""
    document, outside, found = dict(case.document), {}, list(case.found)
    for stage, key in OUTSIDE.items():
        table = document.get(stage)
        if not isinstance(table, dict) or not isinstance(table.get(key), str):
            continue
        document[stage] = {name: value for name, value in table.items() if name != key}
        base = Path() if case.origin((stage, key)).startswith("--set") else case.file.parent
        path = base / Path(table[key]).expanduser()
        if not path.is_file():
            found.append(Complaint((stage, key), f"no file at {path}"))
        outside[stage] = path
    case = replace(case, document=document, outside=outside, found=tuple(found))
    return with_impact(case, outside["nbody"]) if "nbody" in outside and outside["nbody"].is_file() else case


def with_impact(case: Case, file: Path) -> Case:
    """The case with speed, angle and projectile of an ``impact.toml``: from then on that file is the one truth about the impact.

    The encounters' stage has written the values there that ``[impact]`` pins; a file from elsewhere replaces them.
    """
    try:
        content = tomllib.loads(file.read_text())
    except tomllib.TOMLDecodeError as reason:
        raise InputError(f"{file} is not valid TOML: {reason}") from None
    given = {key: content[key] for key in (*FROM_ENCOUNTERS, "projectile") if key in content}
    document = _opened(case.document, case.filled) if case.filled else case.document
    own = document.get("impact", {})
    changed = replace(case, document={**document, "impact": overlay.merged(own if isinstance(own, dict) else {}, given)}, filled=())
    return _completed(changed) if case.filled else changed


def compose(case: Case, wanted: Iterable[str] = stages.ORDER) -> dict[str, Model]:
    """The settings of every stage whose module exists, by its name.

    ``wanted`` are the stages that are to run: a missing module is an error for these only. Raises ``InputError`` with every complaint.
    """
    wanted = tuple(wanted)
    settings, found = _composed(case, wanted)
    if found:
        raise InputError(listed(case, found, wanted))
    return settings


def _composed(case: Case, wanted: tuple[str, ...]) -> tuple[dict[str, Model], list[Complaint]]:
    """The settings that are right, and every complaint."""
    settings: dict[str, Model] = {}
    found = list(case.found)
    document = case.document
    if not case.pinned:
        document = {**document, "impact": {**FROM_ENCOUNTERS, **document["impact"]}}
    found += _tables(document)
    found += _checked(CaseTable, document.get("case", {}), ("case",))[1]
    shared = {name: document[name] for name in stages.SHARED_TABLES if name in document}
    for name, model in (("target", Target), ("impact", Impact)):
        if name in shared:
            found += _checked(model, shared[name], (name,))[1]
    if not any(complaint.path[:2] == ("case", "stages") for complaint in found):  # a stage's name that is misspelt is one mistake
        idle = [stage for stage in stages.ORDER if stage in document and stage not in case.stages]
        found += [Complaint((stage,), f"[case] stages does not include {stage}") for stage in idle]
    found += outside.faults(case.outside, OUTSIDE)
    for stage in case.stages:
        try:
            model = stages.load(stage).Settings
        except InputError as reason:
            if stage in wanted and stage not in case.outside:
                found.append(Complaint((stage,), str(reason)))
            continue
        table = document.get(stage, {})
        if not isinstance(table, dict):
            continue  # already complained about
        payload, moved = _payload(model, table, shared, document)
        if stage == "crater" and case.chain and "chain" in model.model_fields and "chain" not in payload:
            from pipeline import expected  # it composes cases itself

            payload |= {"chain": errors} if (errors := expected.chain_of(case)) else {}
        if "pinned" in model.model_fields:
            payload.setdefault("pinned", case.pinned)
        made, wrong = _checked(model, payload, (stage,), moved)
        if stage in case.outside:  # it will not run: misspelt keys still count, missing ones do not
            wrong = [complaint for complaint in wrong if complaint.message != "is missing"]
        found += wrong
        if made is not None:
            settings[stage] = made
    return settings, _causes(found)


def _causes(found: list[Complaint]) -> list[Complaint]:
    """The complaints without those that follow from others: what could not be filled in is no second mistake."""
    first = [complaint for complaint in found if not (complaint.message == "is missing" and complaint.path in FOLLOWS)]
    return first or found


def _tables(document: dict[str, Any]) -> list[Complaint]:
    valid = ["case", *stages.SHARED_TABLES, *stages.ORDER, "preset"]
    found = []
    for name, value in document.items():
        if name not in valid:
            found.append(Complaint((name,), unknown(name, valid, "table")))
        elif not isinstance(value, dict):
            found.append(Complaint((name,), f"is a table: write [{name}]"))
    return found


def _payload(model: type[BaseModel], table: dict[str, Any], shared: dict[str, Any], document: dict[str, Any]) -> tuple[dict[str, Any], dict[str, KeyPath]]:
    """A stage's own table with the shared tables that its settings declare, and where those stand in the document."""
    payload, moved = dict(table), dict[str, KeyPath]()
    for name in stages.SHARED_TABLES:
        if name in model.model_fields and name in shared and name not in table:
            payload[name], moved[name] = shared[name], (name,)
    dem = document.get("dem")
    if "contact" in model.model_fields and "contact" not in table and isinstance(dem, dict) and "contact" in dem:
        payload["contact"], moved["contact"] = dem["contact"], ("dem", "contact")
    for name, field_info in model.model_fields.items():
        # a table that gives some keys of a field changes these keys of its default, not the others
        if isinstance(field_info.default, BaseModel) and isinstance(payload.get(name), dict):
            payload[name] = overlay.merged(plain(field_info.default), payload[name])
    return payload, moved


def _checked(model: type[Model], payload: Any, place: KeyPath, moved: dict[str, KeyPath] | None = None) -> tuple[Model | None, list[Complaint]]:
    try:
        return model.model_validate(payload, context=UNITS), []
    except ValidationError as error:
        found = []
        for path, message in complaints(model, error):
            first = path[0] if path else None
            origin = moved[str(first)] if moved and first in moved else (*place, *path[:1])
            if message == "is missing" and len(path) == 1 and first in stages.SHARED_TABLES:
                origin = (str(first),)
            found.append(Complaint((*origin, *path[1:]), message))
        return None, found


def listed(case: Case, found: list[Complaint], wanted: tuple[str, ...]) -> str:
    """All complaints in the order of the file, then those about options; those of composing for the ``wanted`` stages blame an option that causes them."""
    rows = []
    found = list(dict.fromkeys(found))
    blamed = _blamed(case, found, wanted) if wanted else {}
    for complaint in found:
        path, message = complaint
        origin = blamed.get(complaint) or (case.origin(path) if path else "")
        line = origin.rpartition(":")[2]
        rows.append((int(line) if line.isdigit() else 10**9, f"  {origin}  {dotted(path)}: {message}" if path else f"  {message}"))
    rows.sort(key=lambda row: row[0])
    return f"{case.file} cannot be used, {len(rows)} error{'s' if len(rows) > 1 else ''}:\n" + "\n".join(text for _, text in rows)


def _blamed(case: Case, found: list[Complaint], wanted: tuple[str, ...]) -> dict[Complaint, str]:
    """The options at fault for complaints about other places: those without which a complaint would not be there."""
    blamed: dict[Complaint, str] = {}
    for number, assignment in enumerate(case.overrides):
        try:
            key = overlay.parsed(assignment)[0]
            without = _composed(read(case.file, case.preset, case.overrides[:number] + case.overrides[number + 1 :], case.size), wanted)[1]
        except InputError:
            continue  # that option has a complaint of its own
        for complaint in found:
            if complaint.path and complaint not in without:
                blamed[complaint] = f"{blamed[complaint]}, --set {dotted(key)}" if complaint in blamed else f"--set {dotted(key)}"
    return blamed
