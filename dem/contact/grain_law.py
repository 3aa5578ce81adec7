"""The values of one species of grain: the keys of ``[dem.contact.shell]``, composed from the ``Parameters`` of the
laws, and those of the ocean."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import create_model

from dem.laws.dispatch import FAMILIES
from matter.case.body import Model
from matter.compilation.law_family import keys

if TYPE_CHECKING:

    class _Values(Model):
        def __getattr__(self, key: str) -> Any: ...
else:
    _Values = create_model("_Values", __base__=Model, **keys(FAMILIES))


class GrainLaw(_Values):
    """Contact parameters of one species of grain, for whichever of the laws in ``dem.laws`` the case names."""


SPECIES = ("shell", "ocean")

OCEAN = GrainLaw.model_validate(
    {"restitution": 0.1, "restitution_tangential": 0.1, "friction": 0.0, "shape": 0.0, "rolling": 0.0, "twisting": 0.0}
)
