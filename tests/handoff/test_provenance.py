"""What grains are told of the matter that they stand for, against clouds whose marks are known."""

from __future__ import annotations

import numpy as np
import pytest

from fixtures import clouds
from fixtures.clouds import ARC_FLAT as ARC
from fixtures.clouds import DEPTH
from fixtures.flows import FIELDS, hemisphere
from handoff.domains import domain
from handoff.ledger_rows import account
from handoff.source import cloud_surface
from handoff.transfer import direct, grain_provenance, transfer
from matter.case import shock_phases
from matter.particles import ORIGINS

ICE = shock_phases.pressures("ice")
LIFT = 2.0


def marked():
    """Ice under a bowl: shocked to 20 GPa at its centre, half of that at every further 6 m; it rose by 2 m without
    turning, and one particle in 50 came with the projectile."""
    source = clouds.flat_source(1.3, ARC, DEPTH, hemisphere, FIELDS["translation"], density=1100.0)
    away = np.linalg.norm(source.position, axis=1)
    source["peak_pressure"] = 20e9 * 0.5 ** (away / 6.0)
    source["initial_position"] = source.position - np.array([0.0, 0.0, LIFT])
    source["layer"] = np.where(np.arange(len(source)) % 50 == 0, -1, 0)
    source["material"] = np.zeros(len(source))
    return source


@pytest.fixture(scope="module")
def handed(flat_bed, ground):
    source = marked()
    source["velocity"][:40] = [0.0, 0.0, 900.0]  # 40 particles of ejecta
    made = transfer.hand_over(source, flat_bed, cloud_surface.Rules(), ground)
    return source, made, account.ledger_of(made, source, flat_bed, ground, {})


def test_every_field_is_there_and_lies_within_what_the_cloud_holds(handed):
    source, made, _ = handed
    start = made.start
    assert set(ORIGINS) <= set(start)
    shares = [start[name] for name in ("vapour_fraction", "melt_fraction", "melting_fraction")]
    assert all(((0.0 <= part) & (part <= 1.0)).all() for part in shares)
    # the critical pressures stand in this order, so their shares do too
    assert (shares[0] <= shares[1]).all() and (shares[1] <= shares[2]).all()
    assert shares[1].sum() > 50 and shares[0].sum() == 0.0  # ice gives no pressure of vapour
    assert (start.peak_pressure_mean <= start.peak_pressure_largest * (1.0 + 1e-6)).all()
    assert start.peak_pressure_largest.max() <= source.peak_pressure.max() * (1.0 + 1e-6)


def test_a_grain_knows_the_depth_and_the_shock_of_its_own_place(handed):
    """A field that varies slowly over a grain comes back as its value at the grain."""
    _, made, _ = handed
    kept = len(made.start) - len(made.ejecta.mass)
    grains = made.start.select(np.arange(kept))
    true_depth, true_away = LIFT - grains.position[:, 2], np.hypot(grains.position[:, 0], grains.position[:, 1])
    spacing = 1.3
    assert np.sqrt(np.mean((grains.first_depth - true_depth) ** 2)) < 0.4 * spacing
    assert abs(np.mean(grains.first_depth - true_depth)) < 0.05 * spacing
    deep = true_away > 4.0 * spacing
    assert np.sqrt(np.mean((grains.first_distance - true_away)[deep] ** 2)) < 0.4 * spacing
    pressure = 20e9 * 0.5 ** (np.linalg.norm(grains.position, axis=1) / 6.0)
    assert np.median(np.abs(grains.peak_pressure_mean / pressure - 1.0)) < 0.05


def test_ejecta_are_their_particles(handed):
    source, made, _ = handed
    tail = made.start.select(np.arange(len(made.start))[-len(made.ejecta.mass) :])
    own = source.select(made.ejecta.source)
    assert len(own) >= 40
    assert tail.melt_fraction.tolist() == (own.peak_pressure > ICE["molten"]).astype(float).tolist()
    np.testing.assert_allclose(tail.peak_pressure_mean, own.peak_pressure, rtol=1e-6)
    np.testing.assert_array_equal(tail.peak_pressure_mean, tail.peak_pressure_largest)
    foreign = own.layer < 0
    assert foreign.any() and np.isnan(tail.first_depth[foreign]).all() and (tail.projectile_fraction == foreign).all()
    np.testing.assert_allclose(tail.first_depth[~foreign], -own.initial_position[~foreign, 2], rtol=1e-6)


