"""The runner: what is done once, what is made anew, and what a run folder says about itself."""

from __future__ import annotations

import json
import os
import re
import tomllib
from pathlib import Path

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from matter import progress
from matter.errors import InputError, Stopped, UnphysicalState
from matter.files import lock
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running.request import Request
from pipeline.running.run import run
from pipeline.settings import identity
from pipeline.settings.compose import compose


class Recorder:
    """A screen that remembers."""

    def __init__(self, on_move=None):
        self.lines, self.on_move = [], on_move

    def say(self, text):
        self.lines.append(text)

    begins = moves = ends = lambda self, stage, what: self._hear(stage, what)

    def _hear(self, stage, what):
        if isinstance(what, str):
            self.lines.append(what)
        elif self.on_move:
            self.on_move(stage, what)

    def worked(self):
        """The stages that really ran."""
        return [line.split(":")[0][2:] for line in self.lines if line.endswith((": begins", ": continued"))]


@pytest.fixture(autouse=True)
def _fakes(fake_stages):
    """Every test here runs the fake stages."""


@pytest.fixture
def go(case_folder, tmp_path):
    """``go(*overrides, start=..., ...)`` runs the case and returns the outcome and what the screen heard."""

    def start(*overrides, preset=None, on_move=None, screen=None, **options):
        screen = screen or Recorder(on_move)
        request = Request(cases.read(case_folder, preset, overrides), tmp_path / "runs", **options)
        return run(request, screen), screen

    return start


ALL = list(stages.ORDER)


def test_a_run_makes_every_stage_once(go):
    outcome, screen = go()
    assert screen.worked() == ALL
    assert screen.lines[0] == f"run folder: {outcome.run}"
    for stage in ALL:
        done = json.loads((stages.folder(outcome.run, stage) / "done.json").read_text())
        assert done["stage"] == stage and len(done["inputs_sha256"]) == 64
        assert set(done) >= {"stage", "inputs_sha256", "wall_s", "finished_at", "version"}
        assert not (stages.folder(outcome.run, stage) / "begun.json").exists()
    _, again = go()
    assert again.worked() == []


def test_the_run_folder_describes_itself(go, case_folder):
    outcome, _ = go()
    status = json.loads((outcome.run / "status.json").read_text())
    assert status["state"] == "done" and status["fraction"] == 1.0 and status["pid"] == os.getpid()
    provenance = json.loads((outcome.run / "provenance.json").read_text())
    assert provenance["libraries"]["numba"] and provenance["sessions"][0]["threads"] >= 1
    assert provenance["case"]["file"] == str(case_folder / "case.toml")
    assert set(provenance["sources_sha256"]) == set(ALL)
    papers = (outcome.run / "references.bib").read_text()
    assert "Winter2017" in papers and "BenzAsphaug1999" in papers  # the case, and the source of its materials
    assert "Melosh1989" not in papers  # iron is not in this target
    assert "2_sph begins" in (outcome.run / "run.log").read_text()
    assert tomllib.loads((outcome.run / "case.used.toml").read_text())["sph"]["spacing"] == "52000.0 m"
    go()
    assert len(json.loads((outcome.run / "provenance.json").read_text())["sessions"]) == 2


def test_a_stage_that_other_sources_made_is_kept_and_said_so(go):
    outcome, _ = go()
    file = outcome.run / "5_dem" / "done.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "sources_sha256": "of yesterday"}))
    _, screen = go()
    assert screen.worked() == []
    assert [line for line in screen.lines if "another version of the code" in line] == [
        line for line in screen.lines if line.startswith("5_dem")
    ]


def test_a_stage_without_its_done_file_runs_again_and_those_after_it_are_of_the_same_key(go):
    outcome, _ = go()
    (stages.folder(outcome.run, "handoff") / "done.json").unlink()
    (stages.folder(outcome.run, "handoff") / "begun.json").write_text('{"inputs_sha256": "of something else"}')
    _, screen = go()
    assert screen.worked() == ["handoff"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda file: file.write_text(file.read_text().replace("1", "2", 1)), "has other content"),
        (lambda file: file.write_text(file.read_text() + " "), "has 24 bytes instead of 23"),
        (lambda file: file.unlink(), "is missing"),
    ],
)
def test_a_result_that_is_not_as_its_stage_left_it_is_not_read(go, change, words):
    outcome, _ = go()
    before = (outcome.run / "5_dem" / "last.txt").read_bytes()
    change(outcome.run / "2_sph" / "target.json")
    with pytest.raises(InputError, match=rf"2_sph is not as the stage left it: target\.json {words}.*--from sph"):
        go()
    assert (outcome.run / "5_dem" / "last.txt").read_bytes() == before
    _, screen = go(start="sph")
    assert screen.worked() == ["sph", "bed", "handoff", "dem", "crater"]


