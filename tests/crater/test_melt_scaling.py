"""What published laws say that an impact melts."""

from __future__ import annotations

import math

import pytest

from crater.pages import report_matter
from crater.scaling import melt
from crater.scaling.crater_size import ImpactEvent
from matter.case import material, shock_phases
from pipeline.running import result
from sph.materials.rows import collect
from sph.shock_states import hugoniot


def event(**changed):
    """A ball of 2 km at 25 km/s, straight down, dunite into dunite."""
    values = dict(
        radius=1e3, speed=25e3, angle=0.0, gravity=9.81, projectile_density=3320.0, target_density=3320.0
    )  # fmt: skip
    return ImpactEvent(**(values | changed))


def test_masses_of_dunite_by_hand():
    """v^2 / E_m = 69.44: 0.42 * 69.44^0.84 = 14.80, a quarter of it 17.36."""
    masses = melt.facts(event(), "dunite")["over_projectile_mass"]
    assert masses["abramov_2012"] == pytest.approx(14.80, abs=0.01)
    assert masses["pierazzo_1997"] == pytest.approx(17.36, abs=0.01)


def test_angle_speed_and_densities():
    steep, slanted = (melt.facts(event(angle=a), "dunite")["over_projectile_mass"] for a in (0.0, 1.0))
    for key, power in (("abramov_2012", 1.32), ("pierazzo_1997", 1.0)):
        assert slanted[key] / steep[key] == pytest.approx(math.cos(1.0) ** power)
    faster = melt.facts(event(speed=50e3), "dunite")["over_projectile_mass"]
    assert faster["abramov_2012"] / steep["abramov_2012"] == pytest.approx(2.0**1.68)
    heavy = melt.facts(event(projectile_density=6640.0), "dunite")["over_projectile_mass"]
    assert heavy["pierazzo_1997"] == pytest.approx(0.5 * steep["pierazzo_1997"])
    assert heavy["abramov_2012"] == steep["abramov_2012"]


@pytest.mark.parametrize("name", [name for name in material.names() if "melt_scaling" in material.load(name)])
def test_the_energy_is_that_of_a_strong_shock(name):
    """E_m is the energy of motion behind the shock twice over at most: some 3 km/s in rock and metal, 1 in ice."""
    speed = math.sqrt(2.0 * material.section(name, "melt_scaling")["energy"])
    assert 2.5e3 < speed < 4.5e3 or (name == "ice" and 0.8e3 < speed < 1.5e3)


@pytest.mark.parametrize("name", ["granite", "aluminum", "aluminum_1100", "aluminum_6061", "dunite"])
def test_the_critical_pressure_is_where_the_hugoniot_has_that_energy(name):
    """u = up^2 / 2 behind a strong shock into matter at rest."""
    speed = math.sqrt(2.0 * material.section(name, "melt_scaling")["energy"])
    state = hugoniot.behind(*hugoniot.solid(collect((name,)).rows, 0), speed)
    assert shock_phases.pressures(name) == {"molten": pytest.approx(state.P, rel=0.01)}


def test_nothing_is_said_of_slow_impacts_and_of_what_is_not_known():
    assert melt.facts(event(speed=11e3), "dunite") == {} != melt.facts(event(speed=12e3), "dunite")
    assert melt.facts(event(), "basalt") == {} == melt.facts(event(), "no such material")
    assert melt.melt_lines({}) == [] and report_matter.published({}) == ""


def test_page_and_terminal_say_it():
    facts = melt.facts(event(), "dunite")
    page = report_matter.published(facts)
    assert "Abramov et al. 2012" in page and "14.8" in page and "17.4" in page and "9 MJ/kg" in page
    assert result._melted(facts) == [
        "molten dunite of the target in projectile masses, by published laws: Abramov et al. 2012: 14.8, energy "
        "scaling, Pierazzo et al. 1997: 17.4"
    ]
