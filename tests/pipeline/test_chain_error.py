"""The chain error: formulas on known scatter, the ladder of resolutions, the runs of ``--errors`` and how they share
stages."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest

from matter.errors import InputError
from matter.files import archive
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.commands import error_command
from pipeline.running import run_process
from pipeline.settings import expected
from pipeline.settings.compose import compose
from pipeline.sweeps import error_study, sweep_run
from pipeline.sweeps.error_study import ErrorStudy
from pipeline.sweeps.sweep import Member
from pipeline.uncertainty import chain_error, ladder
from pipeline.uncertainty.chain_error import REFERENCE

ROOT = Path(__file__).resolve().parents[2]
FAKES = Path(__file__).resolve().parent / "fake_rooms"
VALHALLA = Path(__file__).resolve().parents[2] / "cases" / "valhalla_980km"


def test_the_variance_of_one_run_is_found_from_draws_that_share_shock_stages():
    """Grains scatter by 3, shock stages by 4: one run by 5, whatever the design; the grains' part is the mean square
    within."""
    rng = np.random.default_rng(5)
    for groups in ((1, 1, 2, 2, 3, 3, 4, 4), (1, 1, 1, 2, 2, 3), (1, 2, 3, 4, 5)):
        shock, bed = rng.normal(0.0, 4.0, (5_000, 9)), rng.normal(0.0, 3.0, (5_000, len(groups)))
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
    draws = {REFERENCE: 1, "draw_2": 1, "draw_3": 2, "draw_4": 2}
    row = chain_error.row("final", "depth_m", found, draws)
    # within (18 + 18)/2; between 2 (103 - 102)^2 + 2 (101 - 102)^2 = 4 over 1, less than within
    assert row.mean == 102.0 and row.draws == pytest.approx(math.sqrt(18.0)) and row.measuring == 3.0
    assert row.handoff == pytest.approx(math.sqrt(25.0**2 - chain_error.HALF_RANGE_OF_THREE * 18.0))
    assert row.size == pytest.approx(math.sqrt(12.0**2 - 36.0)) and row.ladder.extrapolated is None
    assert row.alpha is None and row.parts.keys() == {"draws", "handoff", "size"}
    assert row.chain == pytest.approx(math.sqrt(row.draws**2 + row.handoff**2 + row.size**2))
    wide = found | {"alpha_x0.67": measured(70.0), "alpha_x1.5": measured(100.0)}
    assert chain_error.row("final", "depth_m", wide, draws).alpha == pytest.approx(
        math.sqrt(15.0**2 - chain_error.HALF_RANGE_OF_THREE * 18.0)
    )
    # twice the spacing at the contact: what is beyond the scatter of a difference, where it is more than the ladder's
    fine = found | {"contact_x2": measured(116.0)}
    assert chain_error.row("final", "depth_m", fine, draws).size == pytest.approx(math.sqrt(16.0**2 - 36.0))
    assert chain_error.row("final", "depth_m", fine | {"contact_x2": measured(101.0)}, draws).size == row.size
    del fine["coarser"]
    assert chain_error.row("final", "depth_m", fine, draws).size == pytest.approx(math.sqrt(16.0**2 - 36.0))
    # what is within the scatter of the draws is no further error, what is missing is not measured
    quiet = found | {"handoff_x0.5": measured(99.0), "handoff_x2": measured(101.0), "coarser": measured(102.0)}
    assert (
        chain_error.row("final", "depth_m", quiet, draws).handoff,
        chain_error.row("final", "depth_m", quiet, draws).size,
    ) == (0.0, 0.0)
    alone = chain_error.row("final", "depth_m", {"reference": measured(100.0)}, draws)
    assert (alone.draws, alone.handoff, alone.size, alone.values) == (None, None, None, (100.0,))
    assert chain_error.row("final", "rim_height_m", found, draws) is None


def test_what_the_sectors_of_a_run_show_of_its_scatter_does_not_count_twice():
    """Craters scatter by 3 (runs) and by 4 (where particles lie, which the sectors tell): the whole error of one run
    is 5 on average, not sqrt(5^2 + 4^2) = 6.4; with calm sectors it is what the draws show; louder ones stay."""
    rng = np.random.default_rng(8)
    names = [REFERENCE, *(f"draw_{k}" for k in range(2, 9))]

    def error(azimuth):
        found = {name: measured(rng.normal(100.0, 5.0), azimuth, azimuth=azimuth) for name in names}
        row = chain_error.row("final", "depth_m", found, dict.fromkeys(names, 1))
        return math.hypot(row.measuring, row.chain)

    assert np.mean([error(4.0) ** 2 for _ in range(2000)]) == pytest.approx(25.0, rel=0.1)
    assert np.mean([error(0.0) ** 2 for _ in range(2000)]) == pytest.approx(25.0, rel=0.05)
    assert min(error(9.0) for _ in range(200)) >= 9.0


@pytest.mark.parametrize("order", [1.0, 1.5, 2.0])
def test_a_ladder_finds_the_order_and_the_limit_of_a_known_law(order):
    rungs = [50.0 + 4.0 * h**order for h in ladder.RATIO ** np.arange(3)]
    found = ladder.climb(rungs, 0.01)
    assert found.order == pytest.approx(order) and found.extrapolated == pytest.approx(50.0)
    assert found.size == pytest.approx(4.0, rel=1e-3)


def test_a_ladder_within_the_scatter_has_no_order_and_no_size_on_average():
    """Rungs that scatter by 1 and do not change: an order is claimed in few, and the mean squares of slope and
    residual are what is subtracted; each is below that in 68 %, both in 47 %."""
    drawn = np.random.default_rng(3).normal(50.0, 1.0, (4000, 3))
    found = [ladder.climb(list(row), 1.0) for row in drawn]
    assert np.mean([one.order is not None for one in found]) < 0.05
    weights = np.linalg.pinv(np.stack([np.ones(3), ladder.RATIO ** np.arange(3)], axis=1))[1]
    slopes = drawn @ weights
    assert np.mean(slopes**2 - np.sum(weights**2)) == pytest.approx(0.0, abs=0.3)
    assert np.mean([one.size == 0.0 for one in found]) == pytest.approx(0.683**2, abs=0.03)
    assert ladder.climb([1.0], 0.0) is None
    turning = ladder.climb([50.0, 54.0, 50.0], 0.01)  # neither rises nor falls throughout, which counts as scatter
    assert turning.order is None and turning.size == pytest.approx(3.27, rel=0.02)


@pytest.fixture
def study(tmp_path):
    """A study of the smallest shipped preset whose reference has handed over at 60 s with an alpha of 2."""
    made = ErrorStudy(cases.read(VALHALLA, "tiny"), tmp_path)
    record(made, time_s=60.0, alpha_spacings=2.0)
    return made


def record(study, **facts):
    folder = stages.folder(study.run, "handoff")
    folder.mkdir(parents=True, exist_ok=True)
    archive.write_json(folder / "handoff.json", facts)


def test_a_case_that_refines_the_contact_has_a_run_with_twice_the_spacing_there(tmp_path):
    requests = ErrorStudy(cases.read(ROOT / "cases" / "first_crater"), tmp_path).whole().requests
    mine, coarse = (compose(requests[name].case)["sph"] for name in (REFERENCE, "contact_x2"))
    assert coarse.zones.contact == 2.0 * mine.zones.contact
    assert (coarse.spacing_at_impact, coarse.contact_radius) == (mine.spacing_at_impact, mine.contact_radius)
    whole = ErrorStudy(cases.read(ROOT / "cases" / "sci_ryugu", "quick"), tmp_path).whole()
    assert "contact_x2" not in whole.requests


def test_a_longer_shock_stage_keeps_the_late_stage_that_follows_from_the_case(tmp_path):
    """It follows from the crater; where the run is longer, further switches come after."""
    made = ErrorStudy(cases.read(ROOT / "examples" / "own_case.toml"), tmp_path)
    record(made, time_s=10.0, alpha_spacings=1.5)
    settings = {name: compose(request.case)["sph"] for name, request in made.whole().requests.items()}
    assert settings["handoff_x2"].end_time == 20.0 > settings[REFERENCE].end_time
    short, long = (settings[name].late.switches for name in (REFERENCE, "handoff_x2"))
    assert len(short) > 1 and long[: len(short)] == short


def test_every_member_differs_in_what_it_says(study):
    whole = study.whole()
    assert [member.name for member in whole.members] == [
        "reference", "handoff_x0.5", "handoff_x2", "alpha_x0.67", "alpha_x1.5", "coarser", "coarsest", "draw_2",
        "draw_3", "draw_4",
    ]  # fmt: skip
    settings = {name: compose(request.case) for name, request in whole.requests.items()}
    origin = settings[REFERENCE]

    def changed(name):
        return {
            f"{stage}.{key}": value
            for stage, one in settings[name].items()
            for key, value in one.model_dump().items()
            if key != "chain"
            and value != origin[stage].model_dump()[key]  # a member is not the shipped case: it has no chain error
        }

    assert changed("handoff_x0.5") == {"handoff.time": 30.0} and changed("handoff_x2") == {"handoff.time": 120.0}
    assert changed("alpha_x0.67") == {"handoff.alpha": 1.34} and changed("alpha_x1.5") == {"handoff.alpha": 3.0}
    sph = origin["sph"]
    for name, parts in (("coarser", 2.0), ("coarsest", 4.0)):
        rung = changed(name)
        assert rung["sph.spacing_at_impact"] ** 3 == pytest.approx(parts * sph.spacing_at_impact**3)
        assert rung["sph.spacing_far"] ** 3 == pytest.approx(parts * sph.spacing_far**3)
        assert rung["bed.count"] == round(origin["bed"].count / parts)
        assert rung["sph.projectile_particles"] == round(sph.projectile_particles / parts)
    assert (
        changed("draw_2") == {"bed.seed": 2}
        and changed("draw_3") == {"bed.seed": 3, "sph.seed": 2}
        and changed("draw_4") == {"bed.seed": 4, "sph.seed": 2}
    )
    assert study.shocks == 2 and len({request.run_folder for request in whole.requests.values()}) == 10
    assert whole.folder == study.reference.folder and whole.folder.name.startswith("valhalla_980km-errors-")


def test_a_shock_stage_that_ends_too_early_for_the_later_handoff_is_followed_on(study):
    end = study.settings["sph"].end_time
    for time, follows in ((0.5 * end, False), (0.75 * end, True)):
        record(study, time_s=time, alpha_spacings=2.0)
        later = compose(study.whole().requests["handoff_x2"].case)
        assert later["handoff"].time == 2.0 * time
        assert later["sph"].end_time == (2.0 * time if follows else end)


@pytest.fixture
def fakes(fake_stages, monkeypatch):
    """Members are processes with the fake stages; the rungs change their steps, since they have no spacings. One later
    handoff, which the fake one has no snapshot for, one alpha."""
    monkeypatch.setattr(run_process, "_COMMAND", "import drive; drive.cli.run_case()")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(FAKES)]))
    monkeypatch.setattr(sweep_run, "EVERY_S", 0.05)
    monkeypatch.setattr(ErrorStudy, "_rungs", lambda study: [Member("coarser", {"sph.steps": 10})])
    every = ErrorStudy._of_handoff
    monkeypatch.setattr(ErrorStudy, "_of_handoff", lambda study: every(study)[1:3])


def test_the_command_makes_runs_once_names_what_fails_and_ends_in_a_run_with_errors(
    case_folder, tmp_path, fakes, capfd
):
    """With the fake stages: the later handoff cannot be made and is named, the rest is kept, the same command makes
    nothing anew but that; the last run carries the errors; expected.toml gets them."""
    from studies import chain_error as script

    out, others = tmp_path / "runs", [(None, "a sweep")]
    case = cases.read(case_folder, "quick")
    assert error_command.with_errors(case, out, 1, True, False, others) == 0
    assert "4 members, 4 to do" in capfd.readouterr().out
    for begun in (4, 1):
        assert error_command.with_errors(case, out, 1, False, False, others) == 1
        said = capfd.readouterr().out
        assert "handoff_x2: failed, exit code 2" in said and said.count("begins (") == begun
    assert "In the final crater of 4 runs with bolide" in said and "page: " in said
    study = ErrorStudy(case, out)
    assert (study.run / "2_sph" / "starts.txt").read_text().split() == ["0"]
    where = study.whole().folder
    assert where == next(out.glob("small-errors-*"))
    kept = archive.read_json(where / error_study.FILE)
    assert kept["could_not_be_made"] == ["handoff_x2"]
    (depth,) = (row for row in kept["rows"] if (row["crater"], row["measure"]) == ("final", "depth_m"))
    assert depth["mean"] == 1.2e4 and depth["parts"] == {"size": 0.0, "alpha": 0.0}
    page = (where / error_study.PAGE).read_text()
    assert "handoff.time = 120.0 s" in page and "failed" in page and "a quarter" in page
    carries = Path(said.rsplit("result: ", 1)[1].strip())
    assert 'holds = ["size", "alpha"]' in (carries / "case.used.toml").read_text() and carries != study.run
    file = case_folder / "expected.toml"
    file.write_text('[other]\ncommand = "c"\ncommit = "d"\nmeasured = "2026-01-01"\nmembers = 1\nshocks = 1\n')
    script.write(study, study.rows(), "the command", file)
    written = expected.read(case_folder)
    assert set(written) == {"other", "quick"} and written["quick"].command == "the command"
    assert written["quick"].transient.diameter_apparent_m.value == 8.1e5 and written["quick"].shocks == 1
    assert written["quick"].transient.diameter_apparent_m.size == 0.0 and written["quick"].final.depth_m.alpha == 0.0


def test_without_the_case_itself_there_are_no_errors(case_folder, tmp_path, fakes):
    study = ErrorStudy(cases.read(case_folder, "quick", ['handoff.time="120 s"']), tmp_path / "runs")
    with pytest.raises(InputError, match="the case itself could not be run, exit code 2: see "):
        error_study.make(study, 1, lambda words: None)
    with pytest.raises(InputError, match="the case itself could not be run"):
        study.rows()


def test_what_does_not_go_with_errors_is_refused(case_folder, tmp_path, fake_stages):
    case = cases.read(case_folder, "quick")
    with pytest.raises(InputError, match="leave out --until"):
        error_command.with_errors(case, tmp_path, 1, False, False, [(None, "a sweep"), ("dem", "--until")])
    shock_alone = cases.read(case_folder, "quick", ['case.stages=["sph"]'])
    with pytest.raises(InputError, match="measures no crater"):
        error_command.with_errors(shock_alone, tmp_path, 1, False, False, [])


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
    row = chain_error.Row("final", measure, (value,), value, 0.01 * value, None, None, None, None)
    shown = [f"{value * factor:.4g}", f"{0.01 * value * factor:.4g}", "--", "--", "--", "--", "0"]
    assert chain_error.text([row]).splitlines()[1].split() == ["final", measure, *shown, unit]
