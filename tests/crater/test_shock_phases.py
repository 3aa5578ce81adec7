"""Melt and vapour by peak pressure: masses above critical pressures, in masses of the projectile."""

from __future__ import annotations

import numpy as np
import pytest

from crater import shock_phases
from matter import material
from matter.particles import Particles
from pipeline import result

ICE = shock_phases.pressures("ice")


def shocked(materials=("ice", "basalt"), **changed):
    """Six particles: four of ice (one of them the projectile's), two of basalt."""
    fields = {
        "mass": np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0]),
        "material": np.array([0, 0, 0, 0, 1, 1]),
        "layer": np.array([0, 0, 0, -1, 1, 1]),
        "peak_pressure": np.array([1e9, 5e9, 9e9, 9e9, 9e11, 0.0]),
        **changed,
    }
    return Particles(fields, {"materials": list(materials)})


def test_masses_above_the_critical_pressures_of_each_material_and_body():
    facts = shock_phases.masses(shocked(), 8.0)
    assert ICE == {"melting_begins": 4.5e9, "molten": 5.5e9}
    assert [(part["material"], part["body"], part["over_projectile_mass"]) for part in facts["parts"]] == [
        ("ice", "target", {"melting_begins": 0.75, "molten": 0.5}),
        ("ice", "projectile", {"melting_begins": 1.0, "molten": 1.0}),
    ]
    assert facts["not_known_of"] == ["basalt"] and facts["by"] == "peak pressure"


def test_a_pressure_just_at_the_critical_one_melts_nothing():
    facts = shock_phases.masses(shocked(peak_pressure=np.array([4.5e9, 5.5e9, 0.0, 0.0, 0.0, 0.0])), 1.0)
    assert facts["parts"][0]["over_projectile_mass"] == {"melting_begins": 2.0, "molten": 0.0}


@pytest.mark.parametrize("missing", ["peak_pressure", "mass", "material"])
def test_a_snapshot_without_what_it_needs_says_nothing(missing):
    whole = shocked()
    fields = {name: whole[name] for name in whole if name != missing}
    assert shock_phases.masses(Particles(fields, whole.attributes), 8.0) == {}
    assert shock_phases.masses(whole, 0.0) == {}


def test_the_terminal_says_the_masses_and_by_what():
    words = result._molten(shock_phases.masses(shocked(), 8.0))
    assert words[0] == (
        "shocked ice of the target in projectile masses, by peak pressure: begins to melt above 4.5 GPa: 0.75, molten "
        "above 5.5 GPa: 0.5"
    )
    assert len(words) == 2 and result._molten({}) == []


def test_critical_pressures_of_every_material_rise():
    known = {name: list(shock_phases.pressures(name).values()) for name in material.names()}
    assert any(known.values())
    for values in known.values():
        assert values == sorted(values)
