"""Every key of a case file, read from the settings themselves: its table, unit, range, default and meaning (``run_case
--describe``)."""

from __future__ import annotations

import functools
import inspect
import math
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from matter.case.body import Impact, Model, Target
from matter.case.identity_fields import Follows
from matter.case.quantity import Unit
from matter.errors import InputError
from matter.wording.crater_measures import COMPARED
from pipeline.case import experimental, plain, stages
from pipeline.case.case_table import CaseTable
from pipeline.case.inverse_table import InverseTable
from pipeline.case.sweep_keys import SweepTable

SHARED: dict[str, type[Model]] = {"target": Target, "impact": Impact}
# keys that replace a whole stage (pipeline.case.outside): they stand in no settings
OUTSIDE = {
    "nbody": "A file ``impact.toml`` instead of what this stage would find.",
    "sph": "A snapshot (.vtkhdf) instead of this stage's last one. The ground before the impact is that of a "
    "``target.json`` beside it, or else of [target].",
    "bed": "A settled bed (.vtkhdf) instead of the one that this stage would make.",
    "dem": "Settled grains (.vtkhdf) instead of this stage's last snapshot.",
}
MATERIAL = "NAME"
"""Stands in a path for the name of a material, or of what a sweep draws."""
MEASURE = "MEASURE"
"""Stands in a path for the name of a measure of the crater."""


class Key(NamedTuple):
    """One key: the ``path`` of its table and its own name, ``allowed`` values with unit and range, ``default``,
    ``meaning``."""

    path: tuple[str, ...]
    allowed: str
    default: str
    meaning: str

    @property
    def name(self) -> str:
        return ".".join(self.path)


class Table(NamedTuple):
    """One table: its ``path``, what it holds, and whether it is a list of tables, ``[[...]]``."""

    path: tuple[str, ...]
    kind: Any
    meaning: str
    listed: bool = False

    @property
    def name(self) -> str:
        return ".".join(self.path)


def tables(first: str | None = None) -> Iterator[Table]:
    """Every table of a case file in the order of a case, or those that begin with ``first``; only these stages are
    imported."""
    for name, kind in {"case": CaseTable, **SHARED, "sweep": SweepTable, "inverse": InverseTable}.items():
        if first in (None, name):
            yield from _within((name,), kind)
    for stage in stages.ORDER:
        if first in (None, stage):
            yield from _within((stage,), stages.load(stage).Settings)


def _within(path: tuple[str, ...], kind: Any, listed: bool = False) -> Iterator[Table]:
    yield Table(path, kind, text_of(inspect.getdoc(kind)), listed)
    for name, entry in fields(kind).items():
        for inner, many in inner_tables(entry.annotation):
            if not stands_elsewhere(path, name, entry):
                yield from _within(
                    (*path, name, MATERIAL) if many == "by name" else (*path, name), inner, many == "list"
                )
    if of_material(path):
        for name, law in material_sections().items():
            yield Table((*path, name), law, text_of(inspect.getdoc(law)))


def fields(kind: Any) -> dict[str, FieldInfo]:
    """The fields of a model, its own before those of its parents; of a law's parameters (a NamedTuple) what its
    annotations say."""
    if issubclass(kind, BaseModel):
        order = [name for one in kind.__mro__ for name in inspect.get_annotations(one) if name in kind.model_fields]
        return {name: kind.model_fields[name] for name in dict.fromkeys([*order, *kind.model_fields])}
    hints = typing.get_type_hints(kind, include_extras=True)
    defaults = getattr(kind, "_field_defaults", {})
    return {
        name: FieldInfo.from_annotated_attribute(hints[name], defaults.get(name, PydanticUndefined))
        for name in kind._fields
    }


def stands_elsewhere(path: tuple[str, ...], name: str, entry: FieldInfo) -> bool:
    """Whether a field of a stage's settings is filled from another table or stage: ``[target]``, ``[impact]``, for the
    bed ``[dem.contact]``, or what bears ``Follows``."""
    shared = name in stages.SHARED_TABLES or (path[0], name) == ("bed", "contact")
    follows = any(isinstance(item, Follows) for item in entry.metadata)
    return follows or (shared and len(path) == 1 and path[0] in stages.ORDER)


def inner_tables(annotation: Any, many: str = "") -> Iterator[tuple[Any, str]]:
    """The models inside an annotation, each with "list" or "by name" when there may be several."""
    if isinstance(annotation, type) and not typing.get_args(annotation):
        if issubclass(annotation, BaseModel):
            yield annotation, many
        return
    origin = typing.get_origin(annotation)
    inside = "list" if origin in (tuple, list) else "by name" if origin is dict else many
    for argument in typing.get_args(annotation):
        yield from inner_tables(argument, inside)


