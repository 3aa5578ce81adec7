"""Every key of a case file says what it means: the settings themselves are the reference that ``run_case --describe``
prints."""

from __future__ import annotations

import typing
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel

from matter.case import quantity
from matter.errors import InputError
from pipeline.case import keys, overlay, stages
from pipeline.case.case_table import CaseTable
from pipeline.commands import key_reference

ROOT = Path(__file__).resolve().parents[2]


def models(annotation: object) -> Iterator[type[BaseModel]]:
    """The models named in an annotation, and those that they hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        for field in annotation.model_fields.values():
            yield from models(field.annotation)
    for inner in typing.get_args(annotation):
        yield from models(inner)


@pytest.mark.parametrize("table", ["case", *stages.ORDER])
def test_every_key_is_described(table):
    top = CaseTable if table == "case" else stages.load(table).Settings
    for model in set(models(top)):
        for name, field in model.model_fields.items():
            text = (field.description or "").strip()
            sentence = len(text) > 8 and (text.startswith("``") or text[0].isupper()) and text.endswith(".")
            assert sentence, f"{model.__module__}.{model.__name__}.{name}: {text!r}"


def test_every_table_and_key_is_printed_with_unit_range_and_default():
    text = key_reference.describe()
    for table in keys.tables():
        assert f"[{table.name}]" in text
        for key in keys.keys(table):
            assert f"\n  {key.path[-1]}  (" in text
    assert "  spacing_far  (quantity in m, > 0; default" in text
    assert "  courant  (number, > 0 and <= 1; default follows the case)" in text
    assert "  gravity_shift  (number, >= 0 and <= 1; default 0.05)" in text
    assert text.index("\n  spacing_at_impact  (") < text.index(
        "\n  courant  ("
    )  # what a stage sets itself stands before what it inherits
    assert "  angle_from_vertical  (quantity in deg; required)" in text
    assert '  time  (quantity in s, > 0 or "auto" | "last"; default "auto")' in text
    assert "  snapshot  (name of a file; default none)" in text
    assert "``" not in text and "functools" not in text


@pytest.mark.parametrize(
    ("name", "words", "absent"),
    [
        ("sph.late", ["[sph.late]", "  sound_speed  (quantity in m/s, > 0; required)"], "[sph]"),
        ("[dem.contact]", ["[dem.contact.shell]", '  cohesion  ("none" | "zhang" | "sjkr"; default "none")'], "[dem]"),
        ("target.layers.0", ["[[target.layers]]", "  thickness"], "[impact]"),
        (
            "sph.materials.ice.collins",
            ["[sph.materials.NAME.collins]", "  internal_friction  (number, >= 0; required)"],
            "tillotson",
        ),
        (
            "dem.step_factor",
            ["  dem.step_factor  (number, > 0 and <= 1; default 1)", "sensitivity test"],
            "still_interval  (",
        ),
        ("step_factor", ["  dem.step_factor  ("], "[dem]"),
    ],
)
def test_one_table_or_one_key(name, words, absent):
    text = key_reference.describe(name)
    assert all(word in text for word in words) and absent not in text


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("sph.lat", "sph.late"),
        ("dem.contct", "dem.contact"),
        ("spacing", "spacing_at_impact"),
        ("diameter", "radius"),
        ("velocity", "speed"),
    ],
)
def test_a_mistake_is_told_the_nearest_name(name, meant):
    with pytest.raises(InputError, match=f"did you mean '{meant}'"):
        key_reference.describe(name)


def test_numbers_are_shown_as_people_write_them():
    assert [keys.shown(value, unit) for value, unit in ((52e3, "m"), (1000.0, "s"), (3600.0, "s"), (0.05, "s"),
    (0.6981317007977318, "rad"), (1, None))] == [
        '"52 km"', '"1000 s"', '"1 h"', '"50 ms"', '"40 deg"', "1",
    ]  # fmt: skip


def test_the_list_names_what_can_be_named(call):
    done = call("run_case", "--list", cwd=ROOT)
    assert done.returncode == 0, done.stderr
    for words in (
        "valhalla_980km ",
        "presets: thesis, quick, tiny",
        "granite",
        "thesis_980km",
        "tillotson | murnaghan | ideal_gas",
        "hooke | hertz",
    ):
        assert words in done.stdout
    assert "granite" not in call("run_case", "--list", "observed", cwd=ROOT).stdout
    done = call("run_case", "--list", "material")
    assert done.returncode == 2 and "did you mean 'materials'" in done.stderr


def test_the_version_and_the_shell_s_completion(call):
    for name in ("run_case", "inspect_handoff", "export_snapshot"):
        done = call(name, "--version")
        assert done.returncode == 0 and done.stdout.startswith("bolide 0."), done.stderr
    for line, offered in (
        ("run_case --descr", "--describe"),
        ("run_case --from ha", "handoff"),
        ("run_case cases/valhalla_980km --preset qu", "quick"),
    ):
        done = call(
            "run_case",
            cwd=ROOT,
            _RUN_CASE_COMPLETE="complete_bash",
            COMP_WORDS=line,
            COMP_CWORD=str(len(line.split()) - 1),
        )
        assert done.stdout.split() == [offered], (line, done.stdout, done.stderr)


def test_the_example_of_a_message_is_a_key():
    with pytest.raises(InputError) as caught:
        overlay.parsed("impact.speed")
    path, value = overlay.parsed(str(caught.value).rpartition("--set ")[2].split("'")[1])
    assert [key.name for key in keys.find(".".join(map(str, path)))[1]] == ["sph.end_time"] and quantity.parse(
        value, "s"
    ) == 1800.0


def test_keys_are_few():
    """One more takes the place of one that no case, material or study sets."""
    assert sum(len(keys.keys(table)) for table in keys.tables()) <= 250