def test_a_finished_run_with_a_result_missing_says_so(go):
    outcome, _ = go()
    (outcome.run / "2_sph" / "target.json").unlink()
    with pytest.raises(InputError, match=r"target\.json is missing"):
        go()


def test_checkpoints_of_another_version_of_the_code_are_not_continued(go, tmp_path):
    """They belong to the program that wrote them; ``--from`` begins anew."""
    run_folder = stopped_in_sph(go, tmp_path)
    begun = run_folder / "2_sph" / "begun.json"
    content = json.loads(begun.read_text())
    assert len(content["sources_sha256"]) > 8
    begun.write_text(json.dumps({**content, "sources_sha256": "of yesterday", "commit": "0123456789ab"}))
    with pytest.raises(
        InputError, match=r"2_sph was begun by another version of the code \(commit 0123456789\).*--from sph"
    ):
        go("sph.steps=61")
    assert begun.exists()
    _, screen = go("sph.steps=61", start="sph")
    assert screen.worked()[0] == "sph"


def test_from_makes_a_stage_and_those_after_it_anew(go):
    go()
    assert go(start="handoff")[1].worked() == ["handoff", "dem", "crater"]
    assert go(start="dem", until="dem")[1].worked() == ["dem"]
    assert go()[1].worked() == ["crater"]  # it has to follow the new dem
    assert go(until="sph")[1].worked() == []


def test_from_takes_what_lies_before_it_from_the_store_or_names_it(go, drive, case_folder, tmp_path):
    go()
    _, screen = go("bed.radius=1200 m", start="bed")  # another run, whose shock stage is that of the first
    assert screen.worked() == ["bed", "handoff", "dem", "crater"]
    assert any(line.startswith("2_sph: taken from the store") for line in screen.lines)
    assert go("bed.radius=1200 m")[1].worked() == []
    for start, missing in (("bed", "2_sph"), ("crater", "2_sph, 3_bed, 4_handoff, 5_dem")):
        request = Request(cases.read(case_folder, None, ()), tmp_path / "new", start=start)
        with pytest.raises(InputError, match=f"^--from {start} needs {missing}, .*: leave out --from {start}"):
            run(request, Recorder())
        code, _, err = drive(case_folder, "--out", tmp_path / "new", "--from", start)
        assert code == 2 and err.startswith(f"--from {start} needs {missing},") and err.count("\n") == 1, err


def test_from_goes_on_when_the_same_command_was_interrupted(go):
    failing = "dem.failure=unphysical"
    with pytest.raises(UnphysicalState):
        go(failing)
    screens = [Recorder(), Recorder()]
    for screen in screens:
        with pytest.raises(UnphysicalState):
            go(failing, start="sph", screen=screen)
    assert screens[0].worked() == ["sph", "bed", "handoff", "dem"]  # asked for anew
    assert screens[1].worked() == ["dem"]  # the same command again goes on where it stopped


def test_fresh_removes_and_makes_all_anew(go):
    outcome, _ = go()
    (outcome.run / "2_sph" / "leftover").write_text("x")
    _, screen = go(fresh=True)
    assert screen.worked() == ALL
    assert not (outcome.run / "2_sph" / "leftover").exists()


def test_a_request_to_stop_is_kept_and_the_same_command_continues_to_the_same_bits(go, case_folder, tmp_path):
    def stop_at_13(stage, state):
        if state.done >= 13:
            progress.request_stop()

    whole = Request(cases.read(case_folder, None, ["sph.steps=61"]), tmp_path / "uninterrupted")
    expected = (run(whole, Recorder()).run / "2_sph" / "x.txt").read_text()
    try:
        with pytest.raises(Stopped):
            go("sph.steps=61", on_move=stop_at_13)
    finally:
        progress.clear_stop()
    run_folder = next((tmp_path / "runs").glob("small-*"))
    assert json.loads((run_folder / "status.json").read_text())["state"] == "stopped"
    assert not (run_folder / "2_sph" / "done.json").exists()
    assert not (run_folder / "3_bed").exists()
    outcome, screen = go("sph.steps=61")
    assert "2_sph: continued" in screen.lines
    starts = [int(line) for line in (outcome.run / "2_sph" / "starts.txt").read_text().split()]
    assert starts[0] == 0 and starts[1] == 15
    assert (outcome.run / "2_sph" / "x.txt").read_text() == expected


