"""The limit of spin of a ball of grains: its closed form, the plates that measure the packing's angle, and (slow) the
ball itself."""

import math

import numpy as np
import pytest

from dem.contact.settings import Contact, GrainLaw
from studies import spin_limit


def law(friction: float) -> Contact:
    return Contact(shell=GrainLaw(friction=friction, shape=0.4))


def test_the_closed_form():
    assert spin_limit.limit(30.0) == pytest.approx(0.816, abs=5e-4)
    assert spin_limit.limit(40.0) == pytest.approx(0.885, abs=5e-4)
    # the stresses of a turning ball, sigma_equator / sigma_pole = 1 - Omega^2, on Mohr and Coulomb's limit
    sine = math.sin(math.radians(35.0))
    assert 1.0 - spin_limit.limit(35.0) ** 2 == pytest.approx((1.0 - sine) / (1.0 + sine))


def test_without_friction_it_is_maclaurins_spheroid():
    e = 0.6
    level = 2.0 * math.sqrt(1.0 - e**2) / e**3 * (3.0 - 2.0 * e**2) * math.asin(e) - 6.0 * (1.0 - e**2) / e**2
    found = spin_limit.limit(0.0, (200.0, 200.0, 160.0))
    assert found**2 * 4.0 / 3.0 == pytest.approx(level, rel=1e-6)  # omega^2 / (pi G rho)
    assert spin_limit.limit(35.0, (200.0, 200.0, 160.0)) > spin_limit.limit(0.0, (200.0, 200.0, 160.0)) + 0.3


@pytest.mark.validation
def test_plates_press_evenly_and_then_along_one_axis():
    smooth, rough = (spin_limit.compressed(250, 1, law(friction), most=0.012) for friction in (0.05, 0.6))
    for rows in (smooth, rough):
        assert abs(rows[0, 0]) < 1e-3 and rows[0, 2] < 0.2
        assert rows[-1, 0] > 0.011 and rows[-1, 1] < -0.003  # across it the packing widens
    assert spin_limit.angle_at(rough, 0.01) > spin_limit.angle_at(smooth, 0.01) + 8.0
    assert np.all(np.diff(rough[::10, 2])[:3] > 0.0)


@pytest.mark.validation
def test_a_ball_holds_below_its_limit_and_fails_above():
    found = spin_limit.measured(1500, 1, law(0.55))
    assert 38.0 < found["angle_deg"] < 46.0
    assert found["change_at_minus_4_percent"] < spin_limit.FAILED
    assert found["change_let_go"] < 1e-3
    assert 0.96 < found["failed_over_limit"] < 1.04
