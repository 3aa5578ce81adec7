"""Every command against a run that is going on, stage by stage: what it says, and that nothing is lost by it.

The rows of ``SAID`` are the commands, its columns the stage that is being made meanwhile; the run is held in that
stage until every command has ended, goes on, and has to come to what a run comes to that nobody looked at.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import sys
import threading
import tomllib
from pathlib import Path

import numpy as np
import pytest

import bolide
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError, Unsound
from matter.files import archive, snapshot
from matter.particles import Particles
from pipeline import cli
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running import going_on
from pipeline.running.request import Request
from pipeline.running.run import run
from pipeline.store import folder, intact, store, view
from tests import pages
from tests.pipeline import warm
from tests.pipeline.test_ejecta_fates_page import catalogue
from tests.pipeline.test_store import Recorder

STAGES = ("sph", "bed", "handoff", "dem", "crater")
BUSY, MADE, NONE = "in use by process", "is being made by process", "no ledger|no measured crater"
# command -> exit code and a pattern of what it says, while each of STAGES is made
SAID = {
    "inspect_handoff RUN": [(2, NONE), (2, NONE), (2, MADE), (0, "page stays as it is"), (0, "page stays as it is")],
    "inspect_handoff RUN --sensitivity": [(2, BUSY), (2, BUSY), (2, MADE), (2, BUSY), (2, BUSY)],
    "compare_profiles RUN RUN --out RUN/2_sph": [(2, f"is a stage of a run|{NONE}")] * 4 + [(2, MADE)],
    "compare_profiles RUN RUN": [(2, NONE)] * 4 + [(2, MADE)],
    "fly_ejecta RUN --out OUT": [(2, "ejecta.h5")] * 4 + [(0, MADE)],
    "export_snapshot RUN/2_sph/snap_0000.vtkhdf --out OUT/x.csv": [(0, "7 particles")] * 5,
    "export_snapshot RUN/2_sph/snap_0000.vtkhdf --out RUN/2_sph/x.csv": [(2, "is a stage of a run")] * 5,
    "import_snapshot RUN/2_sph/history.csv --out RUN/2_sph/y.vtkhdf": [(2, "is a stage of a run")] * 5,
    "impact_census --count 1 --out RUN/2_sph": [(2, "is a stage of a run")] * 5,
    "measure_crater RUN/2_sph/snap_0000.vtkhdf": [(2, "holds 7 particles")] * 5,
    "measure_crater RUN/2_sph/snap_0000.vtkhdf --out RUN/2_sph": [(2, "is a stage of a run|holds 7 particles")] * 5,
    "fly_ejecta RUN --out RUN/2_sph": [(2, "is a stage of a run|ejecta.h5")] * 5,
    "python_door RUN": [(0, "1 snapshots, 0 tables")] * 3 + [(0, "2 snapshots, 1 tables")] * 2,
    "run_case RUN": [(2, BUSY)] * 5,
    "run_case RUN --from handoff": [(2, BUSY)] * 5,
    "run_case RUN --fresh": [(2, BUSY)] * 5,
    "run_case RUN --movie": [(2, BUSY)] * 5,
    "run_case RUN --verify": [(2, BUSY)] * 5,
    "run_case RUN --check": [(0, "run folder")] * 5,
    "run_case CASE --out RUNS": [(2, BUSY)] * 5,
    "run_case CASE --out RUNS --check": [(0, "run folder")] * 5,
    "run_case CASE --out RUNS --vary bed.radius=1000,2000m --check": [(0, "1 running, 1 to do")] * 5,
    "run_case CASE --out RUNS --vary bed.radius=1000,2000m --status": [
        (0, f"1 running, 1 to do\n.* running {one} ") for one in STAGES
    ],
    "run_case --prune --out RUNS": [(0, "0 B to be freed")] * 5,
    "run_case STAGE --prune --out RUNS": [(0, "in use by a run: it stays")] * 5,
    "run_case EARLIER --prune --out RUNS": [(0, "in use by a run: it stays")] * 5,
}


def started(case_folder: Path, out: Path, **options) -> Path:
    return run(Request(cases.read(case_folder, None, ()), out, **options), Recorder()).run


def command(line: str):
    """One of the commands in a child of this process, which knows the fake stages."""
    name, *words = line.split()

    def work() -> None:
        sys.argv = [name, *words]
        python_door(words[0]) if name == "python_door" else getattr(cli, name)()

    return warm.run(work, {"COLUMNS": "200"})


def python_door(run_folder: str) -> None:
    """Everything that ``bolide.open`` shows of a run, whatever is there of it."""
    opened, tables = bolide.open(run_folder), 0
    for look in ("history", "profile", "ledger", "measures", "compare"):
        try:
            found = getattr(opened, look)
            tables += len(found() if callable(found) else found) >= 0
        except InputError:
            continue
    opened.snapshot(0.0)
    print(f"{opened._repr_html_()}; {len(opened.snapshots)} snapshots, {tables} tables")


def test_every_command_stands_in_the_table():
    scripts = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]["scripts"]
    assert {line.split()[0] for line in SAID} == {*scripts, "python_door"}


def tree(place: Path) -> dict[str, str]:
    """Everything below a folder but what the run itself tells of: links by their targets, files by their content."""
    found = {}
    for path in sorted(place.rglob("*")):
        if path.name in ("status.json", "run.log", "run.lock") or store.LOCKS in path.parts:
            continue
        kind = os.readlink(path) if path.is_symlink() else "folder" if path.is_dir() else ""
        found[str(path.relative_to(place))] = kind or hashlib.sha256(path.read_bytes()).hexdigest()
    return found


def results(run_folder: Path) -> dict[str, object]:
    """The results of every stage, by the stages' own records."""
    return {stage: folder.mark(stages.folder(run_folder, stage) / folder.DONE)["files"] for stage in stages.ORDER}


