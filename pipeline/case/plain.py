"""Settings as the tables of a case file: the way back from validated models to TOML, with units."""

from __future__ import annotations

import typing
from enum import Enum
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from matter.case.quantity import Unit


def plain(value: Any, annotation: Any = None) -> Any:
    """TOML for a value: models become tables, floats with a unit become quantity strings, None is left out."""
    if isinstance(value, BaseModel):
        hints = typing.get_type_hints(type(value), include_extras=True)
        fields = type(value).model_fields
        table = {
            fields[name].alias or name: plain(item, hints.get(name))
            for name, item in value
            if name in fields and item is not None
        }
        return _tables_last(table)
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        hints = typing.get_type_hints(type(value), include_extras=True)
        return _tables_last(
            {name: plain(item, hints.get(name)) for name, item in value._asdict().items() if item is not None}
        )
    if isinstance(value, dict):
        return _tables_last({str(key): plain(item, annotation) for key, item in value.items() if item is not None})
    if isinstance(value, (list, tuple)):
        return [plain(item, annotation) for item in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, (int, float)) and not isinstance(value, bool) and (unit := unit_in(annotation)) is not None:
        return f"{float(value)!r} {unit}"
    return value


def _tables_last(table: dict[str, Any]) -> dict[str, Any]:
    """Simple values first: in TOML what follows a table header belongs to that table."""
    return dict(sorted(table.items(), key=lambda item: _is_table(item[1])))


def _is_table(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and bool(value) and isinstance(value[0], dict))


def unit_in(annotation: Any) -> str | None:
    """The SI unit in the metadata of an annotation, also inside ``Length | None`` or ``tuple[Length, ...]``."""
    for item in typing.get_args(annotation):
        if isinstance(item, Unit):
            return item.symbol
        if (unit := unit_in(item)) is not None:
            return unit
    return None
