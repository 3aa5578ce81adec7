"""From a validation error to a sentence that a user can act on: where, what, the nearest valid name."""

from __future__ import annotations

import typing
from collections.abc import Iterable
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from pipeline.stages import SHARED_TABLES, nearest
from pipeline.toml_lines import KeyPath


class Complaint(NamedTuple):
    """One thing that is wrong, at a key path of the composed case."""

    path: KeyPath
    message: str


def dotted(path: KeyPath) -> str:
    """``("target", "layers", 2, "material")`` as ``target.layers[2].material``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def complaints(model: type[BaseModel], error: ValidationError) -> list[Complaint]:
    """Every error of a validation as a complaint; paths are relative to the model."""
    entries = error.errors(include_url=False)
    places = [tuple(entry["loc"]) for entry in entries]
    found = []
    for entry, place in zip(entries, places):
        # a list whose elements are all wrong is also reported as too short: that is no second mistake
        if entry["type"] == "too_short" and any(other[: len(place)] == place and other != place for other in places):
            continue
        found.append(Complaint(*_worded(model, entry)))
    return found


def _worded(model: type[BaseModel], entry: Any) -> tuple[KeyPath, str]:
    path, kind, context = tuple(entry["loc"]), entry["type"], entry.get("ctx", {})
    given = "" if isinstance(entry.get("input"), (dict, list)) else f" (given: {_shown(entry.get('input'))})"
    match kind:
        case "extra_forbidden" | "unexpected_keyword_argument":
            names = [name for name in names_at(model, path[:-1]) if len(path) > 1 or name not in SHARED_TABLES]
            known = f" (known: {', '.join(names)})" if names else ""
            return path, f"there is no such key{nearest(str(path[-1]), names)}{known}"
        case "missing" | "missing_argument":
            return path, "is missing"
        case "greater_than":
            return path, f"must be greater than {context['gt']:g}{given}"
        case "greater_than_equal":
            return path, f"must be at least {context['ge']:g}{given}"
        case "less_than":
            return path, f"must be less than {context['lt']:g}{given}"
        case "less_than_equal":
            return path, f"must be at most {context['le']:g}{given}"
        case "literal_error":
            options = [option.strip().strip("'") for option in context["expected"].replace(" or ", ", ").split(",")]
            return path, f"must be {context['expected']}{nearest(str(entry.get('input')), options)}{given}"
        case "value_error":
            return path, str(context["error"])
        case _:
            return path, f"{entry['msg'][:1].lower()}{entry['msg'][1:]}{given}"


def _shown(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def names_at(model: type[BaseModel], path: KeyPath) -> list[str]:
    """The key names that are valid in the table at ``path`` of a model."""
    here: list[Any] = [model]
    for part in path:
        inner = [found for one in here for found in _tables_in(_fields(one).get(part))] if isinstance(part, str) else []
        here = inner or here  # an index or the tag of a union names no table of its own
    return list(dict.fromkeys(name for one in here for name in _fields(one)))


def _fields(table: Any) -> dict[Any, Any]:
    if issubclass(table, BaseModel):
        return {field.alias or name: field.annotation for name, field in table.model_fields.items()}
    return typing.get_type_hints(table)


def _tables_in(annotation: Any) -> Iterable[type]:
    """The models and named tuples inside an annotation such as ``tuple[Layer, ...]`` or ``Contact | None``."""
    if isinstance(annotation, type) and not typing.get_args(annotation):
        if issubclass(annotation, BaseModel) or (issubclass(annotation, tuple) and hasattr(annotation, "_fields")):
            yield annotation
        return
    for argument in typing.get_args(annotation):
        yield from _tables_in(argument)
