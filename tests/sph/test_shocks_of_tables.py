"""Shocks in the production kernels with the tables that ship: pistons, and two states that meet."""

from __future__ import annotations

import numpy as np
import pytest

from fixtures import columns, riemann, shock_tube, tables
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.shock_states import hugoniot

LAYERS = 60


def slow(*values):
    """A column of those that one stands for in the fast suite."""
    return pytest.param(*values, marks=pytest.mark.validation)


@pytest.mark.parametrize("name,speed", [("quartz", 1e3), slow("quartz", 4e3), slow("dunite", 8e3)])
def test_a_piston_drives_the_shock_of_the_table(name, speed):
    """Plateau P, rho and the shock's speed within 1 % and energy within 2 %, as with every other law: below the
    transition, beyond it and at 436 GPa."""
    materials = tables.shipped(name)
    (wanted,) = hugoniot.waves(*hugoniot.solid(materials.rows, 0), speed)
    got = columns.shocked(materials, speed, wanted.shock_speed, LAYERS)
    assert (got.P, got.rho, got.speed) == pytest.approx((wanted.P, wanted.rho, wanted.shock_speed), rel=0.01)
    assert got.u == pytest.approx(wanted.u, rel=0.02) and got.width < 5.0


@pytest.mark.validation
@pytest.mark.parametrize(
    "courant",
    [
        0.3,
        pytest.param(None, marks=pytest.mark.xfail(strict=True, reason="1.2 % slow at C = 0.5; 0.9 % at C = 0.3")),
    ],
)
def test_a_shock_that_the_transition_splits_runs_as_two_waves(courant):
    """Quartz at 2 km/s: the first wave at 5.81 km/s within 1 %, and what lies at the piston is of the second, P within
    3 % of 27.8 GPa."""
    materials = tables.shipped("quartz")
    first, second = hugoniot.waves(*hugoniot.solid(materials.rows, 0), 2e3)
    column = columns.Column(materials, 130, piston=2e3)
    column.integrator.step_limit.courant = courant or column.integrator.step_limit.courant
    column.integrator.start()
    times, places = [], []
    for part in (0.6, 0.7, 0.8, 0.9):
        column.run(part * column.height / first.shock_speed)
        times.append(column.integrator.time)
        places.append(columns.front(column, 0.5 * first.v))
    assert np.polyfit(times, places, 1)[0] == pytest.approx(first.shock_speed, rel=0.01)
    P, v = (column.layers(a) for a in (column.integrator.forces.evaluated.pressure, column.cloud.velocity[:, 2]))
    z = column.layers(column.cloud.position[:, 2])
    behind = 2e3 * column.integrator.time + 0.6 * (second.shock_speed - 2e3) * column.integrator.time
    chosen = (z > 2e3 * column.integrator.time + 10.0) & (z < behind)
    assert P[chosen].mean() == pytest.approx(second.P, rel=0.03) and v[chosen].mean() == pytest.approx(2e3, rel=0.01)
    ahead = (z > second.shock_speed * column.integrator.time + 10.0) & (z < places[-1] - 10.0)
    assert ahead.sum() > 5 and P[ahead].mean() == pytest.approx(first.P, rel=0.05)


def errors(materials, speed, layers=LAYERS):
    """Of a tube whose left half is as a shock to ``speed`` left it: P, v, both densities, speed of the shock."""
    pressure, rest = hugoniot.solid(materials.rows, 0)
    (left,) = hugoniot.waves(pressure, rest, speed)
    ends = (left.rho, left.u), (rest.rho, rest.u)
    got, wanted = riemann.tube(materials, *ends, layers), riemann.star(materials, *ends)
    return np.abs(np.array(got) / np.array(wanted) - 1.0)


@pytest.mark.parametrize(
    "name,speed,layers", [("quartz", 1e3, 120), slow("quartz", 8e3, 120), slow("dunite", 8e3, 60)]
)
def test_two_states_that_meet_part_as_the_exact_solution_says(name, speed, layers):
    """Between shock and rarefaction P within 4 %, v within 2 %, densities and the shock's speed within 1.5 %. Seen:
    quartz needs 120 layers (P -3.7 and -0.6 %; in 60 layers P -4.5 % at 1 km/s, and at 8 km/s its shock is 1.6 %
    slow). Basalt and iron of Tillotson: P -1.6 % at 8 km/s and -3 % at 1 km/s, most of it of the disordered
    lattice."""
    off = errors(tables.shipped(name), speed, layers)
    assert off[0] < 0.04 and off[1] < 0.02 and off[2:].max() < 0.015


def test_the_exact_solution_of_a_gas_is_sods():
    """The solver that tables are held against, on the gas of Sod's tube."""
    law = {"rho0": "1 kg/m^3", "gamma": shock_tube.GAMMA}
    gas = collect(("basalt",), {"basalt": Choice(eos="ideal_gas", strength="none", damage="none", ideal_gas=law)})
    ends = [(rho, P / rho / (shock_tube.GAMMA - 1.0)) for rho, P in (shock_tube.LEFT, shock_tube.RIGHT)]
    found = riemann.star(gas, *ends)
    assert (found.P, found.v) == pytest.approx(shock_tube.star(), rel=1e-4)
    assert (found.rho_left, found.rho_right, found.speed) == pytest.approx((0.42632, 0.26557, 1.7522), rel=1e-3)
