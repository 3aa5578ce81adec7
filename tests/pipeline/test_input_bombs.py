"""Input that is made to hang or to fill the screen: one short message and exit code 2, in seconds."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from matter.case import material, quantity
from matter.files import toml_input
from pipeline import cli
from pipeline.case import keys
from pipeline.case import read as cases
from pipeline.commands import command
from pipeline.running.request import Request, settings_of
from sph import cost_prediction
from sph.bodies import projectile
from tests.pipeline import warm

ROOT = Path(__file__).resolve().parents[2]
OWN, DART = ROOT / "examples" / "own_case.toml", ROOT / "cases" / "dart_dimorphos"
DEEP = "nested more than 50 deep"


def checked(*words: object, within: float = 60.0):
    """``run_case ... --check`` in a child of this process, which is killed after ``within`` seconds."""

    def work() -> None:
        sys.argv = ["run_case", *map(str, words), "--check"]
        cli.run_case()

    done = warm.run(work, {"COLUMNS": "200"}, timeout=within)
    assert "Traceback" not in done.stderr and len(done.stderr) <= command.LONGEST + 100, done.stderr[:2000]
    return done


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("case.note=" + "[" * 500 + "]" * 500, DEEP),
        ("case.note=" + "[" * 100 + "]" * 100, DEEP),
        ("bed.seed=" + "9" * 5000, "a whole number is larger than"),
        ("bed.seed=9223372036854775808", "a whole number is larger than"),
        (".".join("a" * 2000) + "=1", "write it as key.path=value"),
        ("target.layers." + "9" * 5000 + ".material=ice", "target.layers"),
        ("target.layers.\u00b2.material=ice", "target.layers"),
        ("impact.speed=" + "9" * 194_000, "impact.speed"),
        ("impact." + "x" * 194_000 + "=1", "there is no such key"),
        ("case.title=" + "[" + "1," * 100_000 + "]", "case.title"),
    ],
    ids=lambda text: text[:30] if "=" in text else "",
)
def test_an_option_beyond_all_limits_is_one_short_message(assignment, words):
    done = checked(OWN, "--set", assignment)
    assert done.returncode == 2 and words in done.stderr, done.stderr[:2000]


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 500 + "]" * 500,
        "a = " + "{b=" * 500 + "1" + "}" * 500,
        ".".join(["a"] * 2000) + " = 1",
        "[" + ".".join(["a"] * 2000) + "]",
        "count = 0x" + "f" * 4000,
        "count = " + "9" * 5000,
    ],
    ids=["lists", "tables", "key", "header", "hexadecimal", "decimal"],
)
def test_a_file_beyond_all_limits_is_one_short_message(tmp_path, text):
    (tmp_path / "mine.toml").write_text(f"{text}\n{OWN.read_text()}")
    done = checked(tmp_path / "mine.toml")
    assert done.returncode == 2 and (DEEP in done.stderr or "a whole number is larger" in done.stderr), done.stderr


def test_what_lies_within_the_limits_is_read():
    depth = toml_input.DEEPEST - 2
    assert toml_input.loads(f"a = {'[' * depth}{']' * depth}\nb = {toml_input.LARGEST}")["b"] == 2**63 - 1
    assert toml_input.loads(f"b = {-(2**63)}")["b"] == -(2**63)
    with pytest.raises(toml_input.BeyondLimits):
        toml_input.loads(f"b = {-(2**63) - 1}")


TOWERS = (
    "2 km**9**9**9/s", "2 km^9^9^9^9/s", "2 9**9**9**9 km/s", "2 km/s**9**9**9", "2 (((9**99)**99)**99)**99 km/s",
    "2 9**(9**(9**9)) km/s", "2 km**-9**9**9/s", "2 km**999999999/s", "2 9\u2079\u2079\u2079\u2079\u2079\u2079 km/s",
    "2 9\u2079**99**9 km/s", "1 (km**99)**99/(m**99)**99", "1 " + "km " * 2000,
)  # fmt: skip


@pytest.mark.parametrize("text", TOWERS, ids=lambda text: ascii(text[:20]))
def test_powers_of_powers_in_a_unit_are_refused_at_once(text):
    def work() -> None:
        for unit in ("", "m/s"):
            try:
                quantity.parse(text, unit)
            except ValueError as reason:
                assert len(str(reason)) < 400
                continue
            raise AssertionError("read as a quantity")

    done = warm.run(work, {}, timeout=60.0)
    assert done.returncode == 0, done.stderr[-500:]


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("3 (m/s)^2", "J/kg", 3.0), ("3 (m/s)**2", "J/kg", 3.0), ("2 kg/m^3", "kg/m^3", 2.0), ("4 m^-3", "1/m^3", 4.0),
        ("2 J/(kg K)", "J/(kg K)", 2.0), ("2 cm\u00b2", "", 2e-4), ("4 m**0.5 m**0.5", "m", 4.0),
        ("5 m s^-1", "m/s", 5.0), ("5 kg m**2 / s**2 / kg", "J/kg", 5.0),
    ],
)  # fmt: skip
def test_units_as_people_write_them_are_read(text, unit, value):
    assert quantity.parse(text, unit) == pytest.approx(value)


def test_a_thousand_unknown_tables_are_told_in_a_second(tmp_path):
    text = OWN.read_text() + "".join(f"\n[t{number}]\na = 1\n" for number in range(1000))
    (tmp_path / "mine.toml").write_text(text)
    settings_of(Request(cases.read(OWN), tmp_path))  # imports
    keys.paths_named("x")
    began = time.process_time()
    with pytest.raises(ValueError, match="1000 errors") as caught:
        settings_of(Request(cases.read(tmp_path / "mine.toml"), tmp_path))
    assert time.process_time() - began < 10.0 and "and 970 more" in str(caught.value)
    assert len(str(caught.value)) < command.LONGEST


def test_many_layers_are_put_together_from_files_that_are_read_once(tmp_path, monkeypatch):
    layer = '\n[[target.layers]]\nname = "l{}"\nmaterial = "granite"\nthickness = "10 m"\n'
    text = OWN.read_text().replace('layers = [{ material = "granite" }]\n', "")
    (tmp_path / "mine.toml").write_text(text + "".join(layer.format(number) for number in range(40)))
    read, loads = [], material.tomllib.loads
    monkeypatch.setattr(material.tomllib, "loads", lambda text: read.append(text) or loads(text))
    settings = settings_of(Request(cases.read(tmp_path / "mine.toml"), tmp_path))
    cost_prediction.predict(settings["sph"])
    files = [text for text in read if "[tillotson]" in text or "[elastic]" in text]
    assert len(files) == len(set(files))


def test_parts_of_any_size_are_counted_without_being_laid_out(tmp_path):
    """As many as there are, and in an instant where there are too many."""
    case = cases.read(DART, "parts")
    sph = settings_of(Request(case, tmp_path))["sph"]
    materials, ball = sph.chosen_materials(), sph.impact.projectile
    for spacing in (sph.projectile_spacing, 0.31, 0.07):
        found, told = projectile.pellets(ball, spacing, materials), projectile.sizes(ball, spacing, materials)
        assert sum(n for n, _ in told) == len(found.fraction)
        assert min(width for _, width in told) == pytest.approx(found.width.min(), rel=1e-12)
    began = time.process_time()
    assert projectile.count(ball, 1e-6, materials) > 1e15
    assert time.process_time() - began < 1.0
