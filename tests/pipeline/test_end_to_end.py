"""The real thing, small: the six stages of Valhalla in a minute, killed in the shock stage and in the collapse, ending
in the same bits."""

from __future__ import annotations

import csv
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from crater import stage as measuring
from crater.measures import chain
from matter.files import archive, checkpoint, snapshot
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running import plan
from pipeline.running.run import Request
from pipeline.settings import expected
from pipeline.settings.compose import compose
from pipeline.store import provenance

ROOT = Path(__file__).resolve().parents[2]
DRIVER = Path(__file__).resolve().parent / "frequent_checkpoints.py"
CASE = ROOT / "cases" / "valhalla_980km"


def start(out: Path) -> subprocess.Popen:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    command = [sys.executable, str(DRIVER), str(CASE), "--preset", "tiny", "--out", str(out)]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def start_command(*arguments: str) -> subprocess.CompletedProcess:
    """``run_case`` with real stages in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    command = [sys.executable, "-c", "from pipeline.cli import run_case; run_case()", *arguments]
    return subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)


def finished(out: Path) -> tuple[Path, str]:
    """Run to the end; the run folder and what was printed."""
    process = start(out)
    text, _ = process.communicate(timeout=900)
    assert process.returncode in (0, 1), text  # at this size a soundness limit may well be broken
    return next(out.glob("valhalla_980km-*")), text


def killed_in(out: Path, stage: str) -> None:
    """Run until ``stage`` has written two checkpoints, then kill the process the hard way."""
    process = start(out)
    end = time.monotonic() + 600
    while len(list(out.glob(f"valhalla_980km-*/*_{stage}/checkpoint_*.h5"))) < 2:
        assert process.poll() is None, process.communicate()[0]
        assert time.monotonic() < end, f"{stage} wrote no checkpoint"
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait(timeout=30) == -signal.SIGKILL
    run_folder = next(out.glob("valhalla_980km-*"))
    assert not (stages.folder(run_folder, stage) / "done.json").exists()
    assert json.loads((run_folder / "status.json").read_text())["stage"] == stage


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> tuple[Path, str]:
    """The uninterrupted run, its checkpoints as rare as a user's."""
    out = tmp_path_factory.mktemp("whole")
    done = start_command(str(CASE), "--preset", "tiny", "--out", str(out))
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return next(out.glob("valhalla_980km-*")), done.stdout


def test_every_stage_is_done_and_a_crater_is_measured(whole):
    run_folder, text = whole
    for stage in stages.ORDER:
        assert json.loads((stages.folder(run_folder, stage) / "done.json").read_text())["stage"] == stage
    measures = json.loads((run_folder / "6_crater" / "measures.json").read_text())
    assert measures["transient"]["depth_m"]["value"] > 0
    assert text.splitlines()[0] == f"run folder: {run_folder}"
    assert text.strip().splitlines()[-1] == f"result: {run_folder}"
    assert "published transient depth_m: 300 +51 -51 km" in text
    assert "BenzAsphaug1999" in (run_folder / "references.bib").read_text()


@pytest.mark.validation
def test_one_snapshot_of_the_run_gives_the_numbers_of_the_run(whole, tmp_path, capsys):
    """Both stages, through what the command calls, on what the run kept and on what the snapshots carry; once through
    the command in a process of its own."""
    run_folder, _ = whole
    measures = json.loads((run_folder / "6_crater" / "measures.json").read_text())
    shutil.copytree(run_folder, tmp_path / "bare", ignore=shutil.ignore_patterns("6_crater"))
    for entry, name in (
        (measures["transient"], measures["transient"]["snapshot"]),
        (measures["final"], "5_dem/last.vtkhdf"),
    ):
        for place in (run_folder, tmp_path / "bare"):
            if (entry, place) == (measures["final"], tmp_path / "bare"):
                code = "from pipeline.cli import measure_crater; measure_crater()"
                command = [sys.executable, "-c", code, str(place / name), "--out", str(tmp_path / "out")]
                environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
                done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
                assert done.returncode == 0 and "not at hand" not in done.stdout, done.stdout + done.stderr
            else:
                assert measuring.measure_snapshot(place / name, out=tmp_path / "out") == 0
                assert "not at hand" not in capsys.readouterr().out
            alone = json.loads((tmp_path / "out" / "measures.json").read_text())["final"]
            for key in ("depth_m", "diameter_apparent_m", "diameter_rim_m", "volume_m3"):
                assert alone[key]["value"] == entry[key]["value"], (name, place.name, key)
                if place == run_folder:
                    assert alone[key]["sigma"] == entry[key]["sigma"], (name, key)
                else:  # the chain error is the case's and stands with the run's own measures
                    own = math.sqrt(entry[key]["sigma"] ** 2 - entry[key]["sigma_parts"].get("chain", 0.0) ** 2)
                    assert alone[key]["sigma"] == pytest.approx(own, rel=1e-9), (name, key)


