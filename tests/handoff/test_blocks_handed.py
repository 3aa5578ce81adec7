"""Blocks at the handover: a whole one becomes its grain with its mass, momentum and spin; a broken one the ground of
its place; what is taken by neither is handed over as ever."""

from __future__ import annotations

import numpy as np
import pytest

from fixtures import clouds
from fixtures.clouds import ARC_FLAT, DEPTH
from fixtures.flows import FIELDS, hemisphere
from handoff import stage
from handoff.domains import domain
from handoff.ledger_rows import account, block_rows
from handoff.source import cloud_surface
from handoff.transfer import carve, correction
from handoff.transfer.blocks import block_room, whole_blocks
from matter.errors import InputError
from matter.particles import Particles

pytestmark = pytest.mark.usefixtures("fewer_points")

RADIUS = 3.0
PLACES = np.array([[16.0, 0.0, -8.0], [-15.0, 4.0, -9.0], [0.0, -17.0, -8.0], [0.0, 0.0, -15.0], [2.0, 17.0, -8.0]])
STAYS, MOVED, BROKEN, DEEP, THROWN = range(5)
ABOVE = np.array([0.0, 0.0, 14.0])
"""How far the thrown one has come."""
ASIDE = np.array([1.5, 0.0, 0.5])


@pytest.fixture(scope="module")
def rubble_bed(flat_bed):
    """The bed of all tests with five large grains in it, which touch those about them."""
    gap = np.linalg.norm(flat_bed.position[:, None] - PLACES, axis=2) - RADIUS
    stays = (gap > 0.98 * flat_bed.radius[:, None]).all(axis=1)
    plain = flat_bed.select(stays)
    blocks = plain.select(np.arange(len(PLACES)))
    blocks["identity"] = int(flat_bed.identity.max()) + 1 + np.arange(len(PLACES))
    blocks["position"], blocks["radius"] = PLACES, np.full(len(PLACES), RADIUS)
    blocks["mass"], blocks["density"] = 4.0 / 3.0 * np.pi * blocks.radius**3 * 2000.0, np.full(len(PLACES), 2000.0)
    blocks["material"], blocks["stiffness"] = np.ones(len(PLACES)), 1e9 * blocks.radius
    fields = {name: np.concatenate([plain[name], blocks[name]]) for name in plain}
    fields["block"] = np.concatenate([np.full(len(plain), -1), 7 + np.arange(len(PLACES))])
    bed = Particles(fields, flat_bed.attributes | {"materials": ["ice", "basalt"]})
    bed.tables = carve.surviving_tables(flat_bed, stays)
    near = np.flatnonzero(gap[stays][:, STAYS] < plain.radius)
    pair = np.sort(np.column_stack([plain.identity[near], np.full(len(near), blocks.identity[STAYS])]), axis=1)
    assert len(near) > 3
    bed.tables["contacts/pair"] = np.concatenate([bed.tables["contacts/pair"], pair])
    rows = np.full((len(near), bed.tables["contacts/history"].shape[1]), 0.125)
    bed.tables["contacts/history"] = np.concatenate([bed.tables["contacts/history"], rows])
    return bed


@pytest.fixture(scope="module")
def source():
    """Ground under a bowl that turns, with the particles of the blocks where these are by now."""
    cloud = clouds.flat_source(1.0, ARC_FLAT, DEPTH, hemisphere, FIELDS["rotation"])
    cloud.attributes["materials"] = ["ice", "basalt"]
    block, position = np.full(len(cloud), -1), cloud.position.copy()
    for j, place in enumerate(PLACES):
        block[np.linalg.norm(position - place, axis=1) < RADIUS] = 7 + j
    # the one that has moved has pushed what was there out of its way: that ground is left out
    inside = np.linalg.norm(position - PLACES[MOVED] - ASIDE, axis=1) < RADIUS
    cloud = _with(cloud, block)
    keep = ~(inside & (block < 0))
    cloud = cloud.select(keep)
    moved, thrown = cloud.block == 7 + MOVED, cloud.block == 7 + THROWN
    place, velocity = cloud.position.copy(), cloud.velocity.copy()
    place[moved] += ASIDE
    place[thrown] += ABOVE
    velocity[thrown] += [0.0, 0.0, 30.0]
    cloud["position"], cloud["velocity"] = place, velocity
    return cloud


