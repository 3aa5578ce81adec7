"""Settings that enter a stage's identity hash: two runs that share them have the same result."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from matter.case import quantity


@dataclass(frozen=True)
class NotIdentity:
    """Marks, in the annotation of a setting, that it does not change the result: notes, pictures, predictions. Of a
    table with this mark only the keys in ``but`` enter the identity."""

    but: tuple[str, ...] = ()


@dataclass(frozen=True)
class Follows:
    """Marks a setting that no case gives and none of its files shows: it follows from another table or stage, or is
    always the same."""


def following(model: type[BaseModel]) -> list[tuple[str, ...]]:
    """Paths of the settings of ``model``, and of the tables in it, that bear ``Follows``."""
    paths: list[tuple[str, ...]] = []
    for name, entry in model.model_fields.items():
        if any(isinstance(item, Follows) for item in entry.metadata):
            paths.append((name,))
        elif isinstance(entry.annotation, type) and issubclass(entry.annotation, BaseModel):
            paths += [(name, *path) for path in following(entry.annotation)]
    return paths


@dataclass(frozen=True)
class IdentityIfSet:
    """Marks a setting that enters the identity only where it is not at its default: a case without it keeps the
    identity that it had before there was such a setting."""


def identity_fields(value: Any) -> Any:
    """The settings that decide a result, as plain JSON: without fields marked ``NotIdentity``, quantities as SI
    numbers.

    Equal contents are equal settings, to the last bit of every number and however they were written.
    """
    if isinstance(value, BaseModel):
        return _of_model(value)
    if isinstance(value, Mapping):
        return {str(key): identity_fields(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [identity_fields(item) for item in value]
    if isinstance(value, str) and re.match(quantity.TEXT, value):
        try:
            return quantity.parse(value)
        except ValueError:
            return value
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)


def _of_model(model: BaseModel) -> dict[str, Any]:
    keys: dict[str, Any] = {}
    for name, entry in type(model).model_fields.items():
        mark = next((item for item in entry.metadata if isinstance(item, NotIdentity)), None)
        value = getattr(model, name)
        if value == entry.default and any(isinstance(item, IdentityIfSet) for item in entry.metadata):
            continue
        if mark is None:
            keys[name] = identity_fields(value)
        elif mark.but and value is not None:
            keys[name] = {key: identity_fields(getattr(value, key)) for key in mark.but}
    return keys
