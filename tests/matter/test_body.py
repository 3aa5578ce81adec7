"""Target and impact: radii, velocities, and what is refused."""

from __future__ import annotations

import math

import pytest
from pydantic import ValidationError

from matter.case.body import Impact, Layer, Projectile, Target

BALL = {"material": "ice", "radius": 53.9e3}


def test_the_published_body():
    layers = [("core", "basalt", 1842e3), ("ocean", "water", 150e3), ("shell", "ice", 150e3)]
    target = Target(
        layers=[Layer(name=name, material=material, thickness=thickness) for name, material, thickness in layers]
    )
    assert target.radius == 2142e3 and target.outer_radii == (1842e3, 1992e3, 2142e3)
    assert target.materials == ("basalt", "water", "ice")


def test_a_projectile_flies_down_and_towards_plus_x():
    impact = Impact(
        speed=18234.0, angle_from_vertical=math.radians(40), projectile=BALL, expected_transient_diameter=980e3
    )
    vx, vy, vz = impact.velocity
    assert vy == 0 and vx > 0 > vz
    assert math.hypot(vx, vz) == pytest.approx(18234.0) and math.degrees(math.atan2(vx, -vz)) == pytest.approx(40.0)
    assert Impact(**{**impact.model_dump(), "angle_from_vertical": 0.0}).velocity == (0.0, 0.0, -18234.0)


def test_the_published_energy():
    """Winter 2017: r = 53.9 km of ice (917 kg/m^3) at 18.234 km/s are 1.00e26 J."""
    assert 0.5 * 917 * Projectile(**BALL).volume * 18234.0**2 == pytest.approx(1.00e26, rel=5e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"angle_from_vertical": math.radians(90)}, "must be at least 0 and less than 90 deg"),
        ({"angle_from_vertical": -0.1}, "must be at least 0 and less than 90 deg"),
        ({"speed": 0.0}, "greater than 0"),
        ({"projectile": {"material": "icee", "radius": 1.0}}, "did you mean 'ice'"),
        ({"colour": "white"}, "Extra inputs"),
    ],
)
def test_what_is_refused(change, words):
    content = {"speed": 1.0, "angle_from_vertical": 0.1, "projectile": BALL, "expected_transient_diameter": 1.0}
    with pytest.raises(ValidationError, match=words):
        Impact(**{**content, **change})
    with pytest.raises(ValidationError):
        Target(layers=[])
