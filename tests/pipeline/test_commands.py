"""The commands as a user meets them: help, exit codes, messages."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import h5py
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = (
    "run_case",
    "inspect_handoff",
    "compare_profiles",
    "measure_crater",
    "impact_census",
    "fly_ejecta",
    "import_snapshot",
    "export_snapshot",
)


def python(code: str, *, path: tuple[Path, ...] = ()) -> subprocess.CompletedProcess:
    """Run code in a process of its own, with ``path`` before the project on the import path."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (*path, ROOT)))}
    command = [sys.executable, "-P", "-c", textwrap.dedent(code)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_imports_neither_numba_nor_vtk(command):
    done = python(f"""
        import sys
        from pipeline import cli
        sys.argv = ["{command}", "--help"]
        try:
            cli.{command}()
        except SystemExit as end:
            assert end.code in (0, None), end.code
        heavy = {{"numba", "vtk", "vtkmodules", "pyvista", "matplotlib", "scipy", "h5py"}} & set(sys.modules)
        assert not heavy, heavy
    """)
    assert done.returncode == 0, done.stderr
    assert f"Usage: {command}" in done.stdout


def test_the_options_of_run_case_are_those_agreed(drive):
    code, out, _ = drive("--help")
    assert code == 0
    for option in ("--preset", "--set", "--out", "--from", "--until", "--threads", "--check", "--fresh"):
        assert option in out


def test_bad_input_is_exit_2_and_no_traceback(drive, case_folder, tmp_path):
    code, _, err = drive(
        case_folder, "--set", "sph.spacng=1 km", "--set", "impact.projectile.radius=-1 km", "--out", tmp_path / "runs"
    )
    assert code == 2 and "Traceback" not in err
    assert "did you mean 'spacing'" in err and "must be greater than 0" in err and "2 errors" in err
    assert not (tmp_path / "runs").exists()
    for arguments in (
        ("nowhere",),
        (case_folder, "--preset", "no"),
        (case_folder, "--from", "spf"),
        (case_folder, "--nonsense"),
        (),
    ):
        code, _, err = drive(*arguments)
        assert code == 2 and "Traceback" not in err, arguments


def test_a_finished_run_prints_its_folder_first_and_its_result_last(drive, case_folder, tmp_path):
    code, out, err = drive(case_folder, "--out", tmp_path / "runs")
    assert code == 0, err
    lines = out.strip().splitlines()
    run_folder = next((tmp_path / "runs").glob("small-*"))
    assert lines[0] == f"run folder: {run_folder}" and lines[-1] == f"result: {run_folder}"
    assert re.search(r"depth below the datum +290 \+- 26 km +12 \+- 26 km", out)
    assert "published transient depth_m: 300 +51 -41 km (Winter 2017); here 290 +- 26 km: met" in out


def test_an_unsound_stage_is_exit_1_with_its_reason(drive, case_folder, tmp_path):
    for _ in range(2):  # also when it was done before
        code, out, err = drive(case_folder, "--set", "handoff.broken=true", "--out", tmp_path / "runs")
        assert code == 1 and "UNSOUND handoff: mass_total_rel is 0.1" in out and "Traceback" not in err
    code, out, err = drive(case_folder, "--set", "dem.failure=unphysical", "--out", tmp_path / "runs")
    assert code == 1 and "grain 7 at (0, 0, 1) m" in err and "Traceback" not in err


def test_check_predicts_and_runs_nothing(drive, case_folder, tmp_path):
    code, out, err = drive(
        case_folder, "--check", "--out", tmp_path / "runs", "--set", "sph.sleep_s=2", "--set", "sph.steps=100"
    )
    assert code == 0, err
    assert not (tmp_path / "runs").exists()
    assert re.search(r"sph +3 min 20 s +2 GB +3 MB", out)
    assert re.search(r"total +3 min 24 s +2 GB", out)
    code, _, err = drive(case_folder, "--check", "--set", "sph.steps=x")
    assert code == 2 and "sph.steps" in err


def test_check_looks_at_the_presets_that_were_not_chosen(drive, case_folder):
    file = case_folder / "case.toml"
    good = file.read_text()
    assert "WARNING: preset" not in drive(case_folder, "--check")[1]
    file.write_text(good.replace("steps = 20", "stepz = 20\nspacing = 3"))
    code, out, err = drive(case_folder, "--check")
    assert code == 0, err
    assert (
        "WARNING: preset quick cannot be used: case.toml:31 sph.stepz: there is no such key; did you mean 'steps'?; "
        "case.toml:32 sph.spacing: the unit" in out
    )
    assert drive(case_folder, "--check", "--preset", "quick")[0] == 2


def test_threads_are_those_asked_for(drive, case_folder, tmp_path):
    code, _, err = drive(case_folder, "--threads", 1, "--until", "nbody", "--out", tmp_path / "runs")
    assert code == 0, err
    assert '"threads": 1' in next((tmp_path / "runs").glob("small-*/provenance.json")).read_text()
    assert drive(case_folder, "--threads", 0)[0] == 2


def test_a_room_imported_from_elsewhere_is_named(tmp_path):
    (tmp_path / "matter").mkdir()
    (tmp_path / "matter" / "__init__.py").write_text("raise RuntimeError('the wrong matter was imported')")
    done = python(
        """
        import sys
        from pipeline import cli
        sys.argv = ["run_case", "--help"]
        cli.run_case()
        """,
        path=(tmp_path,),
    )
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert f"package 'matter' is imported from {tmp_path}" in done.stderr and "virtual environment" in done.stderr


def test_import_snapshot_reads_columns_with_units(tmp_path, call):
    (tmp_path / "cloud.csv").write_text(
        "x [km],y,z,vx,vy,vz,m,rho [g/cm^3],-\n1,2,3,4,5,6,7,0.917,9\n2,0,0,0,0,0,1,1,1\n"
    )
    done = call("import_snapshot", tmp_path / "cloud.csv", "--out", tmp_path / "cloud.vtkhdf", "--materials", "ice")
    assert done.returncode == 0, done.stderr
    assert "2 particles" in done.stdout
    with h5py.File(tmp_path / "cloud.vtkhdf") as file:
        np.testing.assert_allclose(file["particles/position"][0], [1000.0, 2.0, 3.0])
        np.testing.assert_allclose(file["particles/density"][:], [917.0, 1000.0])
        assert file["particles/material"][:].tolist() == [0, 0]
    for arguments, words in {
        (tmp_path / "cloud.csv", "--out", tmp_path / "cloud.h5"): "has to end in .vtkhdf",
        (tmp_path / "none.csv", "--out", tmp_path / "o.vtkhdf"): "no file at",
        (tmp_path / "cloud.csv", "--out", tmp_path / "o.vtkhdf", "--columns", "x,y"): "2 column names for 9 columns",
    }.items():
        done = call("import_snapshot", *arguments)
        assert done.returncode == 2 and words in done.stderr and "Traceback" not in done.stderr


def test_import_places_and_export_hands_on(tmp_path):
    (tmp_path / "cloud.csv").write_text("x,y,z,vx,vy,vz,m,r,id\n5,0,0,1,0,0,7,0.5,3\n5,2,0,0,1,0,7,0.5,9\n")
    code = """
        import sys
        from pipeline import cli
        sys.argv = ["import_snapshot", "{0}/cloud.csv", "--out", "{0}/cloud.vtkhdf"]
        sys.argv += ["--origin", "5,0,0", "--up", "0,1,0", "--time", "2 min"]
        try:
            cli.import_snapshot()
        except SystemExit as end:
            assert not end.code
        sys.argv = ["export_snapshot", "{0}/cloud.vtkhdf", "--out", "{0}/cloud.data"]
        try:
            cli.export_snapshot()
        except SystemExit as end:
            assert not end.code
        sys.argv = ["export_snapshot", "{0}/cloud.vtkhdf", "--out", "{0}/cloud.abc"]
        cli.export_snapshot()
    """
    done = python(code.format(tmp_path))
    assert done.returncode == 2 and "Traceback" not in done.stderr and "name the format with --format" in done.stderr
    assert (
        "cannot be used by handoff: missing density, material" in done.stdout
        and "2 particles as lammps" in done.stdout
    )
    with h5py.File(tmp_path / "cloud.vtkhdf") as file:
        np.testing.assert_allclose(file["particles/position"][:], [[0, 0, 0], [0, 0, 2]], atol=1e-12)
        np.testing.assert_allclose(file["particles/velocity"][1], [0, 0, 1], atol=1e-12)
        assert file.attrs["time"] == 120.0
    lines = (tmp_path / "cloud.data").read_text().splitlines()
    assert "2 atoms" in lines and lines[lines.index("Atoms") + 2].split()[:3] == ["4", "1", "1"]


def test_a_terminal_gets_a_bar_and_a_pipe_gets_lines(case_folder, tmp_path):
    pty = pytest.importorskip("pty")
    fakes = Path(__file__).resolve().parent / "fake_rooms"
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(fakes)]),
        "TERM": "xterm",
        "COLUMNS": "120",
    }
    ours, theirs = pty.openpty()
    command = [sys.executable, str(fakes / "drive.py"), str(case_folder), "--out", str(tmp_path / "runs")]
    process = subprocess.Popen(command, stdout=theirs, stderr=subprocess.PIPE, env=environment)
    os.close(theirs)
    seen = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # Linux: the other end was closed
            break
        if not part:
            break
        seen += part
    os.close(ours)
    assert process.wait(timeout=60) == 0, process.stderr.read()
    text = seen.decode()
    assert (
        "100.0 %" in text and "step 60" in text and "\x1b[?25h" in text
    )  # a moving bar, and the cursor is given back
    assert "result: " in text.splitlines()[-1]
