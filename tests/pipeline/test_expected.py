"""``expected.toml``: mistakes are one message with lines, the chain error reaches the measures, a run is held against
it where it is of its kind."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from crater import settings as crater_settings
from crater import stage as crater_stage
from crater.measures import chain, measure
from matter.errors import InputError
from matter.wording.crater_measures import COMPARED
from pipeline.case import read as cases
from pipeline.settings import expected
from pipeline.settings.compose import compose

ROOT = Path(__file__).resolve().parents[2]
VALHALLA = ROOT / "cases" / "valhalla_980km"
TEXT = """\
[tiny]
command = "python studies/chain_error.py"
commit = "0123456789abcdef"
measured = "2026-11-22"
members = 8
shocks = 4

[tiny.final.diameter_apparent_m]
value = "550 km"
measuring = "12 km"
draws = "16 km"
handoff = "30 km"
size = "8 km"

[tiny.final.volume_m3]
value = "8e6 km^3"
measuring = "4e5 km^3"
draws = "3e5 km^3"

[tiny.transient.depth_m]
value = "235 km"
measuring = "8 km"
"""


@pytest.fixture
def folder(tmp_path):
    """A copy of a shipped case with expectations of its smallest preset."""
    place = tmp_path / "valhalla"
    place.mkdir()
    (place / "case.toml").write_text((VALHALLA / "case.toml").read_text())
    (place / "expected.toml").write_text(TEXT)
    return place


def test_every_shipped_expectation_is_of_a_preset_that_the_case_has():
    files = sorted((ROOT / "cases").glob("*/expected.toml"))
    for file in files:
        for name, table in expected.read(file.parent).items():
            case = cases.read(file.parent, None if name == expected.NO_PRESET else name)
            assert expected.expected_result(case) == table
            assert any(getattr(getattr(table, crater), one) for crater in expected.CRATERS for one in COMPARED)


def test_all_mistakes_come_at_once_with_their_lines(folder):
    wrong = (
        TEXT.replace('draws = "16 km"', 'draw = "16 km"')
        .replace('"12 km"', '"-12 km"')
        .replace('"8e6 km^3"', '"8e6 km"')
        .replace("members = 8", "members = 0")
    )
    (folder / "expected.toml").write_text(wrong)
    with pytest.raises(InputError) as caught:
        expected.expected_result(cases.read(folder, "tiny"))
    message = str(caught.value)
    assert "3 errors" in message and "expected.toml:5  tiny.members: must be at least 1 (given: 0)" in message
    assert "expected.toml:11" in message and "there is no such key; did you mean 'draws'?" in message
    assert (
        "measuring is an error and must be at least 0" not in message
    )  # the wrong key of the same table is said first
    assert "expected.toml:16  tiny.final.volume_m3.value: '8e6 km' is not a quantity in m^3" in message
    (folder / "expected.toml").write_text(TEXT.replace('"12 km"', '"-12 km"'))
    with pytest.raises(InputError, match="measuring is an error and must be at least 0"):
        compose(cases.read(folder, "tiny"))
    (folder / "expected.toml").write_text("[tiny\n")
    with pytest.raises(InputError, match="not valid TOML"):
        expected.read(folder)


def test_the_crater_stage_gets_the_chain_error_of_what_was_measured(folder):
    def errors(preset, *overrides):
        settings = compose(cases.read(folder, preset, overrides))["crater"]
        assert isinstance(settings, crater_stage.Settings)
        return settings.chain

    given = errors("tiny")
    assert given.final.diameter_apparent_m == pytest.approx(math.sqrt(16e3**2 + 30e3**2 + 8e3**2))
    assert given.final.volume_m3 == pytest.approx(3e14) and given.final.depth_m is None
    assert given.transient.depth_m is None  # no part of it was measured
    assert errors("quick") is None  # nothing is known of this preset
    assert errors("tiny", "impact.speed=15 km/s") is None  # nor of another impact
    assert errors("tiny", "bed.seed=1", "dem.ranks=4") == given  # the same values, and one that is only looked at
    assert errors("tiny", "bed.seed=2") is None
    assert errors("tiny", 'crater.chain.final.depth_m="7 km"').final.depth_m == 7e3  # a case's own


def test_a_used_case_keeps_its_chain_error(folder, tmp_path):
    from pipeline.settings import used

    case = cases.read(folder, "tiny")
    settings = compose(case)
    used.write(tmp_path / "case.used.toml", case, settings)
    assert compose(cases.read(tmp_path / "case.used.toml"))["crater"] == settings["crater"]


def quantity(value, sigma, **parts):
    return {"value": value, "sigma": sigma, "unit": "m", "sigma_parts": parts}


def test_a_run_agrees_within_two_standard_errors(folder):
    table = expected.expected_result(cases.read(folder, "tiny"))
    sigma = math.hypot(12e3, 16e3, 30e3, 8e3)

    def verdict(value):
        return expected.verdicts(table, {"final": {"diameter_apparent_m": quantity(value, 1.0)}, "transient": {}})

    (exact,) = verdict(550e3)
    assert (exact.crater, exact.measure, exact.deviation, exact.agrees) == ("final", "diameter_apparent_m", 0.0, True)
    assert exact.sigma == pytest.approx(sigma)
    assert verdict(550e3 + 1.99 * sigma)[0].agrees and not verdict(550e3 - 2.01 * sigma)[0].agrees
    assert verdict(550e3 - 2.3 * sigma)[0].deviation == pytest.approx(-2.3)
    assert verdict(None) == []


def test_the_last_lines_of_a_run(folder, tmp_path):
    from matter.files import archive

    run = tmp_path / "run"
    (run / "6_crater").mkdir(parents=True)
    content = {
        "final": {"diameter_apparent_m": quantity(655e3, 1e3)},
        "transient": {"depth_m": quantity(236e3, 1e3), "at_maximum_depth": {}},
    }
    archive.write_text(run / "6_crater" / "measures.json", json.dumps(content))
    lines = expected.text(cases.read(folder, "tiny"), run).splitlines()
    assert "preset tiny of valhalla (8 draws, commit 01234567, 2026-11-22)" in lines[0]
    assert lines[1].split() == "transient depth 236 km, expected 235 +- 8 km: agrees".split()
    assert lines[2].split() == "final apparent diameter 655 km, expected 550 +- 37 km: differs by 2.8 sigma".split()
    archive.write_text(
        run / "6_crater" / "measures.json", json.dumps(content | {"final": content["final"] | {"settled": False}})
    )
    assert "last snapshot (no final crater) apparent diameter" in expected.text(cases.read(folder, "tiny"), run)
    assert "not compared" in expected.text(cases.read(folder, "tiny", ["sph.seed=3"]), run)
    assert expected.text(cases.read(folder, "quick"), run) == ""
    assert expected.text(cases.read(folder, "tiny"), tmp_path / "nowhere") == ""


def test_a_run_that_goes_on_ends_with_the_same_lines(folder, tmp_path):
    from matter.files import archive
    from pipeline.running import going_on
    from pipeline.settings import describe

    def begun(name, *overrides):
        case, run = cases.read(folder, "tiny", overrides), tmp_path / name
        (run / "6_crater").mkdir(parents=True)
        content = {"final": {"diameter_apparent_m": quantity(655e3, 1e3)}, "transient": {}}
        archive.write_text(run / "6_crater" / "measures.json", json.dumps(content))
        describe.describe(run, case, (), compose(case), 1)
        return case, run

    case, run = begun("valhalla-01234567")
    again = going_on.read(run)
    assert "differs by 2.8 sigma" in expected.text(case, run) and expected.text(again, run) == expected.text(case, run)
    assert compose(again)["crater"] == compose(case)["crater"]
    _, other = begun("valhalla-89abcdef", "sph.seed=3")
    assert "not compared" in expected.text(going_on.read(other), other)
    record = json.loads((run / "provenance.json").read_text())
    record["case"]["file"] = str(tmp_path / "gone" / "case.toml")
    archive.write_text(run / "provenance.json", json.dumps(record))
    assert expected.text(going_on.read(run), run) == ""


def test_the_chain_error_joins_in_quadrature_and_is_named():
    found = {
        "depth_m": measure.Quantity(70e3, 6e3, "m", parts={"azimuth": 6e3}),
        "diameter_rim_m": measure.Quantity(None, None, "m", "no rim"),
        "rim_height_m": measure.Quantity(9e3, 2e3, "m"),
    }
    known = measure.Measures(found, None, None, None)
    joined = chain.with_chain(known, crater_settings.Errors(depth_m=8e3, diameter_rim_m=9e3, volume_m3=1.0))
    assert joined["depth_m"].sigma == pytest.approx(10e3) and joined["depth_m"].parts == {"azimuth": 6e3, "chain": 8e3}
    assert joined["diameter_rim_m"] == found["diameter_rim_m"] and joined["rim_height_m"] == found["rim_height_m"]
    assert joined["depth_m"].as_dict()["sigma_parts"]["chain"] == 8e3
