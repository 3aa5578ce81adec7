"""The JSON schema of case files takes what a run takes, and refuses what an editor can see to be wrong."""

from __future__ import annotations

import copy
import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

from pipeline.case import read as cases
from pipeline.case.overlay import assigned
from pipeline.commands import schema
from pipeline.settings import used
from pipeline.settings.compose import compose

ROOT = Path(__file__).resolve().parents[2]
CASES = sorted((ROOT / "cases").glob("*/case.toml"))


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft7Validator:
    found = json.loads(json.dumps(schema.schema()))
    jsonschema.Draft7Validator.check_schema(found)
    return jsonschema.Draft7Validator(found)


@pytest.mark.parametrize("file", CASES, ids=lambda file: file.parent.name)
def test_a_shipped_case_with_each_preset_and_as_used_is_valid(validator, file, tmp_path):
    content = tomllib.loads(file.read_text())
    assert [error.message for error in validator.iter_errors(content)] == []
    for preset in (None, *content.get("preset", {})):
        case = cases.read(file, preset)
        assert [error.message for error in validator.iter_errors(case.document)] == []
        used.write(tmp_path / "case.used.toml", case, compose(case))
        assert [
            error.message for error in validator.iter_errors(tomllib.loads((tmp_path / "case.used.toml").read_text()))
        ] == []


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("sph", "spacng_far"), "1 km"),
        (("sph", "spacing_far"), 1000.0),
        (("sph", "spacing_far"), "1000"),
        (("sph", "spacing_far"), "1,5 km"),
        (("sph", "courant"), 2.0),
        (("sph", "viscosity_switch"), "balsara"),
        (("sph", "late"), {"att": "1 s"}),
        (("sph", "materials"), {"granit": {"strength": "collins"}}),
        (("sph", "materials"), {"granite": {"collins": {"cohesion": 3.0}}}),
        (("target", "layers"), [{"name": "a", "material": "ice"}]),
        (("target", "layers", 0, "material"), "bassalt"),
        (("dem", "contact", "shell", "friction"), -1.0),
        (("dem", "accept"), "no_twist"),
        (("handoff", "time"), "later"),
        (("crater", "reference"), [{"quantity": "depth_m"}]),
        (("preset", "quick", "sph", "spacng_far"), "1 km"),
        (("shp",), {}),
        (("case",), {}),
    ],
)
def test_a_mistake_is_refused(validator, path, value):
    good = tomllib.loads((ROOT / "cases" / "valhalla_980km" / "case.toml").read_text())
    assert validator.is_valid(good)
    assert not validator.is_valid(assigned(copy.deepcopy(good), path, value))


def test_an_editor_is_told_unit_range_default_and_meaning(tmp_path):
    schema.write(tmp_path / "case.schema.json")
    found = json.loads((tmp_path / "case.schema.json").read_text())
    entry = found["properties"]["sph"]["properties"]["first_step"]
    assert entry["type"] == "string" and entry["x-unit"] == "s" and entry["description"].endswith("[s, > 0]")
    assert found["properties"]["handoff"]["properties"]["time"]["default"] == "auto"
    assert found["definitions"]["target.Layer"]["required"] == ["name", "material", "thickness"]
    assert "``" not in json.dumps(found)
