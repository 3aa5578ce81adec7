"""``[target] arrival``: a direction of flight in the body's frame makes the site's angles, and back."""

import math
from pathlib import Path

import numpy as np
import pytest

from matter.errors import InputError
from matter.solids.distance import measured
from pipeline.case import read
from pipeline.settings.compose import compose
from sph.bodies import solid_target

CASE = """
[case]
stages = ["sph"]
[target]
shape = "ellipsoid"
axes = ["177 m", "174 m", "116 m"]
SITE
[[target.layers]]
material = "basalt"
[impact]
speed = "6 km/s"
expected_transient_diameter = "20 m"
[impact.projectile]
material = "aluminum"
radius = "1 m"
"""


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Depths of the body on a coarse grid: only the number of particles goes by them."""
    monkeypatch.setattr(solid_target, "_distance", lambda solid, height: measured(solid, 16))


def settings(folder: Path, site: str, *sets: str):
    (folder / "case.toml").write_text(CASE.replace("SITE", site))
    return compose(read.read(folder, None, sets))["sph"]


@pytest.mark.parametrize("site", ["", 'latitude = "-8.84 deg"\nlongitude = "264.3 deg"'], ids=["centre", "site"])
@pytest.mark.parametrize("flight", [(0.5, 3.0, -1.0)])
def test_the_projectile_flies_where_the_arrival_says(tmp_path, site, flight):
    found = settings(tmp_path, f"arrival = {list(flight)}\n{site}")
    body, velocity = found.target.placed, np.array(found.target.aim(found.impact))
    own = body.turn.T @ velocity / np.linalg.norm(velocity)
    assert own == pytest.approx(np.array(flight) / np.linalg.norm(flight), abs=1e-9)
    if site:
        assert math.degrees(found.target.latitude) == pytest.approx(-8.84)
    else:  # the line leads through the centre of mass
        assert body.turn.T @ [0.0, 0.0, -1.0] == pytest.approx(own, abs=1e-9)
        assert found.impact.angle_from_vertical > math.radians(3.0)  # an ellipsoid's normal leans


def test_straight_down_onto_a_pole_of_the_body(tmp_path):
    found = settings(tmp_path, "arrival = [0.0, 0.0, -1.0]")
    assert math.degrees(found.target.latitude) == pytest.approx(90.0)
    assert found.impact.angle_from_vertical < math.radians(3.0)  # facets of the surface


def test_what_was_filled_in_may_stand_beside_it(tmp_path):
    first = read.read(_written(tmp_path, "arrival = [0.2, 0.9, 0.2]"))
    target, impact = first.document["target"], first.document["impact"]
    site = "\n".join(
        [f'{key} = "{target[key]}"' for key in ("latitude", "longitude", "azimuth")] + ["arrival = [0.2, 0.9, 0.2]"]
    )
    again = settings(tmp_path, site, f'impact.angle_from_vertical="{impact["angle_from_vertical"]}"')
    assert again.target.azimuth == pytest.approx(compose(first)["sph"].target.azimuth, rel=1e-12)


def _written(folder: Path, site: str) -> Path:
    (folder / "case.toml").write_text(CASE.replace("SITE", site))
    return folder


@pytest.mark.parametrize(
    "site,complaint",
    [
        (
            'arrival = [0.2, 0.9, 0.2]\nazimuth = "10 deg"',
            "azimuth: .* follows from .target. arrival: leave one of them out",
        ),
        ('arrival = [0.2, 0.9, 0.2]\nlatitude = "10 deg"', "latitude: with an arrival give both"),
        (
            'arrival = [0.2, -0.9, 0.2]\nlatitude = "0 deg"\nlongitude = "264 deg"',
            "arrival: .* the surface looks away",
        ),
        ("arrival = [0.0, 0.0, 0.0]", "arrival: .0, 0, 0. is no direction"),
        ("arrival = [0.0, 1.0]", "arrival"),
    ],
)
def test_what_cannot_be_is_said(tmp_path, site, complaint):
    with pytest.raises(InputError, match=complaint):
        settings(tmp_path, site)


def test_a_sphere_has_none(tmp_path):
    sphere = CASE.replace('shape = "ellipsoid"\naxes = ["177 m", "174 m", "116 m"]', "").replace(
        'material = "basalt"', 'material = "basalt"\nthickness = "80 m"'
    )
    (tmp_path / "case.toml").write_text(sphere.replace("SITE", "arrival = [0.2, 0.9, 0.2]"))
    with pytest.raises(InputError, match="arrival: of an ellipsoid or mesh only"):
        compose(read.read(tmp_path, None, ('impact.angle_from_vertical="17 deg"',)))
