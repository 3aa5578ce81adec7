"""Mie-Grueneisen on a linear shock speed: its Hugoniot, its sound speed, its inverses, its ends."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from sph.eos import mie_gruneisen, tillotson
from sph.shock_states import hugoniot

P = mie_gruneisen.EXAMPLE


def pressure(rho, u):
    return mie_gruneisen.pressure_and_derivatives(rho, u, P)[0]


@pytest.mark.parametrize("up", [10.0, 1e3, 3e3, 6e3])
def test_shocks_run_at_the_linear_speed(up):
    """All three jump conditions, as the project's own solver meets them: Us = c0 + s up."""
    state = hugoniot.behind(pressure, hugoniot.State(P.rho0, 0.0, 0.0, 0.0), up)
    speed = P.c0 + P.s * up
    assert state.shock_speed == pytest.approx(speed, rel=1e-9)
    assert state.P == pytest.approx(P.rho0 * speed * up, rel=1e-9) and state.u == pytest.approx(0.5 * up**2, rel=1e-9)
    assert state.rho == pytest.approx(P.rho0 * speed / (speed - up), rel=1e-9)


def test_derivatives_and_sound_speed_are_those_of_the_pressure():
    for eta, u in itertools.product((0.2, 0.7, 0.99, 1.01, 1.6, 2.9, 5.0), (0.0, 1e5, 3e7)):
        rho, step = eta * P.rho0, 1e-5
        value, d_rho, d_u = mie_gruneisen.pressure_and_derivatives(rho, u, P)
        assert d_rho == pytest.approx(
            (pressure(rho * (1 + step), u) - pressure(rho * (1 - step), u)) / (2 * step * rho), rel=1e-6, abs=1.0
        )
        assert d_u == pytest.approx((pressure(rho, u + 1e3) - pressure(rho, u - 1e3)) / 2e3, rel=1e-6)
        along = [pressure(rho * f, u + (f - 1.0) * value / rho) for f in (1 + step, 1 - step)]
        squared = (along[0] - along[1]) / (2 * step * rho)
        assert mie_gruneisen.sound_speed(rho, u, P) == pytest.approx(math.sqrt(max(squared, 0.0)), rel=1e-6)


def test_at_rest_it_is_a_solid_of_its_sound_speed_from_both_sides():
    assert pressure(P.rho0, 0.0) == 0.0 and mie_gruneisen.modulus(P) == P.rho0 * P.c0**2
    for eta in (1.0, 1.0 + 1e-9, 1.0 - 1e-9):
        assert mie_gruneisen.sound_speed(eta * P.rho0, 0.0, P) == pytest.approx(P.c0, rel=1e-6)
        assert pressure(eta * P.rho0, 2e6) == pytest.approx(P.gamma0 * P.rho0 * 2e6, rel=1e-6)


def test_compressed_beyond_what_shocks_reach_it_stiffens_on_and_hot_it_bears_no_tension():
    etas = np.linspace(1.0, 50.0, 2000)
    cold = [mie_gruneisen.hugoniot(eta * P.rho0, P)[0] for eta in etas]
    assert np.isfinite(cold).all() and (np.diff(cold) > 0.0).all()
    hot = 1.01 * P.c0**2 / P.gamma0
    assert all(pressure(eta * P.rho0, hot) > 0.0 for eta in (1e-6, 0.1, 0.5, 0.99))
    assert pressure(0.9 * P.rho0, 0.0) < 0.0


def test_density_and_energy_invert_the_pressure():
    for eta, u in itertools.product((0.9, 1.0, 1.3, 2.5), (0.0, 1e6, 2e7)):
        value = pressure(eta * P.rho0, u)
        assert mie_gruneisen.density(value, u, P) == pytest.approx(eta * P.rho0, rel=1e-9)
        assert mie_gruneisen.energy(eta * P.rho0, value, P) == pytest.approx(u, rel=1e-9, abs=1e-3)
    assert mie_gruneisen.density(-1e12, 0.0, P) == -1.0 and mie_gruneisen.energy(1.2 * P.rho0, 0.0, P) == -1.0


def test_aluminium_is_near_its_tillotson():
    """Two laws fitted to the same metal: pressures behind shocks to 60 GPa differ by less than 10 %."""
    metal = tillotson.Parameters(2700.0, 0.5, 1.63, 75.2e9, 65e9, 5e6, 3e6, 13.9e6, 5.0, 5.0)
    for up in (500.0, 1500.0, 3000.0):
        other = hugoniot.behind(
            lambda rho, u: tillotson.pressure(rho, u, metal), hugoniot.State(2700.0, 0.0, 0.0, 0.0), up
        )
        assert other.P == pytest.approx(P.rho0 * (P.c0 + P.s * up) * up, rel=0.1)
