"""The JSON schema of a case file, for editors that complete and check TOML (taplo, Even Better TOML): ``run_case
--schema FILE``.

Quantities are texts with a unit. What a preset, ``--set`` or the encounters may still bring is not required, so that a
schema never refuses a file that a run takes; what depends on several keys is left to ``run_case --check``.
"""

from __future__ import annotations

import functools
import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel, TypeAdapter

from matter.case import material, quantity
from matter.case.body import SOLIDS
from matter.case.identity_fields import following
from matter.files import archive
from pipeline.case import keys, stages

_KEPT = (
    "type",
    "enum",
    "const",
    "anyOf",
    "items",
    "properties",
    "additionalProperties",
    "minItems",
    "pattern",
    "required",
    "x-unit",
    "$ref",
)
_LIMITS = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum", "multipleOf")


def write(path: Path) -> None:
    """Write the schema. Raises ``InputError`` when there can be no such file."""
    archive.write_text(archive.check_file(path, "--schema"), json.dumps(schema(), indent=1) + "\n")


def schema() -> dict[str, Any]:
    """The schema of a case file with its presets."""
    definitions: dict[str, Any] = {}
    tables = {}
    for table in keys.tables():
        if len(table.path) == 1:
            tables[table.name] = _table(table.kind, table.path, definitions) | {
                "title": table.name,
                "description": table.meaning,
            }
    whole = {name for table in [*tables.values(), *definitions.values()] for name in _elements(table)}
    for name, definition in definitions.items():
        if f"#/definitions/{name}" not in whole:
            definition.pop("required", None)
    _without_thickness(tables["target"], definitions)
    loose = {name: {key: value for key, value in table.items() if key != "required"} for name, table in tables.items()}
    case = {**loose["case"], "required": ["title"]}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A case of bolide",
        "description": "An impact from its encounter to its crater: run_case FILE. Keys and meanings on the terminal: "
        "run_case --describe.",
        "type": "object",
        "properties": {**loose, "case": case, "preset": _presets(loose)},
        "required": ["case"],
        "additionalProperties": False,
        "definitions": definitions,
    }


def _presets(tables: dict[str, Any]) -> dict[str, Any]:
    about = (
        "Values that `--preset NAME` lays over the case, `[preset.NAME.sph]` for example; the preset `thesis` is "
        "taken when none is named."
    )
    return {
        "type": "object",
        "description": about,
        "additionalProperties": {"type": "object", "properties": tables, "additionalProperties": False},
    }


def _without_thickness(target: dict[str, Any], definitions: dict[str, Any]) -> None:
    """The layer of an ellipsoid or mesh needs no thickness: the shape makes it (``matter.case.body.Target``)."""
    layers, layer = target["properties"]["layers"], definitions["target.Layer"]
    definitions["target.SolidLayer"] = {**layer, "required": [key for key in layer["required"] if key != "thickness"]}
    target["if"] = {"properties": {"shape": {"enum": list(SOLIDS)}}, "required": ["shape"]}
    target["then"] = {"properties": {"layers": {"items": {"$ref": "#/definitions/target.SolidLayer"}}}}
    target["else"] = {"properties": {"layers": {"items": layers.pop("items")}}}


def _table(kind: Any, path: tuple[str, ...], definitions: dict[str, Any]) -> dict[str, Any]:
    """The schema of one table, with those of the tables inside it in ``definitions``."""
    whole = TypeAdapter(kind).json_schema(ref_template=f"#/definitions/{path[0]}.{{model}}")
    for name, definition in whole.pop("$defs", {}).items():
        definitions[f"{path[0]}.{name}"] = _plain(definition, name)
    schema = _plain(whole, kind.__name__)
    for *outer, name in following(kind) if issubclass(kind, BaseModel) else ():
        model = functools.reduce(lambda model, key: model.model_fields[key].annotation, outer, kind)
        (definitions[f"{path[0]}.{model.__name__}"] if outer else schema)["properties"].pop(name, None)
    if path[0] in keys.OUTSIDE:
        name, meaning = stages.OUTSIDE[path[0]], keys.OUTSIDE[path[0]]
        either = {"description": keys.text_of(meaning), "type": "string"}
        schema["properties"][name] = (
            {"anyOf": [either, schema["properties"][name]]} if name in schema["properties"] else either
        )
    return schema


def _plain(node: Any, name: str) -> dict[str, Any]:
    """A model's schema with plain texts, quantities as texts, materials by their names, and the tables of a material's
    laws."""
    schema = _node(node)
    for key, part in schema.get("properties", {}).items():
        if key == "material":
            part["enum"] = material.names()
        if key == "materials":
            part["propertyNames"] = {"enum": material.names()}
        if name == "Choice" and key in keys.material_sections():
            schema["properties"][key] = _section(keys.material_sections()[key]) | {
                "description": part.get("description", "")
            }
    return schema


def _node(node: Any) -> Any:
    if isinstance(node, list):
        return [_node(item) for item in node]
    if not isinstance(node, dict):
        return node
    # TOML has no null: the key is left out
    options = [item for item in node.get("anyOf", []) if item != {"type": "null"}]
    if "anyOf" in node and len(options) == 1:
        node = {**{key: value for key, value in node.items() if key != "anyOf"}, **options[0]}
    elif "anyOf" in node:
        node = {**node, "anyOf": options}
    schema = {key: _node(value) for key, value in node.items() if key in (*_KEPT, *_LIMITS) and key != "properties"}
    if "properties" in node:
        schema["properties"] = {key: _node(value) for key, value in node["properties"].items()}
    unit = node.get("x-unit") or next((item["x-unit"] for item in options if "x-unit" in item), None)
    if "description" in node:
        limits: dict[str, float] = next((item["x-number"] for item in (node, *options) if "x-number" in item), {})
        words = [
            f"{sign} {limits[name]:g}"
            for name, sign in (("gt", ">"), ("ge", ">="), ("lt", "<"), ("le", "<="))
            if name in limits
        ]
        schema["description"] = keys.text_of(node["description"]) + (f" [{', '.join([unit, *words])}]" if unit else "")
    default = node.get("default")
    if default is not None and not isinstance(default, (dict, list)):
        schema["default"] = keys.shown(default, unit).strip('"') if unit and not isinstance(default, str) else default
    return schema


def _section(law: Any) -> dict[str, Any]:
    """The values of a law in ``[sph.materials.NAME.<law>]``: texts with units; numbers may be texts too, as in a
    material's file."""
    properties = {}
    for name, entry in keys.fields(law).items():
        number = {"anyOf": [{"type": "string"}, {"type": "number"}]}
        value = {"type": "string", "pattern": quantity.TEXT} if keys.unit_of(entry) else number
        properties[name] = {
            **({"type": "array", "items": value} if "list" in keys.allowed(entry) else value),
            "description": keys.allowed(entry),
        }
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _elements(node: Any) -> list[str]:
    """References to what stands in lists: an element is written as a whole, so that its required keys stay
    required."""
    if isinstance(node, list):
        return [name for item in node for name in _elements(item)]
    if not isinstance(node, dict):
        return []
    own = [node["items"]["$ref"]] if isinstance(node.get("items"), dict) and "$ref" in node["items"] else []
    return own + [name for item in node.values() for name in _elements(item)]