def test_the_run_comes_to_what_the_case_expects(whole):
    """``expected.toml`` of the case at this size: every measure within two standard errors, and the chain error in
    every error bar."""
    run_folder, text = whole
    assert "against expected.toml, preset tiny of valhalla_980km" in text
    lines = [line for line in text.splitlines() if ", expected " in line]
    assert len(lines) > 10 and all(line.endswith(": agrees") for line in lines), lines
    table = expected.expected_result(cases.read(CASE, "tiny"))
    found = expected.values(run_folder)
    for crater in expected.CRATERS:
        for name, entry in found[crater].items():
            if (wanted := getattr(getattr(table, crater), name)) is None or entry["value"] is None:
                continue
            error = wanted.chain
            assert entry["sigma_parts"]["chain"] == pytest.approx(error) and entry["sigma"] >= error
    assert (
        chain.KNOWN in text
        and "errors include the chain error" in (run_folder / "6_crater" / "report.html").read_text()
    )


def test_the_ejecta_of_the_run_are_in_its_catalogue_and_their_mass_by_fate_closes(whole):
    """Masses by fate are those of the rows of ``ejecta.h5``; with what stayed they are the mass of the shock stage's
    history."""
    crater = whole[0] / "6_crater"
    fates = json.loads((crater / "measures.json").read_text())["fates"]
    rows, facts = archive.read(crater / "ejecta.h5")
    mine = rows["layer"] >= 0
    for number, name in enumerate(facts["fates"]):
        if name != "falls back":  # the file does not tell inside from beyond
            assert fates["target_kg"][str(name)] == pytest.approx(rows["mass"][mine & (rows["fate"] == number)].sum())
    with (whole[0] / "2_sph" / "history.csv").open() as file:
        first = next(csv.DictReader(file))
    summed = sum(sum(fates[f"{body}_kg"].values()) for body in ("target", "projectile"))
    assert fates["closure"] < 1e-12 and summed == pytest.approx(float(first["mass_kg"]), rel=1e-9)
    assert len(rows["mass"]) == fates["particles"] > 0 and (rows["peak_pressure"] > 0.0).all()


def test_the_ledger_closes_mass_and_momenta(whole):
    rows = {row["name"]: row for row in json.loads((whole[0] / "4_handoff" / "ledger.json").read_text())}
    assert abs(rows["mass_total_rel"]["value"]) < 1e-12
    assert abs(rows["momentum_linear_rel_after"]["value"]) < 1e-10
    assert abs(rows["momentum_angular_rel_after"]["value"]) < 1e-10


@pytest.mark.parametrize(
    ("taken", "killed"),
    [
        pytest.param(("nbody", "sph", "bed"), ("dem",), marks=pytest.mark.validation),
        pytest.param(("nbody", "bed"), ("sph", "dem"), marks=pytest.mark.validation),
    ],
)
def test_killed_it_ends_in_the_same_bits(whole, tmp_path, taken, killed):
    reference, _ = whole
    for stage in taken:  # shared, as between any two runs
        for made in (reference.parent / ".store").glob(f"{stage}-*"):
            shutil.copytree(made, tmp_path / ".store" / made.name)
    for stage in killed:
        killed_in(tmp_path, stage)
    run_folder, text = finished(tmp_path)
    assert "2_sph: up to date" in text and "5_dem: continued" in text
    for stage, name in (("sph", "last"), ("handoff", "start"), ("dem", "last")):
        expected = snapshot.read(stages.folder(reference, stage) / f"{name}.vtkhdf")
        found = snapshot.read(stages.folder(run_folder, stage) / f"{name}.vtkhdf")
        assert set(found) == set(expected)
        for field in expected:
            np.testing.assert_array_equal(found[field], expected[field], err_msg=f"{stage} {field}")
        for table in expected.tables:
            np.testing.assert_array_equal(found.tables[table], expected.tables[table], err_msg=f"{stage} {table}")
    for name in ("2_sph/history.csv", "5_dem/history.csv", "6_crater/profile.csv"):
        assert (run_folder / name).read_text() == (reference / name).read_text(), name


