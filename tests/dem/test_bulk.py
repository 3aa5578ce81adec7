"""Flows of many grains: small ones always, those that are compared with experiments with ``pytest -m validation`` (an
hour of one core)."""

import math

import numpy as np
import pytest

from dem.contact.settings import Contact
from matter.errors import InputError
from studies.granular import bulk_flows, collapsed_column

CONTACT = Contact(steps_per_contact=20)


def test_a_small_column_runs_out():
    """Ten grains across: the run-out is below that of experiments with many (12 % at 18 grains across, 17 % at 10),
    the height is theirs."""
    found = collapsed_column.column(0.6, 8.0, CONTACT)
    assert 0.6 < found.runout / found.expected < 1.1
    assert found.height == pytest.approx(found.aspect, abs=0.15)
    assert found.duration < 12.0 * math.sqrt(8.0 * 0.6)


def test_the_front_of_a_wedge():
    place = np.arange(0.5, 30.0)
    deep = np.maximum(0.0, 4.0 - 0.2 * place)
    reach, slope = collapsed_column.front(place, deep)
    assert reach == pytest.approx(20.0, abs=0.3) and slope == pytest.approx(-0.2, abs=0.01)


def test_beverloo_is_a_power_of_five_halves():
    rate = bulk_flows.beverloo(np.array([5.4, 9.4]), 0.6)
    assert rate[1] / rate[0] == pytest.approx(2.0**2.5)
    assert rate[0] == pytest.approx(0.58 * 0.6 * 32.0)


def test_a_rate_and_its_error():
    time = np.arange(0.0, 40.0, 0.5)
    noise = 0.2 * np.sin(2.7 * time)
    rate, error = bulk_flows._slope(time, 3.0 * time + noise)
    assert rate == pytest.approx(3.0, abs=0.02) and 0.0 < error < 0.05
    assert bulk_flows._slope(time[:3], time[:3])[1] == math.inf


def test_too_small_a_filling_is_refused():
    with pytest.raises(InputError, match="too few"):
        bulk_flows.filled(1.0, 1.0, [], CONTACT)


@pytest.mark.validation
@pytest.mark.parametrize("aspect, radius", [(0.5, 32.0), (1.0, 20.0), (2.0, 18.0), (5.0, 14.0)])
def test_run_out_of_columns(aspect, radius):
    found = collapsed_column.column(aspect, radius, CONTACT)
    assert found.runout == pytest.approx(found.expected, rel=0.15)


@pytest.mark.validation
def test_a_hopper_drains_with_the_power_five_halves():
    full = bulk_flows.filling(12.0, 16.0, CONTACT)
    rows = [bulk_flows.hopper(hole, full, 12.0, CONTACT) for hole in (8.0, 10.0, 12.0, 14.0)]
    exponent = np.polyfit(np.log([row.hole - 1.4 for row in rows]), np.log([row.rate for row in rows]), 1)[0]
    assert exponent == pytest.approx(2.5, abs=0.25)


@pytest.mark.validation
def test_the_angle_of_repose():
    found = bulk_flows.heap(19.0, CONTACT)
    assert 20.0 < found.angle_deg < 35.0


@pytest.mark.validation
def test_thirty_degrees_hold_on_another_seed_and_by_tilt():
    from dem.trials import friction_angle

    friction, _, _ = friction_angle.friction_for(30.0, Contact())
    found = friction_angle.with_friction(Contact(), friction)
    assert friction_angle.measure(found, "shear", seed=7)["mohr_coulomb_deg"] == pytest.approx(30.0, abs=1.0)
    assert friction_angle.measure(found, "tilt", seed=1, begin=20.0)["mohr_coulomb_deg"] == pytest.approx(
        30.0, abs=1.0
    )


@pytest.mark.validation
def test_smooth_round_grains_keep_six_degrees():
    from dem.contact.settings import GrainLaw
    from dem.trials import friction_angle

    angle = friction_angle.measure(Contact(shell=GrainLaw(friction=0.0, shape=0.0)), "shear", seed=1)["angle_deg"]
    assert 5.0 < angle < 7.0
