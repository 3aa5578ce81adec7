"""Shocks in the production kernels against exact solutions: pistons over the Rankine-Hugoniot tables, compaction
waves, Sod's tube."""

import numpy as np
import pytest

from fixtures import columns, shock_tube
from fixtures.shocks import BASALT, LAYERS, POROUS, SPEEDS, porous, published
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.shock_states import compaction_wave, hugoniot


@pytest.mark.validation
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize(
    "name,file",
    [("basalt", "basalt"), ("ice", "ice"), ("water_thesis", "water"), ("aluminum", "aluminum"), ("iron", "iron")],
)
def test_piston_against_the_table(name, file, speed):
    """Plateau P and rho within 1 %, shock speed 1 %, energy 2 %."""
    row = published(file, speed)
    got = columns.shocked(collect((name,)), speed, float(row["us_m_s"]), LAYERS)
    assert got.P == pytest.approx(float(row["P_Pa"]), rel=0.01)
    assert got.rho == pytest.approx(float(row["rho_kg_m3"]), rel=0.01)
    assert got.speed == pytest.approx(float(row["us_m_s"]), rel=0.01)
    assert got.u == pytest.approx(float(row["E_J_kg"]), rel=0.02)
    assert got.width < 5.0


@pytest.mark.validation
@pytest.mark.parametrize("name,alpha0,curve,speed", POROUS)
def test_compaction_front(name, alpha0, curve, speed):
    """Front speed, density and pressure within 2 % of the jump conditions; full compaction where they say so."""
    materials = porous(name, alpha0, curve)
    wanted = compaction_wave.driven(materials.rows, 0, speed)
    got = columns.shocked(materials, speed, wanted.front.shock_speed, LAYERS, fastest=wanted.fastest)
    assert got.P == pytest.approx(wanted.front.P, rel=0.02)
    assert got.rho == pytest.approx(wanted.front.rho, rel=0.02)
    assert got.speed == pytest.approx(wanted.front.shock_speed, rel=0.02)
    assert got.distention == pytest.approx(wanted.distention, abs=1e-3 if wanted.distention == 1.0 else 0.02)


@pytest.mark.validation
def test_porosity_is_not_just_density():
    """Basalt of alpha0 = 1.5 at 500 m/s: 1.33 GPa, where the same density without pores gives 4.15 GPa (short
    columns)."""
    materials = porous("basalt", 1.5, BASALT)
    waves = compaction_wave.driven(materials.rows, 0, 500.0)
    got = columns.shocked(materials, 500.0, waves.front.shock_speed, layers=60, fastest=waves.fastest)
    assert got.P == pytest.approx(1.326e9, rel=0.04) and got.distention < 1.01
    light = collect(("basalt",), {"basalt": Choice(tillotson={"rho0": "1800 kg/m^3"})})
    wanted = hugoniot.behind(*hugoniot.solid(light.rows, 0), 500.0)
    assert columns.shocked(light, 500.0, wanted.shock_speed, layers=50).P == pytest.approx(4.15e9, rel=0.03)


@pytest.mark.validation
@pytest.mark.parametrize("layers", [50, 200, 400])
def test_sods_tube(layers):
    """L1 error of the density below 2 % at 100 layers per unit and more, below 4 % at 50.

    Not met below 400 layers: 5.8 % at 50, 2.3 % at 200, 2.0 % at 400 (the customary resolution is 400 + 400).
    """
    error, shock = shock_tube.sod(layers)
    assert error < (0.04 if layers < 100 else 0.02)
    assert shock == pytest.approx(1.7522, rel=0.03 if layers < 100 else 0.01)


def test_exact_solution_of_sods_tube():
    star = shock_tube.star()
    assert star == pytest.approx((0.30313, 0.92745), rel=1e-4)
    rho, v, P = shock_tube.exact(np.array([-0.4, 0.1, 0.3, 0.45]), 0.2)
    assert rho == pytest.approx([1.0, 0.42632, 0.26557, 0.125], rel=1e-4)
    assert P[1] == P[2] and v[0] == v[3] == 0.0
