"""Case files: ``case.toml`` read and overlaid (``pipeline.settings.compose`` makes settings of it).

Tables: ``[case]`` (title, source, stages), ``[target]`` with ``[[target.layers]]``, ``[impact]`` with
``[impact.projectile]``, and one table per stage (``[nbody] [sph] [bed] [handoff] [dem] [crater]``).
``[preset.<name>.<table>]`` holds values that ``--preset <name>`` lays over them; without the option the preset
``thesis`` is taken where the case has one. A stage's settings receive their own table and, where they declare a field
of that name, the shared ``target``, ``impact`` and ``contact`` (``[dem.contact]``).
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from matter.errors import InputError
from matter.files import toml_input
from pipeline.case import overlay, shipped, sizes, stages, toml_lines
from pipeline.case.complaints import Complaint, dotted
from pipeline.case.left_open import FROM_ENCOUNTERS, completed
from pipeline.case.toml_lines import KeyPath

DEFAULT_PRESET = "thesis"


@dataclass(frozen=True)
class Case:
    """A case after its overlays; ``document`` is the composed TOML without the presets, with what it leaves open
    (``pipeline.case.left_open``), and ``before`` the same without what depends on the impact (None where nothing of it
    does). ``run``: the run folder that goes on with it, where there is one; ``sweep`` and ``inverse``: its tables of
    these names."""

    file: Path
    name: str
    preset: str | None
    overrides: tuple[str, ...]
    document: dict[str, Any]
    outside: dict[str, Path]
    lines: dict[KeyPath, int] = field(repr=False)
    preset_table: dict[str, Any] = field(repr=False)
    complaints: tuple[Complaint, ...] = ()
    run: Path | None = None
    before: dict[str, Any] | None = field(default=None, repr=False)
    size: str | None = None
    sweep: dict[str, Any] = field(default_factory=dict, repr=False)
    inverse: Any = field(default_factory=dict, repr=False)

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
    def holds_a_sweep_alone(self) -> bool:
        """Whether its file holds nothing but ``[sweep]``, and perhaps ``[inverse]``: not a case itself, but what is
        varied of others."""
        return not self.document and bool(self.sweep)

    @property
    def sources(self) -> tuple[str, ...]:
        """Keys of the bibliography that the case names."""
        table = self.document.get("case", {})
        return tuple(table.get("sources", ())) if isinstance(table, dict) else ()

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
    """Read a case: a folder with ``case.toml``, the file itself, or the name of a shipped case; ``size`` replaces
    its resolution (``pipeline.case.sizes``).

    Complaints about overlays and files from elsewhere are kept in the case, for ``pipeline.settings.compose`` to
    report with the others. Raises ``InputError`` when there is no such file, it is not TOML, or it has no preset of
    that name.
    """
    where = shipped.located(where)
    file = where / "case.toml" if where.is_dir() else where
    if not file.is_file():
        raise InputError(f"no case at {where}: give a folder that holds case.toml, or the file itself")
    text, content = toml_input.read(file)
    name = file.resolve().parent.name if file.name == "case.toml" else file.stem
    inverse, overrides = _inverse(content.pop("inverse", {}), overrides)
    if set(content) == {"sweep"} and isinstance(content["sweep"], dict):
        return Case(file, name, preset, overrides, {}, {}, {}, {}, size=size, sweep=content["sweep"], inverse=inverse)
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
    document, complaints, set_here = _without_left_out(overlay.merged(content, table), table), [], list[KeyPath]()
    if size is not None:
        document = sizes.at_size(document, size)
    for assignment in overrides:
        try:
            path, value = overlay.parsed(assignment)
            document = overlay.assigned(document, path, value)
            set_here.append(path)
        except InputError as reason:
            complaints.append(Complaint((), str(reason)))
    if ("case", "stages") in set_here:
        document = _without_left_out(document, {**{str(path[0]): {} for path in set_here}, "case": document["case"]})
    swept = document.pop("sweep", {})
    if not isinstance(swept, dict):
        raise InputError(f"{file}: sweep is a table: write [sweep]")
    case = Case(
        file, name, preset, overrides, document, {}, toml_lines.key_lines(text), table, tuple(complaints),
        size=size, sweep=swept, inverse=inverse,
    )  # fmt: skip
    return _completed(_outside_taken(_tables_placed(case)))


def _inverse(table: Any, overrides: Iterable[str]) -> tuple[Any, tuple[str, ...]]:
    """``[inverse]`` with the options that change it, and the other options: it is no setting of a run."""
    rest, content = [], {"inverse": table}
    for assignment in overrides:
        if assignment.startswith("inverse.") and isinstance(table, dict):
            content = overlay.assigned(content, *overlay.parsed(assignment))
        else:
            rest.append(assignment)
    return content["inverse"], tuple(rest)


def _completed(case: Case) -> Case:
    """The case with what it leaves open."""
    document, before, complaints = completed(case.document, case.name)
    if case.size and "bed" in document["case"].get("stages", ()):
        document["bed"] = {sizes.NUMBER["bed"]: sizes.SIZES[case.size], **document.get("bed", {})}
    return replace(case, document=document, before=before, complaints=(*case.complaints, *complaints))


def _without_left_out(document: dict[str, Any], preset: dict[str, Any]) -> dict[str, Any]:
    """The document without the case's own tables of stages that its preset, or an option, leaves out
    (``[preset.shock.case] stages = ["sph"]``, ``--set 'case.stages=["sph"]'``)."""
    table = preset.get("case", {})
    named = table.get("stages") if isinstance(table, dict) else None
    if not isinstance(named, list):
        return document
    return {
        name: content
        for name, content in document.items()
        if name not in stages.ORDER or name in named or name in preset
    }


def _tables_placed(case: Case) -> Case:
    """The case with the whole path of each table of an equation of state (``[sph.materials.NAME.table] file``) and of
    the target's surface (``[target] file``); a relative one starts at the case (``--set``: at the current folder)."""
    document = json.loads(json.dumps(case.document, default=str))
    target = document.get("target")
    surface = isinstance(target, dict) and isinstance(target.get("file"), str)
    if surface:
        target["file"] = _placed(case, ("target", "file"), target["file"])
    materials = document.get("sph", {}).get("materials") if isinstance(document.get("sph"), dict) else None
    for name, choice in materials.items() if isinstance(materials, dict) else ():
        table = choice.get("table") if isinstance(choice, dict) else None
        if isinstance(table, dict) and isinstance(table.get("file"), str):
            key = ("sph", "materials", name, "table", "file")
            table["file"] = _placed(case, key, table["file"])
    return replace(case, document=document) if isinstance(materials, dict) or surface else case


