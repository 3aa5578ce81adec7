"""Comparison of craters: differences, ratios, verdicts, observations, a user's own files, cross-sections side by
side."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest

from crater import stage
from crater.comparison import craters, difference, observations
from crater.ground import radial_profile
from crater.ground.radial_profile import Profile
from crater.pages import compare
from crater.pictures import plot_sections
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.files import snapshot
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


MINE = 'title = "a"\nsource = "b"\n[measures.{}]\nvalue = {}\nplus = "1 m"\nminus = "1 m"\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('title = "a"\n', "states no source"),
        ('title = "a"\nsource = "b"\n', "no measure, no zone and no profile"),
        (MINE.format("diameter_m", '"101 m"'), "'diameter_m' is not known; did you mean 'diameter_rim_m'"),
        (MINE.format("depth_m", "101"), 'measures.depth_m.value = 101 is no text with a unit: write it like "101 m"'),
        (MINE.format("depth_m", '"101"'), "measures.depth_m.value: '101' has no unit"),
        (MINE.format("volume_m3", '"101 m"'), "measures.volume_m3.value: '101 m' is not a quantity in m"),
        ('title = "a"\nsource = "b"\n[measures.depth_m]\nvalue = "3 m"\n', "value, minus and plus"),
        (
            'title = "a"\nsource = "b"\n[measures.depth_m]\nvalue = "3 mm3"\nminus = "x"\nplus = "1 m"\n',
            "measures.depth_m",
        ),
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
    path.write_text(
        "\ufeff# body = "
        "Callisto\nradius_km,height_km,height_sigma_m\n0,-2,100\n5,-1,100\n10,,100\n15,0.1,100\n20,0.05,100\n"
    )
    profile = radial_profile.read_csv(path)
    assert (
        profile.radius[1] == 5000.0
        and profile.p84[0] == -1900.0
        and np.isnan(profile.height[2])
        and profile.header["body"] == "Callisto"
    )


def run_folder(path, seed, shift):
    """A run folder with one measured cloud of grains."""
    shape = synthetic.Shape(synthetic.bowl(100.0), 100.0, 320.0)
    rng = np.random.default_rng(seed)
    p = synthetic.cloud_on_plane(shape, 14.0, rng, "jitter") * shift
    (path / "5_dem").mkdir(parents=True)
    fields = {"position": p, "radius": np.full(len(p), 7.0 * shift), "material": np.zeros(len(p))}
    snapshot.write(
        Particles(fields, {"packing_fraction": np.pi / 6, "materials": ["sand"], "time": 10.0}),
        path / "5_dem" / "last.vtkhdf",
    )
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
    with pytest.raises(InputError, match="no snapshot or no datum"):
        plot_sections.draw_side_by_side([craters.load(str(tmp_path / "mine.csv"))], tmp_path / "x.png")
    assert json.loads((tmp_path / "first" / "6_crater" / "measures.json").read_text())["final"]["by_azimuth"][
        "apparent_radius_m"
    ]


def q(value, sigma=1.0, unit="m"):
    return {"value": value, "sigma": sigma, "unit": unit}


def measured_run(path, transient=(500e3, 240e3), deepest=(476e3, 250e3), final=(550e3, 70e3), **said):
    """A run folder as the crater stage leaves it: (apparent diameter, depth) at the maxima of volume (7 min) and depth
    (6 min), and final."""
    folder = path / "6_crater"
    folder.mkdir(parents=True)

    def entry(sizes, time, **more):
        D, d = sizes
        rim = {"diameter_rim_m": q(1.3 * D, 30e3), "depth_rim_to_floor_m": q(1.2 * d, 9e3)}
        return {
            "diameter_apparent_m": q(D, 7e3),
            "depth_m": q(d, 8e3),
            "volume_m3": q(0.39 * D**2 * d, 1e14),
            **rim,
            "time_s": q(time, 30.0, "s"),
            **more,
        }

    content = {"transient": {}, "final": {"reason": "the run ends with the shock stage"}, "reference": []}
    if transient:
        at = {
            "at_maximum_volume": entry(transient, 420.0, stage="sph"),
            "at_maximum_depth": entry(deepest, 360.0, stage="sph"),
        }
        content["transient"] = {**at["at_maximum_volume"], **at}
        radial_profile.write_csv(parabola(0.5 * transient[0], transient[1]), folder / "profile_transient.csv")
        radial_profile.write_csv(parabola(0.5 * deepest[0], deepest[1]), folder / "profile_transient_depth.csv")
    if final:
        content["final"] = entry(final, 3840.0, **{"from": "settled grains", "settled": True, **said})
        radial_profile.write_csv(parabola(0.5 * final[0], final[1]), folder / "profile.csv")
    (folder / "measures.json").write_text(json.dumps(content))
    return str(path)


def compared(tmp_path, *items, **more):
    out = tmp_path / "out"
    assert compare.compare(list(items), out=out, **more) == 0
    return list(csv.DictReader((out / "comparison.csv").open()))


def test_an_observation_of_a_transient_crater_meets_the_transient_crater(tmp_path, capsys):
    """At the maximum of depth, which is what the thesis measured; its profile too."""
    rows = compared(tmp_path, measured_run(tmp_path / "quick"), "thesis_980km")
    assert [row["stage"] for row in rows] == ["transient", "transient"]
    assert float(rows[0]["diameter_apparent_m"]) == 476e3 and float(rows[0]["depth_m"]) == 250e3
    assert float(rows[1]["diameter_apparent_m_ratio"]) == pytest.approx(980 / 476, rel=1e-3)
    assert float(rows[1]["depth_m_ratio"]) == pytest.approx(300 / 250, rel=1e-3)
    printed = capsys.readouterr().out
    assert (
        "transient, maximum depth" in printed and "6.0 min" in printed and "final" not in printed.split("written")[0]
    )
    heights = list(csv.DictReader((tmp_path / "out" / "comparison_profiles.csv").open()))
    assert float(list(heights[0].values())[1]) == pytest.approx(-250e3, rel=0.01)


def test_an_observation_of_a_final_crater_meets_the_final_crater(tmp_path, capsys):
    rows = compared(tmp_path, measured_run(tmp_path / "quick"), "sci_ryugu")
    assert [row["stage"] for row in rows] == ["final", "final"] and float(rows[0]["depth_m"]) == 70e3
    assert "64.0 min, settled grains" in capsys.readouterr().out


def test_with_observations_of_both_kinds_a_run_shows_both_craters(tmp_path):
    rows = compared(tmp_path, measured_run(tmp_path / "quick"), "thesis_980km", "valhalla_bright_zone")
    assert [row["stage"] for row in rows] == ["transient", "final", "transient", "final"]
    assert float(rows[2]["diameter_apparent_m_ratio"]) == pytest.approx(980 / 476, rel=1e-3)
    assert float(rows[3]["diameter_apparent_m_ratio"]) == pytest.approx(700 / 550, rel=1e-3)
    assert not rows[1]["diameter_apparent_m_ratio"]  # final is not set against transient


def test_two_runs_meet_final_with_final_or_transient_with_transient(tmp_path, capsys):
    first = measured_run(tmp_path / "first")
    rows = compared(tmp_path, first, measured_run(tmp_path / "second", final=(600e3, 60e3)))
    assert float(rows[1]["diameter_apparent_m_ratio"]) == pytest.approx(600 / 550, rel=1e-3)
    assert "final with final: every run has one" in capsys.readouterr().out
    rows = compared(tmp_path, first, measured_run(tmp_path / "third", transient=(510e3, 230e3), final=None))
    assert [row["stage"] for row in rows] == ["transient"] * 2 and float(rows[0]["diameter_apparent_m"]) == 500e3
    assert "transient with transient" in capsys.readouterr().out
    rows = compared(
        tmp_path, measured_run(tmp_path / "fourth", transient=None), measured_run(tmp_path / "fifth", final=None)
    )
    assert not rows[1]["diameter_apparent_m_ratio"] and "no stage is common" in capsys.readouterr().out


def test_the_stage_is_chosen_by_option_and_refused_where_there_is_none(tmp_path):
    run = measured_run(tmp_path / "quick")
    assert [row["stage"] for row in compared(tmp_path, run, "thesis_980km", stage="final")] == ["final", "transient"]
    rows = compared(tmp_path, run, measured_run(tmp_path / "other"), stage="transient")
    assert float(rows[0]["diameter_apparent_m"]) == 500e3
    with pytest.raises(InputError, match=r"holds no final crater.*ends with the shock stage.*it has: transient"):
        compare.compare([run, measured_run(tmp_path / "short", final=None)], stage="final", out=tmp_path)
    with pytest.raises(InputError, match="--stage 'middle' is not known"):
        compare.compare([run, "thesis_980km"], stage="middle", out=tmp_path)


def test_a_crater_that_still_grows_is_not_called_final(tmp_path, capsys):
    run = measured_run(tmp_path / "short", settled=False, state="still growing", settled_reason="volume +9%")
    compared(tmp_path, run, "sci_ryugu")
    printed = capsys.readouterr().out
    assert "last snapshot, still growing" in printed and "not at rest: volume +9%" in printed


def test_one_d_over_D_in_a_row_and_the_rim_to_rim_one_is_named(tmp_path, capsys):
    rows = compared(tmp_path, measured_run(tmp_path / "quick"), "thesis_980km")
    assert float(rows[0]["depth_over_diameter"]) == pytest.approx(250 / 476, rel=1e-3)
    assert float(rows[1]["depth_over_diameter"]) == pytest.approx(300 / 980, rel=1e-3)
    assert float(rows[0]["rim_depth_over_rim_diameter"]) == pytest.approx(1.2 * 250 / (1.3 * 476), rel=1e-3)
    printed = capsys.readouterr().out
    assert "d/D apparent" in printed and "d/D rim to rim" in printed and "\nd/D  " not in printed


def test_a_runs_own_profiles_by_path_give_the_runs_numbers(tmp_path):
    """Not what can be read off their points."""
    folder = tmp_path / "quick" / "6_crater"
    measured_run(tmp_path / "quick")
    for name, size in (("profile_transient", 500e3), ("profile_transient_depth", 476e3), ("profile", 550e3)):
        found = compare.load(str(folder / f"{name}.csv"))
        assert found.values["diameter_apparent_m"] == (size, 7e3, 7e3), name
        assert found.profile is not None and found.values["volume_m3"][1] == 1e14


def test_a_profile_without_errors_states_none_and_columns_do_not_touch(tmp_path, capsys):
    radial_profile.write_csv(parabola(90e3, 35e3), tmp_path / "mine.csv")
    rows = compared(
        tmp_path, measured_run(tmp_path / "quick"), measured_run(tmp_path / "second"), str(tmp_path / "mine.csv")
    )
    assert rows[2]["depth_m_plus"] == "" and rows[2]["volume_m3_plus"] == "" and rows[0]["depth_m_plus"] == "8000"
    table = [line for line in capsys.readouterr().out.splitlines() if line.startswith(("depth", "volume", "D "))]
    assert all("+- 0 " not in line and "km3 " not in line.replace("km3  ", "") for line in table)
    for line in table:
        if "/ 1st" not in line:
            assert len(re.split(r"\s{2,}", line.strip())) == 4, line


def test_labels_say_the_stage_once():
    crater = craters.Crater("Winter 2017 (transient)", {}, None, stage="transient", title="transient, maximum depth")
    assert crater.label == "Winter 2017 (transient): maximum depth"
    assert (
        craters.Crater("quick", {}, None, stage="transient", title="transient, maximum depth").label
        == "quick: transient, maximum depth"
    )
    assert (
        craters.Crater("Valhalla, mapped zones", {}, None, stage="final", title="zones").label
        == "Valhalla, mapped zones"
    )


def test_the_widest_cell_makes_the_column():
    wide = [craters.Crater(name, {"volume_m3": (8.273e15, 7.8e14, 7.8e14)}, None) for name in "ab"]
    line = next(line for line in compare._printed(wide, "").splitlines() if line.startswith("volume"))
    assert re.split(r"\s{2,}", line) == ["volume", *["8.273e+06 +- 7.8e+05 km3"] * 2]


def test_a_profile_may_say_its_stage(tmp_path):
    made = parabola(240e3, 200e3)
    radial_profile.write_csv(
        Profile(made.radius, made.height, made.p16, made.p84, made.count, {"stage": "transient"}),
        tmp_path / "mine.csv",
    )
    rows = compared(tmp_path, measured_run(tmp_path / "quick"), str(tmp_path / "mine.csv"))
    assert [row["stage"] for row in rows] == ["transient"] * 2
    (tmp_path / "bad.csv").write_text("# stage = early\nradius_m,height_m\n0,-1\n1,-1\n2,0\n")
    with pytest.raises(InputError, match="stage = early"):
        compare.load(str(tmp_path / "bad.csv"))


def test_the_difference_is_that_of_the_crater_not_of_flat_ground_far_out():
    """Depth 20 against 4 over a radius of 100, both flat out to 1000: RMS inside 1.5 radii, and the largest difference
    with its place."""
    r = np.linspace(0.5, 1000.0, 2000)
    nothing = np.full(len(r), np.nan)
    deep, flat = (
        Profile(r, np.where(r < 100.0, -d * (1 - (r / 100.0) ** 2), 0.0), nothing, nothing, np.zeros(len(r), int), {})
        for d in (20.0, 4.0)
    )
    found = difference.profile_difference(deep, flat)
    assert found["inside_m"] == pytest.approx(150.0, rel=0.02)
    assert found["rms_inside_m"] == pytest.approx(
        16.0 / np.sqrt(3.0) / 1.5, rel=0.02
    )  # of 16 (1 - x^2) over x < 1, spread over x < 1.5
    assert found["rms_over_depth"] == pytest.approx(found["rms_inside_m"] / 20.0, rel=1e-3)
    assert found["rms_m"] < 0.2 * found["rms_inside_m"]
    assert found["largest_m"] == pytest.approx(16.0, rel=1e-3) and found["largest_at_m"] < 1.0


@pytest.mark.parametrize(
    ("line", "words"),
    [('kind = "transiant"', "did you mean 'transient'"), ('at = "width"', "known: volume, depth, diameter")],
)
def test_an_observation_of_an_unknown_kind_is_refused(tmp_path, line, words):
    path = tmp_path / "mine.toml"
    path.write_text(
        f'title = "a"\nsource = "b"\n{line}\n[measures.depth_m]\nvalue = "3 m"\nminus = "1 m"\nplus = "1 m"\n'
    )
    with pytest.raises(InputError, match=words):
        observations.read(path)
