"""A stage's result from elsewhere: taken, checked, and recorded."""

from __future__ import annotations

import json

import numpy as np
import pytest

from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from pipeline.case import outside, stages
from pipeline.case import read as cases
from pipeline.running.request import Request
from pipeline.running.run import run


class Silent:
    """A screen that shows nothing."""

    def say(self, text):
        """Nothing."""

    def begins(self, stage, text):
        """Nothing."""

    moves = ends = begins


@pytest.fixture(autouse=True)
def _fakes(fake_stages):
    """Every test here runs the fake stages."""


def cloud(*fields: str) -> Particles:
    full = {name: np.ones((3, 3)) if name in ("position", "velocity") else np.ones(3) for name in fields}
    return Particles(full, {"time": 600.0, "stage": "sph", "frame": "sphere"})


@pytest.fixture
def sph_file(case_folder):
    """A complete SPH snapshot with its target.json."""
    snapshot.write(cloud(*outside.NEEDED["sph"]), case_folder / "theirs.vtkhdf")
    (case_folder / "target.json").write_text('{"radius_m": 5.0}')
    return case_folder / "theirs.vtkhdf"


def go(case_folder, tmp_path, *overrides, **options):
    return run(Request(cases.read(case_folder, None, overrides), tmp_path / "runs", **options), Silent()).run


def test_a_snapshot_replaces_the_stage_that_would_have_made_it(case_folder, tmp_path, sph_file):
    file = case_folder / "case.toml"
    file.write_text(file.read_text().replace("[sph]", '[sph]\nsnapshot = "theirs.vtkhdf"'))
    run_folder = go(case_folder, tmp_path)
    assert (run_folder / "2_sph" / "last.vtkhdf").read_bytes() == sph_file.read_bytes()
    assert snapshot.series(run_folder / "2_sph") == [run_folder / "2_sph" / "snap_0000.vtkhdf"]
    assert not (run_folder / "2_sph" / "starts.txt").exists()
    assert json.loads((run_folder / "2_sph" / "done.json").read_text())["from"] == str(sph_file)
    assert '"radius_m": 5.0' in (run_folder / "5_dem" / "last.txt").read_text()
    assert json.loads((run_folder / "provenance.json").read_text())["case"]["from_elsewhere"]["sph"]["file"] == str(
        sph_file
    )
    assert f'snapshot = "{sph_file}"' in (run_folder / "case.used.toml").read_text()


def test_a_changed_file_is_taken_again(case_folder, tmp_path, sph_file):
    option = f"sph.snapshot={sph_file}"
    first = (go(case_folder, tmp_path, option) / "2_sph" / "done.json").read_text()
    assert (go(case_folder, tmp_path, option) / "2_sph" / "done.json").read_text() == first
    changed = snapshot.read(sph_file)
    changed["density"] = changed.density * 2
    snapshot.write(changed, sph_file)
    assert (go(case_folder, tmp_path, option) / "2_sph" / "done.json").read_text() != first


def test_missing_fields_and_files_are_named(case_folder, tmp_path, sph_file):
    poor = case_folder / "poor.vtkhdf"
    snapshot.write(cloud("position", "velocity", "mass"), poor)
    with pytest.raises(InputError, match=r"lacks density, material.*bulk density \[kg/m\^3\]"):
        go(case_folder, tmp_path, f"sph.snapshot={poor}")
    (case_folder / "target.json").unlink()
    with pytest.raises(InputError, match=r"target.json is missing"):
        go(case_folder, tmp_path, f"sph.snapshot={sph_file}")
    with pytest.raises(InputError, match="no file at"):
        go(case_folder, tmp_path, "dem.snapshot=nowhere.vtkhdf")
    poor.write_text("not HDF5")
    with pytest.raises(InputError, match="not a readable HDF5 file"):
        go(case_folder, tmp_path, f"bed.snapshot={poor}")


def test_without_a_target_json_the_ground_is_that_of_the_case(case_folder, tmp_path, sph_file, monkeypatch):
    (case_folder / "target.json").unlink()
    facts = lambda settings: {"radius_m": settings.target.radius}  # noqa: E731
    monkeypatch.setattr(stages.load("sph"), "target_facts", facts, raising=False)
    option = f"sph.snapshot={sph_file}"
    one = go(case_folder, tmp_path, option)
    radius = json.loads((one / "2_sph" / "target.json").read_text())["radius_m"]
    assert radius > 0.0 and f'"radius_m": {radius}' in (one / "3_bed" / "bed.txt").read_text()
    assert json.loads((go(case_folder, tmp_path, option) / "2_sph" / "target.json").read_text())["radius_m"] == radius

    monkeypatch.setattr(stages.load("sph"), "target_facts", lambda settings: {"radius_m": 7.0})
    other = go(case_folder, tmp_path, option)
    assert other != one  # another ground is another run, with a bed of its own
    assert '"radius_m": 7.0' in (other / "3_bed" / "bed.txt").read_text()


def test_one_may_start_at_the_last_stage(case_folder, tmp_path):
    grains = case_folder / "grains.vtkhdf"
    snapshot.write(cloud(*outside.NEEDED["dem"]), grains)
    run_folder = go(case_folder, tmp_path, f"dem.snapshot={grains}", start="crater")
    assert (run_folder / "5_dem" / "last.vtkhdf").exists() and (run_folder / "6_crater" / "measures.json").exists()
    assert not stages.folder(run_folder, "sph").exists()


def test_an_impact_file_replaces_the_encounters(case_folder, tmp_path):
    (case_folder / "mine.toml").write_text('speed = "9.6 km/s"\nangle_from_vertical = "45 deg"\n')
    run_folder = go(case_folder, tmp_path, f"nbody.impact={case_folder / 'mine.toml'}")
    assert (run_folder / "1_nbody" / "impact.toml").read_text() == (case_folder / "mine.toml").read_text()
    assert 'speed = "9600.0 m/s"' in (run_folder / "case.used.toml").read_text()
