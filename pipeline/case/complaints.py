"""From a validation error to a sentence that a user can act on: where, what, the nearest valid name."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from matter.case.identity_fields import following
from pipeline.case import keys
from pipeline.case.stages import SHARED_TABLES, nearest
from pipeline.case.toml_lines import KeyPath


class Complaint(NamedTuple):
    """One thing that is wrong, at a key path of the composed case."""

    path: KeyPath
    message: str


def dotted(path: KeyPath) -> str:
    """``("target", "layers", 2, "material")`` as ``target.layers[2].material``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{short(part)}" if text else short(str(part))
    return short(text, 300)


def complaints(model: type[BaseModel], error: ValidationError) -> list[Complaint]:
    """Every error of a validation as a complaint; paths are relative to the model. What fits none of several kinds is
    one complaint, not one for each."""
    # a default that could not be worked out is no mistake of its own: what it goes by has one
    entries = [entry for entry in error.errors(include_url=False) if entry["type"] != "default_factory_not_called"]
    key_paths = [path_of(model, entry) for entry in entries]
    by_key: dict[KeyPath, list[str]] = {}
    for entry, key_path in zip(entries, key_paths):
        # a list whose elements are all wrong is also reported as too short: that is no second mistake
        if entry["type"] == "too_short" and any(
            other[: len(key_path)] == key_path and other != key_path for other in key_paths
        ):
            continue
        by_key.setdefault(key_path, []).append(_worded(model, key_path, entry))
    return [Complaint(key_path, _joined(messages)) for key_path, messages in by_key.items()]


def path_of(model: type[BaseModel], entry: Any) -> KeyPath:
    """The key path of an error of the file: what pydantic inserts for the branch of a union (``float``,
    ``function-after[...]``) is left out."""
    key_path: list[str | int] = []
    here: list[Any] = [model]
    loc = entry["loc"]
    for position, part in enumerate(loc):
        last = position == len(loc) - 1
        fields = [_fields(one)[part] for one in _tables(here) if part in _fields(one)] if isinstance(part, str) else []
        free = [argument for one in here for argument in _free_keys(one)]
        if fields or free or isinstance(part, int):
            key_path.append(part)
            here = fields or free or here
        elif last and entry["type"] in _UNKNOWN:
            key_path.append(part)
    return tuple(key_path)


_UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")


def _tables(annotations: list[Any]) -> list[Any]:
    return [table for annotation in annotations for table in _tables_in(annotation)]


def _free_keys(annotation: Any) -> list[Any]:
    """What a table with any keys holds, such as ``dict[str, Choice]``; empty for anything else."""
    origin = typing.get_origin(annotation)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return [typing.get_args(annotation)[1]]
    return [free for argument in typing.get_args(annotation) if origin is not None for free in _free_keys(argument)]


def _joined(messages: list[str]) -> str:
    """Complaints about one value that may be of several kinds: the names that it may have come first."""
    distinct = list(dict.fromkeys(messages))
    if len(distinct) == 1:
        return distinct[0]
    bare = [message.partition(" (given: ")[0] for message in distinct]
    given = next((message[len(start) :] for message, start in zip(distinct, bare) if message != start), "")
    bare.sort(key=lambda message: not message.startswith('must be "'))
    return ", or: ".join(bare) + given


def _worded(model: type[BaseModel], path: KeyPath, entry: Any) -> str:
    kind, context, value = entry["type"], entry.get("ctx", {}), entry.get("input")
    given = "" if isinstance(value, (dict, list)) else f" (given: {_shown(value)})"
    if kind != "value_error" and isinstance(value, float) and not math.isfinite(value):
        return f"{value} is not a finite number"
    match kind:
        case "extra_forbidden" | "unexpected_keyword_argument":
            return unknown(
                path,
                [
                    name
                    for name in names_at(model, path[:-1])
                    if (*path[:-1], name) not in {*following(model), *((shared,) for shared in SHARED_TABLES)}
                ],
            )
        case "missing" | "missing_argument":
            return "is missing"
        case "greater_than":
            return f"must be greater than {context['gt']:g}{given}"
        case "greater_than_equal":
            return f"must be at least {context['ge']:g}{given}"
        case "less_than":
            return f"must be less than {context['lt']:g}{given}"
        case "less_than_equal":
            return f"must be at most {context['le']:g}{given}"
        case "literal_error":
            options = [option.strip().strip("'") for option in context["expected"].replace(" or ", ", ").split(",")]
            words = " or ".join(
                part for part in (", ".join(f'"{option}"' for option in options[:-1]), f'"{options[-1]}"') if part
            )
            return f"must be {words}{nearest(str(value), options)}{given}"
        case "value_error":
            return str(context["error"])
        case "too_short":
            return f"needs at least {context['min_length']} element{'s' if context['min_length'] > 1 else ''}"
        case "tuple_type" | "list_type":
            example = _shown(value) if isinstance(value, (str, int, float)) else "..."
            return f"must be a list, [{example}] for example{given}"
        case _ if kind in _KINDS:
            return f"must be {_KINDS[kind]}{given}"
        case _:
            return f"{entry['msg'][:1].lower()}{entry['msg'][1:]}{given}"


