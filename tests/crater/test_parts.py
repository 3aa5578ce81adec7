"""The parts under the measures: smoothing and its inverse, datum fits, profile files, series, comparison."""

from __future__ import annotations

import json

import numpy as np
import pytest

from crater.comparison import observations
from crater.ground import cloud, datum, far_field, radial_profile, surface, surface_smoothing
from crater.ground.radial_profile import Profile, Relief
from crater.pages import compare
from crater.results import series
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.geometry import frame
from matter.particles import Particles


def test_smoothing_of_a_paraboloid_is_a_shift():
    """Average of a r^2 over the kernel's slice: a (r^2 + 2 sigma^2) with sigma^2 = 0.3164 spacings^2 per axis."""
    s, d = np.linspace(0.1, 10.0, 60), np.full(60, 0.7)
    shown = surface_smoothing.smooth(lambda r: 0.3 * r**2, s, d)
    assert shown - 0.3 * s**2 == pytest.approx(np.full(60, 0.3 * 2 * 0.3164 * 0.49), rel=2e-3)


def test_inverse_undoes_the_smoothing_of_smooth_ground():
    s, d = np.arange(0.25, 30.0, 0.5), np.ones(60)
    true = np.exp(-((s / 8.0) ** 2))
    shown = surface_smoothing.smooth(lambda r: np.exp(-((r / 8.0) ** 2)), s, d)
    back = surface_smoothing.sharpened(s, d, shown)
    assert np.abs(back - true)[2:50].max() < 0.1 * np.abs(shown - true).max()


def test_colour_field_follows_the_known_smoothing():
    """Ring means of real clouds against the linear map: within 0.04 spacings, rim included."""
    shape = synthetic.Shape(synthetic.bowl(10.0), 10.0, 22.0)
    flat = datum.plane()
    edges = np.arange(0.0, 18.0, 0.5)
    middle = 0.5 * (edges[1:] + edges[:-1])
    columns = surface.Columns(
        edges, middle, np.ones(len(middle)), np.maximum(6, np.ceil(2 * np.pi * middle)).astype(int), 24
    )
    means = []
    for seed in range(3):
        p = synthetic.cloud_on_plane(shape, 1.0, np.random.default_rng(seed), "lattice")
        heights = surface.measure_heights(cloud.particle_cloud(Particles(synthetic.as_fields(p, 1.0))), flat, columns)
        means.append([np.nanmean(heights.colour[a:b]) for a, b in zip(columns.start[:-1], columns.start[1:])])
    expected = surface_smoothing.smooth(shape.h, middle, np.ones(len(middle)))
    assert np.abs(np.mean(means, axis=0) - expected)[6:].max() < 0.06


def test_every_method_finds_flat_ground():
    p = synthetic.fill(np.random.default_rng(3), 1.0, (-12, -12, -6), (12, 12, 0), "lattice")
    body = cloud.particle_cloud(Particles(synthetic.as_fields(p, 1.0)))
    columns = surface.make_columns(body, datum.plane(), 8.0)
    found = surface.measure_heights(body, datum.plane(), columns, "four")
    assert np.nanmean(found.colour) == pytest.approx(0.0, abs=0.06)
    assert np.nanmean(found.highest) == pytest.approx(0.0, abs=0.15)
    assert np.nanmean(found.alpha_shape) == pytest.approx(0.0, abs=0.2)
    assert np.nanmean(found.cell) == pytest.approx(0.0, abs=0.08)


def ground_of(given: datum.Datum, height) -> Relief:
    """A relief with the ``height`` (distance, azimuth) and no particles under it: rings of a half to forty, spacing
    one."""
    edges = np.arange(0.0, 40.5, 0.5)
    s = 0.5 * (edges[1:] + edges[:-1])
    columns = surface.Columns(edges, s, np.ones(len(s)), np.full(len(s), 24), 24)
    a = (np.arange(24) + 0.5) * 2.0 * np.pi / 24
    cells = height(s[:, None], a[None, :]) + 0.02 * np.random.default_rng(1).normal(size=(len(s), 24))
    return Relief(given, columns, {"colour": cells}, cells.ravel())


def crater_with_blanket(s):
    """A crater of radius 8 with a blanket that falls as s^-3."""
    return np.where(s < 8.0, -3.0 + 4.0 * (s / 8.0) ** 2, (np.maximum(s, 8.0) / 8.0) ** -3.0)


