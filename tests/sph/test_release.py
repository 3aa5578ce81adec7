"""Critical entropies at 1 bar of the tables that ship: against their own mixtures, their own isentropes, and an ideal
table whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from matter.case.material import TABLES
from matter.formats import sesame
from sph.eos import table
from sph.materials import rows
from sph.materials.settings import Choice
from sph.shock_states import isentropic_release, release_phases

SHIPPED = {
    "quartz": table.EXAMPLE,
    "dunite": table.Parameters(3320.0, str(TABLES / "dunite.txt.xz"), 298.0),
}
BAR = isentropic_release.BAR


@pytest.fixture(scope="module", params=SHIPPED)
def shipped(request):
    p = SHIPPED[request.param]
    return p, sesame.read(p.file), isentropic_release.boiling(sesame.read(p.file))


def test_liquid_and_gas_lie_on_the_line_of_the_mixtures_between_them(shipped):
    """In a mixture of fixed T, s is linear in v with the slope (s_v - s_l) / (v_v - v_l) = dP/dT (Clapeyron): of the
    isotherms on both sides of T_b, read between 1 and 1000 kg/m^3, where the boiling point reads nothing."""
    _, nodes, known = shipped
    j = int(np.searchsorted(nodes.T, known.temperature))
    inside = (nodes.rho > 1.0) & (nodes.rho < 1000.0)
    slope, liquid = zip(*(np.polyfit(1.0 / nodes.rho[inside], nodes.s[inside, k], 1) for k in (j - 1, j)))
    part = np.log(known.temperature / nodes.T[j - 1]) / np.log(nodes.T[j] / nodes.T[j - 1])
    at_boiling = np.exp(np.interp(part, [0.0, 1.0], np.log(slope)))
    expected = at_boiling * (known.gas_volume - known.liquid_volume)
    assert known.gas - known.liquid == pytest.approx(expected, rel=0.01)
    assert known.liquid == pytest.approx(np.interp(part, [0.0, 1.0], liquid), abs=2.0)
    # the gas is thin: P v / T is that of the node below it on the next isotherm, but for what dissociates
    i = int(np.flatnonzero(nodes.P[:, j] < 0.9 * BAR).max())
    assert known.gas_volume * BAR / known.temperature == pytest.approx(
        nodes.P[i, j] / nodes.rho[i] / nodes.T[j], rel=0.02
    )


def test_an_isentrope_through_the_liquid_at_its_boiling_point_meets_its_balance_at_one_bar(shipped):
    """Released along s_l in the law that the run itself uses, matter begins to boil at 1 bar and T_b."""
    p, _, known = shipped
    row = table.row(p)
    rho = 0.999 / known.liquid_volume  # just inside the mixture
    u = isentropes_energy(row, rho, known.liquid)
    assert table.pressure_and_derivatives(rho, u, row)[0] == pytest.approx(BAR, rel=0.12)
    assert table.temperature(rho, u, row) == pytest.approx(known.temperature, rel=0.01)
    # far more gas: half of the mass, by the lever
    half = 0.5 * (known.liquid + known.gas)
    rho = 1.0 / (0.5 * (known.gas_volume + known.liquid_volume))
    assert table.pressure_and_derivatives(rho, isentropes_energy(row, rho, half), row)[0] == pytest.approx(
        BAR, rel=0.1
    )


def isentropes_energy(row, rho, s) -> float:
    """u [J/kg] (the law's own zero) of entropy ``s`` at ``rho``, by bisection."""
    low, high = -5e6, 5e7
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if table.entropy(rho, middle, row) < s else (low, middle)
    return 0.5 * (low + high)


def test_the_shock_that_just_boils_releases_to_one_bar_as_liquid_at_its_boiling_point(shipped):
    """The closed loop: up the Hugoniot to the pressure found, down the isentrope by dP alone (no entropy is read)."""
    p, _, known = shipped
    critical = isentropic_release.entropies(p.file, 1800.0)
    shocks = isentropic_release.shocks_of(p, critical)
    assert shocks["shock_melting_begins_Pa"] < shocks["shock_boiling_begins_Pa"] < shocks["shock_vapour_Pa"]
    row = table.row(p)
    u, rho = hugoniot_state(p, row, shocks["shock_boiling_begins_Pa"])
    # du = P / rho^2 drho in small steps down to the volume of the liquid at 1 bar
    for x in np.diff(np.geomspace(rho, 1.0 / known.liquid_volume, 20_001)):
        P = table.pressure_and_derivatives(rho, u, row)[0]
        middle = table.pressure_and_derivatives(rho + 0.5 * x, u + 0.5 * P / rho**2 * x, row)[0]
        u += middle / (rho + 0.5 * x) ** 2 * x
        rho += x
    assert table.temperature(rho, u, row) == pytest.approx(known.temperature, rel=0.02)
    assert table.entropy(rho, u, row) == pytest.approx(known.liquid, rel=0.005)


def hugoniot_state(p, row, pressure):
    """(u, rho) behind one shock of this pressure from rest: u = P (1/rho0 - 1/rho) / 2, by bisection on rho."""
    low, high = 1.05 * p.rho0, 4.0 * p.rho0
    for _ in range(100):
        rho = 0.5 * (low + high)
        u = 0.5 * pressure * (1.0 / p.rho0 - 1.0 / rho)
        low, high = (rho, high) if table.pressure_and_derivatives(rho, u, row)[0] < pressure else (low, rho)
    return u, rho


def test_the_isobar_gives_the_entropy_at_a_melting_temperature(shipped):
    p, nodes, known = shipped
    isobar = isentropic_release.dense(nodes)
    assert (np.diff(isobar.s) > 0.0).all() and isobar.T[-1] < known.temperature
    k = len(isobar.T) // 2
    assert isentropic_release.entropies(p.file, float(isobar.T[k]))["melting_begins"] == pytest.approx(
        isobar.s[k], rel=1e-12
    )
    assert "melting_begins" not in isentropic_release.entropies(p.file, float("inf"))
    assert "melting_begins" not in isentropic_release.entropies(p.file, 2.0 * known.temperature)


def test_a_table_that_holds_no_boiling_point_says_none():
    """An ideal gas has no plateau."""
    rho, T = np.geomspace(1e-3, 1e3, 60), np.geomspace(100.0, 1e4, 40)
    P = rho[:, None] * 287.0 * T[None]
    s = 717.0 * np.log(T)[None] - 287.0 * np.log(rho)[:, None]
    assert isentropic_release.boiling(sesame.Table(rho, T, 717.0 * T[None] + 0.0 * P, P, P, s)) is None


def test_snapshots_carry_it_for_tables_and_melting_temperatures_alone():
    chosen = Choice(
        eos="table", table={"file": SHIPPED["dunite"].file, "rho0": "3320 kg/m^3"},
        thermal={"melt_temperature": "1900 K"},
    )  # fmt: skip
    facts = release_phases.phase_thresholds(rows.collect(("basalt", "ice"), {"basalt": chosen}))
    assert set(facts) == {"basalt"} and facts["basalt"]["table"] == "dunite.txt.xz"
    assert facts["basalt"]["melting_temperature_K"] == 1900.0
    assert release_phases.phase_thresholds(rows.collect(("basalt", "ice"))) == {}
    assert release_phases.phase_thresholds(rows.collect(("aluminum_6061",)))["aluminum_6061"] == {
        "melting_temperature_K": 925.0
    }
