"""Which settings decide a result: what two runs must share to have the same outcome."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel

from matter.case import quantity


@dataclass(frozen=True)
class View:
    """Marks a setting that decides no result, in its annotation: what is only looked at (notes, pictures), predicted
    or done elsewhere in the same way. Of a table that bears it the keys in ``but`` do decide."""

    but: tuple[str, ...] = ()


def deciding(value: Any) -> Any:
    """What of settings decides a result, as plain JSON: without fields that bear ``View``, numbers in SI, texts that
    are quantities as SI numbers.

    Equal contents are equal settings, to the last bit of every number and however they were written.
    """
    if isinstance(value, BaseModel):
        return _of_model(value)
    if isinstance(value, Mapping):
        return {str(key): deciding(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [deciding(item) for item in value]
    if isinstance(value, str) and re.match(quantity.TEXT, value):
        try:
            return quantity.parse(value)
        except ValueError:
            return value
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)


def _of_model(model: BaseModel) -> dict[str, Any]:
    keys: dict[str, Any] = {}
    for name, entry in type(model).model_fields.items():
        mark = next((item for item in entry.metadata if isinstance(item, View)), None)
        value = getattr(model, name)
        if mark is None:
            keys[name] = deciding(value)
        elif mark.but and value is not None:
            keys[name] = {key: deciding(getattr(value, key)) for key in mark.but}
    return keys
