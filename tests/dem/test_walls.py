"""Walls: distances, normals, and the step of water that runs out flat."""

import math

import numpy as np
import pytest

from dem.beds.relaxation import Fire
from dem.contact.settings import OCEAN
from dem.contact.walls import CONE, PLANE, SPHERE_INSIDE, SPHERE_OUTSIDE, Wall, cylinder, distance
from matter.errors import InputError
from studies.granular.bulk_flows import funnel
from tests.dem.scenes import SMOOTH, assembly, grains

ANGLE = 0.6
SHAPES = (
    (
        Wall(PLANE, point=(1.0, 0.0, -2.0), direction=(1.0, 2.0, 2.0)),
        lambda x: (x - [1.0, 0.0, -2.0]) @ np.array([1.0, 2.0, 2.0]) / 3.0,
    ),
    (Wall(SPHERE_OUTSIDE, radius=2.0), lambda x: np.linalg.norm(x) - 2.0),
    (Wall(SPHERE_INSIDE, radius=9.0), lambda x: 9.0 - np.linalg.norm(x)),
    (
        Wall(CONE, half_angle=ANGLE),
        lambda x: np.linalg.norm(x) * math.sin(ANGLE - math.acos(x[2] / np.linalg.norm(x))),
    ),
    (cylinder(5.0), lambda x: 5.0 - math.hypot(x[0], x[1])),
    (cylinder(5.0, -1.0, 6.0, point=(0.0, 0.0, 1.0)), lambda x: 5.0 - math.hypot(x[0], x[1])),
    (cylinder(0.5, 0.0, 9.0, outside=True), lambda x: math.hypot(x[0], x[1]) - 0.5),
    (cylinder(7.0, axis=(0.0, 1.0, 1.0)), lambda x: 7.0 - math.sqrt(x[0] ** 2 + 0.5 * (x[1] - x[2]) ** 2)),
    (
        cylinder(5.0, 0.0, 3.5),
        lambda x: math.hypot(5.0 - math.hypot(x[0], x[1]), x[2] - 3.5),
    ),  # beyond the end: its rim
    (funnel((1.0, 0.0), (5.0, 4.0)), lambda x: (x[2] + 1.0 - math.hypot(x[0], x[1])) / math.sqrt(2.0)),
    (funnel((3.0, 0.0), (0.0, 3.0), outside=True), lambda x: (x[2] - 3.0 + math.hypot(x[0], x[1])) / math.sqrt(2.0)),
    (funnel((0.5, 2.0), (5.0, 2.0)), lambda x: x[2] - 2.0),
    (
        funnel((2.0, 2.0), (5.0, 2.0)),
        lambda x: math.hypot(2.0 - math.hypot(x[0], x[1]), x[2] - 2.0),
    ),  # over the hole: its edge
)


@pytest.mark.parametrize("wall, exact", SHAPES)
def test_distance_and_normal(wall, exact):
    x = np.array([0.9, 0.7, 4.0])
    d, *normal = distance(wall.row(), *x)
    assert d == pytest.approx(exact(x), rel=1e-12)
    assert np.linalg.norm(normal) == pytest.approx(1.0, rel=1e-12)
    # moving towards the wall by s shortens the distance by s
    assert exact(x + 1e-6 * np.array(normal)) == pytest.approx(d - 1e-6, abs=1e-11)


@pytest.mark.parametrize("wall, exact", SHAPES)
def test_a_ball_at_rest_presses_with_its_weight(wall, exact):
    """Let go a hundredth of its radius from the wall, with gravity towards it, a ball comes to rest at k_n x = m g."""
    x, radius, g, k = np.array([0.9, 0.7, 4.0]), 0.2, 3.0, 1e4
    d, *normal = distance(wall.row(), *x)
    x = x + (d - 1.01 * radius) * np.array(normal)
    ball = assembly(
        grains(x, radius, stiffness=[k]), SMOOTH.model_copy(update={"restitution": 0.1}), [wall], g * np.array(normal)
    )
    for _ in range(6000):
        ball.step()
    assert (radius - exact(ball.position[0])) * k == pytest.approx(g, rel=1e-3)
    assert ball.speed < 1e-4 and ball.energies()["elastic_J"] == pytest.approx(0.5 * g * g / k, rel=2e-3)


