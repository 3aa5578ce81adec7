"""The table ``[sweep]`` of a case file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from matter.case.body import Model

NAME = re.compile(r"\w[\w.-]*")
"""What a member may be called: its log and its link are named so."""


class SweepTable(Model):
    """What is varied; it takes effect with ``run_case CASE --sweep``."""

    kind: Literal["grid", "list", "lhs", "sobol", "points"] = "grid"
    """``grid``: every combination of the values; ``list``: the first values of all keys, then the second ones ...;
    ``lhs`` (Latin hypercube) and ``sobol``: drawn between the two limits of each key; ``points``: each member by
    itself."""
    case: str = ""
    """The case that is swept, in a file that holds ``[sweep]`` alone: a folder or file beside it, or the name of a
    shipped case."""
    common: dict[str, Any] = Field(default_factory=dict)
    """Key of the case -> value, for all members."""
    vary: dict[str, Any] = Field(default_factory=dict)
    """Key of the case -> list of its values, or of its two limits: ``"impact.angle_from_vertical" = ["15 deg", "40
    deg"]``."""
    points: tuple[dict[str, Any], ...] = ()
    """For ``points``: a table for each member, keys of the case with their values; ``name`` is what it is called,
    ``case`` another case than that of the others."""
    members: Annotated[int, Field(ge=1, le=100_000)] = 16
    """How many are drawn, for ``lhs`` and ``sobol``."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the draws."""

    @field_validator("vary", "common", mode="before")
    @classmethod
    def _flat(cls, table: Any) -> Any:
        return flat(table) if isinstance(table, Mapping) else table

    @field_validator("points", mode="before")
    @classmethod
    def _flat_points(cls, tables: Any) -> Any:
        if not isinstance(tables, list | tuple):
            return tables
        return tuple(flat(table) if isinstance(table, Mapping) else table for table in tables)

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

    @field_validator("points")
    @classmethod
    def _named(cls, tables: tuple[dict[str, Any], ...]) -> tuple[dict[str, Any], ...]:
        for number, table in enumerate(tables, 1):
            name = table.get("name", "x")
            if not isinstance(name, str) or not NAME.fullmatch(name) or name in ("logs", "done"):
                raise ValueError(f"point {number}: a name has letters, digits, '.', '_' and '-', not {name!r}")
            if not isinstance(table.get("case", ""), str):
                raise ValueError(f"point {number}: case is the name or the folder of one")
            for key, value in table.items():
                if not isinstance(value, bool | int | float | str):
                    raise ValueError(f"point {number}: {key}: one value is needed")
        names = [table["name"] for table in tables if "name" in table]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"the name {twice[0]!r} is given twice")
        return tables

    @model_validator(mode="after")
    def _fits(self) -> SweepTable:
        lengths = {len(values) for values in self.vary.values()}
        if (self.kind == "points") != bool(self.points):
            raise ValueError('points: kind = "points" goes with a list of them')
        if self.points:
            if self.vary:
                raise ValueError("vary: points name their own values")
            return self
        if not self.vary:
            raise ValueError("vary: nothing is varied")
        if self.kind == "list" and len(lengths) > 1:
            raise ValueError("vary: the keys of a list have equally many values")
        if self.kind in ("lhs", "sobol") and lengths != {2}:
            raise ValueError(f"vary: for {self.kind} each key has two limits")
        return self


def flat(table: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Nested tables as one with dotted keys: ``dem.contact.shell.friction = [...]`` may be written without quotes."""
    dotted: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{above}.{name}" if above else name
        dotted |= flat(value, key) if isinstance(value, Mapping) else {key: value}
    return dotted
