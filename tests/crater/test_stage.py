"""The stage on a synthetic run folder: with both stages, with one, with none; and the command on a bare snapshot."""

from __future__ import annotations

import csv
import html
import json
import re
import shutil
import sys

import numpy as np
import pytest

from crater import stage
from crater.measures.measure import UNITS
from fixtures import synthetic_craters as synthetic
from matter import progress
from matter.case.body import Impact, Layer, Projectile, Target
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from matter.wording import drawing

R, RIM, SPACING = 2102e3, 300e3, 60e3
TIMES = (0.0, 120.0, 240.0, 360.0, 480.0, 600.0)
DEPTH_RATIO = {0.0: 0.0, 120.0: 0.1, 240.0: 0.2, 360.0: 0.25, 480.0: 0.12, 600.0: 0.02}


def settings(**more) -> stage.Settings:
    layers = (
        Layer(name="core", material="basalt", thickness="1842 km"),
        Layer(name="ocean", material="water", thickness="150 km"),
        Layer(name="shell", material="ice", thickness="150 km"),
    )
    projectile = Projectile(material="ice", radius="53.9 km")
    impact = Impact(
        speed="18.234 km/s", angle_from_vertical="40 deg", projectile=projectile, expected_transient_diameter="700 km"
    )
    published = (
        stage.Published(quantity="depth_m", value="150 km", plus="20 km", minus="20 km", source="made up"),
        stage.Published(
            quantity="diameter_apparent_m",
            value="980 km",
            plus="177 km",
            minus="273 km",
            source="made up",
        ),
    )
    return stage.Settings(target=Target(layers=layers), impact=impact, reference=published, **more)


GRAIN = 35e3
"""Spacing of the settled grains, finer than the shock stage's: with five to a radius the draw decides about the
diameter."""


def cloud(ratio: float, body: float = R, spacing: float = SPACING) -> tuple[np.ndarray, synthetic.Shape]:
    height = synthetic.bowl(RIM, max(ratio, 1e-6), 0.2 * ratio)
    shape = synthetic.Shape(height, RIM, 1600e3, body)
    return synthetic.cloud_on_sphere(shape, spacing, np.random.default_rng(7), "jitter", depth_of_cloud=400e3), shape


GRAVITY = 1.284


def carried(before: str) -> dict:
    """The attribute by which a snapshot of a run says what its crater is measured against."""
    datum = {"kind": "sphere", "radius_m": R, "centre_m": [0.0, 0.0, 0.0], "source": "made up"}
    return {"datum": datum, "gravity_m_s2": GRAVITY, "expected_transient_diameter_m": 700e3, "before": before}


def write_sph(folder):
    folder.mkdir(parents=True)
    (folder / "target.json").write_text(
        json.dumps({"centre": [0, 0, 0], "radius_m": R, "surface_gravity_m_s2": GRAVITY})
    )
    for number, time in enumerate(TIMES):
        p, _ = cloud(DEPTH_RATIO[time])
        fields = synthetic.as_fields(p, SPACING, 917.0)
        fields |= {"velocity": np.zeros_like(p), "material": np.zeros(len(p)), "layer": np.full(len(p), 2)}
        facts = {"time": time, "stage": "sph", "frame": "sphere", "materials": ["ice"], "target_radius_m": R}
        facts["measuring"] = carried("snap_0000.vtkhdf")
        snapshot.write(Particles(fields, facts), folder / f"snap_{number:04d}.vtkhdf")
    snapshot.write(Particles(fields, facts), folder / "last.vtkhdf")


def write_grains(run):
    for folder in ("3_bed", "5_dem"):
        (run / folder).mkdir(parents=True)
    facts = {"frame": "sphere", "materials": ["ice"], "species": ["shell"], "domain": {"datum_radius_m": R}}
    p, _ = cloud(0.0, spacing=GRAIN)
    lid = p[np.linalg.norm(p, axis=1) > R - 1.33 * GRAIN] * (1 + 1.33 * GRAIN / R)
    fields = synthetic.as_fields(np.vstack([p, lid]), GRAIN, 917.0)
    fields |= {
        "headroom": np.r_[np.zeros(len(p)), np.ones(len(lid))],
        "radius": np.full(len(p) + len(lid), 0.5 * GRAIN),
    }
    snapshot.write(Particles(fields, {**facts, "time": 0.0, "stage": "bed"}), run / "3_bed" / "bed.vtkhdf")
    p, shape = cloud(0.15, spacing=GRAIN)
    fields = synthetic.as_fields(p, GRAIN, 917.0) | {
        "velocity": np.zeros_like(p),
        "radius": np.full(len(p), 0.5 * GRAIN),
    }
    facts["measuring"] = carried("../3_bed/bed.vtkhdf")
    for name in ("snap_0000", "last"):
        snapshot.write(Particles(fields, {**facts, "time": 3600.0, "stage": "dem"}), run / "5_dem" / f"{name}.vtkhdf")
    (run / "5_dem" / "stage_report.json").write_text(json.dumps({"still": True, "profile_change_radii": 0.01}))
    return shape


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    run = tmp_path_factory.mktemp("run")
    write_sph(run / "2_sph")
    shape = write_grains(run)
    (run / "4_handoff").mkdir()
    rows = [
        {"name": "mass_total_rel", "value": 1e-15, "limit": 1e-12, "verdict": "pass", "unit": "1", "note": "a < b & c"}
    ]
    (run / "4_handoff" / "ledger.json").write_text(json.dumps(rows))
    (run / "4_handoff" / "handoff.json").write_text(json.dumps({"time_s": 360.0}))
    shutil.copy(run / "5_dem" / "snap_0000.vtkhdf", run / "4_handoff" / "start.vtkhdf")
    out = run / "6_crater"
    out.mkdir()
    stage.run(settings(), run, out)
    return run, out, shape


