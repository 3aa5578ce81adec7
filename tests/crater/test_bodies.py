"""Bodies whose changes are known: a hollow at three places, axes that were stretched, a turn, a spin, momenta, an
orbit."""

from __future__ import annotations

import json
import math

import h5py
import numpy as np
import pytest

from crater.bodies import body_findings, body_report, levels, measured
from crater.bodies.body_comparison import BodyComparison, Pair
from crater.bodies.body_findings import Body
from crater.bodies.mutual_orbit import Orbit
from crater.ground import datum, locate
from crater.results.measurement_config import MeasurementConfig
from fixtures import grain_bodies as bodies
from fixtures import synthetic_craters as synthetic
from matter.particles import Particles
from matter.points import packing
from matter.solids.body_shape import Shape, enclosed
from matter.solids.pose_tracker import PoseTracker
from matter.solids.tangent_map import TangentMap
from matter.wording.body_measures import PAIRS, SINGLES, TABLE

AXES = (200.0, 150.0, 110.0)
SPACING = 5.0
DENSITY = bodies.DENSITY
ORBIT = Orbit(5e11, 1200.0, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]))


def lattice(spacing: float, half: float, seed: int = 1) -> Particles:
    """Grains of a jittered lattice, wider than a body."""
    x = packing.hexagonal(spacing, half)
    x = x + 0.1 * spacing * np.random.default_rng(seed).standard_normal(x.shape)
    n = len(x)
    radius = spacing * (3.0 * bodies.PACKING / (4.0 * math.pi)) ** (1.0 / 3.0)
    fields = {
        "identity": np.arange(n), "position": x, "velocity": np.zeros_like(x), "radius": np.full(n, radius),
        "mass": np.full(n, DENSITY * spacing**3), "state": np.zeros(n),
    }  # fmt: skip
    return Particles(fields, {"packing_fraction": bodies.PACKING, "frame": "solid", "time": 0.0, "stage": "bed"})


def inside(particles: Particles, turn: np.ndarray, axes: tuple[float, float, float] = AXES) -> np.ndarray:
    return np.sum((2.0 * particles.position @ turn / axes) ** 2, axis=1) < 1.0


def a_body(shape: Shape, brought=(0.0, 0.0, -1e7), **more) -> Body:
    given = {"omega": np.zeros(3), "orbit": None, "gravity": 1e-4, "rise": 50.0}
    return Body(shape=shape, brought=np.array(brought, dtype=float), **{**given, **more})


def look_at(first: Particles, last: Particles, shape: Shape, **more) -> BodyComparison:
    return body_findings.compare_bodies(a_body(shape, **more), first, last)


@pytest.fixture(scope="module")
def even():
    """A body of grains before anything, with its shape and all of the lattice."""
    placed = bodies.placed(AXES, 30.0, 50.0)
    every = lattice(SPACING, 115.0)
    return Shape(placed, AXES), every.select(inside(every, placed.turn)), every


def test_the_ground_of_grains_is_the_shape_that_they_fill(even):
    shape, before, _ = even
    seen = look_at(before, before, shape)
    chart = seen.chart
    assert abs(np.average(chart.before, weights=chart.points.area)) < 0.05 * SPACING
    assert 0.0 < chart.noise < 0.3
    assert np.abs(chart.change).max() == 0.0 and chart.resurfaced_fraction == 0.0
    assert enclosed(chart.ground(False), chart.points.triangles) == pytest.approx(shape.solid.volume, rel=0.02)
    assert chart.points.area.sum() == pytest.approx(_surface(shape), rel=0.01)


def slow(site):
    return pytest.param(site, marks=pytest.mark.validation)


def _surface(shape: Shape) -> float:
    corner = shape.solid.vertices[shape.solid.triangles]
    return 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum()