FORMER = {
    **dict.fromkeys(("bed_grains", "bed_step", "bed_radius"), "the stages before say it"),
    "tangential": 'the normal law brings its own, "spring" or "mindlin"',
    "attractive_tail": "contacts may always pull at their end",
    "tangential_stiffness_ratio": "it is 2/7",
    "wave_speed_limit": "it is 2",
    "overlap_warn": "it is 0.15 radii",
    "returning_speed_limit": "it is 0.3",
    "ocean": "liquid grains are smooth",
    "latitude_window": "it is 10 deg",
    "jupiter_mean_anomaly": "the population has its own (nbody.census.census.census takes another)",
    "speed_at_infinity": "it is 5 km/s (nbody.census.census.census takes another)",
    "still_change": "it is 0.1 mean grain radii",
    "damped_layers": "it is 3 mean grain diameters",
    "residual_speed": "it is 0.001",
    "rise_limit_over_diameter": "it is 0.15",
    "simple_to_complex": "it follows from gravity and from whether the ground is ice",
    "crush_table": "the curves are quadratic and two_power",
    "every": "every snapshot is measured",
    "sectors": "there are 24",
    "along_track": "with [target.companion] it is that of the circle about it",
    "crush_form": "pressure alone decides how pores crush",
    "mapping": "velocities are mapped by moving least squares",
    "liquids": "grains of water and water_thesis are liquid",
    "pull_interval": "it is a 500th of an orbit's time",
    "pinned": "[impact] with speed and angle says it",
    "until": "[dem] latest_time says it",
    "expected_speed": "the grains' own speeds say it; steps_per_contact shortens the step",
    "rayleigh_fraction": "it is 0.2; steps_per_contact shortens the step",
    **dict.fromkeys(("shortest", "length_terms", "viscosity", "volumes", "smoothing"), "[sph] numerics says it"),
    "longest": "it is 2",
    "conductivity": "[sph] numerics says it",
    "direct_packing": "a sphere holds the volume of its particle",
    "correction": "momentum is closed by one field over all grains",
    "region": "momentum is closed by one field over all grains",
    **dict.fromkeys(("kernel", "support"), "[sph] numerics says it"),
    "mindlin_history": "springs keep their force while a contact grows",
    "restitution_tangential": "it is 0.55",
    "rolling": "it is 1.05; shape scales the resistance",
    "pictures": "the report always has its pictures",
    "integrator": "it is fast (impact_census --integrator takes another)",
    **dict.fromkeys(("published_speed", "published_angle"), "[impact] with speed and angle says it"),
    "crush": "the table of its values, crush_quadratic or crush_two_power, says it",
    "companion.longitude": "a companion stands above longitude 0",
    "reference.at": "published transient craters are those at their first maximum of depth",
    "bed.growth": "it is 0.04",
    "theta": "the opening angle of the gravity tree is 0.5",
}
"""Former keys (``table.key`` where another table still has that key) and what replaces each. The case file of a run
that an earlier version made may name them."""

# pydantic's words for what a value should have been, in a user's
_KINDS = {
    "int_type": "a whole number", "int_parsing": "a whole number", "int_from_float": "a whole number",
    "float_type": "a number", "float_parsing": "a number",
    "bool_type": "true or false", "bool_parsing": "true or false", "string_type": "a text in quotes",
    "dict_type": "a table", "mapping_type": "a table",
    "model_type": "a table", "model_attributes_type": "a table", "finite_number": "a finite number",
}  # fmt: skip


def unknown(path: KeyPath, names: list[str], what: str = "key") -> str:
    """What to say of a key that there is not: a near name, the same key in another table, or all names where nothing
    is near."""
    *tables, word = (part for part in path if isinstance(part, str))
    for former in (word, ".".join((*tables[-1:], word))):
        if former in FORMER:
            return f"there is no such {what} any more: {FORMER[former]}"
    near = nearest(word, names, 0.75)
    if not near and (elsewhere := keys.paths_named(word)):
        return f"there is no such {what} here; did you mean {' or '.join(repr(name) for name in elsewhere[:3])}?"
    near = near or nearest(word, names)
    known = f" (known: {', '.join(names)})" if names and not near else ""
    return f"there is no such {what}{near}{known}"


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return f'"{short(value)}"'
    return str(value).lower() if isinstance(value, bool) else short(str(value))


def short(text: str, most: int = 80) -> str:
    """A text with its middle left out where it is long."""
    return text if len(text) <= most else f"{text[: most - 20]} ... {text[-10:]} ({len(text)} characters)"


def names_at(model: type[BaseModel], path: KeyPath) -> list[str]:
    """The key names that are valid in the table at ``path`` of a model."""
    here: list[Any] = [model]
    for part in path:
        inner = (
            [table for one in here for table in _tables_in(_fields(one).get(part))] if isinstance(part, str) else []
        )
        here = inner or here  # an index or the tag of a union names no table of its own
    return list(dict.fromkeys(name for one in here for name in _fields(one)))


def _fields(table: Any) -> dict[Any, Any]:
    if issubclass(table, BaseModel):
        return {field.alias or name: field.annotation for name, field in table.model_fields.items()}
    return typing.get_type_hints(table)


def _tables_in(annotation: Any) -> Iterable[type]:
    """The models and named tuples inside an annotation such as ``tuple[Layer, ...]`` or ``Contact | None``."""
    if isinstance(annotation, type) and not typing.get_args(annotation):
        if issubclass(annotation, BaseModel) or (issubclass(annotation, tuple) and hasattr(annotation, "_fields")):
            yield annotation
        return
    for argument in typing.get_args(annotation):
        yield from _tables_in(argument)
