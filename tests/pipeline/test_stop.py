"""Stopped by signals, in a process of its own: exit 75, and the same command ends in the same bits."""

from __future__ import annotations

import json
import signal
import time
from pathlib import Path

import pytest

STEPS = ("--set", "sph.steps=61")


def wait_for(condition, process, seconds: float = 60.0) -> None:
    """Wait until ``condition()`` holds while ``process`` runs."""
    end = time.monotonic() + seconds
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def checkpoints(runs: Path) -> list[Path]:
    return list(runs.glob("small-*/2_sph/checkpoint_*.h5"))


@pytest.fixture(scope="module")
def whole() -> dict[str, str]:
    """What an uninterrupted run ends with, once it has run."""
    return {}


@pytest.fixture
def expected(drive, case_folder, tmp_path, whole) -> str:
    """What an uninterrupted run ends with; one for all tests here."""
    if "x" not in whole:
        code, _, err = drive(case_folder, "--out", tmp_path / "whole", *STEPS, "--until", "sph")
        assert code == 0, err
        whole["x"] = next((tmp_path / "whole").glob("small-*/2_sph/x.txt")).read_text()
    return whole["x"]


@pytest.mark.parametrize(
    "number", [pytest.param(signal.SIGTERM, marks=pytest.mark.validation), signal.SIGINT, signal.SIGKILL]
)
def test_an_interrupted_run_ends_bitwise_equal(drive, case_folder, tmp_path, expected, number):
    slow = (case_folder, "--out", tmp_path / "runs", *STEPS, "--set", "sph.sleep_s=0.05")
    process = drive(*slow, wait=False)
    wait_for(lambda: checkpoints(tmp_path / "runs"), process)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    run_folder = next((tmp_path / "runs").glob("small-*"))
    status = json.loads((run_folder / "status.json").read_text())
    if number == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL and status["state"] == "running"
    else:
        assert process.returncode == 75
        assert "saving before exit" in out and "the same command resumes" in err and "Traceback" not in err
        assert status["state"] == "stopped"
    code, out, err = drive(*slow)
    assert code == 0, err
    assert "2_sph: continued" in out
    assert (run_folder / "2_sph" / "x.txt").read_text() == expected
    assert not checkpoints(tmp_path / "runs")
    assert json.loads((run_folder / "6_crater" / "done.json").read_text())["stage"] == "crater"


def test_a_stage_that_is_made_again_and_killed_ends_in_the_same_bits(drive, case_folder, tmp_path, expected):
    """``--from`` makes it beside the one that is there; the same command goes on with that."""
    run = (case_folder, "--out", tmp_path / "runs", *STEPS, "--set", "sph.sleep_s=0.05")
    code, _, err = drive(*run)
    assert code == 0, err
    before = {path.name: json.loads((path / "done.json").read_text()) for path in stored(tmp_path / "runs")}
    process = drive(*run, "--from", "sph", wait=False)
    wait_for(lambda: list((tmp_path / "runs" / ".store").glob("sph-*.anew/checkpoint_*.h5")), process)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)
    code, out, err = drive(*run, "--from", "sph")
    assert code == 0 and "2_sph: continued" in out, err
    after = {path.name: json.loads((path / "done.json").read_text()) for path in stored(tmp_path / "runs")}
    assert list(after) == list(before)  # nothing is left beside them
    for name, done in after.items():
        assert done["files"] == before[name]["files"], name
        assert (done["finished_at"] != before[name]["finished_at"]) == (not name.startswith("nbody"))
    assert next((tmp_path / "runs").glob("small-*/2_sph/x.txt")).read_text() == expected


def stored(runs: Path) -> list[Path]:
    return sorted(path for path in (runs / ".store").iterdir() if path.name != ".locks")


def test_a_second_signal_stops_at_once_and_a_second_run_waits_outside(drive, case_folder, tmp_path):
    long = (case_folder, "--out", tmp_path / "runs", "--set", "sph.steps=1004", "--set", "sph.sleep_s=3")
    process = drive(*long, wait=False)
    wait_for(lambda: list((tmp_path / "runs").glob("small-*/2_sph/starts.txt")), process)
    code, _, err = drive(*long)
    assert code == 2 and f"in use by process {process.pid}" in err
    process.send_signal(signal.SIGTERM)
    time.sleep(0.5)
    assert process.poll() is None  # it waits for the next checkpoint, fifteen seconds away
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=10) == 75


def test_two_processes_that_start_the_same_run_at_once(drive, case_folder, tmp_path):
    """One makes it, the other is told who does; nothing is made twice or half."""
    command = (case_folder, "--out", tmp_path / "runs", "--set", "sph.sleep_s=0.05")
    both = [drive(*command, wait=False) for _ in range(2)]
    words = [process.communicate(timeout=120) for process in both]
    (refused,) = [k for k in (0, 1) if both[k].returncode == 2]
    made = 1 - refused
    assert both[made].returncode == 0, words[made][1]
    assert f"in use by process {both[made].pid}" in words[refused][1] and "Traceback" not in words[refused][1]
    (starts,) = (tmp_path / "runs").glob("small-*/2_sph/starts.txt")
    assert starts.read_text() == "0\n"
    code, out, err = drive(*command)
    assert code == 0 and out.count("up to date") == 6, out + err
