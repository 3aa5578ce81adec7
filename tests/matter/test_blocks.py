"""Blocks in the ground: sizes as the law says, places without overlaps, one file, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from pydantic import ValidationError
from scipy import stats

from matter.blocks import block_file, ellipsoids, placing, size_laws
from matter.case.block_tables import Blocks
from matter.case.body import Target
from matter.case.identity_fields import identity_fields
from matter.errors import InputError

GROUND = {
    "shape": "half_sphere",
    "gravity": 1e-4,
    "layers": [{"name": "soil", "material": "basalt", "thickness": 10.0}],
}
POWER = {"material": "gabbro", "law": "power_law", "index": 2.65, "smallest": 0.8, "largest": 4.0}
WEIBULL = {"material": "gabbro", "law": "weibull", "scale": 1.0, "shape": 0.9, "smallest": 0.5, "largest": 4.0}


def _target(**blocks) -> Target:
    return Target(**GROUND, blocks=[{**POWER, "volume_fraction": 0.3, **blocks}])


def _numbers(table: Blocks, volume: float, seed: int = 1) -> np.ndarray:
    return size_laws.drawn(table, volume, np.random.default_rng(seed))


@pytest.mark.parametrize("table", [POWER, WEIBULL])
def test_drawn_sizes_follow_the_law(table):
    """N(>D) of a draw is uniform: Kolmogorov-Smirnov's p of 20 seeds above 0.01 all but once, and spread over 0..1."""
    law = Blocks(**table, volume_fraction=0.3)
    found = []
    for seed in range(20):
        sizes = _numbers(law, 3000.0, seed)
        assert law.smallest <= sizes.min() and sizes.max() <= law.largest
        found.append(stats.kstest(fraction_above(law, sizes), "uniform").pvalue)
    assert sum(p < 0.01 for p in found) <= 1
    assert stats.kstest(found, "uniform").pvalue > 0.01


def fraction_above(law, diameter):
    """N(>D) of a law that is cut at its smallest and largest."""

    def whole(D):
        return D**-law.index if law.law == "power_law" else np.exp(-((D / law.scale) ** law.shape))

    least, most = whole(law.smallest), whole(law.largest)
    return (whole(diameter) - most) / (least - most)


def test_the_index_of_a_power_law_is_found_again():
    """Maximum likelihood of the cut law, within 2 a / sqrt(N)."""
    law = Blocks(**{**POWER, "largest": 80.0}, volume_fraction=0.3)
    D = size_laws.quantile(law)(1.0 - np.random.default_rng(3).random(4000))
    a = 1.0 / np.log(D / law.smallest).mean()
    assert a == pytest.approx(2.65, abs=2.0 * 2.65 / math.sqrt(len(D)))


@pytest.mark.parametrize("table", [POWER, WEIBULL, {"material": "gabbro", "law": "equal", "largest": 1.0}])
def test_the_volume_is_that_asked_for(table):
    """To half the smallest block."""
    law = Blocks(**table, volume_fraction=0.3)
    sizes = _numbers(law, 500.0)
    least = law.smallest or law.largest
    assert abs(math.pi / 6.0 * (sizes**3).sum() - 500.0) <= 0.5001 * math.pi / 6.0 * least**3
    assert (np.diff(sizes) <= 0.0).all()


def test_balls_touch_at_the_sum_of_their_radii_and_ellipsoids_along_their_axes():
    assert ellipsoids.overlap(2.9999, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0)
    assert not ellipsoids.overlap(3.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0)
    for axis, reach in enumerate((3.0, 2.5, 2.2)):  # half axes 2, 1.5, 1.2 beside a ball of radius 1
        for near, expected in ((0.99, True), (1.02, False)):
            way = [0.0, 0.0, 0.0]
            way[axis] = near * reach
            assert ellipsoids.overlap(*way, 2.0, 1.5, 1.2, 1.0, 1.0, 1.0) is expected


