"""Variants of a handoff: what each changes, and how the ledger's rows are filled. Real ones: ``test_end_to_end``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from handoff.ledger import LIMITS, Ledger
from matter.errors import InputError
from matter.wording.crater_measures import RATIOS
from pipeline.uncertainty import sensitivity, sensitivity_table, variants

CASE = Path(__file__).resolve().parents[2] / "cases" / "valhalla_980km" / "case.toml"


@pytest.fixture
def run(tmp_path):
    (tmp_path / "4_handoff").mkdir()
    shutil.copy(CASE, tmp_path / "case.used.toml")
    (tmp_path / "4_handoff" / "handoff.json").write_text(
        json.dumps({"time_s": 240.0, "speed_limit_m_s": 430.5, "alpha_spacings": 1.5})
    )
    return tmp_path


def test_every_variant_changes_one_thing(run):
    from handoff import stage

    table = {variant.name: variant for variant in variants.variants(run)}
    settings = {name: sensitivity.settings_of(variant.request(run))["handoff"] for name, variant in table.items()}
    assert all(isinstance(one, stage.Settings) for one in settings.values())

    def of(name):
        one = settings[name]
        return one.time, one.speed_limit, one.alpha, one.control

    assert of("base") == of("another_bed") == (240.0, 430.5, 1.5, "none")
    assert of("time_x0.5")[0] == 120.0 and of("time_x2")[0] == 480.0
    assert of("speed_limit_x0.5")[1] == 215.25 and of("speed_limit_x2")[1] == 861.0
    assert of("alpha_x0.67")[2] == pytest.approx(1.005) and of("alpha_x1.5")[2] == 2.25
    assert of("control_at_rest")[3] == "at_rest" and of("control_uncarved")[3] == "uncarved"
    for name in table:
        assert sum(a != b for a, b in zip(of(name), of("base"))) == (0 if name in ("base", "another_bed") else 1)
    assert table["another_bed"].shared_stages == ("nbody", "sph") and "bed.seed=2" in table["another_bed"].overrides
    assert len({variant.request(run).run_folder for variant in table.values()}) == len(table) == 10


def test_what_cannot_be_varied_is_a_message(tmp_path, run):
    with pytest.raises(InputError, match="not a finished run"):
        variants.variants(tmp_path / "nowhere")
    with pytest.raises(InputError, match="no variant time_x3"):
        sensitivity.make(run, ["time_x3"])
    with pytest.raises(InputError, match=r"nbody of .* is not done with the settings"):
        sensitivity.make(run, ["alpha_x1.5"])


def test_a_case_that_names_how_it_is_hit_shares_no_encounters(run):
    """Flat ground has none: what is missing first is the shock stage."""
    shutil.copy(CASE.parents[1] / "first_crater" / "case.toml", run / "case.used.toml")
    with pytest.raises(InputError, match=r"sph of .* is not done with the settings"):
        sensitivity.make(run, ["alpha_x1.5"])


def row(rim, apparent, depth, rms=1e3):
    changes = {
        "diameter_rim_m_change": rim,
        "diameter_apparent_m_change": apparent,
        "depth_m_change": depth,
        "dem_depth_most_m_change": 0.0,
    }
    return {"time_s": 1.0, "speed_limit_m_s": 1.0, "alpha_spacings": 1.0, "profile_rms_m": rms, "diameter_rim_m": 1.0,
    "diameter_apparent_m": 1.0,
            "depth_m": 1.0, "dem_depth_most_m": 1.0, "volume_m3": 1.0, **changes}  # fmt: skip


def test_the_ledger_takes_the_larger_change():
    still = {"grains": 9, "drift_most_over_r": 0.02, "drift_mean_over_r": 0.01, "deep_grains": 4,
    "deep_drift_most_over_r": 0.01, "deep_beyond": 0,
             "lost": 0, "energy_rise_J": 0.0, "energy_rise_rel": 0.0, "kinetic_most_J": 1.0, "from_s": 1.0,
             "to_s": 2.0}  # fmt: skip
    rows = {
        "base": row(0.0, 0.0, 0.0, 0.0), "time_x0.5": row(0.01, 0.0, -0.3), "time_x2": row(-0.04, 0.0, 0.02),
        "speed_limit_x0.5": row(None, 0.09, 0.0), "speed_limit_x2": row(0.01, 0.02, 0.0), "alpha_x0.67": row(None,
        None, None, 800.0),
    }  # fmt: skip
    found = {"rows": rows, "controls": {"control_uncarved": still}, "missing": ["alpha_x1.5"], "allowed_rms_m": 500.0}
    book = Ledger()
    book.complete()
    sensitivity_table.enter(found, book)
    assert {name: sum(entry["name"] == name for entry in book.rows) for name in LIMITS} == dict.fromkeys(LIMITS, 1)

    def of(name):
        entry = book[name]
        return entry["value"], entry["limit"], entry["verdict"]

    assert of("final_D_change_on_t_handoff_x2") == (0.04, 0.05, "pass")  # both rims are there
    assert of("final_d_change_on_t_handoff_x2") == (0.3, 0.1, "fail")
    assert of("final_D_change_on_vcut_x2") == (0.09, 0.05, "fail")  # a rim is missing: apparent diameters
    assert "speed_limit_x0.5 +9.0 %, speed_limit_x2 +2.0 %" in book["final_D_change_on_vcut_x2"]["note"]
    assert of("final_D_change_on_alpha_x1.5") == (800.0, 500.0, "fail")  # no crater left: profiles
    assert (
        book["final_D_change_on_alpha_x1.5"]["unit"] == "m"
        and "alpha_x1.5" in book["final_D_change_on_alpha_x1.5"]["note"]
    )
    assert of("control_no_impact_run_drift_over_r") == (0.02, 0.05, "pass")
    table = sensitivity_table.text(found)
    assert "alpha_x0.67" in table and "not made: alpha_x1.5" in table and "0.02 r" in table


def test_variants_share_what_the_run_has_done_and_are_made_once(
    case_folder, tmp_path, drive, fake_stages, monkeypatch, capsys
):
    """With the fake stages: the shock stage is not run again, a variant that cannot be handed over does not keep the
    others, nothing is made twice."""
    assert drive(case_folder, "--out", tmp_path / "runs")[0] == 0
    run = next((tmp_path / "runs").glob("small-*"))
    calls = []

    def as_process(arguments):
        calls.append(arguments)
        return drive(*arguments)[0]

    monkeypatch.setattr(sensitivity.run_process, "as_process", as_process)
    wanted = ["time_x2", "alpha_x1.5", "control_uncarved"]
    assert sensitivity.make(run, wanted) == ["time_x2"]  # 120 s: the fake handoff has no such snapshot
    assert len(calls) == 3 and "--until" in calls[2] and "--until" not in calls[1]
    places = {one.name: one.request(run).run_folder for one in variants.variants(run) if one.name in ("base", *wanted)}
    assert json.loads((places["alpha_x1.5"] / "4_handoff" / "handoff.json").read_text())["alpha_spacings"] == 2.25
    assert (places["alpha_x1.5"] / "2_sph").resolve() == (run / "2_sph").resolve()
    assert (run / "2_sph" / "starts.txt").read_text().split() == ["0"]
    assert (places["control_uncarved"] / "5_dem" / "done.json").is_file() and not (
        places["control_uncarved"] / "6_crater"
    ).exists()
    assert sensitivity.make(run, wanted) == ["time_x2"] and len(calls) == 4
    assert "alpha_x1.5: done before" in capsys.readouterr().out
    # the run's own last stages are by the sources of today: it is the base
    assert sensitivity.place_of(variants.variants(run)[0], run) == run
    done = run / "5_dem" / "done.json"
    done.write_text(done.read_text().replace('"sources_sha256": "', '"sources_sha256": "0'))
    assert sensitivity.place_of(variants.variants(run)[0], run) == places["base"]


def test_every_variant_is_drawn_on_other_beds(run):
    table = {variant.name: variant for variant in variants.variants(run, 3)}
    assert len(table) == 7 * 3 + 2 and len({variant.request(run).run_folder for variant in table.values()}) == len(
        table
    )
    assert {"another_bed", "another_bed_3", "time_x2@bed2", "alpha_x1.5@bed3"} <= set(table)
    settings = {
        name: sensitivity.settings_of(table[name].request(run))
        for name in ("time_x2", "time_x2@bed3", "another_bed_3")
    }
    assert (
        settings["time_x2@bed3"]["handoff"] == settings["time_x2"]["handoff"]
        and settings["time_x2@bed3"]["bed"] == settings["another_bed_3"]["bed"]
    )
    assert (settings["time_x2"]["bed"].seed, settings["time_x2@bed3"]["bed"].seed) == (1, 3)
    assert table["time_x2@bed2"].shared_stages == ("nbody", "sph")


def test_a_change_is_the_mean_over_beds_each_against_its_own_base(run, monkeypatch):
    """Bed 2 alone makes every crater a tenth wider: a later handoff changes it by +5 and +7 %, not by +5 and +17.7
    %."""
    wide = {
        "base": 100.0,
        "another_bed": 110.0,
        "time_x2": 105.0,
        "time_x2@bed2": 110.0 * 1.07,
        "alpha_x1.5": 98.0,
        "alpha_x0.67@bed2": 1.0,
    }
    monkeypatch.setattr(sensitivity, "is_done", lambda variant, _: variant.name in wide)
    monkeypatch.setattr(sensitivity, "place_of", lambda variant, _: variant.name)
    keys = (*RATIOS, "dem_depth_most_m")
    monkeypatch.setattr(
        sensitivity,
        "_measured",
        lambda name: {**dict.fromkeys(keys, wide[name]), "time_s": 1.0, "speed_limit_m_s": 1.0, "alpha_spacings": 1.0},
    )
    monkeypatch.setattr(sensitivity, "_profile_rms", lambda *_: 0.0)
    monkeypatch.setattr(sensitivity, "_allowed", lambda _: 1.0)
    found = sensitivity.compare(run, 2)
    assert set(found["rows"]) == {"base", "another_bed", "time_x2", "alpha_x1.5"} and set(found["other_beds"]) == {
        "time_x2@bed2",
        "alpha_x0.67@bed2",
    }
    later = found["rows"]["time_x2"]
    assert (
        later["beds"] == 2
        and later["diameter_rim_m_change"] == pytest.approx(0.06)
        and later["diameter_rim_m_change_error"] == pytest.approx(0.01)
    )
    assert found["rows"]["alpha_x1.5"]["diameter_rim_m_change"] == pytest.approx(-0.02)
    assert found["rows"]["alpha_x1.5"]["diameter_rim_m_change_error"] is None
    assert found["rows"]["another_bed"]["diameter_rim_m_change"] == pytest.approx(0.1)
    book = Ledger()
    book.complete()
    sensitivity_table.enter(found, book)
    assert "time_x2 +6.0 % (+- 1.0 % over 2 beds)" in book["final_D_change_on_t_handoff_x2"]["note"]
    assert "time_x2" in sensitivity_table.text(found)
