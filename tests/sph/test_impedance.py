"""The planar limit of an impact, and what the shock stage reports of pressures, resolution and edges."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.outcome import stage_report
from sph.shock_states import impedance

TABLE = Path(__file__).parent.parent / "data" / "impedance_match.csv"


@pytest.mark.parametrize(
    "row",
    list(csv.DictReader(line for line in TABLE.open() if not line.startswith("#"))),
    ids=lambda r: f"{r['projectile']}-{r['v_m_s'][:5]}",
)
def test_against_a_table_made_independently(row):
    names = tuple(dict.fromkeys([row["projectile"], row["target"]]))
    match = impedance.planar(collect(names), row["projectile"], row["target"], float(row["v_m_s"]))
    assert match.pressure == pytest.approx(float(row["P_Pa"]), rel=2e-6)
    assert match.speed == pytest.approx(float(row["up_target_m_s"]), rel=2e-6)


def test_cold_gases_by_hand():
    """P = (gamma + 1)/2 rho w^2 on both sides: w = v / (1 + sqrt(rho_target g_target / rho_projectile
    g_projectile))."""
    gas = {name: Choice.model_validate({"eos": "ideal_gas", "ideal_gas": {"rho0": f"{rho} kg/m^3", "gamma": gamma}})
           for name, rho, gamma in (("ice", 2.0, 1.4), ("basalt", 5.0, 5.0 / 3.0))}  # fmt: skip
    found = impedance.planar(collect(("ice", "basalt"), gas), "ice", "basalt", 1000.0)
    heavy, light = 0.5 * 5.0 * (5.0 / 3.0 + 1.0), 0.5 * 2.0 * 2.4
    w = 1000.0 / (1.0 + np.sqrt(heavy / light))
    assert found.speed == pytest.approx(w, rel=1e-5) and found.pressure == pytest.approx(heavy * w**2, rel=1e-5)


def test_pores_lower_the_limit():
    """Crushed pumice of bulk density rho00: the jump conditions hold from rho00 on, with the pressure of the solid."""
    materials = collect(("basalt", "pumice"), {"pumice": Choice.model_validate({"porosity": "p_alpha"})})
    found = impedance.planar(materials, "basalt", "pumice", 5000.0)
    solid = impedance.planar(
        collect(("basalt", "pumice"), {"pumice": Choice.model_validate({"porosity": "none"})}),
        "basalt",
        "pumice",
        5000.0,
    )
    assert materials.bulk_density[1] < 0.7 * materials.rho0[1]
    assert found.pressure < 0.8 * solid.pressure and found.speed > solid.speed


def test_share_of_the_mass_that_reached_a_pressure():
    peak, mass = np.array([5.0, 1.0, 3.0, 2.0]), np.array([1.0, 4.0, 2.0, 3.0])
    assert stage_report._reached(peak, mass, 0.1) == 5.0
    assert stage_report._reached(peak, mass, 0.3) == 3.0
    assert stage_report._reached(peak, mass, 0.5) == 2.0
    assert stage_report._reached(peak, mass, 0.9) == 1.0
    assert stage_report._reached(peak, mass, 1.0) == 1.0