@pytest.mark.validation
def test_a_control_run_shares_the_shock_stage_and_fills_the_ledger(whole):
    """The bed carved at the datum, through the real command: it does not move, and the ledger says so. (The bed by
    itself: ``tests/dem/test_controls.py``; what is shared and entered, with fake stages: ``test_sensitivity.py``.)"""
    run_folder, _ = whole
    before = (run_folder / "2_sph" / "done.json").stat().st_mtime_ns
    code = "from pipeline.cli import inspect_handoff; inspect_handoff()"
    command = [
        sys.executable,
        "-c",
        code,
        str(run_folder),
        "--sensitivity",
        "--only",
        "control_uncarved",
        "--no-pictures",
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    assert done.returncode in (0, 1) and "Traceback" not in done.stderr, done.stderr
    found = json.loads((run_folder / "4_handoff" / "sensitivity.json").read_text())
    still = found["controls"]["control_uncarved"]
    assert still["lost"] == 0 and still["drift_most_over_r"] < 0.05 and still["energy_rise_rel"] < 1e-9
    assert set(found["rows"]) == {"base"}  # the run itself, made by the same sources
    row = {entry["name"]: entry for entry in json.loads((run_folder / "4_handoff" / "ledger.json").read_text())}[
        "control_no_impact_run_drift_over_r"
    ]
    assert row["verdict"] == "pass" and row["value"] == still["drift_most_over_r"]
    assert (run_folder / "2_sph" / "done.json").stat().st_mtime_ns == before
    assert "control_uncarved" in (run_folder / "4_handoff" / "report.html").read_text()


@pytest.mark.parametrize(
    ("override", "shared"),
    [
        ("dem.contact.shell.friction=0.4", ["nbody", "sph"]),
        ("bed.seed=2", ["nbody", "sph"]),
        ("handoff.alpha=1.6", ["nbody", "sph", "bed"]),
        ("dem.end_time=500 s", ["nbody", "sph", "bed", "handoff"]),
    ],
)
def test_another_run_takes_what_comes_before_its_change(whole, override, shared):
    """The bed settles with the friction of the grains; what comes later leaves both shock stage and bed alone."""
    request = Request(cases.read(CASE, "tiny", [override]), whole[0].parent)
    planned = plan.plan(request, compose(request.case))
    assert [stage for stage in stages.ORDER if planned[stage].startswith(plan.STORED)] == shared


@pytest.mark.validation
def test_the_spread_of_an_ensemble_becomes_the_error_of_the_first(whole):
    """Two draws of the grains on one shock stage: their scatter, |y1 - y2| / sqrt(2), stands as the chain error of the
    first run's measures, in its own crater stage; the plain run keeps the one of ``expected.toml``. (The rule on known
    numbers: ``test_sweep.py``; the error bars that a case's chain error makes: above.)"""
    run_folder, _ = whole
    before = (run_folder / "6_crater" / "measures.json").read_text()
    command = [str(CASE), "--preset", "tiny", "--out", str(run_folder.parent), "--ensemble", "2", "--threads", "1"]
    done = start_command(*command)
    assert done.returncode in (0, 1) and "spread of the draws" in done.stdout, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    (sweep,) = run_folder.parent.glob("valhalla_980km-sweep-*")
    first, second = (sweep / name for name in ("m01", "m02"))
    assert first.samefile(run_folder) and (first / "2_sph").samefile(second / "2_sph")
    assert not (first / "3_bed").samefile(second / "3_bed")
    with_spread = [
        place
        for place in run_folder.parent.glob("valhalla_980km-????????")
        if place not in (run_folder, second.resolve())
    ]
    (measured,) = with_spread
    assert (measured / "5_dem").samefile(run_folder / "5_dem")
    one, other, found = (expected.values(place)["final"] for place in (first, second, measured))
    checked = 0
    for name in ("depth_m", "diameter_apparent_m", "volume_m3"):
        scatter = abs(one[name]["value"] - other[name]["value"]) / math.sqrt(2.0)
        assert found[name]["value"] == one[name]["value"]
        assert found[name]["sigma_parts"]["chain"] == pytest.approx(scatter, rel=1e-6), name
        checked += scatter > 0.0
    assert checked > 0 and (run_folder / "6_crater" / "measures.json").read_text() == before


@pytest.mark.validation
def test_a_stretch_of_it_computed_again_has_the_same_bits(whole, tmp_path):
    """``--verify``, the stages up to the bed: what the machine computes today, and then one number of one grain that a
    checkpoint holds otherwise than the run had it."""
    run_folder, _ = whole
    out = tmp_path / "runs"
    shutil.copytree(run_folder.parent, out, symlinks=True)
    run_folder = out / run_folder.name

    def verified() -> tuple[int, str]:
        code = "from pipeline.cli import run_case; run_case()"
        command = [sys.executable, "-c", code, str(run_folder), "--verify", "--from", "sph", "--until", "bed"]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
        return done.returncode, done.stdout + done.stderr

    code, text = verified()
    assert code == 0 and text.count("the same bits") == 2, text
    place = (run_folder / "2_sph").resolve()
    (path,) = place.glob("checkpoint_*.h5")
    arrays, scalars = archive.read(path)
    arrays["cloud/velocity"][7, 0] += 1e-6
    scalars.pop("checksum")
    path.unlink()
    checkpoint.save(place, int(scalars.pop("step")), arrays, scalars)
    done = json.loads((place / "done.json").read_text())
    done["files"][path.name] = [path.stat().st_size, provenance.file_sha256(path)]
    (place / "done.json").chmod(0o644)
    (place / "done.json").write_text(json.dumps(done))
    code, text = verified()
    assert code == 1 and "sph: DIFFERS in " in text and "bed: the same bits" in text, text
    assert not list(run_folder.glob(".verify*"))
