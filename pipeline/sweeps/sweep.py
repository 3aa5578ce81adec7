"""A sweep: one case with some of its keys varied, each combination a run of its own; what they have in common is made
once (``pipeline.store.store``).

    [sweep]
    kind = "grid"                        # every combination; "list": in step; "lhs", "sobol": drawn between two limits
    [sweep.vary]
    "dem.contact.shell.friction" = [0.3, 0.5, 0.7]
    "impact.angle_from_vertical" = ["15 deg", "40 deg", "65 deg"]

or ``--vary "impact.angle_from_vertical=15,40,65 deg"`` on the command line (a unit at the end is that of all). A file
may hold ``[sweep]`` alone, with the ``case`` that it varies; the ``points`` of one may be of several cases:

    [sweep]
    kind = "points"
    case = "valhalla_980km"
    common = { "case.stages" = ["sph", "crater"] }    # of all members
    points = [
      { name = "steep", "impact.angle_from_vertical" = "15 deg" },
      { name = "small", case = "valhalla_350km" },
    ]

``kind = "prior"`` draws quantities from distributions, several keys of one where they are derived from it
(``pipeline.case.prior_table``, ``pipeline.case.derived``):

    [sweep]
    kind = "prior"
    members = 96
    whole_chain = 32                                  # the first 32; the others end with the shock stage
    [sweep.prior.friction_angle]
    distribution = "normal"
    mean = "32.7 deg"
    sd = "2.5 deg"
    [sweep.derive]
    "sph.materials.basalt.drucker_prager.friction_angle" = "friction_angle"

A sweep has a folder in the folder of runs with links to its members, their table and a page; its name follows from
what the members compute.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from matter.case import quantity
from matter.errors import InputError
from pipeline.case import derived, overlay, shipped, stages
from pipeline.case import read as cases
from pipeline.case.complaints import complaints, dotted
from pipeline.case.read import Case
from pipeline.case.sweep_keys import SweepTable, flat, prior_faults
from pipeline.case.toml_lines import KeyPath
from pipeline.running.request import Request
from pipeline.sweeps import draws, results_elsewhere

Number = bool | int | float | str
SHOCK = "sph"
"""The last stage of a member that does not run the whole chain."""


def merged_sweep(content: Mapping[str, Any], given: Mapping[str, Any], varied: Mapping[str, Any]) -> dict[str, Any]:
    """``[sweep]`` of a case with other keys (``given``) and values (``varied``) laid over it."""
    vary = content.get("vary", {})
    return {**content, **given, "vary": {**flat(vary), **varied} if isinstance(vary, Mapping) else vary}


def read_table(content: Mapping[str, Any], options: Iterable[str]) -> SweepTable:
    """``[sweep]`` of a case with the ``--vary`` options laid over it. Raises ``InputError`` with every mistake."""
    whole = merged_sweep(content, {}, dict(parsed(option) for option in options))
    faults: list[tuple[KeyPath, str]] = [*prior_faults(whole)]
    try:
        table = SweepTable.model_validate(whole)
    except ValidationError as error:
        faults = [*complaints(SweepTable, error), *faults]
    if faults:
        rows = dict.fromkeys(f"  {dotted(('sweep', *path))}: {message}" for path, message in faults)
        raise InputError(
            f"[sweep] cannot be used, {len(rows)} error{'s' if len(rows) > 1 else ''}:\n" + "\n".join(rows)
        )
    return table


def check(content: Mapping[str, Any]) -> None:
    """Raise ``InputError`` with every mistake in ``[sweep]`` of a case that is run alone; nothing need be varied."""
    if content:
        varied = content.get("vary") or content.get("points") or content.get("kind") == "prior"
        read_table(content, () if varied else ("case.title=-",))


QUANTITY = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s.].*)$")
"""A number and its unit."""


def parsed(option: str) -> tuple[str, list[Number]]:
    """Key and values of one ``--vary`` text, ``key=a,b,c``; a unit after the last value is that of all that have none.

    Raises ``InputError`` when there is no ``=`` or a value is empty.
    """
    key, equals, text = option.partition("=")
    parts = [part.strip() for part in text.split(",")]
    if not equals or not key.strip() or not all(parts):
        raise InputError(
            f'--vary {option!r}: write it as key=a,b,c, --vary "impact.angle_from_vertical=15,40,65 deg" for example'
        )
    unit = match.group(2).strip() if (match := QUANTITY.match(parts[-1])) else ""
    return key.strip(), [_value(f"{part} {unit}" if unit and _number(part) is not None else part) for part in parts]


def _number(text: str) -> int | float | None:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return None


def _value(text: str) -> Number:
    number = _number(text)
    if number is not None:
        return number
    return {"true": True, "false": False}.get(text, text.strip("\"'"))


@dataclass(frozen=True)
class Member:
    """One run of a sweep: its ``name`` and the ``values`` of what is varied, by key; ``where``: its case, where it has
    one of its own; ``drawn``: the quantities that were drawn for it, by name or key; ``until``: its last stage."""

    name: str
    values: Mapping[str, Number]
    where: Path | None = None
    drawn: Mapping[str, Number] = field(default_factory=dict)
    until: str | None = None

    @property
    def parameters(self) -> Mapping[str, Number]:
        """What tells it from the others: what was drawn, or else its values."""
        return self.drawn or self.values

    @property
    def overrides(self) -> tuple[str, ...]:
        """Its values as texts of ``--set``."""
        return tuple(f"{key}={overlay.toml(value)}" for key, value in self.values.items())


def members(table: SweepTable, folder: Path = Path()) -> list[Member]:
    """The members, in order; cases are looked for in the ``folder`` of theirs, then by name. Raises ``InputError``
    where a limit is no number or the two are of different units, where an expression has no value, and for a case that
    is not there."""
    if table.points:
        return _points(table, folder)
    if table.kind == "prior":
        return _from_priors(table, folder)
    keys = list(table.vary)
    rows: Iterable[Sequence[Number]]
    if table.kind == "grid":
        rows = itertools.product(*table.vary.values())
    elif table.kind == "list":
        rows = zip(*table.vary.values(), strict=True)
    else:
        rows = _drawn(table)
    combinations = [dict(zip(keys, row, strict=True)) for row in rows]
    where = _case_file(table.case, folder)
    return [Member(_name(number, len(combinations)), values, where) for number, values in enumerate(combinations, 1)]


def _points(table: SweepTable, folder: Path) -> list[Member]:
    return [
        Member(
            point.get("name") or _name(number, len(table.points)),
            {key: value for key, value in point.items() if key not in ("name", "case")},
            _case_file(point.get("case", table.case), folder),
        )
        for number, point in enumerate(table.points, 1)
    ]


def _from_priors(table: SweepTable, folder: Path) -> list[Member]:
    """Members by draws from distributions. Neither their names nor their values depend on how many there are."""
    where, made = _case_file(table.case, folder), []
    for number, drawn in enumerate(draws.drawn(table.prior, table.members, table.seed), 1):
        values = {name: value for name, value in drawn.items() if "." in name}
        faults = []
        for key, text in table.derive.items():
            try:
                values[key] = derived.value(text, drawn)
            except ValueError as reason:
                faults.append(f"  sweep.derive.{key}: {reason}")
        name = f"m{number:04d}"
        if faults:
            shown = ", ".join(f"{one} = {value}" for one, value in drawn.items())
            raise InputError(f"[sweep] cannot be used, member {name} ({shown}):\n" + "\n".join(faults))
        shock_alone = table.whole_chain is not None and number > table.whole_chain
        made.append(Member(name, values, where, drawn, SHOCK if shock_alone else None))
    return made


def _name(number: int, count: int) -> str:
    return f"m{number:0{max(2, len(str(count)))}d}"


def _case_file(case: str, folder: Path) -> Path | None:
    """The case that a sweep names; None where it names none."""
    if not case:
        return None
    return folder / case if (folder / case).exists() else shipped.located(Path(case))


def common(table: SweepTable) -> tuple[str, ...]:
    """What all members have in common, as texts of ``--set``."""
    return tuple(f"{key}={overlay.toml(value)}" for key, value in table.common.items())


def planned_sweep(case: Case, table: SweepTable, out: Path, until: str | None = None) -> Sweep:
    """The sweep of a case that was read, in the folder of runs ``out``; values of ``--set`` prevail over what its
    members have in common. Raises ``InputError`` where a file that holds a sweep alone does not say which case it
    varies."""
    drawn = tuple(members(table, case.file.parent))
    if case.holds_a_sweep_alone and any(member.where is None for member in drawn):
        raise InputError(f'{case.file} holds a sweep alone, and does not say of which case: [sweep] case = "..."')
    return Sweep(
        case.file, case.preset, case.size, (*common(table), *case.overrides), out, drawn, until, name=case.name
    )


def _drawn(table: SweepTable) -> list[list[Number]]:
    """Values between the limits of each key, evenly spread in all of them together."""
    from scipy.stats import qmc

    count = len(table.vary)
    if table.kind == "lhs":
        points = qmc.LatinHypercube(d=count, rng=table.seed).random(table.members)
    else:
        points = draws.sobol(count, table.members, table.seed)
    columns = [_between(key, low, high, points[:, k]) for k, (key, (low, high)) in enumerate(table.vary.items())]
    return [list(row) for row in zip(*columns, strict=True)]


def _between(key: str, low: Number, high: Number, fraction: Any) -> list[Number]:
    """Values at the ``fraction`` (n,) of the way between two limits; whole numbers where both limits are."""
    if isinstance(low, bool) or isinstance(high, bool):
        raise InputError(f"[sweep] vary {key}: limits are numbers")
    if isinstance(low, int) and isinstance(high, int):
        return [low + min(int(s * (high - low + 1)), high - low) for s in fraction]
    if isinstance(low, str) and isinstance(high, str):
        unit = match.group(2).strip() if (match := QUANTITY.match(high)) else ""
        try:
            first, one, last = quantity.parse(low), quantity.parse(f"1 {unit}"), quantity.parse(high)
        except ValueError as reason:
            raise InputError(f"[sweep] vary {key}: {reason}") from None
        return [f"{(first + s * (last - first)) / one:.6g} {unit}" for s in fraction]
    if isinstance(low, str) or isinstance(high, str):
        raise InputError(f"[sweep] vary {key}: one limit has a unit, the other has none")
    return [float(f"{low + s * (high - low):.6g}") for s in fraction]


@dataclass(frozen=True)
class Sweep:
    """A case (``where``, with ``preset`` and ``overrides``) and its members, in the folder of runs ``out``; ``until``:
    the last stage of each; ``name`` begins that of its folder (by default the case's), ``folder_name`` is that of its
    folder, where what its members compute shall not decide it."""

    where: Path
    preset: str | None
    size: str | None
    overrides: tuple[str, ...]
    out: Path
    members: tuple[Member, ...]
    until: str | None = None
    name: str = ""
    folder_name: str = ""

    @cached_property
    def requests(self) -> dict[str, Request]:
        """The request of each member, by its name. Raises ``InputError`` with every complaint about the first that
        cannot be."""
        by_name = {}
        for member in self.members:
            try:
                read = cases.read(
                    member.where or self.where, self.preset, [*self.overrides, *member.overrides], self.size
                )
                request = Request(read, self.out, until=self.last_stage(member))
                assert request.run_folder
            except InputError as reason:
                raise InputError(f"member {member.name} ({', '.join(member.overrides)}): {reason}") from None
            by_name[member.name] = request
        return by_name

    def last_stage(self, member: Member) -> str | None:
        """The stage with which a member ends, the earlier of its own and that of all; None where the case says."""
        named = [stages.known(stage) for stage in (self.until, member.until) if stage]
        return min(named, key=stages.ORDER.index, default=None)

    @cached_property
    def values(self) -> dict[str, dict[str, Any]]:
        """Every quantity that is drawn and every key that is varied with its value in each member, by name; where a
        member says nothing, that of its case (None where the case leaves it to the default). ``case`` is one of them
        where there are several."""
        keys = dict.fromkeys(key for member in self.members for key in (*member.drawn, *member.values))
        by_name = {}
        for member in self.members:
            case = self.requests[member.name].case
            said = {**member.drawn, **member.values}
            own = {key: said.get(key, overlay.at(case.document, key)) for key in keys}
            by_name[member.name] = {"case": case.name, **own} if self.several else own
        return by_name

    @cached_property
    def elsewhere(self) -> dict[str, dict[str, Any]]:
        """The rows of the members that were computed elsewhere, by name. Raises ``InputError``."""
        rows = results_elsewhere.rows_in(self.folder / results_elsewhere.FOLDER)
        found = {name: rows.get((name, request.run_folder.name)) for name, request in self.requests.items()}
        last = {name: request.wanted[-1] for name, request in self.requests.items()}
        return {name: row for name, row in found.items() if row and row.get("until") == last[name]}

    @property
    def named(self) -> bool:
        """Whether members name keys of their own, each others (``points``)."""
        return len({tuple(member.values) for member in self.members}) > 1

    @cached_property
    def several(self) -> bool:
        """Whether the members are of more than one case."""
        return len({request.case.name for request in self.requests.values()}) > 1

    @cached_property
    def folder(self) -> Path:
        """Where table, page and links are; the name follows from what the members compute."""
        if self.folder_name:
            return self.out / self.folder_name
        runs = [request.run_folder.name for request in self.requests.values()]
        name = self.name or next(iter(self.requests.values())).case.name
        return self.out / f"{name}-sweep-{hashlib.sha256(json.dumps(runs).encode()).hexdigest()[:8]}"

    def arguments(self, member: Member, threads: int | None) -> list[str]:
        """What ``run_case`` is given for a member."""
        options = [
            ("--preset", self.preset),
            ("--size", self.size),
            ("--until", self.last_stage(member)),
            ("--threads", threads and str(threads)),
        ]
        given = [part for option, value in options if value for part in (option, str(value))]
        return [
            str(member.where or self.where),
            *given,
            "--out",
            str(self.out),
            *(part for text in (*self.overrides, *member.overrides) for part in ("--set", text)),
        ]