def test_a_fitted_plane_shrugs_off_boulders_and_the_blanket():
    def height(s, a):
        h = crater_with_blanket(s) + 2.0 + 0.05 * s * np.cos(a) - 0.02 * s * np.sin(a)
        return np.where((s > 20.0) & (s < 22.0) & (a < 0.6), h + 5.0, h)

    found = far_field.refit(ground_of(datum.plane(), height), datum.plane(), 7.0)
    normal = np.asarray(found.axes)[2]
    assert -normal[:2] / normal[2] == pytest.approx([0.05, -0.02], abs=3e-3)
    assert abs(found.centre[2] - 2.0) < max(3.0 * found.sigma, 0.01)
    assert 0.0 < found.sigma < 0.05


@pytest.mark.parametrize("known", ["nothing", "centre", "radius"])
def test_a_fitted_sphere_tells_a_blanket_from_its_own_curvature(known):
    """The start is 0.6 too large and its centre 0.5 too low; the ground is a sphere of 100 with a crater and its
    blanket."""
    start = datum.sphere(100.6 if known != "radius" else 100.0, (0.0, 0.0, -0.5 if known != "centre" else 0.0))

    def height(s, a):
        along, up = 100.0 * np.sin(s / 100.0), 100.0 * np.cos(s / 100.0) - start.centre[2]
        return np.hypot(along, up) - start.radius + crater_with_blanket(s) + 0.0 * a

    kept = {
        "centre": (0.0, 0.0, 0.0) if known == "centre" else None,
        "fixed_radius": 100.0 if known == "radius" else None,
    }
    found = far_field.refit(ground_of(start, height), start, 7.0, **kept)
    top = np.asarray(found.centre) + found.radius * np.asarray(found.axes)[2]
    assert abs(top[2] - 100.0) < max(3.0 * found.sigma, 0.02)
    assert 0.0 < found.sigma < 0.2


def test_sphere_fit_free_and_fixed():
    rng = np.random.default_rng(2)
    u = rng.normal(size=(500, 3))
    u[:, 2] = np.abs(u[:, 2]) + 0.5
    u /= np.linalg.norm(u, axis=1)[:, None]
    p = np.array([1.0, 2.0, 3.0]) + u * (50.0 + rng.normal(scale=0.05, size=(500, 1)))
    free = datum.fit_sphere(p, 0.05)
    assert free.radius == pytest.approx(50.0, abs=0.1)
    assert free.centre == pytest.approx((1.0, 2.0, 3.0), abs=0.1)
    assert datum.fit_sphere(p, 0.05, radius=50.0).radius == 50.0
    assert datum.fit_sphere(p, 0.05, centre=(1.0, 2.0, 3.0)).radius == pytest.approx(50.0, abs=0.02)


def test_polar_coordinates_agree_with_the_frames():
    p = np.random.default_rng(3).normal(size=(50, 3)) * 100 + np.array([0, 0, 500.0])
    for mine, theirs in (
        (datum.of_frame(frame.Sphere(500.0)), frame.Sphere(500.0)),
        (datum.of_frame(frame.Plane(3.0, (1.0, 2.0))), frame.Plane(3.0, (1.0, 2.0))),
    ):
        s, azimuth, h = mine.polar(p)
        assert s == pytest.approx(theirs.distance(p))
        assert h == pytest.approx(theirs.height(p))
        assert azimuth == pytest.approx(np.mod(theirs.azimuth(p), 2 * np.pi))


@pytest.mark.parametrize("start", [datum.sphere(1000.0, (10.0, 0.0, 0.0)), datum.plane(5.0)])
def test_a_moved_axis_stands_where_it_was_told(start):
    there = start.moved(30.0, -40.0)
    place = start.outside(np.array([[30.0, -40.0, 0.0]])) if not start.is_sphere else None
    if start.is_sphere:
        psi = 50.0 / 1000.0
        place = start.outside(1000.0 * np.array([[np.sin(psi) * 0.6, -np.sin(psi) * 0.8, np.cos(psi)]]))
    s, _, h = there.polar(place)
    assert s[0] == pytest.approx(0.0, abs=1e-6) and h[0] == pytest.approx(0.0, abs=1e-6)
    assert np.asarray(there.axes) @ np.asarray(there.axes).T == pytest.approx(np.eye(3))


