"""Sweeps: which members there are, how they run side by side, and the table in which they end."""

from __future__ import annotations

import ast
import csv
import json
import os
import shlex
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import bolide
from matter.case.identity_fields import identity_fields
from matter.errors import InputError, Stopped
from matter.files import archive
from pipeline.case import read as cases
from pipeline.running import prediction, run_process
from pipeline.settings.compose import compose
from pipeline.store.store import LOCKS, STORE
from pipeline.sweeps import ensemble, sweep_cost, sweep_dask, sweep_jobs, sweep_run, sweep_table
from pipeline.sweeps.sweep import Member, Sweep, members, parsed, planned_sweep, read_table

FAKES = Path(__file__).resolve().parent / "fake_rooms"
ROOT = Path(__file__).resolve().parents[2]
VALHALLA = ROOT / "cases" / "valhalla_980km"


def test_the_text_of_a_variation():
    assert parsed("impact.angle_from_vertical=15,40,65 deg") == (
        "impact.angle_from_vertical",
        ["15 deg", "40 deg", "65 deg"],
    )
    assert parsed("impact.speed = 900 m/s, 1.2 km/s") == ("impact.speed", ["900 m/s", "1.2 km/s"])
    assert parsed("bed.seed=1,2") == ("bed.seed", [1, 2]) and parsed("handoff.alpha=1,1.5") == (
        "handoff.alpha",
        [1, 1.5],
    )
    assert parsed("sph.damage=true,false") == ("sph.damage", [True, False]) and parsed("handoff.method=mapped,direct")[
        1
    ] == ["mapped", "direct"]
    for wrong in ("bed.seed", "=1,2", "bed.seed=1,,2"):
        with pytest.raises(InputError, match="write it as key=a,b,c"):
            parsed(wrong)


def values(content, *options):
    return [dict(member.values) for member in members(read_table(content, options))]


def test_grids_and_lists():
    grid = values({}, "a.x=1,2", "b=3,4,5")
    assert len(grid) == 6 and grid[0] == {"a.x": 1, "b": 3} and grid[-1] == {"a.x": 2, "b": 5}
    assert values({"kind": "list", "vary": {"a": {"x": [1, 2]}, "b": [3, 4]}}) == [
        {"a.x": 1, "b": 3},
        {"a.x": 2, "b": 4},
    ]
    assert Member("m01", {"impact.speed": "15 km/s", "bed.seed": 2, "sph.damage": False}).overrides == (
        'impact.speed="15 km/s"', "bed.seed=2", "sph.damage=false",
    )  # fmt: skip


def points(*rows, **more):
    return {"kind": "points", "points": list(rows), **more}


def test_points_are_members_by_themselves():
    found = members(read_table(points({"name": "one", "a": {"x": 1}, "b": 2}, {"b": 3, "case": "valhalla_350km"}), []))
    assert [(one.name, dict(one.values)) for one in found] == [("one", {"a.x": 1, "b": 2}), ("m02", {"b": 3})]
    assert found[0].where is None and found[1].where == ROOT / "cases" / "valhalla_350km"
    for content, words in (
        (points({"a": [1, 2]}), "point 1: a: one value is needed"),
        (points({"name": "x", "a": 1}, {"name": "x", "a": 2}), "'x' is given twice"),
        (points({"name": "../x", "a": 1}), "a name has letters"),
        (points({"name": "logs", "a": 1}), "a name has letters"),
        (points({"a": 1}, vary={"b": [1]}), "points name their own values"),
        (points({"a": 1}) | {"kind": "grid"}, 'kind = "points" goes with'),
        (points(), 'kind = "points" goes with'),
    ):
        with pytest.raises(InputError, match=words):
            read_table(content, [])
    with pytest.raises(InputError, match="no case at nowhere"):
        members(read_table(points({"case": "nowhere", "a": 1}), []))