def of_material(path: tuple[str, ...]) -> bool:
    """Whether a path is that of one material's table, ``[sph.materials.NAME]``."""
    return path == ("sph", "materials", MATERIAL)


def material_sections() -> dict[str, Any]:
    """Title of a table in ``[sph.materials.NAME]`` -> the parameters of the law that it belongs to."""
    from sph.damage import grady_kipp
    from sph.materials import rows as materials
    from sph.materials import temperature
    from sph.materials.families import FAMILIES

    laws = {
        family.title(module): module.Parameters
        for family in FAMILIES
        for module in family.laws
        if hasattr(module, "Parameters")
    }
    return {
        "elastic": materials.Elastic,
        "tension": materials.Tension,
        "melting": materials.Melting,
        "thermal": temperature.Parameters,
        "weibull": grady_kipp.Parameters,
        **laws,
    }


def keys(table: Table) -> list[Key]:
    """The keys of a table that hold values, without those that are tables themselves; a table of one entry for each
    measure has one row."""
    rows = []
    if set(fields(table.kind)) == set(COMPARED):
        allowed_ = "quantity in the measure's unit, >= 0"
        return [Key((*table.path, MEASURE), allowed_, "none", f"Any of {', '.join(COMPARED)}.")]
    for name, entry in fields(table.kind).items():
        holds_tables = any(True for _ in inner_tables(entry.annotation)) or (
            of_material(table.path) and name in material_sections()
        )
        if holds_tables or stands_elsewhere(table.path, name, entry):
            continue
        path = (*table.path, entry.alias or name)
        rows.append(Key(path, allowed(entry), default(entry), text_of(entry.description) + experimental.remark(path)))
    if table.name in OUTSIDE:
        name, meaning = stages.OUTSIDE[table.name], OUTSIDE[table.name]
        rows.append(Key((*table.path, name), "name of a file", "none", text_of(meaning)))
    return rows


def text_of(description: str | None) -> str:
    """A docstring as one line of plain text."""
    return " ".join((description or "").split()).replace("``", "`")


def unit_of(entry: FieldInfo) -> str | None:
    """The SI unit of a field."""
    own = next((item.symbol for item in entry.metadata if isinstance(item, Unit)), None)
    return own or plain.unit_in(entry.annotation)


def allowed(entry: FieldInfo) -> str:
    """What a field may hold: "quantity in m, > 0", "0 to 1", "quick | fine"."""
    options = list(_choices(entry.annotation))
    limits = _limits([*entry.metadata, *_metadata(entry.annotation)])
    unit = unit_of(entry)
    kind = f"quantity in {'deg' if unit == 'rad' else unit}" if unit else _kind(entry.annotation)
    parts = [
        part
        for part in (
            f"{kind}, {limits}" if kind and limits else kind or limits,
            " | ".join(f'"{option}"' for option in options),
        )
        if part
    ]
    words = " or ".join(parts)
    return f"list of {words}" if typing.get_origin(entry.annotation) in (tuple, list) and options else words


def _choices(annotation: Any) -> Iterator[str]:
    if typing.get_origin(annotation) is typing.Literal:
        yield from (str(option) for option in typing.get_args(annotation))
        return
    for argument in typing.get_args(annotation):
        yield from _choices(argument)


def _metadata(annotation: Any) -> Iterator[Any]:
    yield from getattr(annotation, "__metadata__", ())
    for argument in typing.get_args(annotation):
        yield from _metadata(argument)


def _limits(metadata: list[Any]) -> str:
    words = []
    for item in metadata:
        for inner in getattr(
            item, "metadata", [item]
        ):  # pydantic's Field inside Annotated holds its limits one level down
            for name, sign in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<=")):
                if getattr(inner, name, None) is not None:
                    words.append(f"{sign} {getattr(inner, name):g}")
    return " and ".join(dict.fromkeys(words))


