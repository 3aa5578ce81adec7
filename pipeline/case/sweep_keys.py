"""The table ``[sweep]`` of a case file."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from matter.case.body import Model
from pipeline.case import derived
from pipeline.case.prior_table import Prior
from pipeline.case.stages import nearest

NAME = re.compile(r"\w[\w.-]*")
"""What a member may be called: its log and its link are named so."""


class SweepTable(Model):
    """What is varied; it takes effect with ``run_case CASE --sweep``."""

    kind: Literal["grid", "list", "lhs", "sobol", "points", "prior"] = "grid"
    """``grid``: every combination of the values; ``list``: the first values of all keys, then the second ones ...;
    ``lhs`` (Latin hypercube) and ``sobol``: drawn between the two limits of each key; ``points``: each member by
    itself; ``prior``: drawn from distributions."""
    case: str = ""
    """The case that is swept, in a file that holds ``[sweep]`` alone: a folder or file beside it, or the name of a
    shipped case."""
    common: dict[str, Any] = Field(default_factory=dict)
    """Key of the case -> value, for all members."""
    vary: dict[str, Any] = Field(default_factory=dict)
    """Key of the case -> list of its values, or of its two limits: ``"impact.angle_from_vertical" = ["15 deg", "40
    deg"]``."""
    points: tuple[dict[str, Any], ...] = ()
    """For ``points``: one table per member, with keys of the case and their values; ``name`` names the member, and
    ``case`` gives it a case of its own."""
    prior: dict[str, Prior] = Field(default_factory=dict)
    """For ``prior``: the distribution of each drawn quantity, in their order."""
    derive: dict[str, str] = Field(default_factory=dict)
    """For ``prior``: key of the case -> the drawn quantity that it is, or an expression such as ``"'3500 kg/m^3' /
    bulk_density"``, of drawn quantities, numbers, quantities in quotes, + - * / ** and sqrt, exp, log, sin, cos, tan,
    atan."""
    whole_chain: Annotated[int, Field(ge=0)] | None = None
    """For ``prior``: how many members, counted from the first, run all stages; the others end with the shock stage. By
    default every member runs all stages."""
    members: Annotated[int, Field(ge=1, le=100_000)] = 16
    """Number of draws, for ``lhs``, ``sobol`` and ``prior``. A larger number adds members to a ``prior`` and keeps
    those that it has."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the draws."""

    @field_validator("vary", "common", "derive", mode="before")
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
        if self.kind == "prior":
            if self.vary:
                raise ValueError('vary: kind = "prior" draws its values, [sweep.prior] says from which distributions')
            return self
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


OWN_COLUMNS = ("member", "run", "state", "reason", "commit", "until", "case", "settled", "class")
"""What a sweep's table says of a member beside what is drawn and measured: no quantity is called so."""
Fault = tuple[tuple[str, ...], str]
"""The path of a mistake in ``[sweep]``, and a sentence."""


def prior_faults(content: Mapping[str, Any]) -> Iterator[Fault]:
    """What in ``[sweep]`` as it was written does not fit together of priors and derived keys. Looked at beside the
    table's own validation, so that a wrong distribution hides no other mistake."""
    if content.get("kind") != "prior":
        for name in ("prior", "derive", "whole_chain"):
            if name in content:
                yield (name,), 'goes with kind = "prior"'
        return
    prior, derive, common = (_table(content, name) for name in ("prior", "derive", "common"))
    if not prior:
        yield ("prior",), "nothing is drawn: [sweep.prior.NAME] holds the distribution of a quantity"
    texts = {key: text for key, text in flat(derive).items() if isinstance(text, str)}
    free = [name for name in prior if "." not in name]
    yield from _misnamed(free, texts.values())
    for key, text in texts.items():
        yield from ((("derive", key), words) for words in derived.faults(text, free))
    yield from _said_twice(
        {
            "prior": {name for name in prior if "." in name},
            "derive": set(flat(derive)),
            "common": set(flat(common)),
        }
    )


def _table(content: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    table = content.get(name)
    return table if isinstance(table, Mapping) else {}


def _misnamed(free: Sequence[str], texts: Iterable[str]) -> Iterator[Fault]:
    """Names of one's own that are none, or that no expression takes up."""
    used = sorted({name for text in texts for name in derived.names_in(text)})
    for name in free:
        if not name.isidentifier():
            yield ("prior", name), "a name of one's own has letters, digits and '_'"
        elif name in derived.FUNCTIONS or name in OWN_COLUMNS:
            yield ("prior", name), "this is the name of a function, or of a column of the table: call it otherwise"
        elif name not in used:
            near = nearest(name, [other for other in used if other not in free])
            yield ("prior", name), f"is drawn, and nothing in [sweep.derive] takes it up{near}"


def _said_twice(keys: Mapping[str, set[str]]) -> Iterator[Fault]:
    """Keys of the case that two of the tables set."""
    for one, other in itertools.combinations(keys, 2):
        for key in sorted(keys[one] & keys[other]):
            yield (other, key), f"is set by [sweep.{one}] too"
