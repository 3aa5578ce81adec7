"""Walls of triangles: distances against exact ones, one contact where one is due, no bump on a seam, the weight of a
ball."""

import math
import time

import numpy as np
import pytest
import trimesh

from dem.contact.settings import GrainLaw
from dem.contact.walls import PLANE, Wall, distance, rows, walls_of
from matter.errors import InputError
from tests.dem.scenes import SMOOTH, assembly, grains

BOX = (6.0, 4.0, 3.0)


def box(inside: bool) -> list[Wall]:
    """A box about the origin, its facets split until none is larger than 1.5 m."""
    return walls_of(trimesh.creation.box(BOX).subdivide_to_size(1.5), flip=inside)


def contacts(table: np.ndarray, x: np.ndarray, reach: float) -> list[tuple[float, np.ndarray]]:
    """Distance and normal of every wall within reach."""
    found = [distance(row, *x) for row in table]
    return [(d, np.array(n)) for d, *n in found if d < reach]


def test_the_inside_of_a_box_is_six_planes():
    walls = box(inside=True)
    assert len(walls) == 6
    half, table, rng = 0.5 * np.array(BOX), rows(walls, 0.4), np.random.default_rng(1)
    for x in rng.uniform(-half, half, (400, 3)):
        gaps = np.concatenate([half - x, half + x])
        assert sorted(d for d, _ in contacts(table, x, 0.4)) == pytest.approx(sorted(gaps[gaps < 0.4]), rel=1e-12)


def test_the_outside_of_a_box_is_touched_once():
    """Faces, edges and corners from outside: exactly one of the six pieces answers, with the exact distance and
    direction."""
    half, table, rng = 0.5 * np.array(BOX), rows(box(inside=False), 0.5), np.random.default_rng(2)
    kinds = set()
    for x in rng.uniform(-half - 0.45, half + 0.45, (3000, 3)):
        beyond = np.maximum(np.abs(x) - half, 0.0)
        d = np.linalg.norm(beyond)
        if not 1e-9 < d < 0.45:
            continue
        kinds.add(int((beyond > 0.0).sum()))
        found = contacts(table, x, 0.45)
        assert len(found) == 1
        assert found[0][0] == pytest.approx(d, rel=1e-12)
        np.testing.assert_allclose(found[0][1], -np.sign(x) * beyond / d, atol=1e-9)
    assert kinds == {1, 2, 3}


def test_a_step_has_a_hollow_and_a_ridge():
    """Floor, riser, tread: the hollow is two faces and nothing more, the ridge one contact, whichever piece it belongs
    to."""
    profile = [(-3.0, 0.0), (0.0, 0.0), (0.0, 1.0), (3.0, 1.0)]
    points = np.array([(x, y, z) for x, z in profile for y in (-3.0, 3.0)])
    faces = [f for k in range(3) for f in ((2 * k, 2 * k + 2, 2 * k + 1), (2 * k + 1, 2 * k + 2, 2 * k + 3))]
    walls = walls_of(trimesh.Trimesh(points, faces, process=False).subdivide_to_size(0.9))
    table = rows(walls, 0.5)
    assert len(walls) == 3
    assert sorted(d for d, _ in contacts(table, np.array([-0.2, 0.1, 0.3]), 0.5)) == pytest.approx([0.2, 0.3])
    # beside the hollow the riser's lower edge is nearer than half a metre to points over the floor, but no contact of
    # its own
    assert [d for d, _ in contacts(table, np.array([-0.45, 0.1, 0.2]), 0.44)] == pytest.approx([0.2])
    for x, d in (([-0.2, 0.1, 1.3], math.hypot(0.2, 0.3)), ([0.2, 0.1, 1.3], 0.3), ([-0.2, 0.1, 0.8], 0.2)):
        assert [found for found, _ in contacts(table, np.array(x), 0.45)] == pytest.approx([d])
    # its free edge is felt from all around
    assert [d for d, _ in contacts(table, np.array([-3.1, 0.0, -0.2]), 0.45)] == pytest.approx([math.hypot(0.1, 0.2)])


def test_a_bowl_of_facets_is_a_bowl():
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=10.0)
    walls = walls_of(sphere, flip=True)
    assert len(walls) == 1 and len(walls[0].piece.facets) == 5120
    table, rng = rows(walls, 0.5), np.random.default_rng(3)
    for direction in rng.normal(size=(300, 3)):
        direction /= np.linalg.norm(direction)
        d, *normal = distance(table[0], *(9.6 * direction))
        assert d == pytest.approx(0.4, abs=0.03)  # the facets' middles lie 0.02 inside the sphere
        assert np.array(normal) @ direction > 0.998
    assert distance(table[0], 0.0, 0.0, 0.0)[0] == np.inf and distance(table[0], 0.0, 0.0, 10.4)[0] == np.inf