def _kind(annotation: Any) -> str:
    """ "number", "whole number" ... of the plain types in an annotation."""
    if typing.get_origin(annotation) is typing.Literal:
        return ""
    words = {float: "number", int: "whole number", bool: "true or false", str: "text", Path: "name of a file"}
    if isinstance(annotation, type) and not typing.get_args(annotation):
        return words.get(annotation, "")
    inner = [word for word in map(_kind, typing.get_args(annotation)) if word]
    kind = " or ".join(dict.fromkeys(inner))
    origin = typing.get_origin(annotation)
    if origin in (tuple, list):
        return f"list of {kind}" if kind else ""
    if isinstance(origin, type) and issubclass(origin, typing.Mapping):  # type: ignore[arg-type]
        return f"table of {inner[-1]}" if inner else "table"
    return kind


def default(entry: FieldInfo) -> str:
    """The default as one writes it in a case; "required" where there is none, "none" where the key may be absent,
    "follows the case" where other keys decide it."""
    if entry.is_required():
        return "required"
    if entry.default_factory_takes_validated_data:
        return "follows the case"
    value = entry.get_default(call_default_factory=True)
    if value is None or value == () or value == {} or value == "":
        return "none"
    return shown(value, unit_of(entry))


def shown(value: Any, unit: str | None) -> str:
    """A value with its unit in the size in which people read it: ``"52 km"``, ``"40 deg"``, ``true``."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(shown(item, unit) for item in value) + "]"
    if not isinstance(value, (int, float)):
        return str(value)
    if not unit or not math.isfinite(value):
        return f"{value:.10g}"
    sizes = ((least, f"{value / scale:.10g} {symbol}") for least, scale, symbol in _SIZES.get(unit, ()))
    return (
        f'"{next((text for least, text in sizes if abs(value) >= least and len(text) < 10), f"{value:.10g} {unit}")}"'
    )


# from which value on [SI], scale, symbol; a unit that would need many digits is passed over
_SIZES = {
    "m": ((1e3, 1e3, "km"), (1.0, 1.0, "m"), (1e-12, 1e-3, "mm")),
    "m/s": ((1e3, 1e3, "km/s"),),
    "s": ((3600.0, 3600.0, "h"), (180.0, 60.0, "min"), (0.1, 1.0, "s"), (1e-12, 1e-3, "ms")),
    "rad": ((0.0, math.pi / 180.0, "deg"),),
    "Pa": ((1e9, 1e9, "GPa"), (1e6, 1e6, "MPa")),
    "J/kg": ((1e6, 1e6, "MJ/kg"),),
}


def paths_named(word: str) -> list[str]:
    """Full names of the keys and tables that are called ``word``, ``["impact.speed"]`` for "speed"."""
    return _by_last_word().get(word, [])


@functools.cache
def _by_last_word() -> dict[str, list[str]]:
    names: dict[str, list[str]] = {}
    for table in tables():
        for path in (table.path, *(key.path for key in keys(table))):
            names.setdefault(path[-1], []).append(".".join(path))
    return names


def wildcard(path: tuple[str, ...]) -> tuple[str, ...]:
    """A path of a case with the numbers of list elements left out, ``NAME`` instead of a material or of what a sweep
    draws, and ``MEASURE`` instead of a measure with a chain error."""
    parts = tuple(part for part in path if not part.isdigit())
    if parts[:2] == ("crater", "chain") and len(parts) > 3:
        return (*parts[:3], MEASURE)
    named = parts[:2] in (("sph", "materials"), ("sweep", "prior"))
    if named and len(parts) > 2:
        table, group, _, *rest = parts
        return (table, group, MATERIAL, *rest)
    return parts


def find(name: str) -> tuple[list[Table], list[Key]]:
    """The table called ``name`` with those inside it, or the key of that name (a key's own name is enough).

    Raises ``InputError`` with the nearest name when there is neither.
    """
    path = wildcard(tuple(part for part in name.strip("[]").split(".") if part))
    top = ("case", *SHARED, "sweep", "inverse", *stages.ORDER)
    all_tables = list(tables(path[0] if path and path[0] in top else None))
    inside = [table for table in all_tables if table.path[: len(path)] == path]
    if inside:
        return inside, []
    every = [key for table in all_tables for key in keys(table)]
    matching = [key for key in every if key.path == path] or [key for key in every if key.path[-len(path) :] == path]
    matching_tables = [] if matching else [table for table in all_tables if table.path[-len(path) :] == path]
    if not matching and not matching_tables:
        known = [key.name for key in every] + [table.name for table in all_tables]
        short = list(dict.fromkeys(full.rpartition(".")[2] for full in known))
        near = stages.nearest(".".join(path), known) if len(path) > 1 else stages.nearest(name, short)
        raise InputError(f"--describe {name}: there is no such table or key{near}; run_case --describe names them all")
    return matching_tables, matching
