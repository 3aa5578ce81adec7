"""Files are whole or absent."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from matter.errors import Stopped
from matter.files import archive

ROOT = Path(__file__).resolve().parents[2]


def test_arrays_attributes_units_come_back(tmp_path):
    arrays = {"a": np.arange(5), "group/b": (np.linspace(0, 1, 100).reshape(10, 10), "m", "a height")}
    archive.write(tmp_path / "x.h5", arrays, {"time": 2.5, "name": "β", "flag": True, "count": np.int64(3)})
    back, attributes = archive.read(tmp_path / "x.h5")
    np.testing.assert_array_equal(back["a"], arrays["a"])
    np.testing.assert_array_equal(back["group/b"], arrays["group/b"][0])
    assert attributes == {"time": 2.5, "name": "β", "flag": True, "count": 3}


def test_a_write_that_fails_leaves_the_old_file_and_no_litter(tmp_path):
    archive.write_text(tmp_path / "x.txt", "old")
    with pytest.raises(RuntimeError), archive.replacing(tmp_path / "x.txt") as temporary:
        temporary.write_text("half of the new")
        raise RuntimeError("the disk is full")
    assert (tmp_path / "x.txt").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]


def test_a_new_file_is_readable_by_others_and_folders_are_made(tmp_path):
    archive.write_text(tmp_path / "deep" / "er" / "x.txt", "new")
    assert (tmp_path / "deep" / "er" / "x.txt").stat().st_mode & 0o777 == 0o644


def test_a_full_disk_stops_with_one_message_and_keeps_what_was_there(tmp_path, monkeypatch):
    path = tmp_path / "state.h5"
    archive.write(path, {"a": np.arange(3)})
    monkeypatch.setattr(
        os, "fsync", lambda number: (_ for _ in ()).throw(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    )
    with pytest.raises(Stopped, match=r"no space left on the disk for .*state\.h5"):
        archive.write(path, {"a": np.zeros(3)})
    assert archive.read(path)[0]["a"].tolist() == [0, 1, 2] and os.listdir(tmp_path) == ["state.h5"]


def test_a_write_that_fails_under_hdf5_ends_in_one_message(tmp_path):
    """In a process of its own: HDF5 that hears of a failed write may end its process when it closes the file."""
    program = f"""
import resource
import numpy as np
from matter.files import archive
path = {str(tmp_path / "a.h5")!r}
archive.write(path, {{"x": np.arange(10.0)}})
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, resource.RLIM_INFINITY))
try:
    archive.write(path, {{f"g/{{k}}": np.random.rand(3000) for k in range(50)}}, compress=False)
except OSError as fault:
    print(fault.strerror)
print(list(archive.read(path)[0]))
"""
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert (said.returncode, said.stderr) == (0, "")
    assert said.stdout.split("\n") == ["File too large", "['x']", ""]
    assert [path.name for path in tmp_path.iterdir()] == ["a.h5"]


def test_json_holds_plain_numbers_and_null_for_what_is_not_finite(tmp_path):
    content = {
        "a": float("nan"),
        "b": [np.float32("inf"), -np.inf, 1.5],
        "c": np.arange(2),
        "d": np.bool_(True),
        5: "x",
    }
    archive.write_json(tmp_path / "a.json", content)

    def refused(name):
        raise ValueError(name)

    read = json.loads((tmp_path / "a.json").read_text(), parse_constant=refused)
    assert read == {"a": None, "b": [None, None, 1.5], "c": [0, 1], "d": True, "5": "x"}
    assert type(read["c"][0]) is int and read["d"] is True


def test_rooms_write_json_files_by_the_writer_that_knows_no_nan():
    """``json.dumps`` writes NaN and Infinity, which no other reader takes. The ledger turns its own into text."""
    rooms = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline", "bolide")
    others = {"handoff/ledger.py", "pipeline/settings/sense.py", "pipeline/commands/schema.py"}
    found = {
        path.relative_to(ROOT).as_posix()
        for room in rooms
        for path in (ROOT / room).rglob("*.py")
        if re.search(r"write_text\([^\n]*json\.dumps|json\.dump\(", path.read_text())
    }
    assert found <= others, found - others
