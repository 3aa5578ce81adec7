"""Temperature from the energy above the cold curve, from a table, and strength that goes by it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fixtures import tables
from matter.errors import InputError
from sph.bodies.particle_cloud import Cloud
from sph.eos import dispatch, murnaghan, table, tillotson
from sph.materials import temperature
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.stepping import state

WARM = {"heat_capacity": "900 J/(kg K)", "temperature": "300 K"}


def rows_of(name, **changes):
    return collect((name,), {name: Choice.model_validate(changes)}).rows


def kelvin(rows, rho, u):
    return temperature.temperature(rows.eos[0], rows.eos_row[0], rows.thermal[0], rho, u)


def compressed(rows, eta, steps=4000):
    """Energy after a compression without shocks from rest to ``eta`` times the density, by the midpoint rule."""
    rho0, u = rows.rho0[0], 0.0
    step = (eta - 1.0) * rho0 / steps

    def slope(r, e):
        return dispatch.pressure_and_derivatives(rows.eos[0], rows.eos_row[0], r, e)[0] / r**2

    for i in range(steps):
        r = rho0 + i * step
        u += step * slope(r + 0.5 * step, u + 0.5 * step * slope(r, u))
    return u


def test_the_cold_curve_of_murnaghan_is_its_integral():
    p = murnaghan.Parameters(2700.0, 2.67e10, 4.0)
    numbers = np.array([*p], dtype=float)
    row = temperature.row(temperature.Parameters(900.0), dispatch.FAMILY.kind("murnaghan"), numbers, p.rho0, 1e8)
    for eta in (1.0005, 1.01, 1.2, 1.7, 2.5, 3.9):
        exact = p.K0 / (p.n * p.rho0) * ((eta ** (p.n - 1.0) - 1.0) / (p.n - 1.0) + 1.0 / eta - 1.0)
        assert temperature.cold_energy(eta * p.rho0, row) == pytest.approx(exact, rel=1e-6, abs=1e-3)


def test_matter_squeezed_without_heat_stays_at_its_temperature_and_heat_warms_it():
    """Tillotson's basalt to twice its density: 0.01 K, where its energy alone would say more than 50; u above it
    warms by du / c_v; stretched it stores no more than its tension cut."""
    rows = rows_of("basalt", thermal=WARM)
    rho0 = rows.rho0[0]
    for eta in (1.1, 1.5, 2.0):
        u = compressed(rows, eta)
        assert u / 900.0 > 50.0
        assert kelvin(rows, eta * rho0, u) == pytest.approx(300.0, abs=0.01)
        assert kelvin(rows, eta * rho0, u + 9e5) == pytest.approx(1300.0, abs=0.01)
    assert kelvin(rows, rho0, 0.0) == pytest.approx(300.0, abs=1e-4)
    stored = 130e6**2 / (2.0 * rho0 * tillotson.EXAMPLE.A)
    assert temperature.cold_energy(0.3 * rho0, rows.thermal[0]) == pytest.approx(stored, rel=0.3)


def test_a_gas_has_no_cold_curve_and_begins_at_zero():
    p = np.array([1.2, 1.4])
    row = temperature.row(temperature.Parameters(718.0), dispatch.FAMILY.kind("ideal_gas"), p, 1.2, 0.0)
    for rho in (0.1, 1.2, 9.0):
        assert temperature.temperature(dispatch.FAMILY.kind("ideal_gas"), p, row, rho, 718e3) == pytest.approx(1000.0)


def test_a_table_gives_its_own_temperature_and_entropy(tmp_path):
    file = tables.written(tmp_path / "t.txt", tables.solid(), tables.SOLID_NODES)
    values = {"rho0": f"{tables.solid_at_rest(300.0)!r} kg/m^3", "file": file}
    rows = collect(
        ("basalt", "ice"), {"basalt": Choice(eos="table", table=values, thermal={"temperature": "300 K"})}
    ).rows
    rho, u = np.array([3000.0, 3000.0]), np.array([1e6, 1e6])
    found = temperature.fields(np.array([0, 1], np.int32), rows, rho, u)
    row = table.row(table.Parameters(tables.solid_at_rest(300.0), file, 300.0))
    assert found["temperature"].tolist() == [table.temperature(3000.0, 1e6, row), 0.0]
    assert found["entropy"].tolist() == [table.entropy(3000.0, 1e6, row), 0.0]


def test_a_run_that_knows_no_temperature_gets_no_field():
    plain = collect(("basalt", "ice")).rows
    assert temperature.fields(np.zeros(2, np.int32), plain, np.full(2, 2700.0), np.zeros(2)) == {}
    assert plain.thermal.shape == (2, temperature.HEAD)
    warm = rows_of("basalt", thermal=WARM)
    assert set(temperature.fields(np.zeros(2, np.int32), warm, np.full(2, 2700.0), np.zeros(2))) == {"temperature"}


def evaluated(density, energy, **changes):
    """Limit of sqrt(3 J2) that a sheared particle of basalt is left with, and its pressure."""
    body = Cloud(1)
    for name, value in (("mass", 1e9), ("density", density), ("specific_energy", energy), ("support_radius", 100.0)):
        getattr(body, name)[:] = value
    body.neighbours[:], body.distention[:], body.initial_distention[:] = 50, 1.0, 1.0
    body.stress[:] = 1e12
    materials = collect(("basalt",), {"basalt": Choice.model_validate({"damage": "none", **changes})})
    out = state.Evaluated(1)
    state.evaluate(body, materials.rows, True, True, out)
    a, b, c, d, e = body.stress[0]
    return math.sqrt(3.0 * (0.5 * (a * a + d * d + (a + d) ** 2) + b * b + c * c + e * e)), out.pressure[0]


@pytest.mark.parametrize("strength", ["von_mises", "collins", "drucker_prager"])
def test_strength_falls_straight_to_nothing_at_the_melting_temperature(strength):
    """At the same pressure, and not by energy: cold compression weakens nothing."""
    melts = {"strength": strength, "thermal": {**WARM, "melt_temperature": "1500 K"}}
    rows = rows_of("basalt", thermal=WARM)
    u = compressed(rows, 1.3)
    P = evaluated(1.3 * 2700.0, u, **melts)[1]
    for T, share in ((300.0, 1.0), (900.0, 0.5), (1200.0, 0.25), (1600.0, 0.0)):
        heat = 900.0 * (T - 300.0)
        whole = evaluated(1.3 * 2700.0, u + heat, strength=strength, melting={"energy": "1e30 J/kg"})
        left = evaluated(1.3 * 2700.0, u + heat, **melts)
        assert left[1] == whole[1] > 0.9 * P
        assert left[0] == pytest.approx(share * whole[0], rel=1e-6, abs=1e-6 * whole[0])


def test_tension_is_gone_at_the_melting_temperature():
    melts = {"thermal": {**WARM, "melt_temperature": "1500 K"}}
    for heat, share in ((0.0, 1.0), (540e3, 0.5), (1.2e6, 0.0)):
        assert evaluated(1620.0, heat, **melts)[1] == pytest.approx(-share * 130e6, rel=1e-3, abs=1.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"melt_temperature": "1500 K"}, r"\[thermal\]: heat_capacity is missing"),
        ({**WARM, "melt_temperature": "200 K"}, r"\[thermal\]: melt_temperature must be above temperature"),
        ({"heat_capacity": "900 K"}, r"\[thermal\]: heat_capacity"),
    ],
)
def test_what_does_not_fit_is_told(values, words):
    with pytest.raises(InputError, match=words):
        rows_of("basalt", thermal=values)