@pytest.mark.parametrize("kind", ["lhs", "sobol"])
def test_draws_fill_the_space_between_limits(kind):
    found = values(
        {"kind": kind, "members": 16, "seed": 3, "vary": {"a": [0.0, 1.0], "b": ["10 km/s", "20 km/s"], "n": [1, 4]}}
    )
    assert len(found) == 16 and found == values(
        {"kind": kind, "members": 16, "seed": 3, "vary": {"a": [0.0, 1.0], "b": ["10 km/s", "20 km/s"], "n": [1, 4]}}
    )
    assert sorted(int(16 * one["a"]) for one in found) == list(range(16))  # one in every sixteenth
    speeds = [float(one["b"].removesuffix(" km/s")) for one in found]
    assert min(speeds) < 11.0 and max(speeds) > 19.0 and {one["n"] for one in found} == {1, 2, 3, 4}


def test_what_cannot_be_varied_is_told_at_once():
    for content, words in (
        ({}, "nothing is varied"),
        ({"kind": "gird", "vary": {"a": [1]}}, "kind"),
        ({"kind": "list", "vary": {"a": [1], "b": [1, 2]}}, "equally many"),
        ({"kind": "lhs", "vary": {"a": [1, 2, 3]}}, "two limits"),
        ({"memebers": 3, "vary": {"a": [1]}}, "did you mean 'members'"),
    ):
        with pytest.raises(InputError, match=words):
            read_table(content, [])
    for low, high, words in (
        ("1 km", "x", "cannot read"),
        ("1 km", 2.0, "one limit has a unit"),
        (True, False, "limits are numbers"),
    ):
        with pytest.raises(InputError, match=words):
            values({"kind": "lhs", "vary": {"a": [low, high]}})


@pytest.fixture
def sweep(case_folder, tmp_path, fake_stages, monkeypatch):
    """``sweep(*options)`` of the fake stages, whose members are processes with fake stages too."""
    monkeypatch.setattr(run_process, "_COMMAND", "import drive; drive.cli.run_case()")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(FAKES)]))
    monkeypatch.setattr(sweep_run, "EVERY_S", 0.05)

    def make(*options, overrides=(), kind="grid", out="runs"):
        return Sweep(
            case_folder,
            None,
            None,
            tuple(overrides),
            tmp_path / out,
            tuple(members(read_table({"kind": kind}, options))),
        )

    return make


def begun(sweep) -> list[str]:
    """How often each shock stage was begun."""
    return [path.read_text() for path in (sweep.out / STORE).glob("sph-*/starts.txt")]


def test_members_share_what_comes_before_and_end_in_one_table(sweep):
    """Two at once, one shock stage: the second member is not begun before that is there. One member cannot be made,
    and is named."""
    one = sweep("dem.contact.friction=0.3,0.4,0.4", "handoff.time=60,60,120 s", kind="list")
    heard = []
    failed = sweep_run.Runner(one, 1, 2, heard.append).run()
    assert failed == {"m03": 2}  # 120 s: the fake handoff has no such snapshot
    assert "no snapshot near" in (one.folder / "logs" / "m03.log").read_text()
    assert begun(one) == ["0\n"] and not any(
        "waits" in path.read_text() for path in (one.folder / "logs").glob("*.log")
    )
    sweep_run.links(one)
    rows = sweep_table.write(one)
    with open(one.folder / sweep_table.CSV, newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["state"] for row in table] == ["done", "done", "failed"] and table[1]["dem.contact.friction"] == "0.4"
    assert [row["final/depth_m"] for row in table] == ["12000.0", "12000.0", ""] and table[0]["handoff.time"] == "60 s"
    arrays = archive.read(one.folder / sweep_table.HDF5)[0]
    assert arrays["final.depth_m_sigma"][0] == 2.6e4 and np.isnan(arrays["final.depth_m"][2])
    assert arrays["dem.contact.friction"].tolist() == [0.3, 0.4, 0.4]
    page = (one.folder / sweep_table.PAGE).read_text()
    assert "<h1>2 of 3 members are done, 1 failed, depth 12 km, 0 settled</h1>" in page
    assert "2 of 3 members are done" in page and "Against dem.contact.friction" in page and "<img" in page
    assert (one.folder / "m02" / "6_crater" / "measures.json").is_file() and "m03" in sweep_table.text(rows)
    status = sweep_run.status(one)
    assert "3 members, 2 done, 1 failed" in status and "handoff.time = 120 s" in status
    # the same again makes only what failed, and ends in the same table
    before = (one.folder / sweep_table.CSV).read_text()
    again = []
    sweep_run.Runner(one, 1, 2, again.append).run()
    assert sum("begins" in line for line in again) == 1
    sweep_table.write(one)
    assert (one.folder / sweep_table.CSV).read_text() == before


