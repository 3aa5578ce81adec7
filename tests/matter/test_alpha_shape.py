import numpy as np
import pytest

from matter.errors import InputError
from matter.geometry.alpha_shape import alpha_shape
from matter.geometry.tetrahedra import circumradius, tetrahedron_volume


def close_packed(radius: float) -> np.ndarray:
    """A perfect close-packed ball of ``radius`` spacings (one point per unit volume)."""
    a = 2.0 ** (1.0 / 6.0)
    n = int(1.4 * radius)
    k, j, i = np.meshgrid(*(np.arange(-n, n + 1),) * 3, indexing="ij")
    points = (
        np.stack(
            [(2 * i + (j + k) % 2) * 0.5, np.sqrt(3) / 2 * (j + (k % 2) / 3), np.sqrt(6) / 3 * k], axis=-1
        ).reshape(-1, 3)
        * a
    )
    points += 0.123
    return points[np.linalg.norm(points, axis=1) < radius]


def cubic(shape: tuple[int, int, int]) -> np.ndarray:
    return np.stack(np.meshgrid(*(np.arange(n, dtype=float) for n in shape), indexing="ij"), axis=-1).reshape(-1, 3)


def test_circumradius_and_volume_of_known_tetrahedra():
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)  # edge sqrt(8)
    corner = np.array(
        [[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 6]], dtype=float
    )  # circumsphere through the box's diagonal
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float)
    shapes = np.stack([regular, corner, flat])
    assert circumradius(shapes)[:2] == pytest.approx([np.sqrt(3.0), 3.5], rel=1e-14)
    assert circumradius(shapes)[2] == np.inf
    assert tetrahedron_volume(shapes) == pytest.approx([8.0 / 3.0, 6.0, 0.0], rel=1e-14)


@pytest.mark.parametrize("disorder", [0.0, 0.05, 0.2])
def test_ball_is_one_watertight_solid(disorder):
    points = close_packed(7.0)
    points = points + np.random.default_rng(1).normal(0.0, disorder, points.shape)
    shape = alpha_shape(points, 1.0, 1.5)
    mesh = shape.surface()
    assert len(shape.component_volume) == 1
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(shape.volume, rel=1e-9)
    # each surface particle stands for matter on both sides: the bare shape is too small, about half a spacing closes
    # it
    assert shape.volume < 0.92 * len(points)
    assert shape.offset(0.3).volume < len(points) < shape.offset(0.55).volume
    assert np.all(shape.members == 0) or disorder > 0.1


def test_offset_of_a_lattice_box_is_the_box_of_its_cells():
    n = (9, 8, 7)
    shape = alpha_shape(cubic(n), 1.0, 1.0)
    assert shape.volume == pytest.approx(8 * 7 * 6, rel=1e-4)
    grown = shape.offset(0.5)
    inner = np.random.default_rng(2).uniform(
        [1.6, 1.6, -0.49], [6.4, 5.4, -0.1], (2000, 3)
    )  # outside a face, away from its edges
    beyond = inner.copy()
    beyond[:, 2] = -0.52
    assert not shape.contains(inner).any()
    assert np.mean(grown.contains(inner)) > 0.999
    assert not grown.contains(beyond).any()
    assert grown.volume == pytest.approx(9 * 8 * 7, rel=0.05)  # corners are cut


def test_point_location_agrees_with_the_surface():
    points = close_packed(6.0) + np.random.default_rng(3).normal(0.0, 0.1, (len(close_packed(6.0)), 3))
    shape = alpha_shape(points, 1.0, 1.5)
    box = np.random.default_rng(4).uniform(-8, 8, (60_000, 3))
    for solid in (shape, shape.offset(0.45), shape.offset(0.45, smoothing=4)):
        assert np.mean(solid.contains(box)) * 16.0**3 == pytest.approx(
            solid.volume, rel=0.02
        )  # 3 standard errors of the sampling
    assert np.array_equal(shape.contains(box[::-1])[::-1], shape.contains(box))


def test_detached_blocks_and_voids_are_counted():
    ball = close_packed(6.0)
    hollow = ball[np.linalg.norm(ball, axis=1) > 3.0]
    block = cubic((4, 4, 4)) + [20.0, 0.0, 0.0]
    shape = alpha_shape(np.concatenate([hollow, block]), 1.0, 1.5)
    assert len(shape.component_volume) == 2
    assert shape.component_volume[1] == pytest.approx(27.0, rel=1e-3)
    assert not shape.contains(np.zeros((1, 3)))[0]
    assert np.count_nonzero(shape.members == 1) == 64
    pieces = shape.only(1).surface().split(only_watertight=False)
    assert sorted(np.sign(piece.volume) for piece in pieces) == [
        -1.0,
        1.0,
    ]  # an outer skin and, turned inwards, the void
    filled = alpha_shape(np.concatenate([hollow, block]), 1.0, 1.5, fill_below=1000.0)
    assert filled.voids_filled == 1 and filled.contains(np.zeros((1, 3)))[0]
    assert alpha_shape(np.concatenate([hollow, block]), 1.0, 1.5, fill_below=10.0).voids_filled == 0