def half_made(out: Path, stage: str) -> None:
    """What a stage has written before it is done."""
    fields = {"position": np.eye(7, 3), "velocity": np.zeros((7, 3)), "mass": np.ones(7), "radius": np.ones(7)}
    if stage in ("sph", "dem"):
        snapshot.write(Particles(fields, {"time": 0.0, "stage": stage}), out / "snap_0000.vtkhdf")
    if stage == "crater":
        catalogue(out / "ejecta.h5")
        (out / "report.html").write_text(pages.document("A", ["before"]))


@pytest.mark.parametrize("stage", STAGES)
def test_nothing_is_lost_when_a_run_is_looked_at(case_folder, tmp_path, fake_stages, monkeypatch, stage):
    for one in ("sph", "dem", "crater"):
        _writes_first(monkeypatch, one)
    reference = results(started(case_folder, tmp_path / "undisturbed"))
    begun, seen, failed = threading.Event(), threading.Event(), []
    make = stages.load(stage).run

    def held(settings, inputs, out):
        half_made(out, stage)
        begun.set()
        failed.append(not seen.wait(600))
        make(settings, inputs, out)

    monkeypatch.setattr(stages.load(stage), "run", held)
    runs, out = tmp_path / "runs", tmp_path / "out"
    at_work = threading.Thread(target=started, args=(case_folder, runs))
    at_work.start()
    try:
        assert begun.wait(60)
        [run_folder] = [path for path in runs.iterdir() if path.name != store.STORE]
        places = [os.readlink(run_folder / f"{k}_{one}").rpartition("/")[2] for k, one in ((2, "sph"), (1, "nbody"))]
        places[0] = os.readlink(stages.folder(run_folder, stage)).rpartition("/")[2]
        before = tree(runs)
        for line, outcomes in SAID.items():
            words = line.replace("RUNS", str(runs)).replace("RUN", str(run_folder)).replace("OUT", str(out))
            words = words.replace("STAGE", places[0]).replace("EARLIER", places[1]).replace("CASE", str(case_folder))
            code, said = outcomes[STAGES.index(stage)]
            done = command(words)
            heard = done.stdout + done.stderr
            assert done.returncode == code and re.search(said, heard) and "Traceback" not in heard, (line, heard)
            assert tree(runs) == before, line
    finally:
        seen.set()
        at_work.join()
    assert failed == [False] and results(run_folder) == reference


