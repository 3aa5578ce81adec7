"""A patch of a body's ground as a flat bed: its gravity against closed forms, its curvature, what is refused, and what
the stages of grains take it for."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from dem.beds import patch, stage
from dem.beds.settings import Settings
from dem.beds.solid_body import SolidBody
from fixtures import grain_bodies
from matter.case.body import Impact
from matter.constants import G
from matter.errors import InputError
from sph.bodies import solid_target

DENSITY = 1227.0
BALL = (896.0, 896.0, 896.0)
FLAT = (900.0, 900.0, 30.0)
OBLATE = (1004.0, 1004.0, 876.0)
IMPACT = Impact.model_validate(
    {
        "speed": "2 km/s",
        "angle_from_vertical": "0 deg",
        "expected_transient_diameter": "14.5 m",
        "projectile": {"material": "copper", "radius": "3.76 cm"},
    }
)


def settings(axes=BALL, site=(0.0, 0.0), body=(), **bed) -> Settings:
    """A bed on an ellipsoid hit at a site [deg]; ``body``: further keys of the target."""
    given = {"shape": "bowl", "arc_radius": 15.0, "count": 1500}
    target = grain_bodies.target(axes, *site, **dict(body))
    return Settings(target=target, impact=IMPACT, **{**given, **bed})


def read(folder, chosen: Settings) -> patch.Patch:
    path = folder / "target.json"
    path.write_text(json.dumps(solid_target.target_json(chosen.target, DENSITY)))
    return patch.read(chosen, path)


def test_gravity_of_a_ball_is_that_of_its_mass(tmp_path):
    found = read(tmp_path, settings())
    assert found.gravity == pytest.approx(4.0 / 3.0 * math.pi * G * DENSITY * 448.0, rel=2e-4)
    assert found.slope < 0.1 and found.density == pytest.approx(DENSITY)


def test_at_the_equator_of_a_turning_ball_it_is_less_by_the_centrifugal_part(tmp_path):
    still, turning = read(tmp_path, settings()), read(tmp_path, settings(body={"spin_period": "7.63 h"}))
    omega = 2.0 * math.pi / (7.63 * 3600.0)
    assert still.gravity - turning.gravity == pytest.approx(omega**2 * 448.0, rel=1e-3)
    v = math.sqrt(14.5 * turning.gravity)
    assert turning.facts["coriolis_over_gravity"] == pytest.approx(2.0 * omega * v / turning.gravity)
    assert still.facts["coriolis_over_gravity"] == 0.0


@pytest.mark.validation
def test_at_the_pole_of_a_turning_ball_it_is_that_of_its_mass(tmp_path):
    still = read(tmp_path, settings())
    at_the_pole = read(tmp_path, settings(site=(90.0, 0.0), body={"spin_period": "7.63 h"}))
    assert at_the_pole.gravity == pytest.approx(still.gravity, rel=1e-3)


@pytest.mark.validation
def test_at_the_pole_of_a_spheroid_it_is_its_closed_form(tmp_path):
    found = read(tmp_path, settings(OBLATE, (90.0, 0.0)))
    e = math.sqrt(1.0 - (876.0 / 1004.0) ** 2)
    factor = 2.0 / e**2 * (1.0 - math.sqrt(1.0 - e**2) * math.asin(e) / e)
    assert found.gravity == pytest.approx(2.0 * math.pi * G * DENSITY * factor * 438.0, rel=3e-4)
    ball = G * DENSITY * 4.0 / 3.0 * math.pi * (502.0**2 * 438.0) ** (1.0 / 3.0)
    assert abs(found.gravity / ball - 1.0) > 0.01  # told apart from the ball of its volume


@pytest.mark.validation
def test_a_companion_over_the_site_lifts_by_its_tide(tmp_path):
    moon = {"companion": {"mass": "1e12 kg", "distance": "1500 m"}}
    alone, lifted = read(tmp_path, settings()), read(tmp_path, settings(body=moon))
    known = G * 1e12 * (1.0 / (1500.0 - 448.0) ** 2 - 1.0 / 1500.0**2)
    assert alone.gravity - lifted.gravity == pytest.approx(known, rel=1e-3)


@pytest.mark.parametrize(
    ("site", "known"),
    [((90.0, 0.0), (438.0 / 502.0**2,) * 2), ((0.0, 30.0), (1.0 / 502.0, 502.0 / 438.0**2))],
    ids=["pole", "equator"],
)
def test_curvatures_are_those_of_the_ellipsoid(site, known):
    target = grain_bodies.target(OBLATE, *site)
    ground = patch.site_geometry(target.placed, target.axes, 15.0)
    assert ground.curvature == pytest.approx(known, rel=0.01)
    assert ground.normal == pytest.approx([0.0, 0.0, 1.0], abs=2e-3)


@pytest.mark.validation
def test_the_report_says_how_far_the_law_goes(tmp_path):
    facts = read(tmp_path, settings(OBLATE)).facts
    least = 438.0**2 / 502.0
    assert facts["least_radius_of_curvature_m"] == pytest.approx(least, rel=0.02)
    assert facts["fall_of_the_ground_at_the_edge_m"] == pytest.approx(15.0**2 / (2.0 * least), rel=0.02)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"axes": OBLATE, "site": (35.0, 0.0)}, r"slopes by 3\.\d+ deg against gravity, at most 2 deg"),
        ({"arc_radius": 46.0}, r"arc_radius = 46 m: .* at most 0\.1 of the least radius of curvature"),
        ({"shape": "cylinder", "depth": 46.0}, r"depth = 46 m: a patch that is laid flat"),
        ({"axes": FLAT, "site": (90.0, 0.0), "arc_radius": 25.0}, r"only [\d.]+ m away from there: .* too thin"),
        ({"body": {"spin_period": "2 h"}}, r"weighs nothing \(-"),
        ({"depth": 10.0}, r"a bowl is as deep as its radius"),
    ],
    ids=["slope", "wide", "deep", "thin", "weightless", "bowl"],
)
def test_what_cannot_be_laid_flat_is_refused(tmp_path, keys, words):
    chosen = settings(**keys)
    path = tmp_path / "target.json"
    path.write_text(json.dumps(solid_target.target_json(chosen.target, DENSITY)))
    with pytest.raises(InputError, match=words):
        stage.maker(chosen, path)


def test_a_spherical_cap_of_an_ellipsoid_is_refused(tmp_path):
    chosen = settings(shape="cap")
    path = tmp_path / "target.json"
    path.write_text(json.dumps(solid_target.target_json(chosen.target, DENSITY)))
    with pytest.raises(InputError, match=r"a bowl, box or cylinder of its ground"):
        stage.maker(chosen, path)


def test_the_stages_of_grains_see_flat_ground(tmp_path):
    chosen = settings(OBLATE, body={"spin_period": "7.63 h"})
    known = read(tmp_path, chosen)
    ground = stage.ground(chosen)
    bulk = SolidBody.expected(chosen.target, {}).density
    assert ground.flat and ground.shape == "half_sphere" and ground.radius == 15.0
    # as dense as the material's file says, of which the attraction is made, less what the spin takes off
    omega = 2.0 * math.pi / (7.63 * 3600.0)
    lost = omega**2 * 502.0
    assert ground.gravity + lost == pytest.approx((known.gravity + lost) * bulk / DENSITY, rel=1e-4)
    column = stage.ground(settings(shape="cylinder", depth=12.0))
    assert column.shape == "half_space" and column.half_width == 15.0 and column.radius == 12.0
    whole = settings(shape="whole")
    assert stage.ground(whole) is whole.target


def test_the_ground_of_the_facts_is_uniform_and_carries_its_weight(tmp_path):
    found = read(tmp_path, settings())
    ground = patch.ground_of(json.loads(json.dumps(found.facts)))
    assert ground.g == found.gravity and ground.depth == 15.0
    assert ground.pressure(np.array([-15.0, -7.5, 0.0])) == pytest.approx(
        found.density * found.gravity * np.array([15.0, 7.5, 0.0])
    )
    assert ground.density(np.array([-3.0])) == pytest.approx(DENSITY)
    with pytest.raises(InputError, match="lacks 'depth_m'"):
        patch.ground_of({key: value for key, value in found.facts.items() if key != "depth_m"})
