"""``run_case RUN``: a run goes on in its own folder, whatever has become of its case; nothing that is done is made
again."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path

import pytest

from matter.errors import InputError
from pipeline.running import going_on


def only_run(place: Path) -> Path:
    (found,) = place.glob("small-*")
    return found


@pytest.mark.parametrize("named", ["folder", "file"])
def test_a_run_goes_on_without_its_case(drive, case_folder, tmp_path, named):
    runs = tmp_path / "runs"
    code, _, err = drive(case_folder, "--preset", "quick", "--set", "sph.steps=30", "--out", runs, "--until", "sph")
    assert code == 0, err
    run = only_run(runs)
    marks = {path: path.read_bytes() for path in run.glob("*/done.json")}
    before, head = json.loads((run / "provenance.json").read_text())["case"], (run / "case.used.toml").read_text()
    shutil.rmtree(case_folder)
    code, out, err = drive(run if named == "folder" else run / "case.used.toml")
    assert code == 0, err
    assert out.splitlines()[0] == f"run folder: {run}" and out.strip().splitlines()[-1] == f"result: {run}"
    assert out.count("up to date") == 2 and len(marks) == 2
    assert all(path.read_bytes() == content for path, content in marks.items())
    assert only_run(runs) == run and len(list(run.glob("*/done.json"))) == 6
    after = json.loads((run / "provenance.json").read_text())
    assert (
        after["case"] == before
        and before["preset"] == "quick"
        and before["overrides"] == ["sph.steps=30"]
        and len(after["sessions"]) == 2
    )
    assert (run / "case.used.toml").read_text() == head  # the values, and the line that says how the run was begun


def test_what_the_encounters_find_is_left_to_them_again(drive, case_folder, tmp_path):
    file = case_folder / "case.toml"
    text = file.read_text().replace('speed = "18.234 km/s"\n', "").replace('angle_from_vertical = "40 deg"\n', "")
    file.write_text(text)
    runs = tmp_path / "runs"
    code, _, err = drive(case_folder, "--out", runs)
    assert code == 0, err
    run = only_run(runs)
    marks = {path: path.read_bytes() for path in run.glob("*/done.json")}
    values = (run / "case.used.toml").read_text()
    assert "angle_from_vertical" in tomllib.loads(values)["impact"]
    code, out, err = drive(run)
    assert code == 0 and out.count("up to date") == 6, out + err
    assert len(marks) == 6 and all(path.read_bytes() == content for path, content in marks.items())
    assert (run / "case.used.toml").read_text() == values


def test_values_that_were_changed_in_place_are_refused(drive, case_folder, tmp_path):
    runs = tmp_path / "runs"
    assert drive(case_folder, "--out", runs, "--until", "nbody")[0] == 0
    file = only_run(runs) / "case.used.toml"
    text = file.read_text()
    file.write_text(text.replace("steps = ", "steps = 1", 1))
    assert file.read_text() != text
    code, _, err = drive(only_run(runs))
    assert code == 2 and "was changed since the run wrote it" in err and "copy it elsewhere" in err, err
    (tmp_path / "mine.toml").write_text(file.read_text())
    assert drive(tmp_path / "mine.toml", "--out", tmp_path / "others", "--until", "nbody")[0] == 0


def test_a_changed_run_is_another_run(drive, case_folder, tmp_path):
    runs = tmp_path / "runs"
    assert drive(case_folder, "--out", runs, "--until", "nbody")[0] == 0
    run = only_run(runs)
    code, _, err = drive(run, "--set", "sph.steps=7", "--out", tmp_path / "others", "--until", "sph")
    assert code == 0, err
    other = only_run(tmp_path / "others")
    assert other.name != run.name and tomllib.loads((other / "case.used.toml").read_text())["sph"]["steps"] == 7
    assert not (run / "2_sph").exists()


def test_options_that_cannot_be_obeyed_are_refused(drive, case_folder, tmp_path):
    runs = tmp_path / "runs"
    assert drive(case_folder, "--out", runs, "--until", "nbody")[0] == 0
    run = only_run(runs)
    with pytest.raises(InputError, match="continues in its own folder"):
        going_on.read(run, out=tmp_path / "others")
    with pytest.raises(InputError, match="apply a preset to the case itself"):
        going_on.read(run, preset="quick")
    assert going_on.read(run, out=runs).run == run
    assert going_on.run_of(case_folder) is None and going_on.name_of(
        Path("small-0123abcd")
    ) == "small" == going_on.name_of(Path("small"))
    (run / "provenance.json").unlink()  # a copy of the values alone is a case like any other
    assert going_on.run_of(run / "case.used.toml") is None
