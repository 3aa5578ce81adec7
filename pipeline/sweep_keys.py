"""The table ``[sweep]`` of a case file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from matter.body import Model


class SweepTable(Model):
    """What is varied; it takes effect with ``run_case CASE --sweep``."""

    kind: Literal["grid", "list", "lhs", "sobol"] = "grid"
    """``grid``: every combination of the values; ``list``: the first values of all keys, then the second ones ...;
    ``lhs`` (Latin hypercube) and ``sobol``: drawn between the two limits of each key."""
    vary: dict[str, Any] = Field(default_factory=dict)
    """Key of the case -> list of its values, or of its two limits: ``"impact.angle_from_vertical" = ["15 deg", "40
    deg"]``."""
    members: Annotated[int, Field(ge=1, le=100_000)] = 16
    """How many are drawn, for ``lhs`` and ``sobol``."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the draws."""

    @field_validator("vary", mode="before")
    @classmethod
    def _flat(cls, table: Any) -> Any:
        return flat(table) if isinstance(table, Mapping) else table

    @field_validator("vary")
    @classmethod
    def _lists(cls, table: dict[str, Any]) -> dict[str, Any]:
        for key, values in table.items():
            if (
                not isinstance(values, list | tuple)
                or not values
                or not all(isinstance(value, bool | int | float | str) for value in values)
            ):
                raise ValueError(f"{key}: a list of values is needed")
        return table

    @model_validator(mode="after")
    def _fits(self) -> SweepTable:
        lengths = {len(values) for values in self.vary.values()}
        if not self.vary:
            raise ValueError("vary: nothing is varied")
        if self.kind == "list" and len(lengths) > 1:
            raise ValueError("vary: the keys of a list have equally many values")
        if self.kind in ("lhs", "sobol") and lengths != {2}:
            raise ValueError(f"vary: for {self.kind} each key has two limits")
        return self


def flat(table: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Nested tables as one with dotted keys: ``dem.contact.shell.friction = [...]`` may be written without quotes."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{above}.{name}" if above else name
        found |= flat(value, key) if isinstance(value, Mapping) else {key: value}
    return found