def test_walls_of_revolution_end_where_they_say():
    tube = cylinder(5.0, 0.0, 3.0, rims=(False, True)).row()
    assert distance(tube, 4.9, 0.0, -0.1)[0] == np.inf  # joined there
    assert distance(tube, 5.3, 0.0, 3.4)[0] == pytest.approx(0.5)  # its rim, from above
    assert distance(tube, 5.1, 0.0, 2.0)[0] == np.inf  # behind it
    assert distance(tube, 0.0, 0.0, 1.0)[0] == pytest.approx(5.0)
    with pytest.raises(InputError, match="bottom below top"):
        cylinder(1.0, 2.0, 1.0)
    with pytest.raises(InputError, match="two different ends"):
        funnel((1.0, 1.0), (1.0, 1.0)).row()


def test_the_cone_is_open_above_its_top_and_outside():
    row = Wall(CONE, half_angle=ANGLE, top=5.0).row()
    edge = np.array([math.sin(ANGLE - 0.01), 0.0, math.cos(ANGLE - 0.01)])
    assert distance(row, *(4.0 * edge))[0] < 0.1
    assert distance(row, *(6.0 * edge))[0] == np.inf
    outside = np.array([math.sin(ANGLE + 0.01), 0.0, math.cos(ANGLE + 0.01)])
    assert distance(row, *(4.0 * outside))[0] == np.inf


def test_the_cone_carries_no_weight():
    # with gravity towards the apex its push has no radial part
    row = Wall(CONE, half_angle=ANGLE).row()
    azimuth = 1.1
    x = (
        3.0
        * np.array([math.sin(ANGLE) * math.cos(azimuth), math.sin(ANGLE) * math.sin(azimuth), math.cos(ANGLE)])
        * 0.999999
    )
    x[2] += 1e-6
    _, *normal = distance(row, *x)
    assert abs(np.array(normal) @ x) < 1e-5


@pytest.mark.validation
def test_a_step_of_water_runs_out_flat():
    """Eight radii of ocean grains let go in a box: the slope that stays is below 7 degrees."""
    length, width, depth = 44.0, 10.0, 14.0
    rng = np.random.default_rng(5)
    n = int(0.64 * length * width * depth / (4 / 3 * math.pi))
    radius = rng.uniform(0.85, 1.15, n)
    points = rng.uniform(1.0, np.array([length, width, depth * 1.15]) - 1.0, (n, 3))
    walls = [
        Wall(PLANE), Wall(PLANE, direction=(1, 0, 0)), Wall(PLANE, point=(length, 0, 0), direction=(-1, 0, 0)),
        Wall(PLANE, direction=(0, 1, 0)), Wall(PLANE, point=(0, width, 0), direction=(0, -1, 0)),
    ]  # fmt: skip
    mass, stiffness = radius**3, 200.0 * radius
    scene = grains(points, radius, mass=mass, stiffness=stiffness, species=np.ones(n))
    packed = assembly(
        scene, SMOOTH, walls, (0, 0, -1.0), ocean=OCEAN.model_copy(update={"restitution": 0.5}), overlap_stop=1.99
    )
    packed.overlap_limit = np.inf
    fire = Fire(packed)
    for _ in range(700):
        fire.step()
    level = np.percentile(packed.position[:, 2], 99.0)
    packed = packed.particles({}, tables=False)
    packed["velocity"] = np.zeros((n, 3))
    step = packed.select((packed.position[:, 0] < 0.5 * length) | (packed.position[:, 2] < level - 8.0))
    water = assembly(step, None, walls, (0, 0, -1.0))
    start = surface_slope(water, length)
    for _ in range(int(70.0 / water.dt)):
        water.step()
    assert start > 12.0
    assert surface_slope(water, length) < 7.0


def surface_slope(bed, length: float) -> float:
    """Slope [deg] of a straight line through the highest grains of columns along x."""
    x, z = bed.position[:, 0], bed.position[:, 2] + bed.X[:, 3]
    column = np.minimum((x / 2.0).astype(int), int(length / 2.0) - 1)
    top = np.array([z[column == c].max() for c in np.unique(column)])
    centre = 2.0 * np.unique(column) + 1.0
    return abs(math.degrees(math.atan(np.polyfit(centre, top, 1)[0])))
