"""Grains of flat ground that grow outwards: sizes, numbers, and that the step in size changes nothing else."""

import numpy as np
import pytest

from dem.beds import expected_grains, extent, grading, grain_packing, stage
from matter import cadence
from matter.geometry.ground_region import Upright
from tests.dem.stops import interrupted, same_grains
from tests.dem.test_flat_bed import IMPACT, TARGET, check_at_rest, settled

SMALL = IMPACT.model_copy(update={"expected_transient_diameter": 3.0})  # fine within 2.1 m
USUAL = dict(impact=SMALL, arc_radius=5.5, depth=3.0, headroom_fraction=0.2, growth=0.1)
CONTAINERS = [Upright("cylinder", 50.0, -20.0, 4.0), Upright("bowl", 50.0, -50.0, 4.0)]


def sizes_of(attribute):
    return grading.Grading(attribute["radius_m"], attribute["fine_m"], attribute["growth"])


@pytest.fixture(scope="module")
def graded_bed(tmp_path_factory):
    return settled(tmp_path_factory.mktemp("graded"), **{**USUAL, "depth": 3.5}, count=1800)


def test_the_default_bed_reaches_three_radii_of_a_settled_crater():
    """The widest measured one, 91 m where 84 m were expected (first_crater), and sci_ryugu's 13.4 of 14.5 m."""
    for expected, came_out in ((84.0, 91.0), (14.5, 13.4)):
        impact = IMPACT.model_copy(update={"expected_transient_diameter": expected})
        ground = TARGET.model_copy(update={"width": 1e3})
        assert 3.0 <= extent.radius(ground, impact) / (0.5 * came_out) < 4.0
    ground = TARGET.model_copy(update={"shape": "half_sphere"})  # within four fifths of the ground, of 20 m
    assert extent.radius(ground, impact.model_copy(update={"expected_transient_diameter": 84.0})) == 16.0


def test_neighbours_differ_little_and_nothing_is_coarser_than_twice_the_finest():
    sizes = grading.Grading(1.0, 10.0, 0.04)
    distance = np.linspace(0.0, 100.0, 1001)
    mean = sizes.at(distance)
    assert (mean[distance <= 10.0] == 1.0).all() and mean[-1] == grading.COARSEST
    assert (sizes.at(distance + 2.0 * mean) / mean).max() == pytest.approx(1.08)


@pytest.mark.parametrize("container", CONTAINERS, ids=["cylinder", "bowl"])
def test_sizes_follow_the_profile_and_fill_every_zone_alike(container):
    impact = IMPACT.model_copy(update={"expected_transient_diameter": 25.0})  # fine within 17.9 m
    sizes, below = grading.solved(30_000, 0.15, grain_packing.FRACTION, container, impact, 0.04)
    points, radius = grain_packing.contained(30_000, 0.15, container, sizes, np.random.SeedSequence(1))
    assert (container.depth_inside(points) >= radius * (1.0 - 1e-12)).all()  # none is pushed through a wall
    over = radius / sizes.local(points)
    assert 0.845 < over.min() < 0.855 and 1.145 < over.max() < 1.155  # radii as predicted: no scale is left to find
    assert over.mean() == pytest.approx(1.0, abs=0.005)
    assert (points[:, 2] < 0.0).sum() == pytest.approx(below, rel=0.02)
    volume, distance = 4.0 / 3.0 * np.pi * radius**3, np.linalg.norm(points, axis=1)
    trial = np.random.default_rng(2).uniform(-50.0, 50.0, (400_000, 3))
    trial = trial[container.depth_inside(trial) > 0.0]
    whole = container.volume_between(container.floor, container.top)
    for low, high in ((0.0, 17.9), (17.9, 30.0), (30.0, 45.0)):
        zone = whole * np.mean((np.linalg.norm(trial, axis=1) >= low) & (np.linalg.norm(trial, axis=1) < high))
        assert volume[(distance >= low) & (distance < high)].sum() / zone == pytest.approx(
            grain_packing.FRACTION, rel=0.03
        )


def test_grains_alike_are_a_growth_of_nothing():
    container = CONTAINERS[0]
    sizes, below = grading.solved(1000, 0.0, 0.6, container, IMPACT, 0.0)
    sphere = 4.0 / 3.0 * np.pi * sizes.radius**3
    assert 1000 * sphere == pytest.approx(0.6 * container.volume_between(-20.0, 4.0))
    assert below == pytest.approx(1000 * 20.0 / 24.0)
    assert (sizes.at(np.array([0.0, 1e3])) == sizes.radius).all()


@pytest.mark.validation
def test_a_graded_bed_rests_and_packs_alike_in_both_zones(graded_bed):
    bed, report = graded_bed
    check_at_rest(report)
    sizes = sizes_of(bed.attributes["grading"])
    assert report["radius_at_edge_m"] == pytest.approx(1.3 * sizes.radius, rel=0.6)
    assert report["packing_fraction_fine"] == pytest.approx(report["packing_fraction_coarse"], abs=0.03)
    over = bed.radius / sizes.local(bed.position)  # grains hardly leave the place that they were drawn for
    assert over.mean() == pytest.approx(1.0, abs=0.02) and np.percentile(over, 99.0) < 1.35
    assert np.percentile(over, 1.0) > 0.7
    domain = bed.attributes["domain"]
    edge = sizes.at(np.array([5.5]))[0]
    assert domain["damped_width_m"] == pytest.approx(6.0 * edge)
    # the level: as much solid below the datum in the coarse ring as in the fine zone
    across, below = np.hypot(*bed.position[:, :2].T), bed.headroom == 0
    solid = [
        4.0 / 3.0 * np.pi * (bed.radius[below & (across >= a) & (across < b)] ** 3).sum() / (np.pi * (b**2 - a**2))
        for a, b in ((0.0, 2.5), (2.5, 4.8))
    ]
    assert solid[1] / solid[0] == pytest.approx(1.0, abs=0.06)


@pytest.mark.validation
def test_the_prediction_is_the_bed(graded_bed):
    bed, report = graded_bed
    settings = stage.Settings(**{**USUAL, "depth": 3.5}, target=TARGET, count=1800, packing="rcp")
    grains = expected_grains.expected(settings)
    assert grains.radius == pytest.approx(bed.attributes["grading"]["radius_m"], rel=1e-3)
    assert grains.below == pytest.approx((bed.headroom == 0).sum(), rel=0.2)
    assert grains.step == pytest.approx(report["time_step_s"], rel=0.15)
    words = " ".join(stage.explain(settings))
    assert "growing to" in words and "3.3 times that of the widest settled crater" in words


@pytest.mark.validation
def test_a_graded_bowl_stopped_on_its_way_ends_alike(tmp_path, monkeypatch):
    monkeypatch.setattr(cadence, "pace", cadence.Pace(steps=300))
    beds = []
    for name in ("whole", "resumed"):
        stops = () if name == "whole" else (2, 9)
        interrupted(
            monkeypatch,
            stops,
            lambda name=name: beds.append(
                settled(tmp_path / name, **{**USUAL, "arc_radius": 4.5, "depth": 4.5}, shape="bowl", count=400)
            ),
        )
    same_grains(beds[0][0], beds[1][0])
    check_at_rest(beds[0][1])
    assert np.ptp(beds[0][0].radius) > 0.5 * beds[0][0].radius.min()
