"""The census as a whole: same bits for any number of threads and through a stop; the stage's files."""

import json
import tomllib

import numba
import numpy as np
import pytest

from matter import progress
from matter.errors import InputError, Stopped
from matter.files import checkpoint
from nbody import stage
from nbody.census import census
from nbody.population import conditions, encounters, rules

IMPACT = dict(
    speed="18.234 km/s",
    angle_from_vertical="40 deg",
    projectile=dict(material="ice", radius="53.9 km"),
    expected_transient_diameter="980 km",
)


def request(count=25, **changes):
    return census.Request("callisto", conditions.population("literal"), "fast", count, 4, **changes)


@pytest.fixture(scope="module")
def tally(tmp_path_factory):
    return census.collect(request(), tmp_path_factory.mktemp("census"))


def test_any_number_of_threads_gives_the_same_bits(tally, tmp_path):
    before = numba.get_num_threads()
    try:
        numba.set_num_threads(1 if before > 1 else before)
        other = census.collect(request(), tmp_path)
    finally:
        numba.set_num_threads(before)
    assert all(np.array_equal(tally.table[name], other.table[name]) for name in encounters.TABLE)


def test_stopped_census_resumes_bit_for_bit(tally, tmp_path):
    progress.request_stop()
    try:
        with pytest.raises(Stopped):
            census.collect(request(), tmp_path)
    finally:
        progress.clear_stop()
    assert checkpoint.newest(tmp_path)[1]["block"] == 1
    other = census.collect(request(), tmp_path)
    assert all(np.array_equal(tally.table[name], other.table[name]) for name in encounters.TABLE)
    assert (other.particles, other.steps, other.enough) == (tally.particles, tally.steps, tally.enough)


def test_a_census_stopped_at_its_end_flies_nobody_more(tally, tmp_path):
    census._save(request(), tmp_path, tally)
    other = census.collect(request(), tmp_path)
    assert (other.block, other.particles, other.enough) == (tally.block, tally.particles, tally.enough)
    assert all(np.array_equal(tally.table[name], other.table[name]) for name in encounters.TABLE)


def test_every_entry_has_a_collision(tally):
    table = tally.table
    for moon in (0, 1):
        count = {k: int(((table["event"] == k) & (table["moon"] == moon)).sum()) for k in (1, 2, 3, 4)}
        assert count[1] == count[2] == count[3] + (table["direct"][table["moon"] == moon]).sum()
    hits = encounters.select(table, (table["event"] == 2) & (table["direct"] == 0))
    assert np.degrees(hits["angle"].mean()) == pytest.approx(45.0, abs=4 * 19.6 / np.sqrt(len(hits["angle"])))


def test_bad_requests():
    with pytest.raises(InputError, match="count = -1"):
        request(count=-1)
    with pytest.raises(InputError, match="unknown integrator 'ias15'"):
        census.Request("callisto", conditions.population("literal"), "ias15", 5, 1)


def test_stage_leaves_its_files_and_pins_what_the_case_pins(tmp_path):
    settings = stage.Settings(impact=IMPACT, encounters=25, seed=4, latitude="14.7 deg")
    stage.run(settings, tmp_path, tmp_path)
    impact = tomllib.loads((tmp_path / "impact.toml").read_text())
    assert (impact["speed"], impact["angle_from_vertical"]) == ("18.234 km/s", "40 deg")
    assert impact["projectile"] == {"material": "ice", "radius": "53.9 km"}
    assert impact["source"]["pinned"] is True
    table, attributes = encounters.read(tmp_path / "encounters.h5")
    assert attributes["target"] == "callisto"
    retrograde = (table["event"] == 2) & (table["moon"] == 1) & (table["direct"] == 0) & (table["retrograde"] == 1)
    assert impact["source"]["found_speed"] == f"{table['speed'][retrograde].mean() / 1e3:.12g} km/s"
    assert impact["source"]["found_speed_count"] == retrograde.sum()
    report = json.loads((tmp_path / "nbody_report.json").read_text())
    assert report["jacobi_drift_over_gm_over_a"]["maximum"] < 1e-7
    assert len(list(tmp_path.glob("checkpoint_*"))) <= 1


def test_unpinned_impact_carries_what_was_found(tally):
    settings = stage.Settings(impact=IMPACT, pinned=False, encounters=25, seed=4)
    choice = rules.apply(settings.rule, tally.table, 1, None, 4)
    impact = tomllib.loads(stage.impact_toml(settings, choice))
    assert impact["speed"] == impact["source"]["found_speed"] != "18.234 km/s"


def test_rules(tally):
    everything = rules.apply("mean of all impacts", tally.table, 1, None, 1)
    fastest = rules.apply("maximum of all impacts", tally.table, 1, None, 1)
    median = rules.apply("quantile 0.5 of all impacts", tally.table, 1, None, 1)
    one = rules.apply("draw one", tally.table, 1, None, 1)
    assert fastest.speed.value > everything.speed.value and fastest.speed.value >= median.speed.value
    assert one.speed.value in tally.table["speed"] and one.speed.impacts == 1
    with pytest.raises(ValueError, match="unknown rule"):
        rules.check("median of retrograde")


def test_unknown_keys_and_rules_are_refused():
    with pytest.raises(ValueError, match="unknown rule"):
        stage.Settings(impact=IMPACT, rule="fastest")
    with pytest.raises(ValueError, match="Extra inputs"):
        stage.Settings(impact=IMPACT, encouters=5)
