"""The values of one species of grain: the keys of ``[dem.contact.shell]`` and ``[dem.contact.ocean]``, composed from
the ``Parameters`` of the laws."""

from __future__ import annotations

import typing
from typing import TYPE_CHECKING, Any

from pydantic import create_model
from pydantic.fields import FieldInfo

from dem.laws.dispatch import FAMILIES
from matter.body import Model


def _keys() -> dict[str, Any]:
    """Annotation and default of every key that a law reads; laws that share a key say what each takes it for."""
    found: dict[str, tuple[Any, Any]] = {}
    words: dict[str, dict[str, list[str]]] = {}
    for family in FAMILIES:
        for name, law in zip(family.names[family.first :], family.laws):
            kinds = typing.get_type_hints(law.Parameters, include_extras=True)
            for key, default in law.Parameters._field_defaults.items():
                found.setdefault(key, (kinds[key], default))
                about = next(
                    (
                        part.description
                        for part in typing.get_args(kinds[key])
                        if isinstance(part, FieldInfo) and part.description
                    ),
                    "",
                )
                words.setdefault(key, {}).setdefault(about, []).append(f'``{family.key} = "{name}"``')
    fields = {}
    for key, (kind, default) in found.items():
        said = words[key]
        text = (
            next(iter(said))
            if len(said) == 1
            else " ".join(f"With {' or '.join(laws)}: {about}" for about, laws in said.items())
        )
        fields[key] = (kind, FieldInfo(default=default, description=text))
    return fields


if TYPE_CHECKING:

    class _Values(Model):
        def __getattr__(self, key: str) -> Any: ...
else:
    _Values = create_model("_Values", __base__=Model, **_keys())


class GrainLaw(_Values):
    """Contact parameters of one species of grain, for whichever of the laws in ``dem.laws`` the case names."""


SPECIES = ("shell", "ocean")

OCEAN = GrainLaw.model_validate(
    {"restitution": 0.1, "restitution_tangential": 0.1, "friction": 0.0, "shape": 0.0, "rolling": 0.0, "twisting": 0.0}
)
