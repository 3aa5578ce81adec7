"""Blocks in a bed of flat ground: which are grains, that they lie where they are listed, under weight and at rest."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dem.beds import stage as bed_stage
from dem.beds.blocks import block_grains
from dem.beds.grading import Grading
from dem.grains import pair_list, size_levels
from matter.blocks import block_file, placing
from matter.case.body import Target
from matter.errors import InputError
from matter.files import snapshot
from matter.geometry.ground_region import Upright
from tests.dem import bodies
from tests.dem.test_flat_bed import IMPACT, TARGET, write_ground

DENSITY = 2500.0
LARGE = ((3.0, 0.0, -4.0, 2.0), (-4.0, 2.0, -2.6, 1.6))
SMALL, THROUGH_FLOOR, COARSE = (0.0, -5.0, -6.0, 1.0), (0.0, 4.0, -9.0, 1.7), (-4.0, -4.0, -6.0, 1.6)


def target_of(balls, material="gabbro") -> Target:
    placed = [{"at": ball[:2], "depth": -ball[2], "size": (2.0 * ball[3],) * 3} for ball in balls]
    table = {"material": material, "law": "list", "placed": placed}
    return TARGET.model_copy(update={"blocks": Target(**TARGET.model_dump() | {"blocks": [table]}).blocks})


def made(folder, target: Target, density=DENSITY, unresolved=(), **settings):
    """A bed with the blocks of a target, and its report; ``unresolved``: those without particles of their own."""
    path = folder / "2_sph" / "target.json"
    write_ground(path)
    (folder / "3_bed").mkdir(exist_ok=True)
    bodies.write_blocks(path, target, density, unresolved)
    usual = dict(
        target=target, impact=IMPACT, count=1000, arc_radius=10.0, headroom_fraction=0.2, growth=0.0, depth=10.0
    )
    bed_stage.run(bed_stage.Settings(**{**usual, **settings}), folder, folder / "3_bed")
    report = json.loads((folder / "3_bed" / "bed_report.json").read_text())
    return snapshot.read(folder / "3_bed" / "bed.vtkhdf"), report


@pytest.fixture(scope="module")
def rubble(tmp_path_factory):
    balls = (*LARGE, SMALL, THROUGH_FLOOR, COARSE)
    return made(tmp_path_factory.mktemp("rubble"), target_of(balls), unresolved=[4])


def test_large_resolved_blocks_inside_the_bed_are_grains(rubble):
    bed, report = rubble
    grains = bed.select(bed.block >= 0)
    assert grains.block.tolist() == [0, 1] and report["blocks"]["grains"] == 2 and report["blocks"]["listed"] == 5
    np.testing.assert_allclose(grains.radius, [ball[3] for ball in LARGE], rtol=1e-12)
    np.testing.assert_allclose(grains.mass, DENSITY * 4.0 / 3.0 * np.pi * grains.radius**3, rtol=1e-12)
    assert [bed.attributes["materials"][k] for k in grains.material] == ["gabbro", "gabbro"]
    assert (bed.material[bed.block < 0] == 0).all() and not grains.headroom.any()


def test_they_lie_where_they_are_listed_and_rest_under_weight(rubble):
    bed, report = rubble
    grains = bed.select(bed.block >= 0)
    way = np.linalg.norm(grains.position - [ball[:3] for ball in LARGE], axis=1)
    assert (way < 0.1 * grains.radius).all()
    assert report["blocks"]["largest_way_over_radius"] == pytest.approx(float((way / grains.radius).max()), rel=1e-9)
    assert report["free_run_speed_over_sqrt_g_r"] < 1e-3 and report["residual_speed_over_sqrt_g_r"]["max"] < 4e-3
    assert report["weight_carried"] == pytest.approx(1.0, abs=0.02)


def test_the_ground_weighs_what_it_did_and_is_as_loose_between_them(rubble):
    bed, report = rubble
    below = bed.headroom == 0
    assert bed.mass[below].sum() == pytest.approx(1500.0 * np.pi * 10.0**3, rel=1e-6)
    assert report["packing_fraction"] == pytest.approx(report["packing_fraction_meant"], abs=0.02)
    x, r = bed.position, bed.radius
    for k in np.flatnonzero(bed.block >= 0):
        gap = np.linalg.norm(x - x[k], axis=1) - r - r[k]
        assert np.sort(gap)[1] > -0.03 * r.min() and (np.sort(gap)[1:] < 0.1 * r[k]).sum() > 6


def test_none_of_the_volume_gives_the_bits_of_ground_without_blocks(tmp_path):
    """``volume_fraction = 0`` and no table at all; blocks that are too small are in the ground and move no grain."""
    equal = {"material": "gabbro", "law": "equal", "largest": 2.0, "volume_fraction": 0.0}
    beds = []
    for k, blocks in enumerate(([], [equal], target_of([SMALL]).model_dump()["blocks"])):
        target = Target(**TARGET.model_dump() | {"blocks": blocks})
        (tmp_path / str(k)).mkdir()
        beds.append(made(tmp_path / str(k), target, count=200)[0])
    for other in beds[1:]:
        assert set(other) == set(beds[0]) and "block" not in other
        assert all((other[name] == beds[0][name]).all() for name in other)
    assert block_file.DIGEST in beds[2].attributes and block_file.DIGEST not in beds[1].attributes


def test_spheres_of_ellipsoids_that_overlap_are_moved_apart():
    flat = {"size": (6.0, 6.0, 2.0)}
    placed = [{"at": (0.0, 0.0), "depth": 3.0, **flat}, {"at": (0.0, 0.0), "depth": 5.2, **flat}]
    target = Target(**TARGET.model_dump() | {"blocks": [{"material": "gabbro", "law": "list", "placed": placed}]})
    blocks = block_file.particles(target, placing.of_target(target), DENSITY)
    box, sizes = Upright("cylinder", 10.0, -10.0, 2.0), Grading(0.5, 5.0, 0.0)
    found = block_grains.of_ground(blocks, "", box, sizes)
    assert np.linalg.norm(found.position[1] - found.position[0]) == pytest.approx(found.radius.sum(), rel=1e-6)
    np.testing.assert_allclose(found.position.mean(axis=0), blocks.position.mean(axis=0), atol=1e-12)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"packing": "rcp"}, 'packing = "loose", not "rcp"'),
        ({"packing": "hcp"}, 'packing = "loose", not "hcp"'),
    ],
)
def test_other_packings_hold_no_blocks(change, words):
    with pytest.raises(ValueError, match=words):
        bed_stage.Settings(target=target_of(LARGE), impact=IMPACT, **change)


def test_blocks_that_weigh_more_than_the_ground_are_refused(tmp_path):
    with pytest.raises(InputError, match="leave too little of the ground"):
        made(tmp_path, target_of(LARGE), density=1e5)


def test_other_blocks_than_the_shock_stage_had_are_refused(tmp_path):
    target = target_of(LARGE)
    path = tmp_path / "2_sph" / "target.json"
    write_ground(path)
    bodies.write_blocks(path, target, DENSITY)
    blocks = block_file.read(path.parent)
    blocks["position"] = blocks.position + 0.5
    block_file.write(blocks, path.parent)
    with pytest.raises(InputError, match="not the blocks that target"):
        block_file.of_target(path)
    (path.parent / block_file.NAME).unlink()
    with pytest.raises(InputError, match="no snapshot at"):
        block_file.of_target(path)


@pytest.mark.parametrize("ratio", [2.5, 6.0, 20.0])
def test_the_pairs_of_few_large_grains_are_all_found(ratio):
    """Whichever search takes them: cells of the largest, or a class of each size."""
    rng = np.random.default_rng(3)
    X = np.column_stack([rng.uniform(-10.0, 10.0, (3000, 3)), np.full(3000, 0.45)])
    X[::600, 3] = 0.45 * ratio
    reach = 2.0 * float(X[:, 3].max()) + 0.1
    cells = pair_list.Cells(X[:, :3], reach)
    X = np.ascontiguousarray(X[cells.order])
    cells = pair_list.Cells(X[:, :3], reach)
    distance = np.linalg.norm(X[:, None, :3] - X[None, :, :3], axis=2)
    wanted = np.triu(distance < X[:, None, 3] + X[None, :, 3] + 0.1, 1).sum()
    row, _, _ = size_levels.build(X, 0.1, 64)
    assert row[-1] == wanted and size_levels.several(X[:, 3]) == (ratio > 3.0)