@pytest.mark.parametrize(
    "site",
    [slow((90.0, 0.0)), slow((0.0, 0.0)), (30.0, 50.0)],
    ids=["pole", "long end", "between"],
)
def test_a_cap_that_is_cut_out_has_its_depth_and_volume_on_the_map(site):
    placed = bodies.placed(AXES, *site)
    shape, every = Shape(placed, AXES), lattice(SPACING, 115.0)
    before = every.select(inside(every, placed.turn))
    cut = bodies.Cut(placed, 50.0, 12.0)
    seen = look_at(before, before.select(~cut.inside(before.position)), shape)
    gained, error = seen.chart.gained()
    assert -gained == pytest.approx(cut.volume(), abs=2.0 * error) and error < 0.15 * cut.volume()
    lowest = measured.height_change_lowest_m(seen)
    assert -lowest.value == pytest.approx(cut.depth, abs=3.0 * lowest.sigma) and lowest.sigma < 0.1 * cut.depth
    # the ball's surface along the normal of every point
    chart = seen.chart
    towards = cut.centre - chart.points.position
    along = np.einsum("ij,ij->i", towards, -chart.points.normal)
    reach = along**2 - np.sum(towards**2, axis=1) + cut.radius**2
    floor = np.linalg.norm(chart.points.position - [0.0, 0.0, placed.height], axis=1) < 10.0
    deep = (along + np.sqrt(np.maximum(reach, 0.0)))[floor]
    mean = np.average(-chart.change[floor], weights=chart.points.area[floor])
    assert mean == pytest.approx(np.average(deep, weights=chart.points.area[floor]), abs=0.25 * SPACING)
    # no deeper than a spacing on ground that was not touched
    far = ~cut.inside(shape.surface_points(lambda x: levels.local_spacing(seen.before.cloud, x)).position)
    away = np.linalg.norm(seen.chart.points.position - cut.centre, axis=1) > cut.radius + 3.0 * SPACING
    assert np.abs(seen.chart.change[far & away]).max() < 0.05 * SPACING
    share = seen.chart.points.area[~far].sum() / seen.chart.points.area.sum()
    assert measured.resurfaced_share(seen).value == pytest.approx(share, rel=0.5)


@pytest.mark.parametrize(
    "site",
    [
        pytest.param((90.0, 0.0), id="pole", marks=pytest.mark.validation),
        pytest.param((0.0, 0.0), id="long end", marks=pytest.mark.validation),
        pytest.param((30.0, 50.0), id="between"),  # the body of the other tests: its distances are measured once
    ],
)
def test_a_crater_has_its_measures_within_their_errors_wherever_it_lies(site):
    placed, wide = bodies.placed(AXES, *site), 20.0
    shape, every = Shape(placed, AXES), lattice(4.0, 115.0)
    foot = shape.nearest_point(every.position)
    profile = synthetic.bowl(wide, 0.2, 0.04)
    away = np.linalg.norm(foot.position - [0.0, 0.0, placed.height], axis=1)
    before, after = every.select(foot.height < 0.0), every.select(foot.height < profile(away))
    ground = TangentMap(shape, PoseTracker(before))
    chosen = MeasurementConfig(datum.plane(), None, 1e-4, 50.0, 75.0, 20.0, ground=ground)
    flat = locate.ground_before(ground.flattened(before), chosen.datum, chosen.reach, chosen.sectors)
    # a body that was hit has turned and flies on
    turned = bodies.moved(after, _turn([0.3, -0.5, 0.2]), np.array([30.0, -500.0, 7.0]))
    crater = chosen.measured(turned, flat, "the body")
    known = synthetic.Shape(profile, wide, 60.0)
    for name, value in (("diameter_apparent_m", 2.0 * known.apparent), ("depth_m", known.depth)):
        found = crater[name]
        assert found.value == pytest.approx(value, abs=3.0 * found.sigma), name
        assert found.value == pytest.approx(value, rel=0.12) and found.sigma < 0.12 * value, name
    taken = (before.position.shape[0] - np.isin(before.identity, after.identity).sum()) * 4.0**3
    assert crater["volume_m3"].value == pytest.approx(taken, rel=0.15)
    seen = look_at(before, turned, shape)
    assert body_findings.classed(seen, measured.all_of(seen), crater)[0] == "crater"


def test_a_hollow_narrower_than_ten_radii_is_not_resolved(even):
    shape, before, _ = even
    cut = bodies.Cut(shape.placed, 14.0, 6.0)
    after = before.select(~cut.inside(before.position))
    ground = TangentMap(shape, PoseTracker(before))
    chosen = MeasurementConfig(datum.plane(), None, 1e-4, 50.0, 75.0, 20.0, ground=ground)
    flat = locate.ground_before(ground.flattened(before), chosen.datum, chosen.reach, chosen.sectors)
    crater = chosen.measured(after, flat, "the body")
    seen = look_at(before, after, shape)
    kind, reason = body_findings.classed(seen, measured.all_of(seen), crater)
    assert kind == "not resolved", (kind, reason)
    assert crater["diameter_apparent_m"].value is None or "radii of a grain" in reason


