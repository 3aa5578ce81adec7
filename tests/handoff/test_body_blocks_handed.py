"""Blocks of a whole body at the handover: whole ones are grains in the turned body, and one above the surface that is
fast enough goes into the list with its particles; ground as fast in contact does not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from handoff import away, stage
from handoff.domains import domain, turning
from handoff.ledger_rows import account, block_rows, whole_body_rows
from handoff.settings import Settings
from handoff.source import cloud_surface, two_body
from handoff.transfer import carve
from handoff.transfer.ejecta import BOOKED
from matter.constants import G
from matter.files import snapshot
from matter.geometry.rotation import rotation
from matter.particles import Particles
from tests.handoff.test_whole_body import BODY, DATUM, DENSITY, OMEGA, TIME, bed, column, source

pytestmark = pytest.mark.usefixtures("fewer_points")

RADIUS = 14.0
UP, ALONG = DATUM.normal, np.array([1.0, 0.0, 0.0])
SITE = DATUM.site - 22.0 * UP
PLACES = np.array([SITE, -SITE, SITE - 34.0 * ALONG, SITE + 34.0 * ALONG])
"""Of a block that is thrown off, one that stays, a broken one, and one that the ground carries along."""
THROWN, STAYS, BROKEN, CARRIED = range(4)
RISEN = 60.0 * UP
ESCAPE = math.sqrt(2.0 * G * DENSITY * BODY.placed.solid.volume / np.linalg.norm(SITE))
ROWS = ("whole_mass_rel", "whole_momentum_rel", "whole_angular_momentum_rel")


def with_blocks(plain: Particles) -> Particles:
    """A bed with four large grains for those of its grains that lie in them."""
    gap = np.linalg.norm(plain.position[:, None] - PLACES, axis=2) - RADIUS
    stays = (gap > 0.9 * plain.radius[:, None]).all(axis=1)
    rest = plain.select(stays)
    blocks = rest.select(np.arange(len(PLACES)))
    blocks["identity"] = int(plain.identity.max()) + 1 + np.arange(len(PLACES))
    blocks["position"], blocks["radius"] = PLACES, np.full(len(PLACES), RADIUS)
    blocks["mass"] = np.full(len(PLACES), 4.0 / 3.0 * np.pi * RADIUS**3 * 2.0 * DENSITY)
    blocks["density"] = np.full(len(PLACES), 2.0 * DENSITY)
    blocks["velocity"] = np.cross(OMEGA, PLACES)
    fields = {name: np.concatenate([rest[name], blocks[name]]) for name in rest}
    fields["block"] = np.concatenate([np.full(len(rest), -1), 3 + np.arange(len(PLACES))])
    return Particles(fields, plain.attributes, carve.surviving_tables(plain, stays))


@pytest.fixture(scope="module")
def cloud():
    """The body at TIME with the particles of its blocks: one far above it and faster than escape, one below the
    surface as fast, with the ground about it at rest."""
    made = source(dug=False, moving=False)
    turn = rotation(OMEGA * TIME)
    position, velocity = made.position @ turn, made.velocity @ turn
    block = np.full(len(made), -1)
    for j, place in enumerate(PLACES):
        block[np.linalg.norm(position - place, axis=1) < RADIUS] = 3 + j
    thrown, carried = block == 3 + THROWN, block == 3 + CARRIED
    position[thrown] += RISEN
    velocity[thrown] += 1.5 * ESCAPE * UP
    velocity[carried] += 1.5 * ESCAPE * UP
    made["position"], made["velocity"] = position @ turn.T, velocity @ turn.T
    made["block"], made["damage"] = block, np.where(block == 3 + BROKEN, 1.0, 0.1)
    made["mass"] = np.where(block >= 0, 2.0, 1.0) * made.mass
    made["density"] = np.where(block >= 0, 2.0, 1.0) * made.density
    return made


@pytest.fixture(scope="module")
def handed(cloud, fewer_points):
    settled = with_blocks(bed())
    region = domain.read(settled.attributes, BODY)
    along = turning.to_bed(cloud, region)
    carved, made = stage._handed(along, settled, cloud_surface.Rules(crater="any"), column(), region, 7200.0)
    start = turning.to_run(made.start, region)
    ledger = account.ledger_of(made, along, carved, column(), {})
    whole_body_rows.enter(ledger, made, cloud, start)
    return made, start, ledger


def test_whole_blocks_are_grains_of_the_turned_body(handed, cloud):
    _, start, ledger = handed
    grains = start.select(start.block >= 0)
    assert grains.block.tolist() == [3 + THROWN, 3 + STAYS, 3 + CARRIED]
    for k, number in enumerate(grains.block):
        mine = cloud.select(cloud.block == number)
        assert grains.mass[k] == pytest.approx(mine.mass.sum(), rel=1e-12)
        np.testing.assert_allclose(grains.mass[k] * grains.velocity[k], mine.mass @ mine.velocity, rtol=1e-9)
        centre = mine.mass @ mine.position / mine.mass.sum()
        assert np.linalg.norm(grains.position[k] - centre) <= 0.1 * RADIUS
    still = grains.angular_velocity[1]  # what rests in the ground turns with it, as far as a sphere has its inertia
    assert still @ OMEGA == pytest.approx(OMEGA @ OMEGA, rel=0.1)
    assert {name: ledger[name]["verdict"] for name in block_rows.LIMITS} == dict.fromkeys(block_rows.LIMITS, "pass")


def test_the_rows_of_the_whole_body_hold_with_blocks(handed, cloud):
    made, start, ledger = handed
    for name in ROWS:
        assert ledger[name]["verdict"] == "pass" and "whole blocks" in ledger[name]["note"], ledger[name]
    assert start.mass.sum() == pytest.approx(cloud.mass.sum(), rel=1e-12)
    parts = whole_body_rows.parts(made, cloud, start)
    thrown = cloud.block == 3 + THROWN
    assert parts["whole blocks"].mass == pytest.approx(
        cloud.mass[(cloud.block == 3 + STAYS) | (cloud.block == 3 + CARRIED)].sum(), rel=1e-12
    )
    assert parts["in the list"].mass >= cloud.mass[thrown].sum() * (1.0 - 1e-12)


def test_only_a_block_clear_of_the_ground_is_in_the_list(handed, cloud, tmp_path):
    made, start, ledger = handed
    grains = start.select(start.block >= 0)
    assert (grains.state == BOOKED).tolist() == [True, False, False]
    attributes = away.leave(Settings(target=BODY), made, cloud, tmp_path, tmp_path)
    assert "shot" in attributes
    listed = snapshot.read(tmp_path / away.LIST_FILE)
    mine = cloud.select(cloud.block == 3 + THROWN)
    of_block = listed.select(listed.block == 3 + THROWN)
    assert len(of_block) == len(mine) and of_block.mass.sum() == pytest.approx(mine.mass.sum(), rel=1e-12)
    assert (listed.tables["fate"][listed.block == 3 + THROWN] == two_body.ESCAPES).all()
    assert len(listed.tables["fate"]) == len(listed) and not (listed.block == 3 + CARRIED).any()
    assert ledger["block_mass_beyond"]["value"] == pytest.approx(mine.mass.sum(), rel=1e-12)
    assert ledger["block_mass_beyond"]["note"].startswith("1 whole blocks, (")


@pytest.mark.parametrize("name, field", [("whole_mass_rel", "mass"), ("whole_momentum_rel", "velocity")])
def test_a_fault_in_one_block_is_seen(handed, cloud, name, field):
    made, start, ledger = handed
    spoilt = Particles(start, start.attributes)
    values = np.array(start[field])
    values[-1] *= 1.0 + 1e-6
    spoilt[field] = values
    again = type(ledger)()
    whole_body_rows.enter(again, made, cloud, spoilt)
    assert again[name]["verdict"] == "fail" and ledger[name]["verdict"] == "pass"
