"""Files that are damaged, in the way, or forbidden: one line that names them, exit code 2 (75 for a full disk),
nothing lost, no traceback."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from handoff import ledger
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.particles import Particles
from pipeline.commands import command
from pipeline.running import result
from pipeline.store import folder

ROOT = Path(__file__).resolve().parents[2]


def refused(done: subprocess.CompletedProcess, *words: str, code: int = 2) -> None:
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr
    for word in words:
        assert word in done.stderr, done.stderr


@pytest.fixture
def in_the_way(tmp_path: Path) -> Path:
    """A file where an output folder should be."""
    path = tmp_path / "file"
    path.write_text("precious")
    return path


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    """A small snapshot."""
    path = tmp_path / "cloud.vtkhdf"
    place = np.random.default_rng(1).normal(size=(20, 3))
    snapshot.write(
        Particles(
            {"position": place, "velocity": 0.0 * place, "mass": np.ones(20), "radius": np.ones(20)}, {"time": 0.0}
        ),
        path,
    )
    return path


def test_an_output_that_is_a_file_is_refused_before_any_work(drive, case_folder, in_the_way, cloud, call):
    for place in (in_the_way, in_the_way / "below"):
        for check in ((), ("--check",)):
            code, out, err = drive(case_folder, "--out", place, *check)
            assert code == 2 and "is a file, and a folder is needed" in err and "Traceback" not in err and not out
        refused(call("measure_crater", cloud, "--out", place), "--out", "is a file, and a folder is needed")
        refused(call("impact_census", "--out", place), "--out", "is a file, and a folder is needed")
        refused(
            call("compare_profiles", "thesis_980km", "thesis_600km", "--out", place),
            "--out",
            "is a file, and a folder is needed",
        )
    assert in_the_way.read_text() == "precious"
    refused(call("import_snapshot", cloud, "--out", in_the_way / "x.vtkhdf"), "is a file, and a folder is needed")
    refused(
        call("export_snapshot", cloud, "--out", in_the_way.parent, "--format", "vtk"),
        "is a folder, and the name of a file is needed",
    )


@pytest.mark.skipif(
    os.geteuid() != 0 and not Path("/proc/self").exists(), reason="needs a place where nothing can be made"
)
def test_an_output_that_cannot_be_made_is_one_line(drive, case_folder):
    code, _, err = drive(case_folder, "--out", "/proc/none/runs")
    assert code == 2 and "Traceback" not in err and "/proc/none" in err and len(err.strip().splitlines()) == 1


def test_the_system_s_complaints_are_one_line_with_the_file(capsys):
    def ended(reason: OSError) -> tuple[int, str]:
        def action() -> None:
            raise reason

        with pytest.raises(SystemExit) as end:
            command.guarded(action)
        return int(end.value.code), capsys.readouterr().err.strip()

    assert ended(PermissionError(errno.EACCES, "Permission denied", "/x/y")) == (2, "/x/y: Permission denied")
    code, text = ended(OSError(errno.ENOSPC, "No space left on device", "/x/y"))
    assert code == 75 and text.startswith("/x/y: No space left on device") and "the same command resumes" in text
    assert ended(OSError("Unable to synchronously open file (truncated file)\nmore"))[1].endswith("(truncated file)")


@pytest.mark.parametrize("text", ["{", "[]", "[{}]", '[{"name": "x"}]', "\x00\xff", "3"])
def test_a_damaged_ledger_is_never_an_empty_one(tmp_path, text, call):
    place = tmp_path / "run" / "4_handoff"
    place.mkdir(parents=True)
    (place / "ledger.json").write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"ledger\.json is damaged"):
        ledger.read(place / "ledger.json")
    if text in ("{", "[]"):
        refused(call("inspect_handoff", place.parent), "ledger.json is damaged")


def test_inspect_handoff_understands_the_stage_s_folder_and_refuses_idle_options(tmp_path, call):
    place = tmp_path / "run" / "4_handoff"
    place.mkdir(parents=True)
    (place / "ledger.json").write_text("{")
    refused(call("inspect_handoff", place), f"{place / 'ledger.json'} is damaged")
    refused(call("inspect_handoff", tmp_path / "run", "--only", "foo"), "--only goes with --sensitivity")


@pytest.mark.parametrize("text", ["{", "[]", "null"])
def test_damaged_measures_are_named(tmp_path, text, call):
    place = tmp_path / "run" / "6_crater"
    place.mkdir(parents=True)
    (place / "measures.json").write_text(text)
    with pytest.raises(InputError, match=r"measures\.json is damaged"):
        result.table(place.parent)
    if text == "{":
        refused(
            call("compare_profiles", place.parent, "thesis_980km", "--out", tmp_path / "out"),
            "measures.json is damaged",
        )


@pytest.mark.parametrize("name", ["done.json", "begun.json"])
def test_a_damaged_mark_of_a_stage_removes_nothing(drive, case_folder, tmp_path, name):
    arguments = (case_folder, "--out", tmp_path / "runs", "--until", "sph")
    assert drive(*arguments)[0] == 0
    place = next((tmp_path / "runs").glob("small-*")) / "2_sph"
    before = sorted(path.name for path in place.iterdir())
    if name == "begun.json":
        (place / "done.json").rename(place / name)
    (place / name).write_text('{"inputs_sha')
    code, _, err = drive(*arguments)
    assert code == 2 and "Traceback" not in err and f"{name} is damaged" in err and "--from sph" in err
    assert set(before) - {"done.json"} <= {path.name for path in place.iterdir()}
    code, out, err = drive(*arguments, "--from", "sph")
    assert code == 0 and "2_sph: begins" in out, err
    assert json.loads((place / "done.json").read_text())["stage"] == "sph"
    assert folder.mark(place / "begun.json") == {}


def test_a_reader_that_has_seen_enough_is_no_fault():
    code = "import sys; from pipeline import cli; sys.argv = ['run_case', '--help']; cli.run_case()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, text=True
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert "Traceback" not in process.stderr.read()
    process.wait(timeout=60)


def test_json_of_the_wrong_kind_is_damage(tmp_path):
    (tmp_path / "a.json").write_text("[1]")
    assert archive.read_json(tmp_path / "a.json", list) == [1]
    with pytest.raises(InputError, match=r"a\.json is damaged: it should hold a JSON object"):
        archive.read_json(tmp_path / "a.json")


def test_the_example_says_how_it_is_used():
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "compare_two_profiles.py")],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 1 and done.stderr.startswith("usage: ") and "Traceback" not in done.stderr


def test_a_result_that_was_altered_is_not_shown(tmp_path, call):
    """By the record of the stage: size and hash of each file."""
    place = tmp_path / "run" / "4_handoff"
    place.mkdir(parents=True)
    (place / "ledger.json").write_text("[]")
    (place / "done.json").write_text(json.dumps({"files": {"ledger.json": [2, "0" * 64]}}))
    refused(call("inspect_handoff", place.parent), "ledger.json has other content", "--from handoff")
    for record in ("x", {"ledger.json": "x"}, {"ledger.json": [2]}):
        (place / "done.json").write_text(json.dumps({"files": record}))
        refused(call("inspect_handoff", place.parent), "done.json is damaged: it should hold size and hash")