def test_transient_and_final_are_told_apart(both):
    _, out, shape = both
    measures = json.loads((out / "measures.json").read_text())
    assert measures["transient"]["time_s"]["value"] == 360.0
    assert measures["transient"]["depth_m"]["value"] == pytest.approx(0.25 * 2 * RIM, abs=0.3 * SPACING)
    assert measures["final"]["from"] == "settled grains"
    assert measures["final"]["depth_m"]["value"] == pytest.approx(shape.depth, abs=0.3 * GRAIN)
    assert measures["final"]["diameter_apparent_m"]["value"] == pytest.approx(2 * shape.apparent, rel=0.04)
    for name in (
        "diameter_rim_m",
        "diameter_apparent_m",
        "depth_m",
        "depth_rim_to_floor_m",
        "rim_height_m",
        "volume_m3",
        "time_s",
    ):
        for phase in ("transient", "final"):
            assert set(measures[phase][name]) >= {"value", "sigma", "unit"}
    assert set(measures["transient"]["by_method"]) == {"colour", "highest", "column", "alpha"}


def test_the_crater_right_before_and_after_the_handover(both):
    """Of the shock stage's snapshot at the handover's time, and of the grains as they took over."""
    _, out, _ = both
    measures = json.loads((out / "measures.json").read_text())
    handed, page = measures["handover"], (out / "report.html").read_text()
    assert handed["depth_m"]["before"]["value"] == measures["transient"]["depth_m"]["value"]
    assert handed["depth_m"]["after"]["value"] == measures["final"]["depth_m"]["value"]
    assert handed["snapshots"]["after"] == "4_handoff/start.vtkhdf"
    assert "<h3>The handover, " in page and "Ground is what is compact and attached" in page


def test_published_numbers_have_verdicts(both):
    _, out, _ = both
    reference = json.loads((out / "measures.json").read_text())["reference"]
    assert [row["met"] for row in reference] == [True, False]


def test_every_file_is_there(both):
    _, out, _ = both
    for name in (
        "measures.json compare.json profile.csv profile_sph.csv profile_transient.csv time_series.csv heightmap.h5 "
        "profile.png time_series.png cross_section.png heightmap.png report.html"
    ).split():
        assert (out / name).stat().st_size > 0, name
    compared = json.loads((out / "compare.json").read_text())
    assert compared["scaling"]["range_m"][0] == pytest.approx(590e3, rel=0.03)
    assert compared["late_stage_sph_against_dem"]["rms_over_depth"] > 0.05
    rows = list(csv.DictReader((out / "time_series.csv").open()))
    assert [row["stage"] for row in rows] == ["sph"] * 5 + ["dem"]
    lines = (out / "profile.csv").read_text().splitlines()
    assert any(line.startswith("# datum_radius_m = 2.102e+06") for line in lines)


def test_the_page_is_self_contained(both):
    _, out, _ = both
    page = (out / "report.html").read_text()
    assert "chain error not known" in page  # no case gave one
    assert re.search(r"Final \(.*\): apparent diameter D = .*m \(errors without random seeds, resolution", page)
    assert page.count("data:image/png;base64,") == 7
    assert "://" not in page and page.count("<img") == page.count('src="data:image/png;base64,')
    assert "a &lt; b &amp; c" in page and "mass_total_rel" in page
    assert "differ by" in page


def test_the_page_begins_with_headline_title_and_picture(both):
    """And the headline holds the numbers of the last column of the table of measures."""
    _, out, _ = both
    page = (out / "report.html").read_text()
    first = re.search(r"<h1>D = (.*?), depth (.*?), settled; (?:no|\d+) cautions?</h1>", page)
    places = [first.start(), page.index("<p class=title>Crater: "), *(page.index(x) for x in ("<figure", "<table"))]
    assert places == sorted(places)
    for value, words in zip(first.groups(), ("apparent diameter, at the datum", "depth below the datum")):
        assert re.search(rf"<td>{words}</td>.*<td class='n'>(.*)</td></tr>", page).group(1) == value


