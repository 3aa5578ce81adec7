"""Compact ground stays compact while it moves, a curtain goes, from an asteroid's gravity to a centrifuge's."""

import numpy as np
import pytest

from fixtures import clouds
from handoff.domains import domain
from handoff.source import cavity, cloud_surface, hydrostatic
from matter.particles import Particles

R, DEPTH, SPACING, HEADROOM = 10.0, 6.0, 1.2, 4.0
GRAVITIES = {"ryugu": 1.2e-4, "moon": 1.6, "earth": 9.81, "500 g": 500 * 9.81}


def bowl(points):
    return np.minimum(DEPTH * ((np.hypot(points[:, 0], points[:, 1]) / R) ** 2 - 1.0), 0.0)


def curtain_about(radius, rng):
    """A cone of dense matter that leans outwards over the rim, three particles thick."""
    length, azimuth = np.meshgrid(
        np.arange(1.0, 9.0, SPACING), np.arange(0.0, 2.0 * np.pi, SPACING / 14.0), indexing="ij"
    )
    across = radius + 0.7 * length.ravel()[:, None] + SPACING * np.array([0.0, 1.0, 2.0])
    turn = np.repeat(azimuth.ravel(), 3)
    points = np.column_stack(
        [across.ravel() * np.cos(turn), across.ravel() * np.sin(turn), np.repeat(1.0 + length.ravel(), 3)]
    )
    return points + rng.normal(0.0, 0.05 * SPACING, points.shape)


def shot(g, share=0.05):
    """A bowl at ``share`` of the crater's own time, and the limit that its flow sets: [the source, its ground, the
    domain, the column, R / t]."""
    volume = 0.5 * np.pi * R**2 * DEPTH
    time = share * 0.8 * np.sqrt(np.cbrt(volume) / g)
    ground = clouds.flat_source(SPACING, 20.0, 12.0, bowl, lambda p: np.zeros_like(p))
    thrown = curtain_about(R, np.random.default_rng(3))
    points = np.concatenate([ground.position, thrown])
    source = clouds.source_of(points, np.full(len(points), SPACING**3), np.zeros_like(points), 1000.0)
    source.attributes["time"] = time
    return (
        source,
        np.arange(len(points)) < len(ground),
        domain.Upright("cylinder", 20.0, -12.0, HEADROOM),
        hydrostatic.uniform(g, 1000.0, 20.0),
        R / time,
    )


@pytest.mark.parametrize("g", GRAVITIES.values(), ids=GRAVITIES)
def test_ground_that_rises_at_half_the_limit_stays_and_a_curtain_goes(g):
    source, ground, region, column, flow = shot(g)
    outwards = source.position / np.linalg.norm(source.position, axis=1)[:, None]
    source["velocity"] = np.where(
        ground[:, None], [0.0, 0.0, 0.5 * flow], 1.2 * flow * (0.7 * outwards + [0.0, 0.0, 0.6])
    )
    split = cloud_surface.by_motion(source, region, column, cloud_surface.Rules())
    assert split.speed_limit == pytest.approx(flow, rel=0.1)
    assert np.mean(split.compact[ground]) > 0.995
    assert np.mean(split.compact[~ground]) < 0.005
    size = cavity.of_particles(source.position[split.compact], split.spacing[split.compact], region)
    assert size.radius == pytest.approx(R, rel=0.06) and size.depth == pytest.approx(DEPTH, abs=SPACING)


def test_under_weak_gravity_a_slow_curtain_goes_too():
    """A tenth of the limit lifts it far beyond the headroom: what is above the ground is in free flight."""
    source, ground, region, column, flow = shot(1.2e-4)
    source["velocity"] = np.tile([0.0, 0.0, 0.1 * flow], (len(source), 1))
    split = cloud_surface.by_motion(source, region, column, cloud_surface.Rules())
    assert np.all(split.reason[~ground] == cloud_surface.HIGH) and np.mean(split.compact[ground]) > 0.995
    # with a limit of the case's own the ground stays, too
    assert (
        np.mean(
            cloud_surface.by_motion(source, region, column, cloud_surface.Rules(speed_limit=0.2 * flow)).compact[
                ground
            ]
        )
        > 0.995
    )
    assert not np.any(
        cloud_surface.by_motion(source, region, column, cloud_surface.Rules(speed_limit=0.05 * flow)).compact
    )


