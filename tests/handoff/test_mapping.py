"""The pieces of the mapping against analytic values: linear fit, remap, closing field, energy limit, local sums."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from handoff.transfer import carve, compare_clouds, correction, interpolation
from handoff.transfer.mapping import Overlap, energy_fraction, locally_closed, neighbours_used


def cloud(count=3000, seed=1):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 3))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.integers(12, 40))
def test_linear_fields_come_out_exactly(seed, count):
    rng = np.random.default_rng(seed)
    points, query = cloud(seed=seed), rng.uniform(-0.95, 0.95, (50, 3))
    gradient, offset = rng.normal(size=(3, 3)), rng.normal(size=3)
    value, found = interpolation.local_linear(
        cKDTree(points), points @ gradient + offset, rng.uniform(0.5, 2.0, len(points)), query, count
    )
    np.testing.assert_allclose(value, query @ gradient + offset, atol=1e-9)
    np.testing.assert_allclose(found, np.broadcast_to(gradient, (50, 3, 3)), atol=1e-7)
    antisymmetric = 0.5 * np.array(
        [gradient[1, 2] - gradient[2, 1], gradient[2, 0] - gradient[0, 2], gradient[0, 1] - gradient[1, 0]]
    )
    np.testing.assert_allclose(interpolation.rotation_rate(found), np.tile(antisymmetric, (50, 1)), atol=1e-7)


def test_fit_converges_with_second_order():
    errors = []
    for count in (2000, 16_000, 128_000):
        points, query = cloud(count), np.random.default_rng(5).uniform(-0.7, 0.7, (400, 3))

        def field(p):
            return np.stack([np.sin(3 * p[:, 1]), np.cos(2 * p[:, 2]), np.sin(2 * p[:, 0])], axis=1)

        value, _ = interpolation.local_linear(cKDTree(points), field(points), np.ones(count), query, 20)
        errors.append(np.sqrt(np.mean((value - field(query)) ** 2)))
    assert errors[0] / errors[1] > 3.4 and errors[1] / errors[2] > 3.4  # halved spacing: a quarter of the error


def test_no_velocity_is_made_up_in_a_plane_or_beyond_the_edge():
    plane = np.column_stack([cloud()[:, :2], np.zeros(3000)])
    motion = np.column_stack([plane[:, 0], np.zeros(3000), np.zeros(3000)])
    value, gradient = interpolation.local_linear(
        cKDTree(plane), motion, np.ones(3000), np.array([[0.1, 0.2, 0.05], [0.0, 0.0, 0.5]]), 20
    )
    assert np.all(np.isfinite(value)) and np.all(np.isfinite(gradient))
    assert value[0, 0] == pytest.approx(0.1, abs=0.02)
    far, _ = interpolation.local_linear(cKDTree(cloud()), cloud(), np.ones(3000), np.array([[9.0, 0.0, 0.0]]), 20)
    assert np.linalg.norm(far) < 3.0  # limited to twice the neighbours' deviation from their mean


def test_the_remap_keeps_momentum_and_linear_fields():
    rng = np.random.default_rng(3)
    particles, grains, place = cloud(400), cloud(700, 2), cloud(60_000, 4)
    owners = cKDTree(particles).query(place)[1], cKDTree(grains).query(place)[1]
    samples = carve.Samples(place, 1.0, np.ones(len(place), dtype=bool), *owners, rng.uniform(0.1, 1.0, len(place)))
    overlap = Overlap(samples, samples.grain, particles, grains, np.arange(700))
    # any field: the matter of a grain's cell keeps its momentum
    mass, velocity = rng.uniform(1.0, 3.0, 400), rng.normal(size=(400, 3))
    lying = (mass / overlap.per_particle)[overlap.particle] * overlap.weight
    taken = np.bincount(overlap.grain, weights=lying, minlength=700)
    np.testing.assert_allclose(taken @ overlap.mean(mass, velocity[overlap.particle]), mass @ velocity, rtol=1e-12)
    # the variation inside the particles carries none
    slope = rng.normal(size=(400, 3, 3))
    inner = overlap.mean(mass, np.einsum("sa,sab->sb", overlap.arm, slope[overlap.particle]))
    np.testing.assert_allclose(taken @ inner, 0.0, atol=1e-9)
    # a linear field comes out at the centroid of each grain's cell
    gradient = rng.normal(size=(3, 3))
    centre = overlap._mean(overlap.particle, place, overlap.per_particle)
    field = (centre @ gradient)[overlap.particle] + overlap.arm @ gradient
    np.testing.assert_allclose(overlap.mean(overlap.per_particle, field), overlap.grains @ gradient, atol=1e-12)


def test_a_grain_without_a_point_of_its_own_keeps_its_mass():
    """One grain so far from every sample that it owns none (it once had no mass at all, and the collapse refused it);
    the others' masses are not changed by it."""
    particles, grains, place = cloud(400), cloud(700, 2), cloud(60_000, 4)
    grains[5] = (9.0, 9.0, 9.0)
    owners = cKDTree(particles).query(place)[1], cKDTree(grains).query(place)[1]
    samples = carve.Samples(place, 1.0, np.ones(len(place), dtype=bool), *owners, np.ones(len(place)))
    overlap = Overlap(samples, samples.grain, particles, grains, np.arange(700))
    assert overlap.per_grain[5] == 0.0
    mass, wanted = np.random.default_rng(2).uniform(1.0, 2.0, 700), np.full(400, 2.6)
    closed = locally_closed(mass, cKDTree(particles), wanted, overlap)
    assert closed[5] == mass[5] and np.all(closed > 0.0)
    assert closed.sum() - closed[5] == pytest.approx(wanted.sum(), rel=0.05)  # factors are bounded


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_closing_field_adds_exactly_what_lacks(seed):
    rng = np.random.default_rng(seed)
    mass, place = rng.uniform(0.1, 3.0, 60), rng.normal(size=(60, 3)) * [1.0, 2.0, 0.3] + rng.normal(size=3) * 10
    momentum, angular = rng.normal(size=3), rng.normal(size=3)
    change = correction.closing_field(mass, place, momentum, angular)
    np.testing.assert_allclose((mass[:, None] * change).sum(axis=0), momentum, atol=1e-10)
    np.testing.assert_allclose(np.cross(place, mass[:, None] * change).sum(axis=0), angular, atol=1e-9)