def test_the_page_says_stage_time_and_place(both):
    """Transient at both maxima with their times; the late stages by depth, inside 1.5 rim radii, and where they differ
    most."""
    _, out, _ = both
    page = (out / "report.html").read_text()
    assert (
        "transient, maximum volume and diameter<br>(6.0 min, SPH)" in page
        and "transient, maximum depth<br>(4.0 min, SPH)" in page
    )
    assert "final<br>(60.0 min, settled grains)" in page
    compared = json.loads((out / "compare.json").read_text())["late_stage_sph_against_dem"]
    measures = json.loads((out / "measures.json").read_text())
    assert compared["inside_m"] == pytest.approx(0.75 * measures["final"]["diameter_rim_m"]["value"], rel=1e-9)
    assert compared["largest_at_m"] < 0.5 * RIM and compared["largest_m"] == pytest.approx(
        -(0.15 - 0.02) * 2 * RIM, abs=0.5 * GRAIN
    )
    assert compared["rms_inside_m"] > 1.5 * compared["rms_m"]  # flat ground far out makes it look small
    assert (
        "1.5 rim radii of the larger crater" in page
        and "from the axis, where the grains' ground lies" in html.unescape(page)
    )
    at = [row["at"] for row in measures["reference"]]
    assert at == ["first maximum of depth, 4.0 min, SPH"] * 2


@pytest.mark.validation
def test_a_run_that_ends_while_its_crater_grows_has_no_final_crater(tmp_path, monkeypatch):
    from crater.comparison import against_published

    monkeypatch.setattr(against_published, "PUBLISHED_AT", "volume")  # depth has its maximum before the end
    write_sph(tmp_path / "2_sph")
    for number in (4, 5):
        (tmp_path / "2_sph" / f"snap_{number:04d}.vtkhdf").unlink()
    shutil.copy(tmp_path / "2_sph" / "snap_0003.vtkhdf", tmp_path / "2_sph" / "last.vtkhdf")
    out = tmp_path / "6_crater"
    out.mkdir()
    stage.run(settings(), tmp_path, out)
    measures = json.loads((out / "measures.json").read_text())
    assert measures["final"]["settled"] is False and measures["final"]["state"] == "still growing"
    assert measures["transient"]["growing"] is True
    page = (out / "report.html").read_text()
    assert (
        "last snapshot, still growing" in page
        and "is no final crater" in page
        and "final<br>" not in page
        and "maximum volume<br>" not in page
    )
    assert "The final crater" not in page and "Final surface" not in page and "The last snapshot</h2>" in page
    assert measures["reference"][0]["at"].startswith("last snapshot, volume still growing")


@pytest.mark.validation
def test_only_the_shock_stage(tmp_path):
    write_sph(tmp_path / "2_sph")
    out = tmp_path / "6_crater"
    out.mkdir()
    stage.run(settings(), tmp_path, out)
    measures = json.loads((out / "measures.json").read_text())
    assert measures["final"]["from"] == "all-SPH late stage"
    assert measures["final"]["diameter_apparent_m"]["value"] is None
    assert (
        "trough" in measures["final"]["diameter_apparent_m"]["reason"]
        or "hollow" in measures["final"]["diameter_apparent_m"]["reason"]
    )


def test_grains_alone_without_matplotlib_have_their_page(tmp_path, monkeypatch):
    """A node of a cluster without the extra ``pictures``: measures, tables and page; one line says what is missing."""
    shape = write_grains(tmp_path)
    out = tmp_path / "6_crater"
    out.mkdir()
    heard: list[str] = []
    monkeypatch.setattr(progress, "_hearers", [heard.append])
    for library in ("matplotlib", "pyvista", "imageio_ffmpeg"):
        monkeypatch.setitem(sys.modules, library, None)
    drawing.has.cache_clear()
    try:
        stage.run(settings(), tmp_path, out)
    finally:
        drawing.has.cache_clear()
    assert heard == ["no pictures of the crater: matplotlib is not installed (pip install 'bolide[pictures]')"]
    text = (out / "report.html").read_text()
    assert "Without pictures: matplotlib was not installed" in text and "<img" not in text and "Measures" in text
    measures = json.loads((out / "measures.json").read_text())
    assert measures["final"]["depth_m"]["value"] == pytest.approx(shape.depth, abs=0.3 * GRAIN)
    assert "no shock-stage" in measures["transient"]["reason"] and not list(out.glob("*.png"))


def test_nothing_to_measure(tmp_path):
    with pytest.raises(InputError, match="neither 2_sph"):
        stage.run(settings(), tmp_path, tmp_path)