@pytest.mark.parametrize("where", [(0.13, 0.07), (0.0, 0.0), (0.5, 0.5)])
def test_a_ball_at_rest_presses_with_its_weight(where):
    """On a facet, on a corner of the mesh, on a seam: one contact, k_n x = m g."""
    g, k = 3.0, 1e4
    walls = walls_of(_plate(cells=6))
    ball = assembly(
        grains([*where, 0.505], 0.5, stiffness=[k]),
        SMOOTH.model_copy(update={"restitution": 0.1}),
        walls,
        (0.0, 0.0, -g),
    )
    for _ in range(4000):
        ball.step()
    assert (0.5 - ball.position[0, 2]) * k == pytest.approx(g, rel=1e-3)
    np.testing.assert_allclose(ball.position[0, :2], where, atol=1e-9)


def test_a_ball_in_the_corner_of_a_box_rests_on_three_faces():
    walls, k = box(inside=True), 1e4
    start = -0.5 * np.array(BOX) + 0.402
    ball = assembly(
        grains(start, 0.4, stiffness=[k]), SMOOTH.model_copy(update={"restitution": 0.1}), walls, (-1.0, -2.0, -3.0)
    )
    for _ in range(6000):
        ball.step()
    overlap = 0.4 - (ball.position[0] + 0.5 * np.array(BOX))
    np.testing.assert_allclose(overlap * k, [1.0, 2.0, 3.0], rtol=2e-3)


def test_a_ball_rolls_over_seams_without_a_bump():
    """The same path to rounding on a mesh of facets as on a plane: no kick, no lost spring, whatever seam or corner it
    rolls over."""
    law = GrainLaw(restitution=0.3, friction=0.5, shape=0.01)
    start = dict(radius=0.5, velocity=np.array([[1.0, 0.37, 0.0]]), stiffness=[1e5], mass=[2.0])
    balls = [
        assembly(grains([-2.5, -1.0, 0.4999], **start), law, walls, (0, 0, -5.0))
        for walls in (walls_of(_plate(cells=9)), [Wall(PLANE)])
    ]
    for _ in range(7500):
        for ball in balls:
            ball.step()
    assert balls[1].position[0, 0] > -0.5 and np.linalg.norm(balls[1].W[0, :3]) > 0.05
    np.testing.assert_allclose(balls[0].position, balls[1].position, atol=1e-7)
    np.testing.assert_allclose(balls[0].W, balls[1].W, atol=1e-5)


def test_five_thousand_facets_cost_little():
    """A bowl of 5120 facets against one plane, per evaluation: the grid leaves a few facets to look at."""
    table = rows([*walls_of(trimesh.creation.icosphere(subdivisions=4, radius=10.0), flip=True)], 0.3)
    rng = np.random.default_rng(4)
    points = rng.normal(size=(20_000, 3))
    points *= 10.0 * np.cbrt(rng.uniform(size=20_000))[:, None] / np.linalg.norm(points, axis=1)[:, None]
    lists = np.diff(table[0, int(table[0, 8]) : int(table[0, 9])])
    assert lists.max() < 60
    assert _nearest_all(table[0], points) > 0.0
    begin = time.perf_counter()
    _nearest_all(table[0], points)
    assert (time.perf_counter() - begin) / len(points) < 1e-5


def test_bad_meshes_are_refused(tmp_path):
    with pytest.raises(InputError, match="cannot read the mesh"):
        walls_of(tmp_path / "nothing.stl")
    path = tmp_path / "bowl.stl"
    trimesh.creation.icosphere(subdivisions=1).export(path)
    assert len(walls_of(path)) == 1
    with pytest.raises(InputError, match="smooth pieces"):
        walls_of(
            trimesh.util.concatenate(
                [trimesh.creation.box((1, 1, 1)).apply_translation([3 * k, 0, 0]) for k in range(9)]
            )
        )


def _plate(cells: int) -> trimesh.Trimesh:
    """A flat square of 6 m at z = 0 out of small triangles."""
    at = np.linspace(-3.0, 3.0, cells + 1)
    points = np.array([(x, y, 0.0) for x in at for y in at])
    corner = [(i * (cells + 1) + j) for i in range(cells) for j in range(cells)]
    faces = [f for c in corner for f in ((c, c + cells + 1, c + 1), (c + 1, c + cells + 1, c + cells + 2))]
    return trimesh.Trimesh(points, faces, process=False)


def _nearest_all(row: np.ndarray, points: np.ndarray) -> float:
    return _sweep(row, points)


def _compiled():
    import numba

    @numba.njit
    def sweep(row, points):
        total = 0.0
        for k in range(points.shape[0]):
            d, _, _, _ = distance(row, points[k, 0], points[k, 1], points[k, 2])
            if d < 1e9:
                total += d
        return total

    return sweep


_sweep = _compiled()
