"""The table ``[case]`` of a case file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from matter.case.body import Model
from pipeline.case import bibliography


class CaseTable(Model):
    """What the case is."""

    title: str
    """Title of the case, on top of its pages."""
    source: str = ""
    """The publication whose numbers the case takes, in words."""
    sources: tuple[str, ...] = ()
    """Keys of the bibliography (``pipeline/settings/references.bib``) that a run of this case cites besides those of
    its laws and materials."""
    stages: Annotated[tuple[Literal["nbody", "sph", "bed", "handoff", "dem", "crater"], ...], Field(min_length=1)] = (
        "nbody", "sph", "bed", "handoff", "dem", "crater",
    )  # fmt: skip
    """Stages that the case runs. By default ``nbody`` if the case has that table or leaves speed or angle to it,
    ``sph``, then ``bed``, ``handoff`` and ``dem`` if there is gravity and strength does not hold the crater, and
    ``crater``."""

    @field_validator("sources")
    @classmethod
    def _known(cls, keys: tuple[str, ...]) -> tuple[str, ...]:
        if fault := bibliography.fault(keys):
            raise ValueError(fault)
        return keys
