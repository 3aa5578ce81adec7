"""Frames: heights along the vertical, distances along the datum."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from matter.geometry.frame import Plane, Sphere

R = 2.142e6
angle = st.floats(1e-6, math.pi - 1e-6)
azimuth = st.floats(-math.pi + 1e-6, math.pi - 1e-6)


def place(height: float, arc: float, turn: float, centre=(0.0, 0.0, 0.0)) -> np.ndarray:
    r = R + height
    return np.array(
        [[r * math.sin(arc) * math.cos(turn), r * math.sin(arc) * math.sin(turn), r * math.cos(arc)]]
    ) + np.array(centre)


@given(st.floats(-1e6, 1e6), angle, azimuth)
def test_a_sphere_gives_back_height_arc_and_azimuth(height, arc, turn):
    centre = (1e5, -2e5, 3e5)
    sphere = Sphere(R, centre)
    point = place(height, arc, turn, centre)
    assert sphere.height(point)[0] == pytest.approx(height, abs=1e-8 * R)
    assert sphere.distance(point)[0] == pytest.approx(R * arc, rel=1e-7, abs=1e-2)
    assert abs(math.remainder(sphere.azimuth(point)[0] - turn, 2 * math.pi)) * math.sin(arc) < 1e-7
    up = sphere.up(point)[0]
    assert np.linalg.norm(up) == pytest.approx(1.0)
    assert up @ (point[0] - np.array(centre)) > 0


def test_a_plane_is_a_sphere_without_curvature():
    plane, sphere = Plane(), Sphere(1e12, (0.0, 0.0, -1e12))
    points = np.random.default_rng(3).normal(size=(20, 3)) * 100.0
    np.testing.assert_allclose(sphere.height(points), plane.height(points), atol=1e-3)
    np.testing.assert_allclose(sphere.distance(points), plane.distance(points), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(sphere.azimuth(points), plane.azimuth(points))
    np.testing.assert_allclose(sphere.up(points), plane.up(points), atol=1e-9)


def test_a_plane_may_be_shifted():
    plane = Plane(level=2.0, origin=(1.0, -1.0))
    point = np.array([[4.0, 3.0, 5.0]])
    assert plane.height(point)[0] == 3.0 and plane.distance(point)[0] == 5.0
    assert plane.azimuth(point)[0] == pytest.approx(math.atan2(4, 3))


def test_downrange_is_plus_x():
    assert Sphere(R).azimuth(np.array([[1.0, 0.0, R]]))[0] == 0.0
    assert Sphere(R).distance(np.array([[0.0, 0.0, R]]))[0] == 0.0
    assert np.isfinite(Sphere(R).up(np.zeros((1, 3)))).all()
