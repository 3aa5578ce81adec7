"""Comparison of craters: differences, ratios, verdicts, observations, a user's own files, cross-sections side by side."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
import synthetic

from crater import compare, difference, observations, plot_sections, radial_profile, stage
from crater.radial_profile import Profile
from matter import snapshot
from matter.errors import InputError
from matter.particles import Particles


def parabola(radius, depth, n=80, lift=0.0):
    r = np.linspace(0.01, 3.0, n) * radius
    h = np.where(r < radius, depth * ((r / radius) ** 2 - 1), 0.0) + lift
    nothing = np.full(n, np.nan)
    return Profile(r, h, nothing, nothing, np.zeros(n, dtype=int), {})


def test_an_offset_of_the_ground_outside_is_stated_and_taken_out():
    found = difference.profile_difference(parabola(100.0, 20.0, 300), parabola(100.0, 20.0, 300, lift=1.5))
    assert found["rms_m"] == pytest.approx(1.5, rel=1e-3)
    assert found["offset_m"] == pytest.approx(1.5, rel=1e-3)
    assert found["rms_aligned_m"] == pytest.approx(0.0, abs=1e-6)


def test_the_same_shape_at_another_size_is_the_same_shape():
    found = difference.profile_difference(parabola(100.0, 20.0, 200), parabola(50.0, 10.0, 200))
    assert found["rms_shape"] < 0.01
    assert found["rms_over_depth"] > 0.1


def test_ratio_takes_the_errors_that_face_each_other():
    value, error, agree = difference.ratio((980.0, 273.0, 177.0), (740.0, 10.0, 10.0))
    assert value == pytest.approx(740 / 980)
    assert agree and error == pytest.approx(value * np.hypot(273 / 980, 10 / 740))
    assert not difference.ratio((980.0, 20.0, 177.0), (740.0, 10.0, 10.0))[2]


def test_verdict_knows_the_limits_of_a_match():
    a = {"depth_m": (100.0, 1.0, 1.0), "diameter_apparent_m": (1000.0, 1.0, 1.0)}
    b = {"depth_m": (115.0, 1.0, 1.0), "diameter_apparent_m": (1150.0, 1.0, 1.0)}
    found = difference.verdict(a, b, None)
    assert found["depth_m"]["match"] and not found["diameter_apparent_m"]["match"]
    assert not found["depth_m"]["within_errors"]


def test_resampled_profiles_share_radii_and_end_where_their_ground_ends():
    r, heights = difference.resampled([parabola(100.0, 20.0, 40), parabola(50.0, 10.0, 400)])
    assert heights.shape == (len(r), 2)
    assert np.isnan(heights[r > 151.0, 1]).all() and np.isfinite(heights[(r > 10.0) & (r < 140.0), 1]).all()
    assert np.interp(50.0, r, heights[:, 0]) == pytest.approx(-15.0, abs=0.3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "a"\n', "states no source"),
        ('title = "a"\nsource = "b"\n', "no measure, no zone and no profile"),
        ('title = "a"\nsource = "b"\n[measures.depth_m]\nvalue = "3 m"\n', "value, minus and plus"),
        ('title = "a"\nsource = "b"\n[measures.depth_m]\nvalue = "3 mm3"\nminus = "x"\nplus = "1 m"\n', "measures.depth_m"),
        ("title = \n", "mine.toml"),
    ],
)
def test_a_bad_observation_is_named(tmp_path, text, message):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        observations.read(path)


def test_zones_and_trends_have_sizes():
    zones = observations.load("valhalla_zones").zones
    assert [zone.outer for zone in zones] == sorted(zone.outer for zone in zones) and zones[0].outer == 350e3
    trend = observations.load("ganymede_callisto_trend").zones
    assert trend[0].depth_over_diameter == (0.20, 0.03) and trend[0].outer == trend[1].inner == 2100.0


def test_a_profile_of_ones_own_in_kilometres_with_errors(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("\ufeff# body = Callisto\nradius_km,height_km,height_sigma_m\n0,-2,100\n5,-1,100\n10,,100\n15,0.1,100\n20,0.05,100\n")
    profile = radial_profile.read_csv(path)
    assert profile.radius[1] == 5000.0 and profile.p84[0] == -1900.0 and np.isnan(profile.height[2]) and profile.header["body"] == "Callisto"


def run_folder(path, seed, shift):
    """A run folder with one measured cloud of grains."""
    shape = synthetic.Shape(synthetic.bowl(100.0), 100.0, 320.0)
    rng = np.random.default_rng(seed)
    p = synthetic.cloud_on_plane(shape, 14.0, rng, "jitter") * shift
    (path / "5_dem").mkdir(parents=True)
    fields = {"position": p, "radius": np.full(len(p), 7.0 * shift), "material": np.zeros(len(p))}
    snapshot.write(Particles(fields, {"packing_fraction": np.pi / 6, "materials": ["sand"], "time": 10.0}), path / "5_dem" / "last.vtkhdf")
    stage.measure_snapshot(path / "5_dem" / "last.vtkhdf", "plane", out=path / "6_crater")


def test_two_runs_a_csv_and_two_observations_in_one_picture(tmp_path, capsys):
    run_folder(tmp_path / "first", 1, 1.0)
    run_folder(tmp_path / "second", 2, 1.05)
    radial_profile.write_csv(parabola(90.0, 35.0), tmp_path / "mine.csv")
    items = [str(tmp_path / name) for name in ("first", "second", "mine.csv")]
    assert compare.compare([*items, "sci_ryugu"], observed="valhalla_zones", out=tmp_path / "out") == 0
    printed = capsys.readouterr().out
    assert "D apparent / 1st" in printed and "nothing is shifted" in printed
    rows = list(csv.DictReader((tmp_path / "out" / "comparison.csv").open()))
    assert len(rows) == 5 and float(rows[1]["diameter_apparent_m_ratio"]) == pytest.approx(1.05, abs=0.03)
    assert rows[1]["diameter_apparent_m_match"] == "yes" and {rows[1]["volume_m3_within_errors"]} <= {"yes", "no"}
    heights = list(csv.DictReader((tmp_path / "out" / "comparison_profiles.csv").open()))
    assert len(heights) > 20 and len(heights[0]) == 4
    for name in ("comparison.png", "cross_sections.png"):
        assert (tmp_path / "out" / name).stat().st_size > 20_000
    with pytest.raises(InputError, match="no measured final crater"):
        plot_sections.draw_side_by_side([tmp_path], tmp_path / "x.png")
    assert json.loads((tmp_path / "first" / "6_crater" / "measures.json").read_text())["final"]["by_azimuth"]["apparent_radius_m"]