@pytest.mark.parametrize("g", GRAVITIES.values(), ids=GRAVITIES)
def test_matter_of_the_wall_that_outruns_the_flow_goes_from_below_the_datum(g):
    source, ground, region, column, flow = shot(g)
    source["velocity"] = np.where(ground[:, None], 0.0, [0.0, 0.0, flow]) * np.ones((len(source), 3))
    lining = (
        ground
        & (source.position[:, 2] > bowl(source.position) - SPACING)
        & (np.hypot(*source.position[:, :2].T) < 0.5 * R)
    )
    source["velocity"] = np.where(lining[:, None], [0.0, 0.0, 1.5 * flow], source.velocity)
    assert np.all(
        cloud_surface.by_motion(source, region, column, cloud_surface.Rules()).reason[lining] == cloud_surface.FAST
    )


def test_late_under_strong_gravity_the_headroom_sets_the_limit():
    """A flow slower than what reaches the top of the bed stays in it; so does one whose time is not known, and the
    cones of a round body."""
    source, _, region, column, _ = shot(9.81, share=5.0)
    reaches = np.sqrt(2.0 * 9.81 * HEADROOM)
    assert cloud_surface.by_motion(source, region, column, cloud_surface.Rules()).speed_limit == pytest.approx(reaches)
    source.attributes["time"] = 0.0
    assert cloud_surface.by_motion(
        source, region, hydrostatic.uniform(1.2e-4, 1000.0, 20.0), cloud_surface.Rules()
    ).speed_limit == pytest.approx(np.sqrt(2.0 * 1.2e-4 * HEADROOM))


def test_without_a_cavity_the_spacing_takes_the_place_of_its_radius():
    source = clouds.flat_source(
        SPACING, 20.0, 12.0, lambda p: np.zeros(len(p)), lambda p: np.tile([0.0, 0.0, 0.004], (len(p), 1))
    )
    split = cloud_surface.by_motion(
        Particles(source, {**source.attributes, "time": 100.0}),
        domain.Upright("cylinder", 20.0, -12.0, HEADROOM),
        hydrostatic.uniform(1e-6, 1e3, 20.0),
        cloud_surface.Rules(),
    )
    assert split.speed_limit == pytest.approx(SPACING / 100.0, rel=1e-6) and split.compact.mean() > 0.99


def graded(radius, depth):
    """A bowl of ``radius`` in ground whose spacing grows from 9 cm at the axis to 1.6 m at 18 m, disordered."""
    rng, pieces, volumes = np.random.default_rng(7), [], []
    for inner, outer, spacing in ((0.0, 3.0, 0.15), (3.0, 7.0, 0.45), (7.0, 20.0, 1.2)):
        points = clouds.lattice((1.1 * outer, 1.1 * outer, min(6.0, 1.1 * outer)), spacing)
        points = points + rng.normal(0.0, 0.08 * spacing, points.shape)
        across = np.hypot(points[:, 0], points[:, 1])
        floor = depth * np.minimum((across / radius) ** 2 - 1.0, 0.0) if depth > 0.0 else 0.0
        points = points[(points[:, 2] < floor) & (across >= inner) & (across < outer)]
        pieces.append(points)
        volumes.append(np.full(len(points), spacing**3))
    return np.concatenate(pieces), np.cbrt(np.concatenate(volumes))


@pytest.mark.parametrize("radius, depth", [(0.75, 0.4), (1.5, 0.7), (2.5, 1.1), (9.0, 3.0)])
def test_a_small_crater_in_a_wide_bed_is_found_beside_coarse_particles(radius, depth):
    size = cavity.of_particles(*graded(radius, depth), domain.Upright("bowl", 18.0, -18.0, 4.0))
    assert size.radius == pytest.approx(radius, rel=0.1)
    assert size.depth == pytest.approx(depth, abs=0.15)


def test_level_ground_of_coarse_particles_has_no_crater():
    assert cavity.of_particles(*graded(1.0, 0.0), domain.Upright("bowl", 18.0, -18.0, 4.0)).radius == 0.0