def test_sums_of_a_spinning_moving_sphere():
    sums = correction.sums(
        np.array([2.0]),
        np.array([[0.0, 3.0, 0.0]]),
        np.array([[4.0, 0.0, 0.0]]),
        np.array([0.5]),
        np.array([[0.0, 0.0, 7.0]]),
    )
    inertia = 0.4 * 2.0 * 0.25
    np.testing.assert_allclose(sums.momentum, [8.0, 0.0, 0.0])
    np.testing.assert_allclose(sums.angular, [0.0, 0.0, -24.0 + inertia * 7.0])
    assert sums.kinetic == pytest.approx(16.0 + 0.5 * inertia * 49.0)
    assert (sums + sums).mass == 4.0 and sums.angular_scale == 24.0


def test_energy_share_stops_where_the_room_ends():
    rng = np.random.default_rng(8)
    mass, velocity, step = rng.uniform(1, 2, 40), rng.normal(size=(40, 3)), rng.normal(size=(40, 3))

    def energy(part):
        return 0.5 * np.sum(mass * np.sum((velocity + part * step) ** 2, axis=1))

    for room in (0.5, 5.0):
        share = energy_fraction(mass, velocity, step, room)
        assert 0.0 < share < 1.0
        assert energy(share) - energy(0.0) == pytest.approx(room, rel=1e-9)
    assert energy_fraction(mass, velocity, step, 1e9) == 1.0
    assert energy_fraction(mass, velocity, 0.1 * velocity, -1.0) == 0.0


def test_local_sums_are_matched_smoothly():
    points = cloud(4000)
    rng = np.random.default_rng(1)
    own = rng.uniform(0.8, 1.2, 4000)
    wanted = own * (1.0 + 0.2 * points[:, 0]) * rng.uniform(0.9, 1.1, 4000)
    factor = interpolation.matching_factor(cKDTree(points), wanted, own)
    left, right = points[:, 0] < -0.5, points[:, 0] > 0.5
    for part in (left, right):
        assert (own * factor)[part].sum() == pytest.approx(wanted[part].sum(), rel=4e-3)
    assert np.std(factor / (1.0 + 0.2 * points[:, 0])) < 0.05  # far below the noise of single points
    assert interpolation.matching_factor(cKDTree(points), 3.0 * own, own) == pytest.approx(3.0)


def test_mass_curve_difference():
    mass, speed = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0, 4.0])
    assert compare_clouds.mass_curve_difference(mass, speed, mass, speed, 1.5) == 0.0
    assert compare_clouds.mass_curve_difference(mass, speed, mass[::-1], speed[::-1], 1.5) == 0.0
    assert compare_clouds.mass_curve_difference(
        mass, speed, mass, np.array([1.0, 2.0, 3.0, 2.5]), 1.5
    ) == pytest.approx(4.0 / 9.0)
    assert compare_clouds.mass_curve_difference(mass, speed, mass, speed, 9.0) == 0.0
    assert compare_clouds.mass_curve_difference(mass, speed, mass, speed * 10, 9.0) == np.inf


def test_neighbours_follow_the_resolution():
    assert neighbours_used(np.ones(5), np.ones(5)) == 20
    assert neighbours_used(np.full(5, 10.0), np.ones(5)) == 40
    assert neighbours_used(np.full(5, 1e3), np.ones(5)) == 64
