"""Ejecta as grains: bookkeeping, states, and no overlaps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fixtures import clouds
from handoff.ledger_rows import account
from handoff.source import cloud_surface, hydrostatic
from handoff.transfer import ejecta, transfer


@pytest.fixture(scope="module")
def thrown(sphere_cloud, sphere_bed):
    source = clouds.sphere_source(sphere_cloud, 480e3, 180e3, 40e3, velocity=lambda p: np.zeros_like(p), curtain=240)
    # some ejecta so low that they touch the bed and each other
    low = np.flatnonzero(source.neighbours == 2)[:60]
    up = source.position[low] / np.linalg.norm(source.position[low], axis=1)[:, None]
    source.position[low] = (np.linalg.norm(source.position[low], axis=1) * 0.0 + clouds.R_BODY + 75e3)[:, None] * up
    column = hydrostatic.from_target(clouds.target_table(), clouds.R_BODY)
    made = transfer.hand_over(source, sphere_bed, cloud_surface.Rules(), column)
    return source, sphere_bed, column, made


def test_every_ejecta_particle_is_one_grain_with_its_mass_and_velocity(thrown):
    source, bed, _, made = thrown
    count = int(made.carving.stays.sum())
    out = np.flatnonzero(~made.split.compact)
    start = made.start
    assert len(start) == count + len(out)
    np.testing.assert_array_equal(start.mass[count:], source.mass[out])
    np.testing.assert_array_equal(start.velocity[count:], source.velocity[out])
    np.testing.assert_array_equal(made.ejecta.source, out)
    assert len(np.unique(start.identity)) == len(start) and start.identity[count:].min() > bed.identity.max()
    assert start.mass.sum() == pytest.approx(made.sums.before.mass, rel=1e-12)
    assert sum(made.ejecta.mass_by_state().values()) == pytest.approx(source.mass[out].sum(), rel=1e-12)


def test_no_overlap_with_the_bed_or_among_the_ejecta(thrown):
    _, _, _, made = thrown
    start, count = made.start, int(made.carving.stays.sum())
    active = np.flatnonzero(start.state == 0)
    pairs = active[cKDTree(start.position[active]).query_pairs(2.0 * start.radius.max(), output_type="ndarray")]
    pairs = pairs[(pairs >= count).any(axis=1)]
    overlap = start.radius[pairs].sum(axis=1) - np.linalg.norm(
        start.position[pairs[:, 0]] - start.position[pairs[:, 1]], axis=1
    )
    assert len(pairs) > 20
    assert overlap.max() <= 1e-9 * start.radius.max()
    assert np.count_nonzero(made.ejecta.moved) + made.ejecta.shrunk > 0


def test_overlaps_are_reported_where_they_are(thrown):
    """An ejecta grain blown up until it presses into the bed shows in all three rows."""
    source, bed, column, made = thrown
    book = account.ledger_of(made, source, bed, column, {})
    assert book["overlap_max_over_r"]["value"] == 0.0
    stay, flying = int(made.carving.stays.sum()), np.flatnonzero(made.ejecta.state == 0)
    distance, _ = cKDTree(made.start.position[:stay]).query(made.ejecta.position[flying])
    one = stay + int(flying[np.argmin(distance)])
    radius = made.start.radius[one]
    made.start.radius[one] = 3.0 * radius
    try:
        book = account.ledger_of(made, source, bed, column, {})
    finally:
        made.start.radius[one] = radius
    for name in ("overlap_max_over_r", "overlap_energy_over_KE"):
        assert book[name]["value"] > 0.0


def test_states(thrown):
    _, bed, column, made = thrown
    flying = made.ejecta
    speed = np.linalg.norm(flying.velocity, axis=1)
    radius = np.linalg.norm(flying.position, axis=1)
    rising = np.einsum("ij,ij->i", flying.velocity, flying.position) > 0.0
    escaping = rising & (speed >= column.escape_speed(radius - clouds.R_BODY))
    assert escaping.any() and np.all(flying.state[escaping] == ejecta.BOOKED)
    light = flying.mass < 0.1 * bed.mass[made.carving.stays].min()
    assert light.any() and np.all(flying.state[light & ~escaping] != ejecta.IN_CONTACT)
    assert (flying.state == ejecta.IN_CONTACT).any()
    ratio = flying.radius**3 * flying.density / flying.mass
    assert ratio.min() >= 0.124 * ratio.max()  # shrunk to no less than half the radius


def test_light_grains_do_not_shorten_the_contact_time(thrown):
    _, bed, _, made = thrown
    count = int(made.carving.stays.sum())
    period = np.sqrt(made.start.mass / made.start.stiffness)
    assert (
        period[count:].min()
        >= 0.999 * np.median(made.start.mass[:count]) ** 0.5 / bed.stiffness[made.carving.stays].min() ** 0.5
    )


def test_materials_and_species_follow_the_source(thrown):
    source, _, _, made = thrown
    count, start = int(made.carving.stays.sum()), made.start
    names = start.attributes["materials"]
    near = cKDTree(source.position[made.compact.indices]).query(start.position[:count])[1]
    expected = [source.attributes["materials"][k] for k in source.material[made.compact.indices][near]]
    assert [names[k] for k in start.material[:count]] == expected
    water = start.material == names.index("water")
    assert np.all(start.species[water] == 1) and np.all(start.species[start.material == names.index("ice")] == 0)


def test_compact_matter_and_ejecta_count_apart(thrown):
    """Ejecta hold all of the energy but a thousandth: a bed that loses its own passes the sum over both, and fails its
    own row."""
    source, bed, column, made = thrown
    start = made.start
    ejecta = np.arange(len(start)) >= int(made.carving.stays.sum())
    energy = made.ejecta_energy
    assert energy == pytest.approx(0.5 * np.sum(start.mass[ejecta, None] * start.velocity[ejecta] ** 2))
    own = 1e-3 * energy
    for kept, verdict in ((0.0, "fail"), (0.89, "fail"), (0.95, "pass"), (1.05, "pass"), (1.11, "fail")):
        before, after = (
            replace(made.sums.before, kinetic=energy + own),
            replace(made.sums.after, kinetic=energy + kept * own),
        )
        changed = replace(made, sums=replace(made.sums, before=before, after=after))
        book = account.ledger_of(changed, source, bed, column, {})
        assert book["kinetic_energy_change_min"]["verdict"] == "pass"
        assert book["kinetic_energy_compact_change"]["verdict"] == verdict
        assert book["kinetic_energy_compact_change"]["value"] == pytest.approx(abs(kept - 1.0), abs=1e-6)
    # the strain energy that is given up counts against what moves in the bed alone
    assert float(book["elastic_over_kinetic_energy"]["note"].split(" J")[0]) == pytest.approx(
        book["elastic_over_kinetic_energy"]["value"] * own, rel=1e-3
    )