def _writes_first(monkeypatch, stage: str) -> None:
    """The stage leaves what ``half_made`` leaves, whether it is held or not."""
    make = stages.load(stage).run

    def both(settings, inputs, out):
        half_made(out, stage)
        make(settings, inputs, out)

    monkeypatch.setattr(stages.load(stage), "run", both)


def test_a_stage_that_is_not_done_is_never_turned_into_a_folder(case_folder, tmp_path, fake_stages, monkeypatch):
    def killed(settings, inputs, out):
        raise Unsound("handoff: made nothing")

    monkeypatch.setattr(stages.load("handoff"), "run", killed)
    with pytest.raises(InputError, match=r"4_handoff ended without start\.vtkhdf, ledger\.json in .*\.store"):
        started(case_folder, tmp_path / "runs")
    [run_folder] = [path for path in (tmp_path / "runs").iterdir() if path.name != store.STORE]
    assert not list((tmp_path / "runs" / store.STORE).glob("handoff-*/done.json"))
    for look in (view.own, intact.check_shown, intact.require_done):
        with pytest.raises(InputError, match=r"was begun and is not finished: run_case .* goes on with it"):
            look(run_folder, "handoff")
    with pytest.raises(InputError, match="has no finished 5_dem yet"):
        view.own(run_folder, "dem")
    assert (run_folder / "4_handoff").is_symlink() and not (run_folder / "5_dem").exists()


def test_a_store_that_holds_an_empty_stage_heals(case_folder, tmp_path, fake_stages):
    """As an earlier version left it: ``done.json`` alone, which lists no files."""
    run_folder = started(case_folder, tmp_path / "runs")
    reference, place = results(run_folder), (run_folder / "4_handoff").resolve()
    done = json.loads((place / "done.json").read_text())
    shutil.rmtree(place)
    place.mkdir()
    archive.write_text(place / "done.json", json.dumps({**done, "files": {}}))
    with pytest.raises(InputError, match=r"is called done and lacks start\.vtkhdf, .*run_case .* makes it again"):
        intact.check_shown(run_folder, "handoff")
    with pytest.raises(InputError, match="is called done and lacks"):  # what reads it says so too
        run(Request(going_on.read(run_folder), tmp_path / "runs", start="dem"), Recorder())
    (run_folder / "anew.json").unlink()
    screen = Recorder()
    run(Request(going_on.read(run_folder), tmp_path / "runs"), screen)
    assert screen.made() == ["handoff"] and results(run_folder) == reference


@pytest.mark.parametrize("mark", ["begun.json", "done.json"])
def test_a_measured_snapshot_of_a_stage_leaves_nothing_in_the_stage(tmp_path, mark):
    from crater import stage

    shape = synthetic.Shape(synthetic.bowl(100.0), 100.0, 320.0)
    p = synthetic.cloud_on_plane(shape, 14.0, np.random.default_rng(1), "jitter")
    path = tmp_path / "5_dem" / "snap_0003.vtkhdf"
    snapshot.write(Particles({"position": p, "radius": np.full(len(p), 7.0)}, {"packing_fraction": np.pi / 6}), path)
    (path.parent / mark).write_text("{}")
    before = tree(path.parent)
    assert stage.measure_snapshot(path) == 0 and tree(path.parent) == before
    assert (tmp_path / "5_dem_snap_0003_crater" / "measures.json").is_file()