def _placed(case: Case, key: KeyPath, file: str) -> str:
    base = Path() if case.origin(key).startswith("--set") else case.file.parent
    return str((base / Path(file).expanduser()).resolve())


def _outside_taken(case: Case) -> Case:
    """Take the files from elsewhere out of the stages' tables; a relative path starts at the case (``--set``: at the
    current folder)."""
    document, outside, complaints = dict(case.document), {}, list(case.complaints)
    for stage, key in stages.OUTSIDE.items():
        table = document.get(stage)
        if not isinstance(table, dict) or not isinstance(table.get(key), str):
            continue
        document[stage] = {name: value for name, value in table.items() if name != key}
        base = Path() if case.origin((stage, key)).startswith("--set") else case.file.parent
        path = base / Path(table[key]).expanduser()
        if not path.is_file():
            complaints.append(Complaint((stage, key), f"no file at {path}"))
        outside[stage] = path
    case = replace(case, document=document, outside=outside, complaints=tuple(complaints))
    return with_impact(case, outside["nbody"]) if "nbody" in outside and outside["nbody"].is_file() else case


def with_impact(case: Case, file: Path) -> Case:
    """The case with speed, angle and projectile of an ``impact.toml``: from then on that file is the one truth about
    the impact.

    The encounters' stage has written the values there that ``[impact]`` pins; a file from elsewhere replaces them.
    """
    _, content = toml_input.read(file)
    given = {key: content[key] for key in (*FROM_ENCOUNTERS, "projectile") if key in content}
    document = case.document if case.before is None else case.before
    own = document.get("impact", {})
    changed = {**document, "impact": overlay.merged(own if isinstance(own, dict) else {}, given)}
    case = replace(case, document=changed)
    return case if case.before is None else _completed(case)