def test_measure_crater_on_a_bare_snapshot(tmp_path, capsys):
    shape = synthetic.Shape(synthetic.bowl(100.0), 100.0, 320.0)
    p = synthetic.cloud_on_plane(shape, 12.0, np.random.default_rng(1), "jitter")
    path = tmp_path / "other.vtkhdf"
    snapshot.write(Particles({"position": p, "radius": np.full(len(p), 6.0)}, {"packing_fraction": np.pi / 6}), path)
    assert stage.measure_snapshot(path, out=tmp_path / "out") == 0
    assert "depth below the datum" in capsys.readouterr().out
    measures = json.loads((tmp_path / "out" / "measures.json").read_text())
    assert measures["final"]["depth_m"]["value"] == pytest.approx(shape.depth, abs=0.3 * 12)
    assert (tmp_path / "out" / "profile.csv").is_file() and (tmp_path / "out" / "profile.png").is_file()


def numbers(entry: dict) -> dict:
    """Every measure of one crater, to the last digit."""
    return {name: (entry[name]["value"], entry[name]["sigma"]) for name in UNITS}


def measured_alone(path, out) -> dict:
    assert stage.measure_snapshot(path, out=out) == 0
    return json.loads((out / "measures.json").read_text())["final"]


@pytest.mark.parametrize(
    ("name", "entry"),
    [
        pytest.param("2_sph/snap_0003", ("transient",), marks=pytest.mark.validation),
        pytest.param("2_sph/last", ("late_sph",), marks=pytest.mark.validation),
        ("5_dem/last", ("final",)),
    ],
    ids=["transient", "late", "grains"],
)
def test_one_snapshot_of_a_run_gives_the_numbers_of_the_run(both, tmp_path, capsys, name, entry):
    """To the last digit: on what the run's crater stage kept, and, where that stage has not run, on what the snapshot
    carries."""
    run, out, _ = both
    known = numbers(json.loads((out / "measures.json").read_text())[entry[0]])
    assert any(value is not None for value, _ in known.values()) == (
        name != "2_sph/last"
    )  # the shock stage's end is nearly flat
    assert numbers(measured_alone(run / f"{name}.vtkhdf", tmp_path / "beside")) == known
    shutil.copytree(run, tmp_path / "bare", ignore=shutil.ignore_patterns("6_crater"))
    assert numbers(measured_alone(tmp_path / "bare" / f"{name}.vtkhdf", tmp_path / "carried")) == known
    assert "measured as its run does" in capsys.readouterr().out


@pytest.mark.validation
def test_a_snapshot_taken_away_says_what_it_misses_and_options_are_said(both, tmp_path, capsys):
    run, _, _ = both
    shutil.copy(run / "5_dem" / "last.vtkhdf", tmp_path / "mine.vtkhdf")
    stage.measure_snapshot(tmp_path / "mine.vtkhdf", out=tmp_path / "a")
    assert "not at hand: the ground before the impact" in capsys.readouterr().out
    stage.measure_snapshot(run / "5_dem" / "last.vtkhdf", datum_radius=R + 8e3, out=tmp_path / "b")
    printed = capsys.readouterr().out
    assert "--datum-radius given" in printed and "datum: sphere of radius 2110 km" in printed
    stage.measure_snapshot(run / "5_dem" / "last.vtkhdf", datum_radius=R, out=tmp_path / "c")
    depths = [
        json.loads((tmp_path / name / "measures.json").read_text())["final"]["depth_m"]["value"] for name in "cb"
    ]
    assert depths[1] - depths[0] == pytest.approx(8e3, abs=0.03 * GRAIN)


@pytest.mark.validation
def test_choices_of_the_case_reach_every_measuring(both, tmp_path):
    """Its chain errors too."""
    run, _, _ = both
    shutil.copytree(run, tmp_path / "run", ignore=shutil.ignore_patterns("6_crater"))
    out = tmp_path / "run" / "6_crater"
    out.mkdir()
    errors = {"final": {"depth_m": "3 km"}, "transient": {"depth_m": "4 km"}}
    stage.run(settings(chain=errors), tmp_path / "run", out)
    content = json.loads((out / "measures.json").read_text())
    alone = measured_alone(tmp_path / "run" / "5_dem" / "last.vtkhdf", tmp_path / "alone")
    assert numbers(alone) == numbers(content["final"]) and alone["depth_m"]["sigma_parts"]["chain"] == 3e3
    alone = measured_alone(tmp_path / "run" / content["transient"]["snapshot"], tmp_path / "alone")
    assert numbers(alone) == numbers(content["transient"]) and alone["depth_m"]["sigma_parts"]["chain"] == 4e3


def test_prediction_has_the_three_numbers():
    assert set(stage.predict(settings())) == {"wall_s", "memory_bytes", "disk_bytes"}
