"""Attraction of a solid at a place: closed forms of a ball and a spheroid, and another program's polyhedron."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fixtures import solids
from matter.constants import G
from matter.solids import attraction, solid


@pytest.mark.parametrize("place", [(0.0, 0.0, 448.0), (0.0, 0.0, 600.0), (0.0, 0.0, 200.0), (300.0, -100.0, 50.0)])
def test_a_ball_attracts_as_its_mass_at_the_centre_and_inside_as_what_is_below(place):
    x = np.array(place)
    r = float(np.linalg.norm(x))
    known = -4.0 / 3.0 * math.pi * G * x * min(1.0, (448.0 / r) ** 3)
    assert attraction.attraction_at(solid.ellipsoid((896.0, 896.0, 896.0)), x) == pytest.approx(
        known, abs=1e-4 * abs(known).max()
    )


def test_a_spheroid_attracts_at_pole_and_equator_as_its_closed_form():
    """g = 2 pi G rho A z with A of Binney & Tremaine 2008, Table 2.1 (oblate, e the eccentricity)."""
    a, c = 502.0, 438.0
    e = math.sqrt(1.0 - (c / a) ** 2)
    polar = 2.0 / e**2 * (1.0 - math.sqrt(1.0 - e**2) * math.asin(e) / e)
    body = solid.ellipsoid((2.0 * a, 2.0 * a, 2.0 * c))
    down = -attraction.attraction_at(body, np.array([0.0, 0.0, c]))[2]
    assert down == pytest.approx(2.0 * math.pi * G * polar * c, rel=2e-4)
    inwards = -attraction.attraction_at(body, np.array([a, 0.0, 0.0]))[0]
    assert inwards == pytest.approx(2.0 * math.pi * G * 0.5 * (2.0 - polar) * a, rel=2e-4)


def test_on_corners_edges_and_faces_it_is_that_beside_them():
    known = solids.box((1.0, 2.0, 4.0))
    body = solid.checked(known.vertices, known.triangles, 1.0, "box")
    corner = body.vertices[body.triangles[0]]
    for place in (corner[0], 0.5 * (corner[0] + corner[1]), corner.mean(axis=0)):
        beside = attraction.attraction_at(body, place * (1.0 + 1e-7))
        assert attraction.attraction_at(body, place) == pytest.approx(beside, abs=1e-4 * np.linalg.norm(beside))


def test_it_is_that_of_another_program():
    polyhedral = pytest.importorskip("polyhedral_gravity", reason="extra test: polyhedral-gravity")
    known = solids.dumbbell(80.0, 150.0, 40.0, rings=30, around=20)
    body = solid.checked(known.vertices, known.triangles, 1.0, "dumbbell")
    theirs = polyhedral.Polyhedron(
        polyhedral_source=(body.vertices, body.triangles),
        density=1.0,
        normal_orientation=polyhedral.NormalOrientation.OUTWARDS,
        integrity_check=polyhedral.PolyhedronIntegrity.DISABLE,
    )
    for place in np.random.default_rng(3).uniform(-200.0, 200.0, (12, 3)):
        found, other = attraction.attraction_at(body, place), np.array(polyhedral.evaluate(theirs, place)[1])
        assert np.abs(found - np.sign(found @ other) * other).max() < 1e-9 * np.linalg.norm(other)
        assert found @ place < 0.0
