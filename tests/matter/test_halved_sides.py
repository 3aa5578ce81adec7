"""Triangles whose sides are halved: closed as before, facing as before, every corner of one a corner of its
neighbours."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from fixtures import grain_bodies as bodies
from matter.solids import halved_sides
from matter.solids.body_shape import Shape, enclosed

AXES = (200.0, 150.0, 110.0)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.6, 1.0])
def test_a_closed_surface_stays_closed_and_keeps_area_and_volume(share):
    box = trimesh.creation.box((3.0, 2.0, 1.0)).subdivide()
    vertices, triangles = np.asarray(box.vertices), np.asarray(box.faces)
    rng = np.random.default_rng(4)
    for _ in range(3):
        known = halved_sides.sides(triangles)
        assert len(vertices) - len(known.ends) + len(triangles) == 2  # Euler
        cut = rng.random(len(known.ends)) < share
        before = len(vertices)
        vertices, triangles = halved_sides.halved(vertices, triangles, known, cut)
        assert len(vertices) == before + cut.sum()
    finer = trimesh.Trimesh(vertices, triangles, process=False)
    assert finer.is_watertight and finer.is_winding_consistent
    assert finer.volume == pytest.approx(6.0, rel=1e-12) and finer.area == pytest.approx(22.0, rel=1e-12)
    assert finer.area_faces.min() > 0.0


def test_points_of_a_body_lie_as_close_as_asked_and_without_gaps():
    """Fine on one side of the body, coarse on the other: no corner lies on a side of a neighbour."""
    shape = Shape(bodies.placed(AXES, 30.0, 50.0), AXES)

    def spacing(place):
        return np.where(place[:, 2] > 0.0, 4.0, 16.0)

    points = shape.surface_points(spacing)
    surface = trimesh.Trimesh(points.position, points.triangles, process=False)
    assert surface.is_watertight and surface.is_winding_consistent
    ends = points.position[surface.edges_unique]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert (length <= 1.001 * spacing(ends.mean(axis=1))).all()
    exact = np.pi / 6.0 * np.prod(AXES)
    assert enclosed(points.position, points.triangles) == pytest.approx(exact, rel=5e-3)
    assert points.area.sum() == pytest.approx(surface.area, rel=1e-12)