def test_voids_are_filled_by_the_spacing_around_them():
    """A pore of coarse packing is no larger for being beside fine packing, of which there is more."""
    fine, coarse = close_packed(4.0), 3.0 * close_packed(4.0)
    coarse = coarse[np.linalg.norm(coarse, axis=1) > 6.0] + [40.0, 0.0, 0.0]
    points = np.concatenate([fine, fine + [0.0, 12.0, 0.0], coarse])
    spacing = np.repeat([1.0, 3.0], [2 * len(fine), len(coarse)])
    assert alpha_shape(points, spacing, 1.5, fill_below=100.0 * np.median(spacing) ** 3).voids_filled == 0
    assert alpha_shape(points, spacing, 1.5, fill_below=100.0 * spacing**3).voids_filled == 1
    assert alpha_shape(points, spacing, 1.5, fill_below=5.0 * spacing**3).voids_filled == 0


def test_solids_that_touch_in_an_edge_or_a_corner_stay_manifold():
    one = cubic((3, 3, 3))
    for shift in ([2.0, 2.0, 0.0], [2.0, 2.0, 2.0]):
        points = np.unique(np.concatenate([one, one + shift]), axis=0)
        shape = alpha_shape(points, 1.0, 0.95)
        mesh = shape.surface()
        edges = np.sort(mesh.edges, axis=1)
        _, count = np.unique(edges, axis=0, return_counts=True)
        assert np.all(count == 2)
        assert mesh.volume == pytest.approx(shape.volume, rel=1e-6)


def test_graded_cloud_needs_a_graded_alpha():
    rng = np.random.default_rng(5)
    uniform = close_packed(9.0) + rng.normal(0, 0.05, (len(close_packed(9.0)), 3))
    radius = np.linalg.norm(uniform, axis=1)
    stretch = 1.0 + 0.15 * radius  # spacing grows from 1 to about 3
    points = uniform * stretch[:, None]
    spacing = np.cbrt((1.0 + 0.3 * radius) * stretch**2)
    graded = alpha_shape(points, spacing, 1.5)
    assert len(graded.component_volume) == 1 and graded.surface().is_watertight
    assert np.mean(graded.members == 0) > 0.999
    assert np.mean(alpha_shape(points, 1.0, 1.5).members == 0) < 0.7


@pytest.mark.parametrize(
    ("points", "word"),
    [
        (np.zeros((3, 3)), "at least four"),
        (np.zeros((10, 2)), "at least four"),
        (cubic((5, 5, 1)), "plane"),
        (np.full((10, 3), np.nan), "finite"),
        (cubic((3, 3, 3)) * 100.0, "empty"),
    ],
)
def test_degenerate_clouds_end_in_a_message(points, word):
    with pytest.raises(InputError, match=word):
        alpha_shape(points, 1.0, 1.5)


CUBE = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), -1).reshape(-1, 3)


@pytest.mark.parametrize("far", [1e3, 1e5, 1e7, 1e9, 1e15])
def test_a_particle_far_away_is_outside_and_changes_nothing(far):
    """A triangulation in doubles resolves some 1e6 spacings: further out the far one may not be in it."""
    away = np.array([[far, 0.0, 0.0], [0.0, 2.0 * far, far]])
    shape = alpha_shape(np.vstack([CUBE, away]), 1.0)
    assert shape.volume == pytest.approx(125.0, abs=1e-3)
    assert np.flatnonzero(shape.members < 0).tolist() == [216, 217]
    inside = shape.contains(np.array([[2.5, 2.6, 2.7], [-0.1, 2.0, 2.0], [far, 0.0, 0.0], [0.5 * far, 0.0, 0.0]]))
    assert inside.tolist() == [True, False, False, False]
    assert shape.offset(0.5).mesh.is_watertight and shape.offset(0.5).volume > 200.0


def test_a_clump_too_far_away_is_named():
    clump = np.stack(np.meshgrid(*[np.arange(2.0)] * 3), -1).reshape(-1, 3)
    assert alpha_shape(np.vstack([CUBE, clump + 5e5]), 1.0).component_volume == pytest.approx([125.0, 1.0], abs=1e-3)
    with pytest.raises(InputError, match=r"particle 223 lies 1\.73e\+07 m from the middle of the others"):
        alpha_shape(np.vstack([CUBE, clump + 1e7]), 1.0)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_a_surface_is_the_same_at_any_size(size):
    """The library of surfaces takes triangles below some 1e-14 m^2 for flat, and leaves their normals out."""
    shape = alpha_shape(CUBE * size, size)
    grown = shape.offset(0.5 * size, smoothing=2)
    reference = alpha_shape(CUBE, 1.0).offset(0.5, smoothing=2)
    assert shape.volume / size**3 == pytest.approx(125.0, rel=1e-5)
    assert grown.volume / size**3 == pytest.approx(reference.volume, rel=1e-4)
