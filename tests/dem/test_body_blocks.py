"""Blocks in the bed of a whole body: in place before the rest settles, at rest under weight, part of its mass."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dem.beds import solid_masses
from dem.beds import stage as bed_stage
from dem.beds.solid_body import SolidBody
from dem.collapse import escaping_grains
from dem.collapse.origins import Origins
from dem.contact.settings import Contact
from dem.grains.assembly import Assembly, Extras
from dem.grains.self_gravity import SelfGravity
from matter.blocks import block_file, placing
from matter.case.body import Impact, Target
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from sph.bodies import solid_target
from tests.dem import bodies

pytestmark = pytest.mark.usefixtures("known_friction_angle")

DENSITY, BLOCK = 2000.0, 2900.0
BODY = {
    "shape": "ellipsoid", "axes": [120.0, 110.0, 90.0], "spin_period": 6.0 * 3600.0, "latitude": 0.3,
    "longitude": 2.0, "layers": [{"name": "body", "material": "basalt"}],
}  # fmt: skip
IMPACT = {
    "speed": 6000.0, "angle_from_vertical": 0.1, "projectile": {"material": "aluminum", "radius": 0.4},
    "expected_transient_diameter": 30.0,
}  # fmt: skip
LARGE = ((18.0, 0.0, 17.0, 26.0), (-16.0, 10.0, 40.0, 32.0))
SMALL, COARSE = (0.0, -16.0, 12.0, 10.0), (8.0, 20.0, 70.0, 26.0)
"""Listed blocks: at along the flight and across, depth, diameter [m]."""


def target_of(balls, **more) -> Target:
    placed = [{"at": b[:2], "depth": b[2], "size": (b[3],) * 3} for b in balls]
    blocks = [{"material": "gabbro", "law": "list", "placed": placed}] if balls else []
    return Target.model_validate({**BODY, "blocks": blocks, **more})


def made(folder, target: Target, unresolved=(), density=BLOCK, count=500, **settings):
    """The bed of a body with its blocks, and its report; ``unresolved``: those without particles of their own."""
    for name in ("2_sph", "3_bed"):
        (folder / name).mkdir(parents=True)
    path = folder / "2_sph" / "target.json"
    path.write_text(json.dumps(solid_target.target_json(target, DENSITY)))
    bodies.write_blocks(path, target, density, unresolved)
    given = {"target": target, "impact": Impact.model_validate(IMPACT), "count": count} | settings
    bed_stage.run(bed_stage.Settings(**given), folder, folder / "3_bed")
    report = json.loads((folder / "3_bed" / "bed_report.json").read_text())
    return snapshot.read(folder / "3_bed" / "bed.vtkhdf"), report


@pytest.fixture(scope="module")
def rubble(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rubble")
    target = target_of((*LARGE, SMALL, COARSE))
    bed, report = made(folder, target, unresolved=[3])
    return bed, report, SolidBody.read(folder / "2_sph" / "target.json", target), placing.of_target(target)


def test_large_resolved_blocks_are_grains_where_they_are_listed(rubble):
    bed, report, _, found = rubble
    grains = bed.select(bed.block >= 0)
    assert grains.block.tolist() == [0, 1] and report["blocks"]["grains"] == 2 and report["blocks"]["listed"] == 4
    np.testing.assert_allclose(grains.radius, 0.5 * found.size[:2, 0], rtol=1e-12)
    np.testing.assert_allclose(grains.mass, BLOCK * found.volume[:2], rtol=1e-12)
    assert [bed.attributes["materials"][k] for k in grains.material] == ["gabbro", "gabbro"]
    assert (bed.material[bed.block < 0] == 0).all() and bed.attributes[block_file.DIGEST]
    way = np.linalg.norm(grains.position - found.centre[:2], axis=1) / grains.radius
    assert (way < 0.1).all()
    assert report["blocks"]["largest_way_over_radius"] == pytest.approx(float(way.max()), rel=1e-9)


def test_the_body_rests_with_its_mass_its_centre_and_its_axes(rubble):
    bed, report, body, _ = rubble
    assert bed.mass.sum() == pytest.approx(body.mass, rel=1e-12) and abs(report["mass_error"]) < 1e-12
    assert np.abs(bed.mass @ bed.position).max() < 1e-9 * body.mass * body.solid.radius
    assert report["free_run_speed_over_sqrt_g_r"] < 1e-3 and report["residual_speed_over_sqrt_g_r"]["rms"] < 1e-3
    assert report["axes_error_max"] < 0.04
    wanted = np.cross(body.omega, bed.position)
    assert np.abs(bed.velocity - wanted).max() < 1e-3 * np.abs(wanted).max()


def test_the_ground_between_them_is_as_loose_as_without_and_touches_them(rubble):
    bed, report, _, _ = rubble
    assert report["packing_fraction"] == pytest.approx(0.58, abs=0.025)
    # grains and blocks fill as much of the body as grains alone do, 0.597, but for the layers about the blocks
    assert report["grain_volume_over_body"] == pytest.approx(0.593, abs=0.015)
    x, r = bed.position, bed.radius
    for k in np.flatnonzero(bed.block >= 0):
        gap = np.sort(np.linalg.norm(x - x[k], axis=1) - r - r[k])[1:]
        assert gap[0] > -0.03 * r.min() and (gap < 0.1 * r.min()).sum() > 6


def test_what_leaves_with_blocks_is_told_by_itself(rubble):
    """One block and one grain are thrown off; number, mass and momentum are those of the block."""
    bed, *_ = rubble
    grains = Particles(bed, bed.attributes)
    kick, block = np.zeros_like(bed.position), int(np.flatnonzero(bed.block == 0)[0])
    grain = int(np.argmin(bed.position[:, 2]))
    for k in (block, grain):
        kick[k] = 2.0 * bed.position[k] / np.linalg.norm(bed.position[k])
    grains["velocity"] = bed.velocity + kick
    run = Assembly(grains, Contact(), extras=Extras(self_gravity=SelfGravity()))
    found = escaping_grains.report(run, None, Origins(grains).blocks(run.identity))
    assert found["grains"] == 2 and found["mass_kg"] == pytest.approx(bed.mass[block] + bed.mass[grain])
    assert found["blocks"]["number"] == 1 and found["blocks"]["mass_kg"] == pytest.approx(bed.mass[block])
    wanted = bed.mass[block] * grains.velocity[block]
    assert found["blocks"]["momentum_kg_m_s"] == pytest.approx(wanted.tolist(), rel=1e-9)
    plain = Particles({name: bed[name] for name in bed if name != "block"}, bed.attributes)
    assert Origins(plain).blocks(run.identity) is None and "blocks" not in escaping_grains.report(run, None)


def test_none_of_the_volume_gives_the_bits_of_a_body_without_blocks(tmp_path):
    """``volume_fraction = 0`` and no table at all; a block that is too small is in the ground and moves no grain."""
    none = [{"material": "gabbro", "law": "equal", "largest": 20.0, "volume_fraction": 0.0}]
    beds = []
    for k, target in enumerate((target_of(()), target_of((), blocks=none), target_of((SMALL,)))):
        beds.append(made(tmp_path / str(k), target, count=200)[0])
    for other in beds[1:]:
        assert set(other) == set(beds[0]) and "block" not in other
        assert all((other[name] == beds[0][name]).all() for name in other)
    assert block_file.DIGEST in beds[2].attributes and block_file.DIGEST not in beds[1].attributes


def test_masses_of_blocks_are_kept_and_grains_make_up_for_them():
    target = target_of(LARGE)
    body = SolidBody(target.placed, 1e9, "basalt", np.zeros(3), None)
    rng = np.random.default_rng(3)
    x = rng.normal(size=(500, 3)) * [30.0, 28.0, 22.0] + [1.0, -2.0, 1.0]
    r, heavy = rng.uniform(3.0, 4.0, 500), np.array([2e7, 5e7])
    mass, _ = solid_masses.matched(x, r, body, heavy)
    assert (mass[-2:] == heavy).all() and mass.sum() == pytest.approx(1e9, rel=1e-12)
    assert np.abs(mass @ x).max() < 1e-9 * body.mass * 30.0
    axes = np.linalg.eigh(body.solid.inertia)[1]
    moments = np.einsum("i,ij,ik->jk", mass, x @ axes, x @ axes)
    assert np.abs(moments - np.diag(np.diag(moments))).max() < 1e-9 * moments.max()


def test_what_a_body_cannot_hold_is_refused(tmp_path):
    with pytest.raises(InputError, match="leave too little of the body"):
        made(tmp_path / "heavy", target_of(LARGE), density=1e5)
    with pytest.raises(InputError, match="lie so much to one side"):
        made(tmp_path / "lopsided", target_of(LARGE[:1]), density=3e4)
    with pytest.raises(ValueError, match='a patch of a body\'s ground, "bowl", holds no blocks; shape = "whole" does'):
        bed_stage.Settings(target=target_of(LARGE), impact=Impact.model_validate(IMPACT), shape="bowl")
    with pytest.raises(ValueError, match='packing = "loose", not "rcp"'):
        bed_stage.Settings(target=target_of(LARGE), impact=Impact.model_validate(IMPACT), packing="rcp")


def test_the_check_says_how_many_can_be_grains():
    given = {"target": target_of((*LARGE, SMALL)), "impact": Impact.model_validate(IMPACT), "count": 500}
    said = bed_stage.explain(bed_stage.Settings(**given))[-1]
    assert said.startswith("of 3 blocks 2 can be large grains, the smallest of 13 m radius")