def _turn(vector) -> np.ndarray:
    angle = float(np.linalg.norm(vector))
    x, y, z = np.asarray(vector) / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k


def test_a_turn_and_a_shift_change_no_map(even):
    shape, before, _ = even
    cut = bodies.Cut(shape.placed, 50.0, 12.0)
    after = before.select(~cut.inside(before.position))
    one = look_at(before, after, shape)
    two = look_at(before, bodies.moved(after, _turn([2.0, 1.0, -0.7]), np.array([1e3, 2e3, -500.0])), shape)
    assert np.abs(one.chart.change - two.chart.change).max() < 1e-4 * SPACING
    assert np.array_equal(one.chart.deep > 0.0, two.chart.deep > 0.0)


def test_a_stretched_body_has_the_axes_and_the_volume_of_the_stretch(even):
    shape, before, _ = even
    factors = np.array([1.06, 1.0, 0.9])
    after = before.select(np.ones(len(before), dtype=bool))
    own = before.position @ shape.placed.turn
    after["position"] = (own * factors) @ shape.placed.turn.T
    seen = look_at(before, after, shape)
    all_of = measured.all_of(seen)
    for name, k in (("axis_a_m", 0), ("axis_b_m", 1), ("axis_c_m", 2)):
        pair = all_of[name]
        assert isinstance(pair, Pair)
        assert pair.before.value == pytest.approx(AXES[k], rel=5e-3)
        assert pair.after.value / pair.before.value == pytest.approx(factors[k], rel=3e-3)
    ratio = all_of["axis_ratio_a_over_c"]
    assert ratio.after.value / ratio.before.value == pytest.approx(1.06 / 0.9, rel=3e-3)
    volume = all_of["body_volume_m3"]
    assert volume.after.value / volume.before.value == pytest.approx(factors.prod(), rel=0.02)
    extent = all_of["extent_z_m"]
    assert extent.change.value == pytest.approx(-0.1 * AXES[2], abs=3.0 * extent.change.sigma)
    assert body_findings.classed(seen, all_of, None)[0] == "reshaped"


def test_a_body_at_rest_has_changed_nothing(even):
    shape, before, _ = even
    seen = look_at(before, before, shape)
    kind, reason = body_findings.classed(seen, measured.all_of(seen), None)
    assert kind == "no hollow" and "no axis" in reason


def test_the_rotation_is_that_of_the_angular_momentum(even):
    shape, before, _ = even
    first, rate = before.select(np.ones(len(before), dtype=bool)), 2.0 * math.pi / 4e4
    axis = shape.placed.spin_axis
    first["velocity"] = np.cross(rate * axis, first.position)
    last = bodies.moved(first, _turn([0.4, 0.1, 0.3]), np.array([100.0, 0.0, 0.0]))
    tilted = _turn([0.4, 0.1, 0.3]) @ axis
    last["velocity"] = np.cross(1.25 * rate * tilted, last.position - [100.0, 0.0, 0.0]) + [0.02, 0.0, 0.0]
    seen = look_at(first, last, shape, omega=rate * axis)
    period = measured.spin_period_s(seen)
    assert period.before.value == pytest.approx(4e4) and period.after.value == pytest.approx(4e4 / 1.25, rel=1e-9)
    assert measured.spin_axis_turned_deg(seen).value == pytest.approx(math.degrees(math.acos(tilted @ axis)), rel=1e-6)
    shift = measured.centre_of_mass_moved_m(seen)
    assert shift.value < 1e-6 * SPACING


