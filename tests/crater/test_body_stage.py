"""A shot at a small ellipsoid by ``run_case``: from the shock stage alone to the measures of the body."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from matter import drawing, snapshot
from matter.body_measures import PAIRS, SINGLES
from pipeline import case as cases
from pipeline import cli, compose

CASE = """
[case]
title = "A shot at a small body"
stages = ["sph", "crater"]
[target]
shape = "ellipsoid"
axes = ["60 m", "55 m", "40 m"]
latitude = "20 deg"
longitude = "130 deg"
azimuth = "60 deg"
spin_period = "5 h"
layers = [{ material = "basalt" }]
[target.companion]
mass = "5e11 kg"
distance = "1 km"
[impact]
speed = "6 km/s"
angle_from_vertical = "20 deg"
projectile = { material = "aluminum", radius = "0.4 m" }
expected_transient_diameter = "15 m"
[sph]
particles = 2000
end_time = "2 ms"
snapshot_interval = "0.5 ms"
"""


def command(monkeypatch, name: str, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", [name, *words])
    with pytest.raises(SystemExit) as end:
        getattr(cli, name)()
    return int(end.value.code or 0)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("body")
    (folder / "case.toml").write_text(CASE)
    with pytest.MonkeyPatch.context() as patch:
        assert command(patch, "run_case", str(folder), "--out", str(folder / "runs"), "--threads", "1") == 0
    return next((folder / "runs").glob("*-*"))


def test_the_body_has_all_measures_and_those_of_the_shock_stage(run):
    measures = json.loads((run / "6_crater" / "measures.json").read_text())
    body = measures["body"]["sph"]
    assert measures["body"]["final"] == "sph" and set(body["measures"]) == {*PAIRS, *SINGLES}
    assert body["class"] in ("crater", "not resolved", "reshaped", "no hollow") and body["class_reason"]
    told = json.loads((run / "2_sph" / "stage_report.json").read_text())["escaping"]
    assert body["measures"]["beta_normal"]["value"] == pytest.approx(told["beta"], rel=1e-3)
    assert body["vectors"]["beta"] == pytest.approx(told["beta_vector"], abs=0.02 * told["beta"])
    assert body["measures"]["escaping_mass_kg"]["value"] == pytest.approx(told["mass_kg"], rel=1e-6)
    track = np.array(body["vectors_own_frame"]["along_track"])
    assert track == pytest.approx([0.0, -1.0, 0.0], abs=1e-9)  # the companion stands above longitude 0
    assert body["measures"]["orbit_period_change_s"]["value"] is not None
    assert measures["transient"]["depth_m"]["value"] > 0.0
    assert measures["measured_with"]["sph"]["unrolled_about"][2] == pytest.approx(27.5, abs=3.0)


def test_page_pictures_and_map_are_there(run):
    out = run / "6_crater"
    page = (out / "report.html").read_text()
    assert "<h2>The body</h2>" in page and "longest axis" in page
    assert (out / "height_map.vtkhdf").stat().st_size > 10_000
    if drawing.has():
        for name in ("body_heights.png", "body_outlines.png", "body_made_anew.png"):
            assert (out / name).stat().st_size > 10_000 and name in page


def test_what_leaves_the_terminal_names_the_class(run):
    from pipeline import result

    table = result.table(run)
    assert "the body: " in table and "beta along the normal" in table


def test_one_snapshot_of_a_body_is_refused_in_words(run, monkeypatch, capsys):
    shot = snapshot.series(run / "2_sph")[-1]
    assert command(monkeypatch, "measure_crater", str(shot)) == 2
    assert "is measured by its run alone" in capsys.readouterr().err


def test_a_case_may_name_every_stage_and_ends_with_the_crater_by_default(tmp_path):
    words = '["sph", "bed", "handoff", "dem", "crater"]'
    (tmp_path / "case.toml").write_text(CASE.replace('["sph", "crater"]', words))
    assert "crater" in compose.compose(cases.read(tmp_path))
    (tmp_path / "case.toml").write_text(CASE.replace('stages = ["sph", "crater"]\n', ""))
    assert set(compose.compose(cases.read(tmp_path))) == {"sph", "crater"}


def test_a_track_belongs_to_such_a_body(tmp_path):
    flat = CASE.replace('shape = "ellipsoid"\naxes = ["60 m", "55 m", "40 m"]\n', 'shape = "half_space"\n')
    for line in ('latitude = "20 deg"\n', 'longitude = "130 deg"\n', 'azimuth = "60 deg"\n', 'spin_period = "5 h"\n'):
        flat = flat.replace(line, "")
    flat = flat.replace('[target.companion]\nmass = "5e11 kg"\ndistance = "1 km"\n', "")
    (tmp_path / "case.toml").write_text(flat + "[crater]\nalong_track = [0.0, 1.0, 0.0]\n")
    with pytest.raises(ValueError, match="along_track: of an ellipsoid or mesh only"):
        compose.compose(cases.read(tmp_path))