@pytest.mark.validation
def test_a_stopped_sweep_continues(sweep):
    slow = sweep("dem.contact.friction=0.3,0.4", overrides=("sph.sleep_s=0.05",))

    def stop():
        while not list((slow.out / STORE).glob("sph-*/checkpoint_*")):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=stop).start()
    with pytest.raises(Stopped, match="the same command continues"):
        sweep_run.Runner(slow, 1, 1, lambda text: None).run()
    assert (
        sweep_run.state_of(slow, slow.members[0]).word == "stopped"
        and sweep_run.state_of(slow, slow.members[1]).word == "to do"
    )
    assert sweep_run.Runner(slow, 1, 1, lambda text: None).run() == {}
    (starts,) = begun(slow)
    assert len(starts.split()) == 2 and starts.split()[1] != "0"  # continued, not begun anew


@pytest.mark.campaign
def test_workers_of_dask_one_of_them_killed(sweep, monkeypatch):
    """Two local workers; the one that makes the shock stage is killed: its member goes on elsewhere, and the table is
    that of any other sweep."""
    distributed = pytest.importorskip("distributed")
    one = sweep("dem.contact.friction=0.3,0.4", overrides=("sph.sleep_s=0.05",))
    monkeypatch.setattr(sweep_dask, "side_by_side", lambda *_: 2)
    monkeypatch.setattr(sweep_dask, "PATIENCE_S", 1.0)
    clusters, killed, make = [], [], distributed.LocalCluster
    monkeypatch.setattr(distributed, "LocalCluster", lambda **given: clusters.append(make(**given)) or clusters[-1])

    def kill():
        while not (found := list(one.out.glob("small-*/2_sph/checkpoint_*"))):
            time.sleep(0.05)
        maker = int(json.loads((one.out / STORE / LOCKS / found[0].resolve().parent.name).read_text())["pid"])
        parents = {nanny.pid for nanny in clusters[0].workers.values()}
        parent = int(Path(f"/proc/{maker}/stat").read_text().rpartition(")")[2].split()[1])
        if parent in parents:
            os.kill(parent, signal.SIGKILL)
            killed.append(parent)

    killer = threading.Thread(target=kill)
    killer.start()
    assert sweep_dask.run(one, 1, sweep_dask.LOCAL, lambda text: None) == {}
    killer.join()
    assert len(killed) == 1
    rows = sweep_table.write(one)
    assert [row["state"] for row in rows] == ["done", "done"] and len(begun(one)) == 1
    with pytest.raises(InputError, match="no scheduler answers"):
        sweep_dask.run(one, 1, "tcp://127.0.0.1:1", lambda text: None)


def test_the_name_of_a_sweep_follows_from_what_it_computes(sweep):
    assert (
        sweep("sph.steps=7,9").folder
        == sweep("sph.steps=7,9", overrides=("impact.speed=18234 m/s",)).folder
        != sweep("sph.steps=7,8").folder
    )
    with pytest.raises(InputError, match=r"(?s)member m02 \(sph\.steps=.*must be a whole number"):
        assert sweep("sph.steps=7,x").folder


