"""A disk that fills up under a run: one line, exit code 75, nothing lost, and the same command goes on when there is
room; while there is none it is refused before it begins, exit code 2. A small file system in memory, so these tests
need root; what single writers do is tested in ``tests/matter/test_archive.py`` without it."""

from __future__ import annotations

import errno
import subprocess
import time
from pathlib import Path

import pytest

from pipeline.store.store import LOCKS, STORE


@pytest.fixture
def disk(tmp_path):
    """The folder of a file system of 4 MB."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", str(place)], capture_output=True)
    if mounted.returncode != 0:
        pytest.skip("a small file system can be mounted by root only")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def fill(place: Path) -> Path:
    """Take all the room that is left; the file that holds it."""
    ballast = place / "ballast"
    with open(ballast, "wb", buffering=0) as file:
        for size in (65536, 4096, 1):
            try:
                while True:
                    file.write(b"x" * size)
            except OSError as reason:
                assert reason.errno == errno.ENOSPC
    return ballast


def fails_for_room(code: int, err: str) -> None:
    assert code == 75, err
    assert "o space left on" in err and "the same command resumes" in err and "Traceback" not in err


def refused_for_room(code: int, err: str) -> None:
    assert code == 2, err
    assert "of disk are needed" in err and "Traceback" not in err


def test_a_run_whose_disk_fills_up_goes_on_when_there_is_room(drive, case_folder, tmp_path, disk):
    steps = ("--set", "sph.steps=100")
    code, _, err = drive(case_folder, "--out", tmp_path / "runs", *steps)
    assert code == 0, err
    (expected,) = (tmp_path / "runs").glob("small-*/2_sph/x.txt")

    slow = (case_folder, "--out", disk / "runs", *steps, "--set", "sph.sleep_s=0.02")
    process = drive(*slow, wait=False)
    while not list((disk / "runs" / STORE).glob("sph-*/checkpoint_*")):
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    ballast = fill(disk)
    _, err = process.communicate(timeout=120)
    fails_for_room(process.returncode, err)
    (place,) = (disk / "runs" / STORE).glob("sph-*")
    assert list(place.glob("checkpoint_*.h5")) and not (place / "done.json").exists()
    assert (disk / "runs" / STORE / LOCKS).is_dir() and not list((disk / "runs").rglob("*.part"))

    code, _, err = drive(*slow)  # still full: refused, nothing lost
    refused_for_room(code, err)
    assert list(place.glob("checkpoint_*.h5"))
    ballast.unlink()
    code, _, err = drive(*slow)
    assert code == 0, err
    starts = (place / "starts.txt").read_text().split()
    assert starts[0] == "0" and int(starts[-1]) > 0  # gone on with from a checkpoint
    assert (place / "x.txt").read_text() == expected.read_text()
    assert {path.name for path in next((disk / "runs").glob("small-*")).glob("?_*")} >= {"2_sph", "6_crater"}


def test_a_run_is_not_begun_on_a_full_disk(drive, case_folder, disk):
    (disk / "runs").mkdir()
    ballast = fill(disk)
    code, _, err = drive(case_folder, "--out", disk / "runs")
    refused_for_room(code, err)
    ballast.unlink()
    code, _, err = drive(case_folder, "--out", disk / "runs")
    assert code == 0, err
