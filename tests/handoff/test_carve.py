import numpy as np
import pytest
from scipy.spatial import cKDTree

from fixtures import clouds
from fixtures.clouds import CAVITY
from handoff.domains import domain
from handoff.source import cloud_surface
from handoff.transfer import carve, transfer
from matter.errors import InputError
from matter.geometry.alpha_shape import alpha_shape


@pytest.fixture(scope="module")
def carved(flat_bed, ground):
    return transfer.hand_over(clouds.bowl_source(), flat_bed, cloud_surface.Rules(), ground)


def test_grains_stay_by_their_centres_and_do_not_move(flat_bed, carved):
    rho = np.hypot(flat_bed.position[:, 0], flat_bed.position[:, 1])
    outside = np.hypot(rho, flat_bed.position[:, 2])
    deep = (flat_bed.position[:, 2] < -1.5) & (outside > CAVITY + 1.5)
    empty = (flat_bed.position[:, 2] > 1.5) | (outside < CAVITY - 1.5)
    assert carved.carving.stays[deep].all()
    assert not carved.carving.stays[empty].any()
    np.testing.assert_array_equal(carved.start.position, flat_bed.position[carved.carving.stays])
    np.testing.assert_array_equal(carved.start.radius, flat_bed.radius[carved.carving.stays])
    np.testing.assert_array_equal(carved.start.identity, flat_bed.identity[carved.carving.stays])
    assert not carved.start.headroom.any()


def test_contacts_of_untouched_neighbours_keep_their_history(flat_bed, carved):
    before, after = flat_bed.tables, carved.start.tables
    kept = set(flat_bed.identity[carved.carving.stays].tolist())
    pairs = {tuple(pair): row for pair, row in zip(before["contacts/pair"].tolist(), before["contacts/history"])}
    expected = [pair for pair in pairs if pair[0] in kept and pair[1] in kept]
    assert [tuple(pair) for pair in after["contacts/pair"].tolist()] == expected
    assert 0 < len(expected) < len(pairs)
    for pair, row in zip(after["contacts/pair"].tolist(), after["contacts/history"]):
        np.testing.assert_array_equal(row, pairs[tuple(pair)])
    walls = {
        int(identity): row for (identity, _), row in zip(before["contacts/wall_pair"], before["contacts/wall_history"])
    }
    assert [int(i) for i, _ in after["contacts/wall_pair"]] == [i for i in walls if i in kept]
    for (identity, _), row in zip(after["contacts/wall_pair"], after["contacts/wall_history"]):
        np.testing.assert_array_equal(row, walls[int(identity)])


def test_volumes_of_the_grains_sum_to_the_solid(flat_bed, carved):
    samples = carved.carving.samples
    inside = samples.weight[samples.inside].sum() * samples.volume
    assert carved.carving.volume.sum() == pytest.approx(inside, rel=1e-9)
    assert (
        np.all(carved.carving.volume[carved.carving.stays] > 0.0)
        and not carved.carving.volume[~carved.carving.stays].any()
    )
    solid = 4.0 / 3.0 * np.pi * flat_bed.radius**3
    packing = solid[carved.carving.stays] / carved.carving.volume[carved.carving.stays]
    assert 0.35 < np.percentile(packing, 1) and np.percentile(packing, 99) < 0.85