def test_beta_of_two_groups_of_known_momenta(even):
    """A part of the body leaves: what stays has the momentum that it took, and the projectile's."""
    shape, before, _ = even
    after = before.select(np.ones(len(before), dtype=bool))
    n, up = shape.placed.normal, np.array([0.0, 0.0, 1.0])
    slow = before.position @ up > 0.85 * shape.placed.height
    after["position"] = after.position + 500.0 * slow[:, None] * up
    thrown, brought = 2.0 * up + [0.3, 0.0, 0.0], -4e7 * n + 1e7 * np.array([1.0, 0.0, 0.0])
    lost = before.mass[slow].sum() * thrown
    velocity = np.tile((brought - lost) / before.mass[~slow].sum(), (len(before), 1))
    velocity[slow] = thrown
    after["velocity"] = velocity
    seen = look_at(before, after, shape, brought=brought, orbit=ORBIT)
    assert np.array_equal(seen.after.bound, ~slow)
    assert measured.escaping_mass_kg(seen).value == pytest.approx(before.mass[slow].sum())
    assert measured.ejected_mass_kg(seen).value == pytest.approx(before.mass[slow].sum())
    stays = brought - lost
    assert measured.beta_normal(seen).value == pytest.approx(stays @ n / (brought @ n), rel=1e-9)
    flight = brought / np.linalg.norm(brought)
    assert measured.beta_flight(seen).value == pytest.approx(stays @ flight / np.linalg.norm(brought), rel=1e-9)
    assert seen.moved.vector == pytest.approx(stays / np.linalg.norm(brought), rel=1e-9)
    speed = np.linalg.norm(stays) / before.mass[~slow].sum()
    assert measured.delta_v_m_s(seen).value == pytest.approx(speed, rel=1e-9)
    assert measured.delta_v_along_track_m_s(seen).value == pytest.approx(stays[1] / before.mass[~slow].sum())
    one = float(before.mass[0]) * thrown
    error = math.sqrt(slow.sum()) * np.linalg.norm(one * n) / abs(brought @ n)
    assert measured.beta_normal(seen).sigma == pytest.approx(error, rel=1e-6)


@pytest.mark.validation
def test_flat_coordinates_keep_areas_on_a_ball():
    axes = (100.0, 100.0, 100.0)
    shape = Shape(bodies.placed(axes, 20.0, 30.0), axes)
    ground = TangentMap(shape, PoseTracker(lattice(10.0, 45.0)))
    angle = np.radians([5.0, 20.0, 45.0, 70.0])
    place = 45.0 * np.stack([np.sin(angle), np.zeros(4), np.cos(angle)], axis=1)
    flat, _ = ground.flat(place)
    assert flat[:, 2] == pytest.approx([-5.0] * 4, abs=0.02)
    assert np.hypot(flat[:, 0], flat[:, 1]) == pytest.approx(100.0 * np.sin(0.5 * angle), abs=0.08)
    assert shape.curvature(place, flat[:, 2]) == pytest.approx([0.02] * 4, rel=0.06)


def test_every_row_has_its_function_and_stands_in_words(even):
    shape, before, _ = even
    seen = look_at(before, before, shape)
    found = measured.all_of(seen)
    assert set(found) == {row.name for row in TABLE} == {*PAIRS, *SINGLES}
    for row in TABLE:
        entry = found[row.name]
        assert isinstance(entry, Pair) == row.pair, row.name
        for cell in entry if isinstance(entry, Pair) else (entry,):
            assert cell.unit == row.unit and (cell.value is not None or cell.reason), row.name


def test_the_map_is_a_surface_that_pyvista_opens(even, tmp_path):
    shape, before, _ = even
    cut = bodies.Cut(shape.placed, 50.0, 12.0)
    seen = look_at(before, before.select(~cut.inside(before.position)), shape)
    stage = body_findings.BodyStage("dem", tmp_path / "last", 60.0, seen, measured.all_of(seen), "crater", "as told")
    body_findings.write_map(stage, tmp_path / "map.vtkhdf")
    with h5py.File(tmp_path / "map.vtkhdf") as file:
        assert set(file["surface"]) == set(file["VTKHDF/PointData"]) | {"place"}
        assert file["surface/height_change"].attrs["unit"] == "m"
        latitude, longitude = (file[f"surface/{name}"][:] for name in ("latitude", "longitude"))
        lowest = int(np.argmin(file["surface/height_change"][:]))
    assert latitude[lowest] == pytest.approx(30.0, abs=8.0) and longitude[lowest] == pytest.approx(50.0, abs=8.0)
    pyvista = pytest.importorskip("pyvista")
    opened = pyvista.read(tmp_path / "map.vtkhdf")
    assert opened.n_cells == len(seen.chart.points.triangles)
    assert opened.point_data["height_change"] == pytest.approx(seen.chart.change)
    lines = body_report.body_lines(json.loads(json.dumps({"final": "dem", "dem": stage.as_dict(tmp_path)})))
    assert lines[0] == "the body: a crater (as told)" and any("longest axis" in line for line in lines)
    assert "<h2>The body</h2>" in body_report.section([stage], tmp_path)