def test_profile_file_round_trip(tmp_path):
    s = np.linspace(1.0, 10.0, 10)
    before = Profile(s, -1 + s / 5, s * 0 - 1.1, s * 0 + 0.1, np.arange(10), {"datum": "plane"})
    radial_profile.write_csv(before, tmp_path / "profile.csv")
    text = (tmp_path / "profile.csv").read_text()
    assert "radius_m,height_m,height_p16_m,height_p84_m,count" in text.splitlines()
    after = radial_profile.read_csv(tmp_path / "profile.csv")
    assert after.height == pytest.approx(before.height, rel=1e-5)
    assert after.header["datum"] == "plane"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("radius_m,depth\n1,2\n2,3\n3,4\n", "height_m"),
        ("radius_m,height_m\n1,2\n2,x\n3,4\n", "line 3"),
        ("radius_m,height_m\n1,2\n1,3\n3,4\n", "increase"),
        ("radius_m,height_m\n1,2,3\n2,3\n3,4\n", "3 values for 2 columns"),
        ("", "holds no profile"),
    ],
)
def test_bad_profile_files_are_named(tmp_path, text, message):
    path = tmp_path / "mine.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        radial_profile.read_csv(path)


def test_first_maximum_ignores_noise_and_the_late_swell():
    t = np.arange(0.0, 60.0)
    growth = np.where(t < 10, t / 10, np.maximum(0.1, 1 - (t - 10) / 10))
    late = np.where(t > 40, 1.5 * (t - 40) / 20, 0.0)
    noisy = growth + 0.03 * np.sin(7 * t) + late
    assert abs(series.first_maximum(t, noisy) - 10) <= 1
    assert series.first_maximum(t, np.full(60, np.nan)) is None


def parabola(radius, depth, n=40):
    r = np.linspace(0.01, 1.6, n) * radius
    h = np.where(r < radius, depth * ((r / radius) ** 2 - 1), 0.1 * depth * np.exp(-(r - radius) / (0.2 * radius)))
    return Profile(r, h, h - 0.05 * depth, h + 0.05 * depth, np.full(n, 20), {})


def test_difference_of_profiles():
    a, b = parabola(100.0, 20.0), parabola(100.0, 20.0, 80)
    assert compare.profile_difference(a, b)["rms_over_depth"] < 0.03
    lifted = Profile(b.radius, b.height + 2.0, b.p16, b.p84, b.count, {})
    assert compare.profile_difference(a, lifted)["mean_m"] == pytest.approx(2.0, abs=0.3)
    far = Profile(b.radius + 1e4, b.height, b.p16, b.p84, b.count, {})
    with pytest.raises(InputError, match="overlap"):
        compare.profile_difference(a, far)


def test_compare_run_csv_and_observation(tmp_path, capsys):
    run = tmp_path / "a_run" / "6_crater"
    run.mkdir(parents=True)
    radial_profile.write_csv(parabola(460e3, 280e3), run / "profile.csv")
    final = {
        "diameter_apparent_m": {"value": 920e3, "sigma": 20e3, "unit": "m"},
        "depth_m": {"value": 280e3, "sigma": 9e3, "unit": "m"},
    }
    (run / "measures.json").write_text(json.dumps({"transient": {}, "final": final, "reference": []}))
    radial_profile.write_csv(parabola(500e3, 200e3), tmp_path / "mine.csv")
    assert (
        compare.compare(
            [str(tmp_path / "a_run"), str(tmp_path / "mine.csv")], observed="thesis_980km", out=tmp_path / "out"
        )
        == 0
    )
    printed = capsys.readouterr().out
    assert "920 +- 20 km" in printed and "RMS to first" in printed and "+177/-273 km" in printed
    table = (tmp_path / "out" / "comparison.csv").read_text().splitlines()
    assert len(table) == 4 and len({line.count(",") for line in table[:1]}) == 1
    assert (tmp_path / "out" / "comparison.png").stat().st_size > 10_000


def test_compare_says_what_it_cannot_find(tmp_path):
    with pytest.raises(InputError, match="thesis_980km"):
        compare.compare(["nowhere", "thesis_980km"], out=tmp_path)
    with pytest.raises(InputError, match="at least two"):
        compare.compare(["thesis_980km"], out=tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"measures\.json"):
        compare.compare([str(tmp_path / "empty"), "thesis_980km"], out=tmp_path)


@pytest.mark.parametrize("name", observations.names())
def test_every_observation_can_be_read(name):
    known = observations.load(name)
    assert known.title and known.source
    assert known.zones if known.kind in ("zones", "trend") else known.values
    for value, minus, plus in known.values.values():
        assert value > 0 and minus >= 0 and plus >= 0


def test_unknown_observation_names_the_nearest():
    with pytest.raises(InputError, match="sci_ryugu"):
        observations.load("sci_ryugo")