@pytest.fixture
def sweep_file(case_folder, tmp_path, sweep):
    """A file that holds a sweep alone, of ``small`` beside it and of a copy of it that is another body."""
    other = tmp_path / "other"
    shutil.copytree(case_folder, other)
    text = (other / "case.toml").read_text()
    (other / "case.toml").write_text(text.replace("1842 km", "1800 km").replace("18.234 km/s", "12 km/s"))
    file = tmp_path / "both.toml"
    file.write_text(
        """
        [sweep]
        kind = "points"
        case = "small"
        common = { "case.stages" = ["nbody", "sph", "bed", "handoff", "dem", "crater"], sph.steps = 7 }
        points = [
          { name = "first" },
          { name = "slow", "impact.speed" = "9 km/s" },
          { name = "third", case = "other", "dem.contact.friction" = 0.4 },
        ]
        """
    )
    return file


@pytest.mark.validation
def test_a_file_with_a_sweep_alone_sweeps_other_cases(sweep_file, tmp_path):
    """Members of two cases in one table: what a member does not set stands there as its case has it."""
    read = cases.read(sweep_file)
    made = planned_sweep(read, read_table(read.sweep, []), tmp_path / "runs")
    assert made.folder.name.startswith("both-sweep-")
    assert sweep_run.Runner(made, 1, 2, lambda text: None).run() == {}
    rows = sweep_table.write(made)
    assert [(row["member"], row["case"], row["impact.speed"]) for row in rows] == [
        ("first", "small", "18.234 km/s"), ("slow", "small", "9 km/s"), ("third", "other", "12 km/s"),
    ]  # fmt: skip
    assert [row["dem.contact.friction"] for row in rows] == [0.7, 0.7, 0.4]
    assert all(compose(made.requests[name].case)["sph"].steps == 7 for name in ("first", "third"))
    page = (made.folder / sweep_table.PAGE).read_text()
    assert "Sweep both" in page and "Against case" in page and "Against impact.speed" in page
    assert "small, impact.speed = 9 km/s" in sweep_run.status(made)
    # a picture shows the plainest member of each case, and what differs from it in that key
    shown = {
        key: [row["member"] for row in sweep_table._about(made, rows, key)]
        for key in ("impact.speed", "dem.contact.friction")
    }
    assert shown == {"impact.speed": ["first", "slow", "third"], "dem.contact.friction": ["first", "third"]}


def test_such_a_file_is_no_case_itself(sweep_file, drive, tmp_path):
    code, _, err = drive(sweep_file, "--out", tmp_path / "runs")
    assert code == 2 and f"{sweep_file} holds a sweep alone: run_case {sweep_file} --sweep" in err
    code, out, err = drive(sweep_file, "--out", tmp_path / "runs", "--sweep", "--check")
    assert code == 0 and "3 members, 3 to do" in out and not (tmp_path / "runs").exists(), err
    sweep_file.write_text('[sweep]\nkind = "points"\npoints = [{ "impact.speed" = "9 km/s" }]\n')
    code, _, err = drive(sweep_file, "--out", tmp_path / "runs", "--sweep")
    assert code == 2 and "does not say of which case" in err and "Traceback" not in err


def test_the_cost_counts_what_members_share_once(sweep):
    """Two frictions in three speeds: the shock stages are three; where one is there already, two."""
    made = sweep("dem.contact.friction=0.3,0.4", "impact.speed=10,11,12 km/s")
    rows = sweep_cost.rows_of(made)
    assert [(rows[stage].members, rows[stage].made) for stage in ("nbody", "sph", "dem")] == [(6, 3), (6, 3), (6, 6)]
    assert rows["sph"].wall_s == pytest.approx(0.5 * rows["sph"].members * _one(made, "sph"))
    bolide.run(made.where, out=made.out, quiet=True, until="sph", **{"impact.speed": "10 km/s"})
    rows = sweep_cost.rows_of(made)
    assert [rows[stage].made for stage in ("nbody", "sph", "dem")] == [2, 2, 6]


def _one(made, stage):
    request = next(iter(made.requests.values()))
    return prediction.predictions(request, compose(request.case))[stage]["wall_s"]