@pytest.mark.validation
def test_the_assignment_is_the_one_that_momentum_takes(flat_bed, ground):
    """Told through the cells, a linear mark comes out as the velocity of the same linear field does."""
    source = marked()
    source["velocity"] = np.column_stack([source.initial_position[:, 2], np.zeros((len(source), 2))])
    source["layer"] = np.zeros(len(source))
    made = transfer.hand_over(source, flat_bed, cloud_surface.Rules(), ground)
    kept = len(made.start) - len(made.ejecta.mass)
    before = made.start.velocity[:kept, 0] - made.mapped.change[:, 0]
    level = -made.start.first_depth[:kept].astype(float)
    # the velocity also varies inside a particle: what is left between them is less than a spacing's worth
    assert np.corrcoef(before, level)[0, 1] > 0.998


def test_the_ledger_says_how_far_the_sums_agree(handed):
    source, made, ledger = handed
    inner = made.compact
    weight = np.zeros(len(source))
    weight[inner.indices] = source.mass[inner.indices] * inner.fraction
    weight[made.ejecta.source] += source.mass[made.ejecta.source]
    molten = float(weight @ (source.peak_pressure > ICE["molten"]))
    grains = float(made.start.mass @ made.start.melt_fraction.astype(float))
    row = ledger["origin_melt_fraction_rel"]
    assert row["value"] == pytest.approx((grains - molten) / molten, rel=1e-9) and abs(row["value"]) < 0.02
    foreign = float(weight @ (source.layer < 0))
    assert ledger["origin_projectile_fraction_rel"]["value"] == pytest.approx(
        float(made.start.mass @ made.start.projectile_fraction.astype(float)) / foreign - 1.0, abs=1e-6
    )
    assert abs(ledger["origin_projectile_fraction_rel"]["value"]) < 0.02
    assert abs(ledger["origin_first_depth_rel"]["value"]) < 0.01 and row["limit"] is None
    assert not [r for r in ledger.rows if r["name"] == "origin_vapour_fraction_rel"]  # nothing boiled


def test_through_the_cells_nothing_of_a_particle_is_lost(handed, flat_bed):
    """Before the masses of the grains are matched: what the cells took is what the particles hold, to rounding."""
    source, made, _ = handed
    region = domain.read(flat_bed.attributes)
    values = grain_provenance.of_particles(source, region)
    held = source.mass[made.compact.indices] * made.compact.fraction
    carving, kept = made.carving, np.flatnonzero(made.carving.stays)
    from scipy.spatial import cKDTree

    from handoff.transfer import mapping

    tree = cKDTree(source.position[made.compact.indices])
    cells = mapping.Overlap(carving.samples, carving.receiver, tree.data, flat_bed.position, kept)
    near = tree.query(flat_bed.position[kept])[1]
    took = grain_provenance.taken(source, made.compact.indices, held, cells, near, made.ejecta.source)
    seen = np.zeros(len(source), dtype=bool)
    seen[took.particle] = True
    inside = np.zeros(len(source))
    inside[made.compact.indices] = held
    inside[made.ejecta.source] += source.mass[made.ejecta.source]
    # the few particles that own no point are all that is missing
    assert took.mass.sum() == pytest.approx(inside[seen].sum(), rel=1e-12)
    assert inside[~seen].sum() < 2e-3 * inside.sum()
    for name in ("melt_fraction", "projectile_fraction"):
        total = np.bincount(took.grain, weights=took.mass, minlength=took.count)
        mean = np.nan_to_num(took.mean(values[name], of_target=False))
        assert total @ mean == pytest.approx(inside[seen] @ values[name][seen], rel=1e-12)


def test_grains_of_the_direct_transition_are_told_the_same(handed, flat_bed, ground):
    source, made, _ = handed
    straight = direct.hand_over(made, source, flat_bed, ground)
    own = source.select(straight.source)
    np.testing.assert_allclose(straight.start.peak_pressure_mean, own.peak_pressure, rtol=1e-6)
    assert straight.start.projectile_fraction.tolist() == (own.layer < 0).astype(float).tolist()


@pytest.mark.validation
def test_a_cloud_that_knows_less_gives_less(flat_bed, ground):
    source = clouds.flat_source(2.5, ARC, DEPTH, hemisphere, FIELDS["translation"], density=1100.0)
    made = transfer.hand_over(source, flat_bed, cloud_surface.Rules(), ground)
    assert set(made.start) & set(ORIGINS) == {"projectile_fraction"}
    assert [
        r["name"] for r in account.ledger_of(made, source, flat_bed, ground, {}).rows if "origin" in r["name"]
    ] == []
