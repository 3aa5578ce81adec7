"""Grains that stand for loosened matter: their size, what they hold, which contacts stay; that they pack again."""

from __future__ import annotations

import json

import numpy as np
import pytest

from dem import stage as dem_stage
from dem.beds.flat_ground import ground_of
from dem.collapse import collapse_run as collapsing
from fixtures import clouds
from fixtures.clouds import ARC_FLAT as ARC
from fixtures.clouds import DEPTH
from fixtures.flows import FIELDS, hemisphere
from handoff.domains import domain
from handoff.ledger_rows import account
from handoff.settings import Settings
from handoff.source import cloud_surface, hydrostatic
from handoff.transfer import bulking, ejecta, mapping, transfer
from matter.case import material
from matter.errors import InputError
from tests.dem.test_flat_bed import settled, write_ground

pytestmark = pytest.mark.usefixtures("fewer_points")

ICE = material.reference_density("ice")
LOOSE, FACTOR = 0.7, 0.7 ** (1.0 / 3.0)


def half_loose():
    """Turning ice under a bowl, as dense as its reference where x > 0, 0.7 of that elsewhere."""
    source = clouds.flat_source(1.7, ARC, DEPTH, hemisphere, FIELDS["rotation"], density=ICE)
    share = np.where(source.position[:, 0] > 0.0, 1.0, LOOSE)
    source["density"], source["mass"] = source.density * share, source.mass * share
    return source


@pytest.fixture(scope="module")
def handed(flat_bed, ground, fewer_points):
    source = half_loose()
    made = {
        rule: transfer.hand_over(source, flat_bed, cloud_surface.Rules(loosened=rule), ground)
        for rule in ("full_size", "shrunk")
    }
    ledgers = {rule: account.ledger_of(one, source, flat_bed, ground, {}) for rule, one in made.items()}
    return source, made, ledgers


def test_the_law():
    share = np.array([0.3, 0.5, 0.7, 0.97, 0.985, 1.0, 1.3])
    least = 0.5 ** (1.0 / 3.0)
    expected = [least, least, FACTOR, 0.97 ** (1.0 / 3.0), 1.0, 1.0, 1.0]
    np.testing.assert_allclose(bulking.radius_factor(share), expected, rtol=1e-14)


def test_grains_of_the_loose_half_shrink_and_no_others(handed, flat_bed):
    _, made, _ = handed
    bed = flat_bed.select(made["shrunk"].carving.stays)
    ratio = made["shrunk"].start.radius / bed.radius
    x = bed.position[:, 0]
    np.testing.assert_allclose(ratio[x < -3.0], FACTOR, rtol=1e-12)
    assert np.all(ratio[x > 3.0] == 1.0)
    assert np.all((ratio >= FACTOR * (1.0 - 1e-12)) & (ratio <= 1.0))
    np.testing.assert_array_equal(made["full_size"].start.radius, bed.radius)


def test_a_shrunk_grain_is_as_dense_as_packed_matter(handed, flat_bed):
    _, made, _ = handed
    start, stays = made["shrunk"].start, made["shrunk"].carving.stays
    own = start.mass / (4.0 / 3.0 * np.pi * start.radius**3)
    left, right = (flat_bed.position[stays][:, 0] * side > 3.0 for side in (-1.0, 1.0))
    assert own[left].mean() == pytest.approx(own[right].mean(), rel=0.02)
    assert start.density[left].mean() == pytest.approx(ICE, rel=0.02)  # single cells scatter by some per cent
    assert made["full_size"].start.density[left].mean() == pytest.approx(LOOSE * ICE, rel=0.02)


