"""The crater stage's keys: how a crater is measured, what it is compared with, and the errors that no single run can
show."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import Field, create_model, field_validator

from matter.case import quantity
from matter.case.body import Impact, Model, Target
from matter.case.identity_fields import Follows, NotIdentity
from matter.case.quantity import Length, Speed, Volume
from matter.wording.crater_measures import BY_NAME, COMPARED, TIME, Measure

RISE_LIMIT = 0.15
"""In expected transient diameters: what rises higher is in flight and takes no part in heights."""
_KINDS = {"m": Length, "m^3": Volume, "1": float}


def of_each_measure(name: str, words: str, kind: Callable[[Any, Measure], Any]) -> Any:
    """A settings model called ``name`` that holds, or leaves out, one entry for each measure that is compared;
    ``kind(quantity, row)`` gives its type."""
    rows = [BY_NAME[measure] for measure in COMPARED]
    if odd := [f"{row.name} [{row.unit}]" for row in rows if row.unit not in _KINDS]:
        raise TypeError(f"{', '.join(odd)}: a measure that is compared is in {', '.join(_KINDS)}")
    fields: dict[str, Any] = {
        row.name: (kind(_KINDS[row.unit], row) | None, Field(None, description=f"Of the {row.words}.")) for row in rows
    }
    return create_model(name, __base__=Model, __module__=__name__, __doc__=words, **fields)


Errors = of_each_measure(
    "Errors",
    "The chain error of each measure of one crater; a measure that is left out has none that is known.",
    lambda quantity, row: Annotated[quantity, Field(ge=0)],
)


class ChainError(Model):
    """Chain errors of the transient crater, at its largest volume and where it is deepest, and of the final one."""

    transient: Errors = Errors()  # type: ignore[valid-type]
    """Of the transient crater at its largest volume."""
    transient_at_maximum_depth: Errors = Errors()  # type: ignore[valid-type]
    """Of the transient crater where it is deepest."""
    final: Errors = Errors()  # type: ignore[valid-type]
    """Of the final crater."""
    holds: tuple[Literal["draws", "size", "handoff", "alpha"], ...] = ("draws", "size", "handoff", "alpha")
    """Parts that they hold: ``draws`` of particles and grains, ``size`` of both, time of the ``handoff``, its
    ``alpha``."""


class Published(Model):
    """A published number of the case, ``[[crater.reference]]``."""

    quantity: Literal[(*COMPARED, TIME)]  # type: ignore[valid-type]
    """Which measure, named as in ``measures.json``."""
    of: Literal["transient", "final"] = "transient"
    """Which crater it describes; the transient one is taken at the first maximum of its depth."""
    value: str
    """With unit, ``"980 km"``."""
    plus: str
    """Upper error with unit."""
    minus: str
    """Lower error with unit."""
    source: str
    """The publication."""
    note: Annotated[str, NotIdentity()] = ""
    """A remark shown next to the number."""

    @field_validator("value", "plus", "minus")
    @classmethod
    def _readable(cls, text: str) -> str:
        quantity.parse(text)
        return text


class Settings(Model):
    """How the crater is measured and what it is compared with."""

    target: Target
    """The body or ground that is hit, ``[target]``."""
    impact: Impact
    """How the projectile hits, ``[impact]``."""
    reference: tuple[Published, ...] = ()
    """Published numbers of the case with their errors."""
    escape_speed: Annotated[Speed, Field(ge=0)] = 0.0
    """Flat ground: what rises faster than this escapes from the body that the ground represents. 0 means not known:
    the page then reports neither escape nor beta."""
    ground: Literal["fluid", "rock", "sand"] = "fluid"
    """Kind of ground whose scaling laws the crater is compared with; ``fluid`` for weak ground without friction."""
    chain: ChainError | None = None
    """Chain errors of the measures; those of a shipped case come from its ``expected.toml``."""
    particles: Annotated[int, Field(gt=0), NotIdentity(), Follows()] = 15_000
    """Size of the shock stage's snapshots, for the prediction of ``--check`` only."""