def test_the_sweep_of_the_thesis_is_the_matrix_of_its_claims(tmp_path):
    """27 members by the names of ``studies/valhalla_claims.py``, each with the same shock stage."""
    from studies.valhalla_claims import matrix

    read = cases.read(ROOT / "studies" / "winter_2017" / "thesis.toml", "quick")
    made = planned_sweep(read, read_table(read.sweep, []), tmp_path)
    variants = {variant.name: variant for variant in matrix("quick")}
    assert [member.name for member in made.members] == list(variants) and len(variants) == 27
    for name, request in made.requests.items():
        assert request.wanted == ("sph", "crater")
        ours, theirs = (identity_fields(compose(case)["sph"]) for case in (request.case, variants[name].read()))
        assert ours == theirs, name


@pytest.mark.validation
def test_the_sweep_of_late_stages_shares_one_shock_stage(tmp_path):
    read = cases.read(VALHALLA / "late_stages.toml", "quick")
    rows = sweep_cost.rows_of(planned_sweep(read, read_table(read.sweep, []), tmp_path))
    assert {stage: row.made for stage, row in rows.items()} == {
        "nbody": 1, "sph": 1, "bed": 12, "handoff": 12, "dem": 12, "crater": 12,
    }  # fmt: skip


def test_a_sweep_from_python_is_a_table(sweep, case_folder, tmp_path):
    table = bolide.sweep(
        case_folder, {"dem.contact.friction": [0.3]}, out=tmp_path / "runs", quiet=True, **{"sph.steps": 7}
    )
    assert (
        table.loc["m01", "state"] == "done"
        and table.loc["m01", "final/depth_m"] == 1.2e4
        and table.attrs["units"]["final/depth_m"] == "m"
    )
    assert (
        bolide.open(Path(table.attrs["folder"]) / "m01").settings["sph"]["steps"] == 7 and table.attrs["failed"] == {}
    )
    with pytest.raises(InputError, match="nothing is varied"):
        bolide.sweep(case_folder)


def test_an_ensemble_draws_grains_anew_in_each_member_and_the_shock_in_every_second():
    case = cases.read(VALHALLA, "tiny")
    found = ensemble.members(case, 4)
    assert [dict(member.values) for member in found] == [
        {"sph.seed": 1, "bed.seed": 1}, {"sph.seed": 1, "bed.seed": 2}, {"sph.seed": 2, "bed.seed": 3}, {"sph.seed": 2,
        "bed.seed": 4},
    ]  # fmt: skip
    assert [
        member.values["sph.seed"] for member in ensemble.members(cases.read(ROOT / "cases" / "deep_impact", "tiny"), 3)
    ] == [1, 2, 3]  # no grains
    with pytest.raises(InputError, match="at least 2"):
        ensemble.members(case, 1)


def test_its_spread_becomes_the_error_of_the_first(tmp_path, monkeypatch):
    """Four depths, 100, 106, 98 and 104 m, in two shock stages: within (18 + 18) / 2, between no more than that:
    sqrt(18) m."""
    case = cases.read(VALHALLA, "tiny")
    one = Sweep(VALHALLA, "tiny", None, (), tmp_path, tuple(ensemble.members(case, 4)))
    depth = dict(
        zip((one.requests[member.name].run_folder for member in one.members), (100.0, 106.0, 98.0, 104.0), strict=True)
    )
    cell = {"sigma": 3.0, "unit": "m", "sigma_parts": {}}
    monkeypatch.setattr(ensemble.expected, "values", lambda run: {"final": {"depth_m": {**cell, "value": depth[run]}}})
    (row,) = ensemble.spread(one)
    assert (row.crater, row.measure, row.mean, row.measuring) == (
        "final",
        "depth_m",
        102.0,
        3.0,
    ) and row.draws == pytest.approx(18.0**0.5)
    request, arguments = ensemble.measured(one, [row], 2)
    settings = compose(request.case)
    assert (
        settings["crater"].chain.final.depth_m == pytest.approx(18.0**0.5)
        and settings["crater"].chain.transient.depth_m is None
    )
    assert arguments[-2:] == ["--set", "bed.seed=1"] and "--threads" in arguments
    monkeypatch.setattr(ensemble.expected, "values", lambda run: {})
    assert ensemble.spread(one) == []