def test_mass_and_momenta_are_those_of_the_source(handed):
    source, made, ledgers = handed
    one, other = made["full_size"], made["shrunk"]
    np.testing.assert_array_equal(one.start.mass, other.start.mass)
    compact = other.compact
    held = source.mass[compact.indices] * compact.fraction
    flow = held[:, None] * source.velocity[compact.indices]
    start = other.start
    turning = (0.4 * start.mass * start.radius**2)[:, None] * start.angular_velocity
    assert np.linalg.norm(turning.sum(axis=0)) > 0.0
    moved = start.mass[:, None] * start.velocity
    angular = np.cross(start.position, moved).sum(axis=0) + turning.sum(axis=0)
    scale = np.sum(np.linalg.norm(flow, axis=1))
    arm = np.sum(np.linalg.norm(flow, axis=1) * np.linalg.norm(compact.centre, axis=1))
    assert start.mass.sum() == pytest.approx(held.sum(), rel=1e-13)
    assert np.linalg.norm(moved.sum(axis=0) - flow.sum(axis=0)) < 1e-12 * scale
    assert np.linalg.norm(angular - np.cross(compact.centre, flow).sum(axis=0)) < 1e-12 * arm
    for row in ledgers["shrunk"].rows:
        if row["name"] in ("bulk_density_rel", "cavity_volume_rel", "cavity_hausdorff_over_r"):
            assert row["value"] == ledgers["full_size"][row["name"]]["value"]
    assert [row["name"] for row in ledgers["shrunk"].rows if row["verdict"] == "fail"] == [
        row["name"] for row in ledgers["full_size"].rows if row["verdict"] == "fail"
    ]


def test_the_ledger_says_how_many_and_how_much(handed):
    _, made, ledgers = handed
    row = ledgers["shrunk"]["grains_shrunk"]
    count = np.count_nonzero(made["shrunk"].start.radius < made["full_size"].start.radius)
    assert row["value"] == count > 1000 and f"smallest {FACTOR:.3f}" in row["note"]
    assert all(one["name"] != "grains_shrunk" for one in ledgers["full_size"].rows)


def test_only_contacts_that_still_touch_stay(handed, flat_bed):
    _, made, _ = handed
    start, before = made["shrunk"].start, made["full_size"].start
    place = {int(number): k for k, number in enumerate(start.identity)}

    def rows(grains):
        return {
            tuple(pair): history
            for pair, history in zip(grains.tables["contacts/pair"].tolist(), grains.tables["contacts/history"])
        }

    was, now = rows(before), rows(start)
    assert set(now) < set(was)
    same = shrunk = opened = 0
    for (one, other), history in was.items():
        i, j = place[one], place[other]
        distance = np.linalg.norm(start.position[i] - start.position[j])
        full, small = (grains.radius[i] + grains.radius[j] - distance for grains in (before, start))
        if full == small:
            np.testing.assert_array_equal(now[(one, other)], history)
            same += 1
        elif small > 0.0:
            np.testing.assert_allclose(now[(one, other)], history * (small / full), rtol=1e-9)
            shrunk += 1
        else:
            assert (one, other) not in now
            opened += 1
    assert min(same, opened) > 1000 and shrunk > 10
    region = domain.read(flat_bed.attributes)
    for grain, _ in start.tables["contacts/wall_pair"].tolist():
        i = place[grain]
        assert start.radius[i] == before.radius[i] or start.radius[i] > region.wall_depth(start.position[i : i + 1])[0]
    assert 0 < len(start.tables["contacts/wall_pair"]) < len(before.tables["contacts/wall_pair"])


def test_an_offset_counts_as_overlap(flat_bed):
    """Two contacts of the same grains but for an offset: only what the offset holds closed stays."""
    two = flat_bed.select(np.arange(2))
    two["position"], two["radius"] = np.array([[0.0, 0.0, -5.0], [1.9, 0.0, -5.0]]), np.ones(2)
    history = np.zeros((1, 8))
    history[0, 0] = 0.3
    for offset, left in ((0.0, 0), (0.4, 1), (-0.05, 0)):
        history[0, 7] = offset
        tables = {"contacts/pair": np.sort(two.identity)[None], "contacts/history": history}
        kept = bulking.contacts_kept(tables, two, np.array([0.8, 1.0]), domain.read(flat_bed.attributes))
        assert len(kept["contacts/pair"]) == len(kept["contacts/history"]) == left
        if left:
            assert kept["contacts/history"][0, 0] == pytest.approx(0.3 * (0.1 - 0.2 + 0.4) / (0.1 + 0.4))
            assert kept["contacts/history"][0, 7] == offset