def _with(cloud: Particles, block: np.ndarray) -> Particles:
    cloud["block"], cloud["damage"] = block, np.where(block == 7 + BROKEN, 1.0, 0.1)
    cloud["material"] = (block >= 0).astype(int)
    cloud["mass"], cloud["density"] = (np.where(block >= 0, 2.0, 1.0) * cloud[name] for name in ("mass", "density"))
    return cloud


@pytest.fixture(scope="module")
def handed(source, rubble_bed, ground, fewer_points):
    region = domain.read(rubble_bed.attributes)
    rules = cloud_surface.Rules(crater="any")
    bed, made = stage._handed(source, rubble_bed, rules, ground, region, np.inf)
    return bed, made, account.ledger_of(made, source, bed, ground, {})


def test_whole_blocks_are_grains_with_what_their_particles_have(handed, source):
    _, made, ledger = handed
    grains = made.start.select(made.start.block >= 0)
    assert grains.block.tolist() == [7 + STAYS, 7 + MOVED, 7 + DEEP, 7 + THROWN]
    for k, number in enumerate(grains.block):
        mine = source.select(source.block == number)
        sums = correction.sums(mine.mass, mine.position, mine.velocity)
        centre = mine.mass @ mine.position / mine.mass.sum()
        assert grains.mass[k] == pytest.approx(sums.mass, rel=1e-12)
        np.testing.assert_allclose(grains.mass[k] * grains.velocity[k], sums.momentum, rtol=1e-10)
        spin = 0.4 * grains.mass[k] * grains.radius[k] ** 2 * grains.angular_velocity[k]
        np.testing.assert_allclose(spin, sums.angular - np.cross(centre, sums.momentum), rtol=1e-8)
        assert np.linalg.norm(grains.position[k] - centre) <= 0.1 * RADIUS
    assert made.blocks.in_place.tolist() == [True, False, True, False]
    assert (grains.position[0] == PLACES[STAYS]).all()
    assert {name: ledger[name]["verdict"] for name in block_rows.LIMITS} == dict.fromkeys(block_rows.LIMITS, "pass")
    assert (grains.block_fraction == 1.0).all() and (grains.material == 1).all()


def test_the_whole_keeps_mass_momentum_and_angular_momentum(handed, source):
    _, made, ledger = handed
    for name in ("mass_total_rel", "momentum_linear_rel_after", "momentum_angular_rel_after"):
        assert ledger[name]["verdict"] == "pass", ledger[name]
    inside = made.sums.before
    start = made.start
    after = correction.sums(start.mass, start.position, start.velocity, start.radius, start.angular_velocity)
    assert after.mass == pytest.approx(inside.mass, rel=1e-12)
    np.testing.assert_allclose(after.angular, inside.angular, atol=1e-9 * inside.angular_scale)
    outside = made.sums.outside.mass
    assert inside.mass + outside == pytest.approx(source.mass.sum(), rel=1e-9)


def test_no_block_is_cut_and_nothing_lies_in_one(handed, rubble_bed):
    _, made, _ = handed
    start = made.start
    grains, plain = start.select(start.block >= 0), start.select((start.block < 0) & (start.state == 0))
    assert (grains.radius == RADIUS).all()
    for k, centre in enumerate(grains.position):
        gap = np.linalg.norm(plain.position - centre, axis=1) - grains.radius[k] - plain.radius
        assert gap.min() >= (-0.03 if made.blocks.in_place[k] else -1e-8)
    assert len(np.unique(start.identity)) == len(start)
    thrown = grains.block == 7 + THROWN
    assert grains.position[thrown][0, 2] > 0.0 and grains.velocity[thrown][0, 2] > 20.0