@pytest.mark.parametrize(
    "shape",
    [
        GROUND,
        {**GROUND, "shape": "half_space", "width": 24.0},
        {**GROUND, "shape": "block", "width": 18.0},
        {"shape": "ellipsoid", "axes": (24.0, 20.0, 16.0), "layers": [{"name": "body", "material": "basalt"}]},
    ],
)
def test_blocks_lie_in_the_ground_and_clear_of_one_another(shape):
    """None outside, no two overlap, the fraction within 0.5 %."""
    placed = [{"at": (1.0, -2.0), "depth": 3.0, "size": (4.0, 3.0, 2.0)}]
    found = placing.of_target(Target(**shape, blocks=[{**POWER, "volume_fraction": 0.3, "placed": placed}]))
    assert found.listed == 1 and found.fraction == pytest.approx(0.3, rel=0.005) and not found.saturated
    radius = 0.5 * found.size[:, 0]
    drawn = slice(1, None)
    apart = np.linalg.norm(found.centre[drawn, None] - found.centre[None, drawn], axis=2)
    need = radius[drawn, None] + radius[None, drawn]
    assert (apart - need)[np.triu_indices(len(need), 1)].min() >= 0.0
    half = 0.5 * found.size[0]
    surface = found.centre[0] + half * placing._ball(2000)  # the listed one, by points of its surface
    assert (np.linalg.norm(surface[:, None] - found.centre[None, drawn], axis=2) >= radius[drawn] - 1e-9).all()
    if shape.get("shape") == "half_sphere":
        assert (np.linalg.norm(found.centre, axis=1) + radius)[drawn].max() <= 10.0
        assert (found.centre[:, 2] + 0.5 * found.size[:, 2]).max() <= 0.0


def test_blocks_fill_a_body_of_a_file_and_none_sticks_out(tmp_path):
    """A lumpy body in kilometres whose surface is known: r(n) of the direction n alone. The fraction is within 2 % of
    what was asked, points on every block lie inside, to a hundredth of the smallest."""

    def radius(n: np.ndarray) -> np.ndarray:
        x, y, z = n.T
        return 50.0 * (1.0 + 0.12 * x * y + 0.1 * z**3 - 0.25 * x**2)

    ball = trimesh.creation.icosphere(subdivisions=5)
    vertices = 1e-3 * radius(np.asarray(ball.vertices))[:, None] * ball.vertices
    mesh = trimesh.Trimesh(vertices, ball.faces, process=False)
    mesh.export(tmp_path / "body.ply")
    law = {**POWER, "smallest": 8.0, "largest": 30.0, "volume_fraction": 0.3}
    body = {"shape": "mesh", "file": str(tmp_path / "body.ply"), "file_unit": 1000.0}
    target = Target(**body, layers=[{"name": "body", "material": "basalt"}], blocks=[law])
    found = placing.of_target(target)
    assert found.fraction == pytest.approx(0.3, rel=0.02) and found.ground_volume == target.placed.solid.volume
    surface = found.centre[:, None] + 0.5 * found.size[:, None] * placing._ball(300)
    own = surface.reshape(-1, 3) @ target.placed.turn + 1e3 * mesh.center_mass
    r = np.linalg.norm(own, axis=1)
    assert (r - radius(own / r[:, None])).max() < 0.08
    assert np.linalg.norm(found.centre, axis=1).max() > 25.0  # not only about the middle


def test_the_same_seed_gives_the_same_blocks_and_another_others():
    one, other = placing._placing.__wrapped__(_target()), placing._placing.__wrapped__(_target())
    assert (one.centre == other.centre).all() and (one.size == other.size).all()
    third = placing.of_target(_target(seed=2))
    assert len(third.size) != len(one.size) or (third.size != one.size).any()


def test_blocks_within_a_distance_fill_their_part_of_the_ground():
    found = placing.of_target(_target(within=6.0))
    assert found.ground_volume == pytest.approx(2.0 / 3.0 * math.pi * 6.0**3)
    assert found.fraction == pytest.approx(0.3, rel=0.005)
    assert np.linalg.norm(found.centre, axis=1).max() < 6.0


def test_blocks_come_back_from_their_file(tmp_path):
    target = _target()
    placed = placing.of_target(target)
    block_file.write(block_file.particles(target, placed, 2700.0), tmp_path)
    again = block_file.read(tmp_path)
    assert (again.position == placed.centre).all() and (again["size"] == placed.size).all()
    assert again.mass.sum() == pytest.approx(2700.0 * placed.fraction * placed.ground_volume, rel=1e-12)
    assert again.attributes["materials"] == ["gabbro"] and again.attributes["unplaced"] == 0
    with pytest.raises(InputError, match="no snapshot at"):
        block_file.read(tmp_path / "elsewhere")