def test_axes_of_what_is_varied():
    places, unit, words = sweep_table.axis_of(["15 deg", "40 deg"])
    assert places.tolist() == [15.0, 40.0] and unit == "deg" and not words
    assert sweep_table.axis_of(["900 m", "1 km"])[0].tolist() == [900.0, 1000.0]
    assert sweep_table.axis_of(["a", "b", "a"])[0].tolist() == [0.0, 1.0, 0.0] and sweep_table.axis_of([True, False])[
        2
    ] == ["True", "False"]


def test_the_command_checks_and_says(drive, case_folder, tmp_path):
    options = (case_folder, "--out", tmp_path / "runs", "--vary", "dem.contact.friction=0.3,0.4", "--until", "nbody")
    code, out, err = drive(*options, "--check")
    assert (
        code == 0 and "2 members" in out and "m02" in out and "at once" in out and not (tmp_path / "runs").exists()
    ), err
    code, _, err = drive(case_folder, "--out", tmp_path / "runs", "--sweep", "--status")
    assert code == 2 and "nothing is varied" in err and "Traceback" not in err


@pytest.mark.parametrize(
    ("kind", "file", "words"),
    [("slurm-array", "slurm.sh", "#SBATCH --array=1-2"), ("snakemake", "Snakefile", "range(1, 2 + 1)")],
)
def test_job_files_hold_a_command_for_each_member(sweep, kind, file, words):
    one = sweep("impact.speed=10,20 km/s")
    assert str(one.folder.resolve() / file) in sweep_jobs.write(one, kind, 4)
    assert words in (one.folder / file).read_text()
    first = (one.folder / "commands.txt").read_text().splitlines()[0]
    assert shlex.split(first)[-2:] == ["--set", 'impact.speed="10 km/s"'] and "--threads 4" in first
    (one.folder / "commands.txt").write_text("exec echo one\nexec echo two\n")
    done = subprocess.run(["bash", str(one.folder / "member.sh"), "2"], capture_output=True, text=True, timeout=60)
    assert (
        done.stdout.split() == ["two"]
        and subprocess.run(["bash", "-n", str(one.folder / "member.sh")]).returncode == 0
    )
    with pytest.raises(InputError, match="did you mean 'slurm-array'"):
        sweep_jobs.write(one, "slurm", 1)


@pytest.mark.parametrize("name", ["a b", "c'd", 'e"+f()+"', "{g}", "$(touch PWNED)", "`touch PWNED`", "%h #", "-n"])
def test_names_in_job_files_are_names_and_never_commands(sweep, tmp_path, name):
    """What ``bash`` and Snakemake make of them is the path, to the last character."""
    one = sweep("impact.speed=10,20 km/s", out=name)
    for kind in sweep_jobs.KINDS:
        sweep_jobs.write(one, kind, 1)
    words = shlex.split((one.folder / "commands.txt").read_text().splitlines()[0])
    assert words[words.index("--out") + 1] == str(tmp_path / name)
    (one.folder / "commands.txt").write_text("exec echo one\nexec echo two\n")
    task = {**os.environ, "SLURM_ARRAY_TASK_ID": "2"}
    assert subprocess.run(["bash", one.folder / "slurm.sh"], env=task, cwd=tmp_path, timeout=60).returncode == 0
    assert (one.folder / "logs" / "2.log").read_text() == "two\n"
    done, made, command = snakemake_texts(one.folder / "Snakefile")
    for pattern in (done, made):
        assert pattern.format(member=1) == str(one.folder.resolve() / "done" / "1")
    words = command.format(wildcards=SimpleNamespace(member=2))
    assert subprocess.run(["bash", "-c", words], capture_output=True, text=True, timeout=60).stdout == "two\n"
    assert not list(tmp_path.rglob("PWNED")) and not Path("PWNED").exists()


