"""The production kernels against exact solutions beyond plane shocks (``solutions.py``)."""

import math

import numpy as np
import pytest
import solutions


def test_constants_of_the_blast_wave():
    """beta of the literature: 0.851 at gamma = 1.4, 0.494 at 5/3."""
    assert solutions.blast_constant(1.4) == pytest.approx(0.851, rel=1e-3)
    assert solutions.blast_constant(5.0 / 3.0) == pytest.approx(0.4936, rel=1e-3)


def test_angle_of_slope():
    assert math.degrees(solutions.angle_of_slope(math.radians(30.0))) == pytest.approx(34.715, abs=1e-3)


@pytest.mark.validation
@pytest.mark.parametrize("name", ["basalt", "ice"])
@pytest.mark.parametrize("transverse", [False, True])
def test_elastic_waves_run_at_the_speed_of_their_moduli(name, transverse):
    assert solutions.elastic_speed(name, transverse) == pytest.approx(1.0, abs=0.015)


@pytest.mark.validation
def test_a_slope_of_dry_sand_stands_up_to_its_angle():
    """Two degrees below it stays; two above it gains 7 % of free sliding, as friction at tan(theta) = B leaves it."""
    angle, more = solutions.angle_of_slope(math.radians(30.0)), math.radians(2.0)
    assert abs(solutions.slope(angle - more)) < 0.01
    wanted = math.sin(more) / (math.cos(angle) * math.sin(angle + more))
    assert solutions.slope(angle + more) == pytest.approx(wanted, rel=0.3)


@pytest.mark.validation
def test_a_ball_collapses_in_free_fall():
    """Half-mass radius at 0.8 of the free-fall time within 1 %; what is left is the softening of gravity (1.8 % at 24 spacings across, 3.5 % at 16)."""
    assert solutions.collapse(40, 0.8) == pytest.approx(1.0, abs=0.01)


@pytest.mark.validation
def test_strength_of_a_rod_grows_with_the_fourth_root_of_the_rate():
    """3 / (m + 3) = 0.25 for m = 9, over two and a half decades."""
    rates = np.array([3.0, 10.0, 30.0, 100.0, 300.0, 1000.0])
    strength = np.array([solutions.rod(rate) for rate in rates])
    assert np.all(np.diff(strength) > 0.0)
    assert np.polyfit(np.log(rates), np.log(strength), 1)[0] == pytest.approx(0.25, abs=0.05)


@pytest.mark.validation
def test_a_spinning_ball_keeps_its_stress():
    """One turn, seven spacings of radius. The correction of the torque keeps L and takes 0.4 % of it; invariants are wanted within 1 %.

    Not met: P -2.1 %, sqrt(J2) -1.8 % (five spacings: -3.0 and -2.4 %). The heating sigma : L with the plain gradients of lopsided neighbourhoods
    is not zero in rotation, as its conjugate, the torque, is not.
    """
    momentum, removed, pressure, shear = solutions.spin()
    assert abs(momentum) < 1e-3 and removed < 0.01
    assert abs(pressure) < 0.01 and abs(shear) < 0.01


@pytest.mark.validation
def test_rubber_rings_bounce_without_breaking():
    """Total energy within 2 % of the kinetic; two whole rings part again, at 0.73 of the speed (viscosity and vibration have the rest)."""
    energy, parting, pieces, largest = solutions.rings()
    assert abs(energy) < 0.02 and pieces == 2 and largest == 0.5
    assert 0.6 < parting < 0.9