def test_without_blocks_nothing_decides_that_did_not_before():
    """A case keeps its key: the new field is left out where no table is given, and decides where one is."""
    assert "blocks" not in identity_fields(Target(**GROUND))
    assert identity_fields(_target())["blocks"][0]["index"] == 2.65
    assert placing.of_target(Target(**GROUND)) is None
    assert placing.of_target(_target(volume_fraction=0.0)) is None


@pytest.mark.parametrize(
    "change, words",
    [
        ({"material": "gabro"}, "did you mean 'gabbro'"),
        ({"volume_fraction": -0.1}, "greater than or equal to 0"),
        ({"volume_fraction": 0.7}, "less than 0.64"),
        ({"smallest": -1.0}, "greater than 0"),
        ({"smallest": 5.0}, "smallest: 5 m is not below largest, 4 m"),
        ({"index": None}, 'index: law = "power_law" needs it'),
        ({"scale": 1.0}, 'scale: law = "power_law" does not take it'),
        ({"law": "list", "index": None, "smallest": None, "largest": None, "volume_fraction": None}, "at least one"),
        ({"law": "powerlaw"}, "Input should be 'power_law'"),
        ({"placed": [{"at": (0.0, 0.0), "depth": -1.0, "size": (1.0, 1.0, 1.0)}]}, "greater than 0"),
    ],
)
def test_bad_tables_are_refused(change, words):
    with pytest.raises(ValidationError, match=words):
        _target(**change)


def test_targets_that_hold_no_blocks_are_refused():
    layers = [{"name": "a", "material": "basalt", "thickness": 10.0}]
    table = {**POWER, "volume_fraction": 0.3}
    with pytest.raises(ValidationError, match='a ball is shape = "ellipsoid"'):
        Target(layers=layers, blocks=[table])
    with pytest.raises(ValidationError, match="blocks: of a target of one layer"):
        Target(**{**GROUND, "layers": 2 * layers}, blocks=[table])
    with pytest.raises(ValidationError, match="at most 1 item"):
        Target(**GROUND, blocks=[table, table])


def _at(x: float, depth: float, size: float = 2.0) -> dict:
    return {"at": (x, 0.0), "depth": depth, "size": (size, size, size)}


@pytest.mark.parametrize(
    "change, words",
    [
        ({"placed": [_at(0.0, 3.0), _at(1.5, 3.0)]}, "blocks 1 and 2 overlap"),
        ({"placed": [_at(0.0, 0.5)]}, "block 1 sticks out of the ground by 0.5 m"),
        ({"placed": [_at(9.5, 2.0)]}, "block 1 sticks out of the ground"),
        ({"placed": [_at(0.0, 6.0, 30.0)]}, "sticks out of the ground"),
        ({"smallest": 9.0, "largest": 40.0}, "has no room in the ground"),
        ({"placed": [_at(0.0, 5.0, 8.0)], "volume_fraction": 0.05}, "the blocks of placed alone are 0.128"),
        ({"smallest": 0.001, "largest": 0.01}, "more than 200,000 blocks"),
    ],
)
def test_blocks_that_cannot_lie_so_are_refused(change, words):
    with pytest.raises(InputError, match=words):
        placing.of_target(_target(**change))


def test_more_than_finds_room_is_refused_with_what_does():
    equal = {"material": "gabbro", "law": "equal", "largest": 2.5, "volume_fraction": 0.6}
    with pytest.raises(InputError, match=r"0.6 was asked for and 0.\d+ found room; the largest that works .* 0\.[23]"):
        placing.of_target(Target(**GROUND, blocks=[equal]))


def test_blocks_under_no_ground_of_a_body_are_refused():
    body = {"shape": "ellipsoid", "axes": (24.0, 20.0, 16.0), "layers": [{"name": "body", "material": "basalt"}]}
    with pytest.raises(InputError, match="no ground of the body lies under"):
        placing.of_target(Target(**body, blocks=[{"material": "gabbro", "law": "list", "placed": [_at(30.0, 1.0)]}]))