def snakemake_texts(file: Path) -> list[str]:
    """The texts of a Snakefile, as Python reads them: what is expanded, what is touched, the command."""
    lines = [line.strip() for line in file.read_text().splitlines()]
    tree = [
        ast.parse(next(line for line in lines if line.startswith(f"{name}(")).rstrip(","))
        for name in ("expand", "touch")
    ]
    tree.append(ast.parse(lines[lines.index("shell:") + 1]))
    found = [[node.value for node in ast.walk(one) if isinstance(node, ast.Constant)] for one in tree]
    assert all(len(texts) == 1 for texts in found)
    return [texts[0] for texts in found]


@pytest.mark.parametrize("kind", sweep_jobs.KINDS)
def test_a_name_of_two_lines_is_refused_in_job_files(sweep, tmp_path, kind):
    for out, more in (("a\ntouch PWNED #", ()), ("a", ("case.title=b\ntouch PWNED",))):
        with pytest.raises(InputError, match="holds a control character"):
            sweep_jobs.write(sweep("impact.speed=10,20 km/s", overrides=more, out=out), kind, 1)
    assert not list(tmp_path.rglob("*.sh")) and not list(tmp_path.rglob("Snakefile"))


def ways_of(tmp_path: Path, frictions: str, sleep_s: float) -> list[str]:
    """Arguments of ``studies/sweep_ways.py`` for a sweep of the fake stages; ``sleep_s`` [s] a step where one is
    killed."""
    file = tmp_path / "friction.toml"
    file.write_text(
        f'[sweep]\ncase = "small"\ncommon = {{ sph.sleep_s = {sleep_s} }}\n'
        f"[sweep.vary]\ndem.contact.friction = {frictions}\n"
    )
    return ["--out", str(tmp_path / "ways"), "--sweep", str(file), "--preset", ""]


@pytest.mark.validation
def test_members_by_themselves_and_the_sweep_are_one_table(sweep, case_folder, tmp_path, capfd):
    """``studies/sweep_ways.py``, two of its ways. A changed cell is told."""
    from studies import sweep_ways

    command = ways_of(tmp_path, "[0.3, 0.4]", 0.0)
    assert sweep_ways.main([*command, "separate", "plain"]) == 0
    assert capfd.readouterr().out.count("the same table as separate") == 1
    shocks = {way: len(list((tmp_path / "ways").glob(f"{way}/**/{STORE}/sph-*"))) for way in ("separate", "plain")}
    assert shocks == {"separate": 2, "plain": 1}
    table = tmp_path / "ways" / "plain.csv"
    table.write_text(table.read_text().replace("12000.0", "12600.0", 1))
    assert sweep_ways.main([*command, "separate", "plain"]) == 1
    assert "differs from separate in 1 cells by up to 4.8e-02 (m01 final/depth_m" in capfd.readouterr().out
    assert sweep_ways.main([*command, "plane"]) == 2


@pytest.mark.validation
def test_a_sweep_in_four_ways_is_one_table(sweep, case_folder, tmp_path, capfd):
    """``studies/sweep_ways.py``: by itself, plain, killed twice, on dask with a worker killed. A changed cell is
    told."""
    pytest.importorskip("distributed")
    from studies import sweep_ways

    command = ways_of(tmp_path, "[0.3, 0.4, 0.5]", 0.05)
    assert sweep_ways.main(command) == 0
    told = capfd.readouterr().out
    assert told.count("the same table as separate") == 3 and told.count("  killed: ") == 3
    shocks = {way: len(list((tmp_path / "ways").glob(f"{way}/**/{STORE}/sph-*"))) for way in sweep_ways.WAYS}
    assert shocks == {"separate": 3, "plain": 1, "killed": 1, "dask": 1}
    starts = (next((tmp_path / "ways" / "killed" / STORE).glob("sph-*")) / "starts.txt").read_text().split()
    assert len(starts) == 2 and starts[0] == "0" and int(starts[1]) > 0
    table = tmp_path / "ways" / "dask.csv"
    table.write_text(table.read_text().replace("12000.0", "12600.0", 1))
    assert sweep_ways.main(command) == 1
    assert "differs from separate in 1 cells by up to 4.8e-02 (m01 final/depth_m" in capfd.readouterr().out
    assert sweep_ways.main([*command, "plane"]) == 2