def test_what_was_a_block_is_filled_with_ground(handed, rubble_bed, source):
    """In the spheres of the broken one, the moved one and the thrown one; the broken one's matter is known there."""
    bed, made, _ = handed
    told = made.blocks.filled
    assert told["holes"] == 3 and told["put_in"] > 9 and told["put_in_m3"] < told["holes_m3"]
    new = bed.select(bed.identity > rubble_bed.identity.max())
    apart = np.linalg.norm(new.position[:, None] - bed.position, axis=2) - new.radius[:, None] - bed.radius
    apart[np.arange(len(new)), len(bed) - len(new) + np.arange(len(new))] = 1.0
    assert apart.min() > -0.03 and told["made_smaller"] + told["taken_out"] > 0
    here = np.linalg.norm(made.start.position - PLACES[BROKEN], axis=1) < RADIUS - 1.0
    assert here.any() and made.start.block_fraction[here].min() > 0.5
    far = np.linalg.norm(made.start.position[:, None] - PLACES, axis=2).min(axis=1) > 8.0
    assert made.start.block_fraction[far & (made.start.block < 0) & (made.start.position[:, 2] < 0.0)].max() < 0.1


def test_contacts_of_a_block_in_place_stay(handed, rubble_bed):
    _, made, _ = handed
    identity = rubble_bed.identity[rubble_bed.block == 7 + STAYS][0]
    pair = made.start.tables["contacts/pair"]
    rows = (pair == identity).any(axis=1)
    assert rows.sum() > 3 and (made.start.tables["contacts/history"][rows] == 0.125).all()
    assert np.isin(pair, made.start.identity).all()
    gone = rubble_bed.identity[rubble_bed.block == 7 + BROKEN][0]
    assert not (pair == gone).any()


@pytest.mark.parametrize(
    "name, change",
    [
        ("block_mass_rel", lambda g: {"mass": g.mass * np.where(g.block == 7, 1.0 + 1e-9, 1.0)}),
        ("block_momentum_rel", lambda g: {"velocity": g.velocity + 1e-8 * (g.block == 8)[:, None]}),
        (
            "block_spin_rel",
            lambda g: {"angular_velocity": g.angular_velocity * (1.0 + 1e-6 * (g.block == 7)[:, None])},
        ),
        ("block_place_over_r", lambda g: {"position": g.position + 0.2 * RADIUS * (g.block == 8)[:, None]}),
        ("block_count_off", lambda g: {"block": np.where(g.block == 8, -1, g.block)}),
    ],
)
def test_each_row_sees_its_fault(handed, source, name, change):
    _, made, ledger = handed
    start = Particles(made.start, made.start.attributes)
    for field, values in change(made.start).items():
        start[field] = values
    rows = len(ledger.rows)
    spoilt = type(ledger)()
    block_rows.enter(spoilt, made.blocks, source, start)
    assert spoilt[name]["verdict"] == "fail" and ledger[name]["verdict"] == "pass" and len(ledger.rows) == rows


def test_a_bed_without_blocks_is_handed_over_as_it_was(flat_bed, source, ground):
    region = domain.read(flat_bed.attributes)
    bed, blocks = block_room.set_apart(source, flat_bed, region, ground)
    assert bed is flat_bed and blocks is None


def test_what_cannot_be_handed_over_is_said(rubble_bed, source, ground):
    region = domain.read(rubble_bed.attributes)
    without = source.select(source.block != 7 + DEEP)
    with pytest.raises(InputError, match="holds no particle of block 10"):
        block_room.set_apart(without, rubble_bed, region, ground)
    close = Particles(source, source.attributes)
    place = source.position.copy()
    place[source.block == 7 + MOVED] += PLACES[DEEP] - PLACES[MOVED] - ASIDE + [1.0, 0.0, 0.0]
    close["position"] = place
    with pytest.raises(InputError, match="two whole blocks lie in one another"):
        block_room.set_apart(close, rubble_bed, region, ground)
    plain = Particles({name: source[name] for name in source if name != "damage"}, source.attributes)
    with pytest.raises(InputError, match="lacks damage"):
        whole_blocks.found(plain, rubble_bed.select(rubble_bed.block >= 0), region, ground)