def stopped_in_sph(go, tmp_path):
    """The folder of a run that was stopped while it made the shock stage."""

    def stop(stage, state):
        if stage == "sph":
            progress.request_stop()

    try:
        with pytest.raises(Stopped):
            go("sph.steps=61", on_move=stop)
    finally:
        progress.clear_stop()
    (run_folder,) = (tmp_path / "runs").glob("small-*")
    return run_folder


def test_checkpoints_of_other_inputs_are_not_continued(go, tmp_path):
    run_folder = stopped_in_sph(go, tmp_path)
    begun = run_folder / "2_sph" / "begun.json"
    begun.write_text(json.dumps({**json.loads(begun.read_text()), "inputs_sha256": "of something else"}))
    outcome, screen = go("sph.steps=61")
    assert "2_sph: begins" in screen.lines
    assert (outcome.run / "2_sph" / "starts.txt").read_text() == "0\n"


def test_an_unsound_stage_is_kept_reported_and_reported_again(go):
    outcome, screen = go("handoff.broken=true")
    assert outcome.unsound == {"handoff": "handoff: mass_total_rel is 0.1, limit 1e-12"}
    assert screen.worked() == ALL  # what follows is still worth seeing
    outcome, screen = go("handoff.broken=true")
    assert screen.worked() == [] and "handoff" in outcome.unsound


@pytest.mark.parametrize("start", ["dem", "crater"])
def test_what_rests_on_an_unsound_stage_says_so_too(go, drive, case_folder, tmp_path, start):
    go("handoff.broken=true")
    outcome, screen = go("handoff.broken=true", start=start)
    assert screen.worked()[0] == start and list(outcome.unsound) == ["handoff"]
    again = (case_folder, "--out", tmp_path / "runs", "--set", "handoff.broken=true", "--from", start)
    code, out, _ = drive(*again)
    assert code == 1 and "UNSOUND handoff: mass_total_rel" in out
    assert go("handoff.broken=true", start="handoff")[0].unsound == outcome.unsound
    go()
    assert not go(start=start)[0].unsound  # another run, whose handoff is sound


@pytest.mark.parametrize("stage", ["handoff", "crater"])
def test_a_stage_without_checkpoints_stops_at_what_it_reports_next(go, monkeypatch, stage):
    """Unless it is done: then its result counts, and the run stops before the next stage."""
    reported, make = [], stages.load(stage).run

    def slow(settings, inputs, out):
        state = progress.Progress(stage, 3.0, interval_s=0.0)
        for step in range(3):
            reported.append(step)
            if asked[0] == step:
                progress.request_stop()
            state.update(step + 1)
        make(settings, inputs, out)

    monkeypatch.setattr(stages.load(stage), "run", slow)
    asked = [1]
    with pytest.raises(Stopped, match=f"{stage}: stopped on request; the same command resumes"):
        go()
    assert reported == [0, 1]
    asked[0] = 2  # its last report
    if stage == "handoff":
        with pytest.raises(Stopped, match="stopped before dem"):
            go()
    else:
        go()
    asked[0] = None
    _, screen = go()
    assert reported == [0, 1, 0, 1, 2] and stage not in screen.worked()


def test_a_failed_stage_is_not_done_and_the_log_has_the_reason(go, tmp_path):
    with pytest.raises(ZeroDivisionError):
        go("dem.failure=bug")
    run_folder = next((tmp_path / "runs").glob("small-*"))
    assert not (run_folder / "5_dem" / "done.json").exists()
    assert json.loads((run_folder / "status.json").read_text())["state"] == "failed"
    assert "ZeroDivisionError: a bug" in (run_folder / "run.log").read_text()


