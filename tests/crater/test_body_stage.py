"""A shot at a small ellipsoid by ``run_case``: from the shock stage alone to the measures of the body."""

from __future__ import annotations

import base64
import json
import re
import sys

import h5py
import numpy as np
import pytest
from scipy.spatial import cKDTree

from crater.bodies import body_view
from matter.files import snapshot
from matter.wording import drawing
from matter.wording.body_measures import PAIRS, SINGLES
from pipeline import cli
from pipeline.case import read as cases
from pipeline.settings import compose
from tests.crater import browser

pytestmark = pytest.mark.validation

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
    assert measures["measured_with"]["sph"]["flattened_about"][2] == pytest.approx(27.5, abs=3.0)


def test_page_pictures_and_map_are_there(run):
    out = run / "6_crater"
    page = (out / "report.html").read_text()
    assert "<h2>The body</h2>" in page and "longest axis" in page
    assert (out / "height_map.vtkhdf").stat().st_size > 10_000
    if drawing.has():
        for name in ("body_heights.png", "body_outlines.png", "body_made_anew.png"):
            assert (out / name).stat().st_size > 10_000 and name in page


def test_what_leaves_the_terminal_names_the_class(run):
    from pipeline.running import result

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


def corners(content, which):
    """The corners (n, 3) [m] ``before`` or ``after``, as the viewer decodes them."""
    return np.frombuffer(base64.b64decode(content[which]), "<i2").reshape(-1, 3) * (content["half"] / 32_767)


def test_the_page_holds_the_body_that_the_map_holds(run):
    """The viewer's corners are the ground before and after, its bytes the change of height, to a step of theirs."""
    page = (run / "6_crater" / "report.html").read_text()
    content = json.loads(re.search(r"id=body-data>(.*?)</script>", page, re.S).group(1))
    with h5py.File(run / "6_crater" / "height_map.vtkhdf") as file:
        fields = {name: np.asarray(file[f"surface/{name}"]) for name in file["surface"]}
    step = content["half"] / 32_767
    for when in ("before", "after"):
        ground = fields["place"] + fields[f"height_{when}"][:, None] * fields["normal"]
        assert np.abs(corners(content, when) - ground).max() <= 0.51 * step
    change = np.frombuffer(base64.b64decode(content["change"]), np.uint8) / 253.0
    clipped = np.clip(fields["height_change"], -content["limit"], content["limit"])
    assert np.abs((2.0 * change - 1.0) * content["limit"] - clipped).max() <= 1.01 * content["limit"] / 253.0
    assert fields["height_change"].min() < -0.1 * content["limit"]
    triangles = np.frombuffer(base64.b64decode(content["triangles"]), "<u2").reshape(-1, 3)
    assert triangles.max() == len(fields["place"]) - 1
    axes = 2.0 * np.abs(corners(content, "before")).max(axis=0)
    assert axes == pytest.approx([60.0, 55.0, 40.0], rel=0.1)


def test_a_browser_draws_the_body(run, tmp_path):
    seen = browser.dom(run / "6_crater" / "report.html", tmp_path, *browser.SOFTWARE)
    figure = re.search(r"<figure [^>]*id=\"body\"[^>]*>", seen).group()
    if "hidden" in figure and "no WebGL" in seen:
        pytest.skip("this Chromium has no WebGL")
    assert int(re.search(r'data-vertices="(\d+)"', figure).group(1)) > 3000
    assert "hidden" not in figure and int(re.search(r'data-pixels="(\d+)"', figure).group(1)) > 20_000
    assert "change of height −" in seen


def test_a_map_of_many_points_is_thinned_out_for_the_page(run, monkeypatch):
    """No more corners than asked for, each on the ground of the whole map."""
    from crater import stage

    settings = compose.compose(cases.read(run / "case.used.toml"))["crater"]
    kept = []
    monkeypatch.setattr(body_view, "of_stage", lambda stage, title: kept.append(stage) or "")
    out = run.parent / "again"
    out.mkdir()
    stage.run(settings, run, out)
    whole = body_view.data(kept[0], body_view.coarsened(kept[0]))
    monkeypatch.setattr(body_view, "MOST_POINTS", 700)
    few = body_view.data(kept[0], body_view.coarsened(kept[0]))
    ends = [corners(content, "after") for content in (whole, few)]
    assert 600 < len(ends[1]) <= 700 < len(ends[0])
    away = cKDTree(ends[0]).query(ends[1])[0]
    assert away.max() < 0.05 * whole["half"]
    monkeypatch.undo()
    assert body_view.of_stage(kept[0], "The body") != ""
    monkeypatch.setattr(body_view, "_CORNERS", 600)
    assert body_view.of_stage(kept[0], "The body") == ""
