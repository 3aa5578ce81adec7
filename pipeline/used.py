"""``case.used.toml``: every parameter that a run used, defaults included, in SI with units.

The file is itself a case: running it gives the same settings to the last bit, whatever the defaults have become since.
"""

from __future__ import annotations

import typing
from enum import Enum
from pathlib import Path
from typing import Any

import tomlkit
from pydantic import BaseModel

from matter import archive
from matter.body import Model
from matter.quantity import Unit
from pipeline import stages
from pipeline.case import OUTSIDE, Case


def write(path: Path, case: Case, settings: dict[str, Model]) -> None:
    """Write what ``settings`` hold, shared tables once."""
    content: dict[str, Any] = {"case": {"title": case.title}}
    if isinstance(source := case.document.get("case", {}).get("source"), str):
        content["case"]["source"] = source
    for stage in stages.ORDER:
        if stage not in settings:
            continue
        table = _plain(settings[stage], None)
        for name in stages.SHARED_TABLES:
            if name in table and name in case.document:
                content.setdefault(name, table.pop(name))
        if stage == "bed" and isinstance(case.document.get("dem"), dict) and "contact" not in case.document.get("bed", {}):
            table.pop("contact", None)  # stands in [dem.contact]
        content[stage] = table
    for stage, file in case.outside.items():
        content.setdefault(stage, {})[OUTSIDE[stage]] = str(file.resolve())
    preset = f"preset {case.preset}" if case.preset else "no preset"
    changes = "".join(f"\n# --set {assignment}" for assignment in case.overrides)
    head = f"# Every parameter of a run of {case.file.name} ({case.name}, {preset}), in SI; itself a case.{changes}\n\n"
    archive.write_text(path, head + tomlkit.dumps(content))


def _plain(value: Any, annotation: Any) -> Any:
    """TOML for a value: models become tables, floats with a unit become quantity strings, None is left out."""
    if isinstance(value, BaseModel):
        hints = typing.get_type_hints(type(value), include_extras=True)
        fields = type(value).model_fields
        found = {fields[name].alias or name: _plain(item, hints.get(name)) for name, item in value if name in fields and item is not None}
        return _tables_last(found)
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        hints = typing.get_type_hints(type(value), include_extras=True)
        return _tables_last({name: _plain(item, hints.get(name)) for name, item in value._asdict().items() if item is not None})
    if isinstance(value, dict):
        return _tables_last({str(key): _plain(item, annotation) for key, item in value.items() if item is not None})
    if isinstance(value, (list, tuple)):
        return [_plain(item, annotation) for item in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, (int, float)) and not isinstance(value, bool) and (unit := _unit(annotation)) is not None:
        return f"{float(value)!r} {unit}"
    return value


def _tables_last(table: dict[str, Any]) -> dict[str, Any]:
    """Simple values first: in TOML what follows a table header belongs to that table."""
    return dict(sorted(table.items(), key=lambda item: _is_table(item[1])))


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def _unit(annotation: Any) -> str | None:
    """The SI unit in the metadata of an annotation, also inside ``Length | None`` or ``tuple[Length, ...]``."""
    for item in typing.get_args(annotation):
        if isinstance(item, Unit):
            return item.symbol
        if (found := _unit(item)) is not None:
            return found
    return None