def test_a_material_that_is_not_known_is_held_against_the_bed(flat_bed, ground):
    source = half_loose()
    source.attributes["materials"] = ["unheard of"]
    source["density"], source["mass"] = source.density * 950.0 / ICE, source.mass * 950.0 / ICE
    bed = flat_bed.select(np.ones(len(flat_bed), dtype=bool))
    bed.tables = flat_bed.tables
    start = transfer.hand_over(source, bed, cloud_surface.Rules(loosened="shrunk"), ground).start
    full = bed.radius[np.isin(bed.identity, start.identity)]
    x = start.position[:, 0]
    np.testing.assert_allclose((start.radius / full)[x < -3.0], FACTOR, rtol=1e-12)
    assert np.all((start.radius / full)[x > 3.0] == 1.0)
    with pytest.raises(InputError, match="material that is not known here"):
        bulking.packed_fraction(
            np.ones(3), np.array([900.0, 0.0, 900.0]), mapping.Overlap, np.zeros(3, dtype=int), None
        )


def test_ejecta_are_as_dense_as_packed_matter(flat_bed, ground):
    source = half_loose()
    flying = np.arange(0, len(source), 40)
    source["position"][flying] = 2.0 * source.position[flying] + [0.0, 0.0, 120.0]  # none touches another
    region = domain.read(flat_bed.attributes)
    radius = {
        rule: ejecta.from_source(
            source, flying, flat_bed, 0.6, region, ground, rules=cloud_surface.Rules(loosened=rule)
        )
        for rule in ("full_size", "shrunk")
    }
    loose = source.position[flying, 0] <= 0.0
    ratio = radius["shrunk"].radius / radius["full_size"].radius
    np.testing.assert_allclose(ratio[loose], FACTOR, rtol=1e-12)
    np.testing.assert_array_equal(ratio[~loose], 1.0)


def test_shrunk_is_the_default():
    assert Settings().loosened == cloud_surface.Rules().loosened == "shrunk"


@pytest.fixture(scope="module")
def settled_ground(tmp_path_factory):
    return settled(tmp_path_factory.mktemp("bed"), radius_spread=0.0, arc_radius=9.0, count=700)[0]


@pytest.mark.validation
@pytest.mark.parametrize("rule", ["full_size", "shrunk"])
def test_loosened_ground_packs_again(tmp_path, settled_ground, rule):
    """Ground at rest whose upper 4 m are at 0.7 of their density: shrunk, it sinks to the height of the packed matter;
    at full size it stays."""
    bed, depth, loose = settled_ground, 9.0, 4.0
    source = clouds.flat_source(
        0.9, depth, depth, lambda p: np.zeros(len(p)), lambda p: np.zeros_like(p), density=1500.0
    )
    share = np.where(source.position[:, 2] > -loose, LOOSE, 1.0)
    source["density"], source["mass"] = source.density * share, source.mass * share
    source["distention"] = np.full(len(source), material.reference_density("basalt") / 1500.0)
    source.attributes["materials"] = ["basalt"]
    rules = cloud_surface.Rules(crater="any", loosened=rule)
    column = hydrostatic.uniform(1.0, 1500.0, depth)
    start = transfer.hand_over(source, bed, rules, column).start
    write_ground(tmp_path / "2_sph" / "target.json", depth=depth)
    (tmp_path / "5_dem").mkdir()
    run = dem_stage.Settings(
        end_time=112.0, latest_time=112.0, still_interval=4.0, snapshot_interval=4.0, history_interval=1.0
    )
    collapse = collapsing.Collapse(run, start, ground_of(tmp_path / "2_sph" / "target.json"), tmp_path / "5_dem")
    collapse.advance()
    collapse.finish()
    last = collapse.bed.particles({})
    report = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    assert report["momentum_error"] < 1e-9 and abs(report["energy_error"]) < 0.02
    assert last.mass.sum() == pytest.approx(start.mass.sum(), rel=1e-12)
    settled_grains = bed.select(np.isin(bed.identity, last.identity))

    def height(grains):
        """Of ground that these spheres fill evenly: twice that of their centre."""
        return 2.0 * np.average(grains.position[:, 2] + depth, weights=grains.radius**3)

    packed = np.sum(last.radius**3) / np.sum(settled_grains.radius**3)
    if rule == "full_size":
        assert packed == 1.0 and height(last) == pytest.approx(height(settled_grains), rel=2e-3)
    else:
        expected = (depth - loose + LOOSE * loose) / depth
        assert packed == pytest.approx(expected, abs=0.01)
        # poured together again it is 2.5 % looser than a bed that was settled with care
        assert 1.0 < height(last) / (packed * height(settled_grains)) < 1.04
