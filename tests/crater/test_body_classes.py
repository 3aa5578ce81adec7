"""Classes of what an impact left of a body, on bodies whose answer is known: bowls from narrow to wider than the body,
axes that were changed, grains that shake in their places."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from crater.bodies import body_findings, classes, hollow, measured
from crater.bodies.body_comparison import BodyComparison
from crater.bodies.body_findings import Body
from crater.bodies.height_map import HeightMap
from crater.ground import datum, locate
from crater.measures.measure import Measures
from crater.results.measurement_config import MeasurementConfig
from fixtures import grain_bodies as bodies
from fixtures import solids
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.particles import Particles
from matter.points import packing
from matter.solids.body_shape import Shape, spread
from matter.solids.pose_tracker import PoseTracker
from matter.solids.tangent_map import TangentMap

AXES = (200.0, 150.0, 110.0)
SPACING = 8.0


def grains(seed: int = 1) -> Particles:
    """Grains of a shaken lattice, wider than the body."""
    x = packing.hexagonal(SPACING, 120.0)
    x = x + 0.1 * SPACING * np.random.default_rng(seed).standard_normal(x.shape)
    return bodies.even(x, SPACING**3)


def at(latitude: float, longitude: float) -> tuple[Shape, Particles, Particles]:
    """The body about a site [deg], its grains, and all of the lattice."""
    shape, every = Shape(bodies.placed(AXES, latitude, longitude), AXES), grains()
    return shape, every.select(shape.datum.height(every.position) < 0.0), every


@pytest.fixture(scope="module")
def body():
    return at(30.0, 50.0)


def class_of(shape: Shape, before: Particles, after: Particles, size: float = 40.0) -> tuple[str, str]:
    """Class and reason as the stage finds them, of a case that expects a transient crater of this ``size`` [m]."""
    ground = TangentMap(shape, PoseTracker(before))
    chosen = MeasurementConfig(datum.plane(), None, 1e-4, 50.0, 2.5 * size, 0.5 * size, ground=ground)
    flat = locate.ground_before(ground.flattened(before), chosen.datum, chosen.reach, chosen.sectors)
    crater: Measures | None = None
    try:
        crater = chosen.measured(after, flat, "the body")
    except InputError:  # the stage goes on without it
        pass
    hit = Body(shape, np.zeros(3), None, 1e-4, 50.0, np.array([0.0, 0.0, -1e7]))
    seen: BodyComparison = body_findings.compare_bodies(hit, before, after)
    return classes.classed(seen, measured.all_of(seen), crater)


def with_bowl(shape: Shape, every: Particles, radius: float, depth: float) -> Particles:
    """The body with a bowl of this rim ``radius`` and ``depth`` [m] over the chord from the site."""
    foot = shape.nearest_point(every.position)
    away = np.linalg.norm(foot.position - [0.0, 0.0, shape.placed.height], axis=1)
    return every.select(foot.height < synthetic.bowl(radius, 0.5 * depth / radius, 0.02)(away))


def shaken(before: Particles, by: float) -> Particles:
    after = before.select(np.ones(len(before), dtype=bool))
    after["position"] = before.position + by * SPACING * np.random.default_rng(3).standard_normal((len(before), 3))
    return after


def stretched(shape: Shape, before: Particles, factors: tuple[float, float, float]) -> Particles:
    after = before.select(np.ones(len(before), dtype=bool))
    after["position"] = (before.position @ shape.placed.turn * factors) @ shape.placed.turn.T
    return after


@pytest.mark.validation
def test_a_bowl_is_a_crater(body):
    shape, before, every = body
    kind, reason = class_of(shape, before, with_bowl(shape, every, 35.0, 14.0))
    assert kind == "crater" and "radii of a grain" in reason, reason


def test_a_bowl_narrower_than_ten_radii_is_not_resolved(body):
    shape, before, every = body
    kind, reason = class_of(shape, before, with_bowl(shape, every, 14.0, 12.0))
    assert kind == "not resolved", (kind, reason)


@pytest.mark.parametrize("radius,depth", [(66.0, 14.0), (75.0, 30.0), (90.0, 36.0), (110.0, 22.0)])
def test_a_bowl_as_wide_as_the_body_is_another_shape(body, radius, depth):
    """What is laid flat ends within the last three: they read as hollows of 108, 64 and 113 m."""
    shape, before, every = body
    kind, reason = class_of(shape, before, with_bowl(shape, every, radius, depth))
    assert kind == "reshaped" and "the widest crater takes 15%" in reason, (kind, reason)


@pytest.mark.validation
@pytest.mark.parametrize("site", [(30.0, 50.0), (90.0, 0.0)], ids=["between", "pole"])
def test_other_axes_are_another_shape_wherever_the_site_is(site):
    """At the pole the ground sinks by a tenth of the radius: no hollow of a crater."""
    shape, before, _ = at(*site)
    kind, reason = class_of(shape, before, stretched(shape, before, (1.1, 1.02, 0.86)))
    assert kind == "reshaped", (kind, reason)


def test_a_small_change_of_the_axes_is_one_too(body):
    shape, before, _ = body
    kind, reason = class_of(shape, before, stretched(shape, before, (1.02, 1.0, 0.97)))
    assert kind == "reshaped" and "shortest axis" in reason, (kind, reason)


@pytest.mark.parametrize("by", [0.1, 0.2, 0.3])
def test_grains_that_shake_in_their_places_leave_no_hollow(body, by):
    shape, before, _ = body
    kind, reason = class_of(shape, before, shaken(before, by))
    assert kind == "no hollow" and "noise" in reason, (kind, reason)


def on_a_ball(change_of, noise: float = 1e-3) -> HeightMap:
    """A map of a ball of radius 1 whose change is a function of the cosine of the distance from the site."""
    known = solids.ball(1.0, 5)
    points = spread(known.vertices, known.triangles)
    change, zero = change_of(points.position[:, 2]), np.zeros(len(points.position))
    return HeightMap(points, np.full(len(zero), 0.05), zero, change, noise, zero)


@pytest.mark.parametrize("angle", [20.0, 45.0, 80.0])
def test_changed_and_spread_are_those_of_a_cap_and_of_a_bowl(angle):
    edge = math.cos(math.radians(angle))
    share = 0.5 * (1.0 - edge)
    even = classes.extent_of(on_a_ball(lambda cos: np.where(cos > edge, -0.1, 0.0)))
    assert even.changed == pytest.approx(share, rel=0.05) and even.spread == pytest.approx(share, rel=0.05)
    # a paraboloid in the chord: dh ~ 1 - (1 - cos) / (1 - edge)
    bowl = classes.extent_of(on_a_ball(lambda cos: -0.1 * np.maximum(1.0 - (1.0 - cos) / (1.0 - edge), 0.0)))
    assert bowl.spread == pytest.approx(0.75 * share, rel=0.03)
    assert bowl.changed == pytest.approx(share, rel=0.05)


def test_a_change_of_degree_two_is_spread_over_three_quarters():
    # <|P2|>^2 / <P2^2> = 5 (2 / (3 sqrt 3))^2 = 20 / 27
    found = classes.extent_of(on_a_ball(lambda cos: 0.1 * (1.5 * cos**2 - 0.5), 1e-6))
    assert found.spread == pytest.approx(20.0 / 27.0, rel=0.01) and found.changed > 0.99


def test_what_stays_below_three_errors_does_not_count():
    found = classes.extent_of(on_a_ball(lambda cos: np.where(cos > 0.9, 0.1, 0.02), noise=0.1))
    # e = sqrt(2) 0.1 0.05 = 0.0071: 0.02 is 2.8 e
    assert found.changed == pytest.approx(0.05, rel=0.1) and found.spread == pytest.approx(found.changed)
    assert classes.extent_of(on_a_ball(lambda cos: 0.0 * cos)) == (0.0, 0.0)


def test_the_share_of_a_hollow_is_that_of_a_cap():
    chart = on_a_ball(lambda cos: 0.0 * cos)
    # twice the chord from pole to rim: areas are kept
    angle = math.radians(45.0)
    share = classes.area_fraction(4.0 * math.sin(0.5 * angle), chart)
    assert share == pytest.approx(0.5 * (1.0 - math.cos(angle)), rel=2e-3)
    assert share == pytest.approx(classes.LOCAL, rel=2e-3)
    assert classes.half_angle(0.5 * (1.0 - math.cos(angle))) == pytest.approx(45.0)


@pytest.mark.parametrize("angle", [20.0, 45.0, 80.0, 130.0])
def test_a_hollow_is_as_wide_as_its_area_however_far_it_reaches(angle):
    """A paraboloid round the site, a deep hole on the other side that does not hang together with it, and noise."""
    edge = math.cos(math.radians(angle))
    noise = np.random.default_rng(1)

    def change(cos):
        bowl = -0.3 * np.maximum(1.0 - (1.0 - cos) / (1.0 - edge), 0.0)
        return bowl + np.where(cos < -0.95, -0.2, 0.0) + noise.normal(0.0, 0.003, len(cos))

    found = hollow.across(on_a_ball(change))
    wide = 2.0 * math.sqrt(2.0 * (1.0 - edge))
    assert found.value == pytest.approx(wide, rel=0.02) and abs(found.value - wide) < found.sigma < 0.2 * wide


def test_a_change_below_two_spacings_is_no_hollow():
    found = hollow.across(on_a_ball(lambda cos: np.where(cos > 0.9, -0.09, 0.0)))
    assert found.value is None and "two spacings" in found.reason


def test_ejecta_are_no_measure_of_the_grains():
    # 200 grains of 2 m and ten times as many fine ejecta in flight
    radius = np.concatenate([np.full(200, 2.0), np.full(2000, 0.1)])
    look = SimpleNamespace(particles=Particles({"radius": radius}, {}), body=np.arange(2200) < 200)
    assert classes.grain_radius(SimpleNamespace(after=look), None, 40.0) == pytest.approx(2.0)
