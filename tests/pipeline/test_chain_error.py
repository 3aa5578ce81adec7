"""The chain error: the formulas on known scatter, the members of a study, and how they share stages. Real members:
studies/chain_error.py."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from matter.errors import InputError
from pipeline.settings import expected
from pipeline.settings.compose import compose
from pipeline.uncertainty import chain_error
from pipeline.uncertainty.chain_error import Member, Study

VALHALLA = Path(__file__).resolve().parents[2] / "cases" / "valhalla_980km"


def test_the_variance_of_one_run_is_found_from_draws_that_share_shock_stages():
    """Grains scatter by 3, shock stages by 4: one run by 5, whatever the design; the grains' part is the mean square
    within."""
    rng = np.random.default_rng(5)
    for groups in ((1, 1, 2, 2, 3, 3, 4, 4), (1, 1, 1, 2, 2, 3), (1, 2, 3, 4, 5)):
        shock, bed = rng.normal(0.0, 4.0, (20_000, 9)), rng.normal(0.0, 3.0, (20_000, len(groups)))
        found = np.array(
            [chain_error.variance(one[list(groups)] + other, groups) for one, other in zip(shock, bed, strict=True)]
        )
        within, total = found.mean(axis=0)
        assert total == pytest.approx(25.0, rel=0.08)  # a variance component is cut off at 0: a few per cent too large
        assert within == pytest.approx(9.0 if len(set(groups)) < len(groups) else 0.0, rel=0.02)
    assert chain_error.variance([1.0, 3.0], [1, 1]) == (2.0, 2.0)
    assert chain_error.variance([7.0, 7.0, 9.0, 9.0], [1, 1, 2, 2]) == (
        0.0,
        2.0,
    )  # the transient crater: grains do not move it


def test_half_the_range_of_three_draws():
    drawn = np.random.default_rng(1).normal(size=(200_000, 3))
    half = 0.5 * (drawn.max(axis=1) - drawn.min(axis=1))
    assert np.mean(half**2) == pytest.approx(chain_error.HALF_RANGE_OF_THREE, rel=0.01)


def measured(value, sigma=1.0, **parts):
    return {"final": {"depth_m": {"value": value, "sigma": sigma, "unit": "m", "sigma_parts": parts}}}


def test_a_row_from_known_members():
    found = {
        "reference": measured(100.0, 5.0, chain=4.0), "draw_2": measured(106.0, 3.0), "draw_3": measured(98.0, 3.0),
        "draw_4": measured(104.0, 3.0),
        "handoff_x0.5": measured(80.0), "handoff_x2": measured(130.0), "coarser": measured(88.0),
    }  # fmt: skip
    draws = [
        Member("reference", shock=1),
        Member("draw_2", shock=1),
        Member("draw_3", shock=2),
        Member("draw_4", shock=2),
    ]
    row = chain_error.row("final", "depth_m", found, draws)
    # within (18 + 18)/2; between 2 (103 - 102)^2 + 2 (101 - 102)^2 = 4 over 1, less than within
    assert row.mean == 102.0 and row.draws == pytest.approx(math.sqrt(18.0)) and row.measuring == 3.0
    assert row.handoff == pytest.approx(math.sqrt(25.0**2 - chain_error.HALF_RANGE_OF_THREE * 18.0))
    assert row.size == pytest.approx(math.sqrt(12.0**2 - 36.0))
    assert row.chain == pytest.approx(math.sqrt(row.draws**2 + row.handoff**2 + row.size**2))
    # what is within the scatter of the draws is no further error, what is missing is not measured
    quiet = found | {"handoff_x0.5": measured(99.0), "handoff_x2": measured(101.0), "coarser": measured(102.0)}
    assert (
        chain_error.row("final", "depth_m", quiet, draws).handoff,
        chain_error.row("final", "depth_m", quiet, draws).size,
    ) == (0.0, 0.0)
    alone = chain_error.row("final", "depth_m", {"reference": measured(100.0)}, draws)
    assert (alone.draws, alone.handoff, alone.size, alone.values) == (None, None, None, (100.0,))
    assert chain_error.row("final", "rim_height_m", found, draws) is None


@pytest.fixture
def study(tmp_path):
    """A study of the smallest shipped preset whose reference has handed over at 60 s."""
    made = Study(VALHALLA, "tiny", tmp_path, draws=5)
    handoff = made.run_folder(chain_error.reference()) / "4_handoff"
    handoff.mkdir(parents=True)
    (handoff / "handoff.json").write_text(json.dumps({"time_s": 60.0}))
    return made


def test_every_member_differs_in_what_it_says(study):
    members = {member.name: member for member in chain_error.others(study)}
    assert list(members) == ["handoff_x0.5", "handoff_x2", "coarser", "draw_2", "draw_3", "draw_4", "draw_5"]
    settings = {name: compose(study.read(member)) for name, member in members.items()}
    origin = compose(study.read(chain_error.reference()))

    def changed(name):
        return {
            f"{stage}.{key}": value
            for stage, one in settings[name].items()
            for key, value in one.model_dump().items()
            if key != "chain"
            and value != origin[stage].model_dump()[key]  # a member is not the shipped case: it has no chain error
        }

    assert changed("handoff_x0.5") == {"handoff.time": 30.0} and changed("handoff_x2") == {"handoff.time": 120.0}
    coarser = changed("coarser")
    sph = origin["sph"]
    assert coarser["sph.spacing_at_impact"] ** 3 == pytest.approx(2.0 * sph.spacing_at_impact**3)
    assert coarser["sph.spacing_far"] ** 3 == pytest.approx(2.0 * sph.spacing_far**3)
    assert coarser["bed.count"] == origin["bed"].count / 2 and coarser["sph.projectile_particles"] == round(
        sph.projectile_particles / 2
    )
    assert (
        changed("draw_2") == {"bed.seed": 2}
        and changed("draw_3") == {"bed.seed": 3, "sph.seed": 2}
        and changed("draw_4") == {"bed.seed": 4, "sph.seed": 2}
    )
    assert [members[f"draw_{k}"].shock for k in (2, 3, 4, 5)] == [1, 2, 2, 3]
    assert (
        settings["draw_2"]["sph"] == origin["sph"]
        and settings["draw_4"]["sph"] == settings["draw_3"]["sph"] != origin["sph"]
    )
    assert len({study.run_folder(member) for member in members.values()}) == len(members)


def test_a_shock_stage_that_ends_too_early_for_the_later_handoff_is_followed_on(study):
    end = compose(study.read(chain_error.reference()))["sph"].end_time
    for time, follows in ((0.5 * end, False), (0.75 * end, True)):
        record = study.run_folder(chain_error.reference()) / "4_handoff" / "handoff.json"
        record.write_text(json.dumps({"time_s": time}))
        later = compose(study.read(next(m for m in chain_error.others(study) if m.name == "handoff_x2")))
        assert later["handoff"].time == 2.0 * time
        assert later["sph"].end_time == (2.0 * time if follows else end)


def test_members_are_made_once_share_stages_and_end_in_a_file(case_folder, tmp_path, drive, fake_stages, monkeypatch):
    """With the fake stages: the later handoff cannot be made and is named, the rest is kept, the same command makes
    nothing anew."""
    study = Study(case_folder, "quick", tmp_path / "runs", draws=2)
    calls = []
    monkeypatch.setattr(chain_error, "_coarser", lambda settings: ("sph.steps=10",))
    monkeypatch.setattr(
        chain_error.run_process, "as_process", lambda arguments: calls.append(arguments) or drive(*arguments)[0]
    )
    said = []
    assert chain_error.make(study, say=said.append) == ["handoff_x2"]  # 120 s: the fake handoff has no such snapshot
    assert (
        len(calls) == 4 and "draw_2: done before" in said
    )  # the fake stages have no seeds: the draw is the reference
    half = study.run_folder(Member("handoff_x0.5", ('handoff.time="30.0 s"',)))
    assert (half / "2_sph").is_symlink() and (half / "2_sph" / "starts.txt").read_text().split() == ["0"]
    assert chain_error.make(study, say=said.append) == ["handoff_x2"] and len(calls) == 5
    rows = chain_error.evaluate(study)
    assert {(row.crater, row.measure): row.mean for row in rows} == {
        ("transient", "diameter_apparent_m"): 8.1e5, ("transient", "depth_m"): 2.9e5, ("final", "depth_m"): 1.2e4,
    }  # fmt: skip
    assert all(row.chain == 0.0 for row in rows)
    file = case_folder / "expected.toml"
    file.write_text('[other]\ncommand = "c"\ncommit = "d"\nmeasured = "2026-01-01"\nmembers = 1\nshocks = 1\n')
    chain_error.write(study, rows, "the command", file)
    kept = expected.read(case_folder)
    assert set(kept) == {"other", "quick"} and kept["quick"].command == "the command" and kept["quick"].shocks == 2
    assert (
        kept["quick"].transient.diameter_apparent_m.value == 8.1e5
        and kept["quick"].transient.diameter_apparent_m.size == 0.0
    )
    chain_error.keep(rows, ["handoff_x2"], tmp_path)
    assert json.loads((tmp_path / "chain_error.json").read_text())["could_not_be_made"] == ["handoff_x2"]
    assert "8.1e+05" not in chain_error.text(rows) and " 810 " in chain_error.text(rows)


def test_without_the_reference_there_is_nothing_to_evaluate(case_folder, tmp_path, fake_stages):
    with pytest.raises(InputError, match="is not done"):
        chain_error.evaluate(Study(case_folder, "quick", tmp_path / "runs"))


@pytest.mark.parametrize(
    ("measure", "value", "factor", "unit"),
    [
        ("diameter_rim_m", 114.8, 1.0, "m"),
        ("diameter_rim_m", 5.2e5, 1e-3, "km"),
        ("volume_m3", 5.17e4, 1.0, "m^3"),
        ("volume_m3", 7.4e15, 1e-9, "km^3"),
    ],
)
def test_a_row_is_written_in_units_of_its_size(measure, value, factor, unit):
    row = chain_error.Row("final", measure, (value,), value, 0.01 * value, None, None, None)
    assert chain_error.text([row]).splitlines()[1].split() == [
        "final",
        measure,
        f"{value * factor:.4g}",
        f"{0.01 * value * factor:.4g}",
        "--",
        "--",
        "--",
        "0",
        unit,
    ]


def test_a_run_that_states_no_error_is_measured_by_its_parts():
    stated = {"value": 10.0, "sigma": 5.0, "sigma_parts": {"azimuth": 3.0, "datum": 4.0}}
    for entry in (stated, {**stated, "sigma": None}):
        assert chain_error._measuring([entry]) == pytest.approx(5.0)
    assert (
        chain_error._measuring([{"value": 10.0, "sigma": 13.0, "sigma_parts": {"azimuth": 5.0, "chain": 12.0}}]) == 5.0
    )