def test_files_that_no_run_made_are_not_deleted(go, tmp_path, case_folder):
    request = Request(cases.read(case_folder), tmp_path / "runs")
    mine = request.run_folder / "1_nbody" / "impact.toml"
    mine.parent.mkdir(parents=True)
    mine.write_text('speed = "1 km/s"\n')
    with pytest.raises(InputError, match="not made by a run: --from sph uses them"):
        go()
    assert go(start="sph")[1].worked() == ALL[1:]
    assert mine.read_text() == 'speed = "1 km/s"\n'
    assert go(fresh=True)[1].worked() == ALL


def test_an_open_impact_is_taken_from_the_encounters(go, case_folder):
    file = case_folder / "case.toml"
    text = file.read_text().replace('speed = "18.234 km/s"\n', "").replace('angle_from_vertical = "40 deg"\n', "")
    file.write_text(text)
    with pytest.raises(InputError, match="run the stage nbody first"):
        go(start="sph")
    outcome, _ = go("nbody.count=234")
    assert tomllib.loads((outcome.run / "case.used.toml").read_text())["impact"]["speed"] == "10234.0 m/s"
    assert go("nbody.count=234")[1].worked() == []
    assert go("nbody.count=234", start="sph", until="sph")[1].worked() == ["sph"]
    (outcome.run / "1_nbody" / "impact.toml").write_text('angle_from_vertical = "30 deg"\n')
    with pytest.raises(InputError, match="lacks speed"):
        go("nbody.count=234", start="sph")


def test_wrong_stage_names_and_ranges_are_messages(go):
    with pytest.raises(InputError, match="no stage 'spf'; did you mean 'sph'"):
        go(start="spf")
    with pytest.raises(InputError, match="comes after --until"):
        go(start="dem", until="sph")


def test_a_taken_folder_names_its_holder(go, tmp_path, case_folder):
    request = Request(cases.read(case_folder), tmp_path / "runs")
    with lock.held(request.run_folder / "run.lock", "x"):
        with pytest.raises(InputError, match=f"in use by process {os.getpid()} on"):
            go()
    go()  # and is free afterwards


def test_a_key_depends_on_settings_and_on_what_is_read(case_folder, tmp_path):
    settings = compose(cases.read(case_folder))

    def key(stage, settings=settings):
        return identity.stage_identity(
            stage, settings[stage], None, lambda earlier: stages.folder(tmp_path, earlier)
        ).key

    other = compose(cases.read(case_folder, None, ["sph.spacing=52.000001 km"]))
    assert (
        key("sph") == key("sph", compose(cases.read(case_folder, None, ["sph.spacing=52000 m"]))) != key("sph", other)
    )
    bed, crater = key("bed"), key("crater")
    (tmp_path / "2_sph").mkdir()
    (tmp_path / "2_sph" / "target.json").write_text("x")
    assert key("bed") != bed
    (tmp_path / "5_dem").mkdir()
    (tmp_path / "5_dem" / "last.vtkhdf").write_text("by hand")
    assert key("crater") != crater


def test_a_case_with_some_of_the_stages_runs_these(go, case_folder):
    file = case_folder / "case.toml"
    text = file.read_text().replace('source = "Winter 2017"\n', 'source = "Winter 2017"\nstages = ["sph", "crater"]\n')
    text = text.replace("[nbody]\n", "")
    file.write_text(text.replace("[dem.contact]\nfriction = 0.7\n", ""))
    outcome, screen = go()
    assert screen.worked() == ["sph", "crater"]
    assert sorted(path.name for path in outcome.run.iterdir() if path.is_dir()) == ["2_sph", "6_crater"]
    with pytest.raises(InputError, match="has none of these stages: it has sph crater"):
        go(start="bed", until="dem")


def test_a_stage_is_made_with_one_thread_of_linear_algebra(tmp_path, monkeypatch):
    """Sums of several threads have other last bits; and nobody makes a stage but by ``stages.make``."""
    found = []

    class Stage:
        @staticmethod
        def run(settings, run, out):
            found.append([pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"])

    monkeypatch.setattr(stages, "load", lambda name: Stage)
    with threadpool_limits(limits=2, user_api="blas"):
        stages.make("sph", None, tmp_path, tmp_path)
    assert found[0] and set(found[0]) == {1}
    others = [
        path.name
        for path in Path(stages.__file__).parent.glob("*.py")
        if path.name != "stages.py" and re.search(r"load\(.*\)\.run\(", path.read_text())
    ]
    assert not others
