"""The base of every settings model, and the check of a material's name."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from matter.case import material
from matter.errors import InputError


class Model(BaseModel):
    """Base of every settings model: frozen, unknown keys refused; the text under a field is its description
    (``run_case --describe``)."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


def known_material(name: str) -> str:
    """Validator of a material name; raises ``ValueError`` with the nearest known name."""
    try:
        material.load(name)
    except InputError as reason:
        raise ValueError(str(reason)) from None
    return name
