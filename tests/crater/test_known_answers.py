"""Synthetic craters on planes and spheres: the measures against what was put in."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ground import locate
from crater.measures import blanket
from crater.measures.measure import measure
from fixtures import synthetic_craters as synthetic
from matter.geometry import frame
from matter.particles import Particles


def errors(measures, shape):
    """Measured minus true, per measure."""
    truth = {
        "depth_m": shape.depth,
        "diameter_apparent_m": 2 * shape.apparent,
        "diameter_rim_m": 2 * shape.rim_found,
        "rim_height_m": shape.rim_height,
        "volume_m3": shape.volume,
    }
    found = {name: measures[name] for name in truth}
    missing = [name for name, quantity in found.items() if quantity.value is None]
    assert not missing, {name: found[name].reason for name in missing}
    return (
        {name: found[name].value - truth[name] for name in truth},
        truth,
        {name: found[name].sigma for name in truth},
    )


def assert_within_twenty_per_radius(measures, shape, spacing):
    """The acceptance numbers at 20 particles per radius."""
    error, truth, _ = errors(measures, shape)
    assert abs(error["diameter_rim_m"]) < 0.01 * truth["diameter_rim_m"], error
    assert abs(error["diameter_apparent_m"]) < 0.01 * truth["diameter_apparent_m"], error
    assert abs(error["depth_m"]) < max(0.02 * truth["depth_m"], 0.3 * spacing), error
    assert abs(error["volume_m3"]) < 0.03 * truth["volume_m3"], error
    assert abs(error["rim_height_m"]) < 0.10 * truth["rim_height_m"], error


def test_tilted_plane_with_ejecta_at_twenty_per_radius():
    rng = np.random.default_rng(11)
    shape = synthetic.Shape(synthetic.bowl(1000.0), 1000.0, 3300.0)
    spacing = 50.0
    position = synthetic.cloud_on_plane(shape, spacing, rng, "lattice", centre=(120.0, -80.0), tilt=0.02, ejecta=0.05)
    found = measure(Particles(synthetic.as_fields(position, spacing)), "plane")
    assert_within_twenty_per_radius(found, shape, spacing)


def test_sphere_of_valhalla_size_at_twenty_per_radius():
    rng = np.random.default_rng(12)
    R, rim = 2142e3, 300e3
    shape = synthetic.Shape(synthetic.exponential(rim), rim, 750e3, R)
    spacing = rim / 20
    position = synthetic.cloud_on_sphere(
        shape, spacing, rng, "jitter", ejecta=0.05, depth_of_cloud=shape.depth + 4 * spacing
    )
    found = measure(Particles(synthetic.as_fields(position, spacing)), frame.Sphere(R))
    assert_within_twenty_per_radius(found, shape, spacing)


@pytest.mark.validation
@pytest.mark.parametrize("R", [1085e3, 2142e3, 2410e3, None])
@pytest.mark.parametrize("kind", ["lattice", "jitter"])
@pytest.mark.parametrize("profile", [synthetic.bowl, synthetic.exponential, synthetic.complex_crater])
def test_every_body_and_sampling_at_twenty_per_radius(R, kind, profile, request):
    if R is None and kind == "jitter" and profile is synthetic.complex_crater:
        reason = (
            "a rim 1.2 spacings high on a shaken lattice with a fitted, tilted plane: rim diameter off by 1.75 %, "
            "apparent by 1.2 %"
        )
        request.applymarker(pytest.mark.xfail(reason=reason))
    rng = np.random.default_rng(13)
    rim = 200e3 if R else 200.0
    shape = synthetic.Shape(profile(rim), rim, 3.3 * rim, R)
    spacing = rim / 20
    if R:
        position = synthetic.cloud_on_sphere(shape, spacing, rng, kind, ejecta=0.05)
        datum = frame.Sphere(R)
    else:
        position = synthetic.cloud_on_plane(shape, spacing, rng, kind, ejecta=0.05, tilt=0.01)
        datum = "plane"
    found = measure(Particles(synthetic.as_fields(position, spacing)), datum)
    assert_within_twenty_per_radius(found, shape, spacing)


@pytest.mark.parametrize("across", [5.0, 7.0, 10.0])
def test_quick_case_resolution_has_honest_errors(across):
    """At 5 to 10 particles per radius every measure lies within 3.5 of its own sigma, and sigma stays useful."""
    rng = np.random.default_rng(int(across))
    R, rim = 2102e3, 300e3
    shape = synthetic.Shape(synthetic.bowl(rim, 0.25, 0.05), rim, 1300e3, R)
    spacing = rim / across
    position = synthetic.cloud_on_sphere(shape, spacing, rng, "jitter", ejecta=0.03)
    error, truth, sigma = errors(measure(Particles(synthetic.as_fields(position, spacing)), frame.Sphere(R)), shape)
    for name in truth:
        assert abs(error[name]) < 3.5 * sigma[name], (name, error[name], sigma[name])
    assert sigma["diameter_apparent_m"] < 0.05 * truth["diameter_apparent_m"]
    assert sigma["depth_m"] < 0.5 * spacing


def test_sphere_fitted_without_any_hint():
    """No centre, no radius: the far field alone gives the datum."""
    rng = np.random.default_rng(5)
    R, rim = 1085e3, 150e3
    shape = synthetic.Shape(synthetic.bowl(rim), rim, 900e3, R)
    spacing = rim / 8
    position = synthetic.cloud_on_sphere(shape, spacing, rng, "jitter") + np.array([3e5, -2e5, 1e5])
    found = measure(Particles(synthetic.as_fields(position, spacing)), "sphere")
    error, _, sigma = errors(found, shape)
    assert abs(found.datum.radius - R) < 0.02 * R
    assert abs(error["diameter_apparent_m"]) < 3.5 * sigma["diameter_apparent_m"]
    assert abs(error["depth_m"]) < 0.5 * spacing


def test_graded_spacing_does_not_move_the_answer():
    """Spacing grows from 40 to some 110 km away from the impact, as a graded target has it."""
    R, rim = 2102e3, 300e3
    shape = synthetic.Shape(synthetic.bowl(rim, 0.25, 0.05), rim, 1700e3, R)
    position, spacing = synthetic.graded_cloud_on_sphere(shape, 40e3, np.random.default_rng(8))
    assert spacing.max() > 2.0 * spacing.min()
    error, truth, sigma = errors(measure(Particles(synthetic.as_fields(position, spacing)), frame.Sphere(R)), shape)
    assert abs(error["diameter_apparent_m"]) < 0.02 * truth["diameter_apparent_m"]
    assert abs(error["depth_m"]) < 0.3 * 40e3
    for name in truth:
        assert abs(error[name]) < 3.5 * sigma[name], (name, error[name], sigma[name])


def test_ellipse_is_measured_as_the_circle_of_equal_area():
    rng = np.random.default_rng(21)
    shape = synthetic.Shape(synthetic.bowl(1.0), 1.0, 3.6)
    spacing = 1.0 / 9
    position = synthetic.cloud_on_plane(shape, spacing, rng, "jitter", stretch=1.3, centre=(0.2, 0.1))
    found = measure(Particles(synthetic.as_fields(position, spacing)), "plane")
    error, truth, _ = errors(found, shape)
    assert found["ellipticity"].value == pytest.approx(1 - 1 / 1.3, abs=0.06)
    low, high = np.nanpercentile(found.notes["by_azimuth"]["apparent_radius_m"], (10, 90))  # exact: 1.283
    assert high / low == pytest.approx(1.283, abs=0.06)
    assert abs(error["diameter_apparent_m"]) < 0.03 * truth["diameter_apparent_m"]
    centre = np.asarray(found.datum.centre)
    assert np.hypot(centre[0] - 0.2, centre[1] - 0.1) < 0.4 * spacing


@pytest.mark.parametrize("decay", [2.5, 3.5])
def test_blanket_exponent(decay):
    rng = np.random.default_rng(31)
    shape = synthetic.Shape(synthetic.bowl(1000.0, 0.2, 0.06, decay), 1000.0, 4200.0)
    position = synthetic.cloud_on_plane(shape, 100.0, rng, "lattice")
    found = measure(Particles(synthetic.as_fields(position, 100.0)), frame.Plane())
    assert found["blanket_exponent"].value == pytest.approx(decay, abs=max(0.4, 3 * found["blanket_exponent"].sigma))
    assert found["blanket_height_at_rim_m"].value == pytest.approx(shape.rim_height, rel=0.2)


def test_what_leaves_the_body():
    position = np.array([[0.0, 0.0, 2e6], [0.0, 0.0, 2e6], [0.0, 0.0, 2e6], [0.0, 0.0, 2e6]])
    velocity = np.array([[0.0, 0.0, 5e3], [0.0, 0.0, -5e3], [0.0, 0.0, 5e2], [3e3, 0.0, 4e3]])
    particles = Particles(
        {"position": position, "velocity": velocity, "mass": [1.0, 2.0, 4.0, 8.0], "layer": [0, 0, 0, -1]}
    )
    gone = blanket.leaving(particles, 8.5e22, np.array([0.0, 0.0, -1e3]))
    assert (gone["target_mass_kg"], gone["projectile_mass_kg"]) == (1.0, 8.0)
    assert gone["beta"] == pytest.approx(1.0 + (5e3 + 32e3) / 1e3)


def test_ejecta_in_flight_is_no_ground():
    rng = np.random.default_rng(2)
    shape = synthetic.Shape(synthetic.bowl(1000.0), 1000.0, 3000.0)
    spacing = 120.0
    position = synthetic.cloud_on_plane(shape, spacing, rng, "jitter")
    slab = synthetic.fill(
        rng, spacing, (-400, -400, 500), (400, 400, 900), "lattice"
    )  # a dense cloud hangs over the crater
    both = np.vstack([position, slab])
    velocity = np.zeros_like(both)
    velocity[len(position) :, 2] = 100.0
    clean = measure(Particles(synthetic.as_fields(position, spacing)), "plane")
    dirty = measure(Particles({**synthetic.as_fields(both, spacing), "velocity": velocity}), "plane")
    for name in ("depth_m", "diameter_apparent_m", "volume_m3"):
        assert dirty[name].value == pytest.approx(clean[name].value, rel=1e-3), name


def test_projectile_and_booked_grains_are_left_out():
    rng = np.random.default_rng(3)
    shape = synthetic.Shape(synthetic.bowl(1000.0), 1000.0, 3000.0)
    spacing = 120.0
    position = synthetic.cloud_on_plane(shape, spacing, rng, "jitter")
    inside = rng.uniform((-300, -300, -350), (300, 300, -200), size=(400, 3))  # fills the bowl, finely
    fields = synthetic.as_fields(
        np.vstack([position, inside]), np.r_[np.full(len(position), spacing), np.full(400, 30.0)]
    )
    mark = np.r_[np.zeros(len(position)), np.full(400, -1)]
    with_projectile = measure(Particles({**fields, "layer": mark}), "plane")
    booked = measure(Particles({**fields, "state": -mark}), "plane")
    clean = measure(Particles(synthetic.as_fields(position, spacing)), "plane")
    assert with_projectile["depth_m"].value == clean["depth_m"].value
    assert booked["depth_m"].value == clean["depth_m"].value


def test_a_ringing_body_is_measured_against_its_own_far_field():
    """The whole body swells by 9 km after t = 0: heights follow the far field at the same time."""
    R, rim, spacing = 2102e3, 300e3, 60e3
    shape = synthetic.Shape(synthetic.bowl(rim, 0.25, 0.05), rim, 2500e3, R)
    flat = synthetic.Shape(lambda s: np.where(np.asarray(s) < 1.0, -1.0, 0.0), rim, 2500e3, R)
    flat.depth = shape.depth
    before = synthetic.cloud_on_sphere(flat, spacing, np.random.default_rng(1), "lattice")
    after = synthetic.cloud_on_sphere(shape, spacing, np.random.default_rng(1), "lattice")
    after = after * (1 + 9e3 / np.linalg.norm(after, axis=1))[:, None]
    found = measure(
        Particles(synthetic.as_fields(after, spacing)),
        frame.Sphere(R),
        Particles(synthetic.as_fields(before, spacing)),
        locate.Search(reach=2000e3),
    )
    error, _, sigma = errors(found, shape)
    level = found["far_field_level_m"]
    assert level.value == pytest.approx(9e3, abs=1.5e3) and abs(level.value - 9e3) < 3.0 * level.sigma
    assert abs(error["depth_m"]) < 0.25 * spacing
    assert abs(error["diameter_apparent_m"]) < 3.5 * sigma["diameter_apparent_m"]


def test_the_same_cloud_gives_the_same_numbers():
    rng = np.random.default_rng(4)
    shape = synthetic.Shape(synthetic.bowl(1.0), 1.0, 3.0)
    particles = Particles(synthetic.as_fields(synthetic.cloud_on_plane(shape, 0.15, rng, "jitter"), 0.15))
    one, two = measure(particles, "plane"), measure(particles, "plane")
    assert one.as_dict() == two.as_dict()