def test_a_lattice_bed_recovers_its_cells():
    """Grains on a cubic lattice stand for one cell each, at the walls too."""
    n = 12
    points = np.stack(np.meshgrid(*(np.arange(n) + 0.5,) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    points -= [n / 2, n / 2, n]
    region = domain.Upright("cylinder", 4.5, -9.0, -3.0, -3.0)
    bed = clouds.bed_of(
        points,
        np.full(len(points), 0.5),
        "plane",
        {"radius_m": 4.5, "floor_m": -9.0, "datum_m": -3.0, "top_m": -3.0},
        0.52,
    )
    solid = alpha_shape(points, 1.0, 1.2).offset(0.5)
    samples = carve.even_samples(region, cKDTree(points), cKDTree(points), len(points)).within(solid)
    assert samples.inside.all()
    stays = np.ones(len(bed), dtype=bool)
    volume = carve.grain_volumes(bed, stays, carve.receivers(bed, stays, samples), samples)
    deep = (np.hypot(points[:, 0], points[:, 1]) < 2.0) & (np.abs(points[:, 2] + 6.0) < 1.5)
    assert volume[deep] == pytest.approx(1.0, rel=0.03)
    assert volume.sum() == pytest.approx(region.volume, rel=1e-9)


def test_share_of_particles_at_the_side_is_their_part_inside():
    """A lattice cut by a cylinder: the shares sum to the volume inside, a particle on the face counts half."""
    points = clouds.lattice((9.0, 9.0, 9.0), 1.0)
    region = domain.Upright("cylinder", 5.0, -5.0, 5.0)
    share, centre = cloud_surface.fraction_inside(
        points, np.ones(len(points)), region, cKDTree(points), np.arange(len(points))
    )
    assert share.sum() == pytest.approx(region.volume, rel=0.02)  # the top counts by centres
    side = np.abs(np.hypot(points[:, 0], points[:, 1]) - 5.0) < 0.05
    assert np.mean(share[side & (np.abs(points[:, 2]) < 4.0)]) == pytest.approx(0.5, abs=0.05)
    assert set(np.unique(share[region.cut_depth(points) > 1.0])) <= {0.0, 1.0}
    assert np.all(region.cut_depth(centre[share > 0.0]) > 0.0)


def test_domain_points_are_even_and_columns_cover_it():
    cone = domain.Cone(1.0, 2.0, 2.5, 0.6)
    points = cone.even_points(np.random.default_rng(1).random((200_000, 3)))
    assert np.all(cone.depth_inside(points) > 0.0)
    inner = np.linalg.norm(points, axis=1) < 1.7
    assert inner.mean() == pytest.approx((1.7**3 - 1.0) / (2.5**3 - 1.0), abs=0.005)
    assert cone.volume == pytest.approx(2 * np.pi / 3 * (1 - np.cos(0.6)) * (2.5**3 - 1.0))
    assert cone.depth_inside(
        np.array([[0.0, 0.0, 1.4], [0.0, 0.0, 2.6], [np.sin(0.7) * 2, 0.0, np.cos(0.7) * 2]])
    ) == pytest.approx([0.4, -0.1, -2.0 * np.sin(0.1)])


@pytest.mark.parametrize("shape", ["bowl", "box", "cylinder"])
def test_flat_domains_are_the_beds_own_containers(shape):
    """What the bed stage records, read here: same volume, same distances from the walls, points of even density
    inside."""
    from matter.geometry.ground_region import Upright

    bed = Upright(shape, 10.0, -10.0, 2.0)
    region = domain.read({"frame": "plane", "domain": bed.as_attribute()})
    assert region.volume == pytest.approx(bed.volume_between(-10.0, 2.0), rel=1e-12)
    points = region.even_points(np.random.default_rng(1).uniform(size=(20_000, 3)))
    np.testing.assert_allclose(region.depth_inside(points), bed.depth_inside(points), atol=1e-9)
    assert region.depth_inside(points).min() > -1e-9
    for low, high in ((-10.0, -6.0), (-4.0, 0.0)):
        share = np.mean((points[:, 2] > low) & (points[:, 2] < high))
        assert share == pytest.approx(bed.volume_between(low, high) / region.volume, abs=0.015)


def test_an_unknown_container_is_refused():
    with pytest.raises(InputError, match="unknown shape"):
        domain.read(
            {
                "frame": "plane",
                "domain": {"radius_m": 1.0, "floor_m": -1.0, "datum_m": 0.0, "top_m": 0.5, "shape": "pot"},
            }
        )


def test_points_are_split_until_every_particle_owns_some():
    """Particles a tenth as wide as elsewhere: before, most of them own no point, and would hand their momentum to no
    grain."""
    rng = np.random.default_rng(5)
    region = domain.Upright("cylinder", 4.5, -9.0, 0.0)
    coarse = rng.uniform([-4.5, -4.5, -9.0], [4.5, 4.5, 0.0], (4000, 3))
    coarse = coarse[np.linalg.norm(coarse, axis=1) > 0.8]
    small = rng.uniform([-0.8, -0.8, -0.8], [0.8, 0.8, 0.0], (12_000, 3))
    small = small[np.linalg.norm(small, axis=1) <= 0.8]
    particles = np.r_[coarse, small]
    volume = np.r_[np.full(len(coarse), 729.0 / 4000.0), np.full(len(small), 2.0 / 3.0 * np.pi * 0.8**3 / len(small))]
    tree = cKDTree(particles)
    before = carve.even_samples(region, tree, tree, tree.n)
    after = carve.finer(before, region, tree, tree, volume)
    fine = np.arange(len(coarse), len(particles))
    unowned = [np.isin(fine, samples.particle, invert=True).mean() for samples in (before, after)]
    assert unowned[0] > 0.5 and unowned[1] < 0.03
    assert after.weight.sum() == pytest.approx(len(before.position), rel=1e-12)
    assert (region.depth_inside(after.position) > 0.0).all()
    # what the fine region takes of the volume stays what it was, and coarse particles alone change nothing
    share = [
        samples.weight[np.isin(samples.particle, fine)].sum() / len(before.position) for samples in (before, after)
    ]
    assert share[1] == pytest.approx(share[0], rel=0.02)
    assert carve.finer(before, region, tree, tree, np.full(len(particles), 729.0 / 4000.0)) is before
