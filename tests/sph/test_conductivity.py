"""Artificial conductivity: the law, the sums that it must keep, one material only, smooth flow, a piston's first
layer, a first contact."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fixtures import columns, shocks, solutions
from sph.materials.rows import collect
from sph.pairs import conductivity, rates, scheme
from sph.pairs.row import BODY, ENERGY, SLOPE
from sph.stepping.numerics import SETS
from studies import sph_peak_pressure
from tests.sph.test_rates import _Cloud, rows_of


@given(mu=st.floats(-1e5, 0.0))
def test_it_falls_with_the_cube_below_the_speed_of_sound(mu):
    """w = |mu|, less a tenth, at the speed of sound; a thousandth of its speed carries 1e-5 of that."""
    got, c = conductivity.exchange(mu, 3000.0), 3000.0
    assert 0.0 <= got <= -mu
    assert got == pytest.approx(-mu / (1.0 + (0.3 * c / mu) ** 2) if mu < -1e-9 else 0.0, rel=1e-9, abs=1e-12)


def exchanged(kinds, energy, k=8.0):
    """The cloud, and what its energies change by for a conductivity of ``k``."""
    c, found = _Cloud(1000), []
    second = np.zeros((1000, 8))
    second[:, SLOPE : SLOPE + 6] = np.random.default_rng(5).normal(size=(1000, 6)) * 0.1
    second[:, BODY], second[:, ENERGY] = kinds, energy
    for coefficient in (k, 0.0):
        out = rates.Rates(1000, strain_rate=True)
        chosen = scheme.Scheme(reconstructed=True)
        rows = rows_of(c.rows(), second, c.density)
        c.summed(chosen, rows, out, rates.Damping(3.0, 10.0, conductivity=coefficient))
        found.append(out)
    assert np.array_equal(found[0].acceleration, found[1].acceleration)
    return c, found[0].energy - found[1].energy


@pytest.mark.validation
def test_what_one_gains_another_loses_and_heat_flows_to_the_cold():
    warmth = np.random.default_rng(2).uniform(0.0, 1e6, 1000)
    c, change = exchanged(0, warmth)
    assert abs(c.mass @ change) < 1e-12 * (c.mass @ np.abs(change))
    assert c.mass @ (change * warmth) < 0.0
    assert change[warmth.argmin()] > 0.0 > change[warmth.argmax()]
    assert np.array_equal(exchanged(0, np.full(1000, 1e6))[1], np.zeros(1000))


@pytest.mark.validation
def test_heat_stays_in_its_material():
    kinds = np.random.default_rng(3).integers(0, 2, 1000)
    c, change = exchanged(kinds, 1e6 * kinds)
    assert np.array_equal(change, np.zeros(1000))
    c, change = exchanged(kinds, np.random.default_rng(2).uniform(0.0, 1e6, 1000))
    for kind in (0, 1):
        mine = kinds == kind
        assert abs(c.mass[mine] @ change[mine]) < 1e-12 * (c.mass[mine] @ np.abs(change[mine]))


@pytest.mark.validation
def test_a_spinning_ball_keeps_the_heat_of_its_core(monkeypatch):
    """A quarter of a turn, 50 crossings of sound: its pressure hangs on that heat, and none of it is carried."""
    found = []
    for k in (8.0, 0.0):
        monkeypatch.setitem(SETS["reconstructed"], "conductivity", k)
        found.append(solutions.spin(radius=4.0, turns=0.25, gradients="plain")[2])
    with_it, without = found
    assert with_it == pytest.approx(without, abs=1e-4)


def first_layer():
    """Excess of the specific energy of the layer at a piston of 10 km/s over ice, and the plateau's pressure, over the
    exact ones."""
    row = shocks.published("ice", 10000.0)
    column = columns.Column(collect(("ice",)), 40, piston=10000.0)
    column.integrator.start()
    column.run(0.8 * 40 * column.gap / float(row["us_m_s"]))
    u, P = column.layers(column.cloud.specific_energy), column.layers(column.integrator.forces.evaluated.pressure)
    return u[0] / float(row["E_J_kg"]) - 1.0, P.max() / float(row["P_Pa"]) - 1.0


@pytest.mark.validation
def test_a_piston_leaves_less_heat_and_pressure_in_its_first_layer(monkeypatch):
    """1.8 times the energy too much without, and a third of the pressure over it on the way."""
    heat, pressure = first_layer()
    monkeypatch.setitem(SETS["reconstructed"], "conductivity", 0.0)
    before, over = first_layer()
    assert before > 1.5 and over > 0.25
    assert heat < 0.75 and pressure < 0.15


@pytest.mark.validation
def test_single_particles_hardly_overshoot_at_first_contact():
    """Ice on ice at 18.2 km/s, planar limit 111 GPa: 169 and 222 GPa without, 282 with the former numerics."""
    got = sph_peak_pressure.measured(6.0, numerics="reconstructed")
    assert got["target_Pa"] < 1.2 * 111e9 and got["ball_Pa"] < 1.45 * 111e9
    assert got["ball_nine_tenths_Pa"] < 1.2 * 111e9
