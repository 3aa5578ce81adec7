"""Melt and vapour by peak pressure: masses above critical pressures, in masses of the projectile."""

from __future__ import annotations

import numpy as np
import pytest

from crater.pages import report_matter
from crater.shock import phases
from matter.case import material
from matter.particles import Particles
from pipeline.running import result

ICE = phases.pressures("ice")


def shocked(materials=("ice", "basalt"), **changed):
    """Six particles: four of ice (one of them the projectile's), two of basalt."""
    fields = {
        "mass": np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0]),
        "material": np.array([0, 0, 0, 0, 1, 1]),
        "layer": np.array([0, 0, 0, -1, 1, 1]),
        "peak_pressure": np.array([1e9, 3e9, 9e9, 9e9, 9e11, 0.0]),
        **changed,
    }
    return Particles(fields, {"materials": list(materials)})


def test_masses_above_the_critical_pressures_of_each_material_and_body():
    facts = phases.masses(shocked(), 8.0)
    assert pytest.approx({"melting_begins": 1.6e9, "molten": 4.1e9}, rel=1e-12) == ICE
    assert [(part["material"], part["body"], part["over_projectile_mass"]) for part in facts["parts"]] == [
        ("ice", "target", {"melting_begins": 0.75, "molten": 0.5}),
        ("ice", "projectile", {"melting_begins": 1.0, "molten": 1.0}),
    ]
    assert facts["not_known_of"] == ["basalt"] and facts["by"] == "peak pressure"
    assert facts["parts"][0]["counting_error"] == pytest.approx(
        {"melting_begins": (20.0 / 3.0) ** 0.5 / 8.0, "molten": (16.0 * 2.0 / 3.0) ** 0.5 / 8.0}
    )
    assert facts["parts"][1]["counting_error"]["molten"] == 0.0  # the whole projectile


def test_a_pressure_just_at_the_critical_one_melts_nothing():
    facts = phases.masses(shocked(peak_pressure=np.array([*ICE.values(), 0.0, 0.0, 0.0, 0.0])), 1.0)
    assert facts["parts"][0]["over_projectile_mass"] == {"melting_begins": 2.0, "molten": 0.0}


@pytest.mark.parametrize("missing", ["peak_pressure", "mass", "material"])
def test_a_snapshot_without_what_it_needs_says_nothing(missing):
    whole = shocked()
    fields = {name: whole[name] for name in whole if name != missing}
    assert phases.masses(Particles(fields, whole.attributes), 8.0) == {}
    assert phases.masses(whole, 0.0) == {}


def test_the_terminal_says_the_masses_and_by_what():
    words = result._molten(phases.masses(shocked(), 8.0))
    assert words[0] == (
        "shocked ice of the target in projectile masses, by peak pressure: begins to melt above 1.6 GPa: 0.75, molten "
        "above 4.1 GPa: 0.5"
    )
    assert len(words) == 2 and result._molten({}) == []


def test_the_page_says_the_masses_their_errors_and_sources_and_what_is_not_known():
    page = report_matter.molten(phases.masses(shocked(), 8.0))
    assert "0.75 ± 0.32 (above 1.6 GPa)" in page and "<td class='n'>1 (above 4.1 GPa)" in page
    assert "Stewart &amp; Ahrens 2005" in page and "No critical pressures are known of basalt" in page
    cold = phases.masses(shocked(peak_pressure=np.zeros(6)), 8.0)
    assert "none (above 1.6 GPa)" in report_matter.molten(cold)
    assert report_matter.molten({}) == "" and report_matter.molten({"parts": [], "not_known_of": ["basalt"]}) == ""


def test_a_material_without_a_pressure_says_so_in_its_cell(monkeypatch):
    """One that boils, beside ice, of which no such pressure is known; no column of what none has."""
    real = phases.pressures
    assert set(real("iron")) == set(real("ice")) == {"melting_begins", "molten"}
    more = {"iron": {"boiling_begins": 500e9}}
    monkeypatch.setattr(phases, "pressures", lambda name: real(name) | more.get(name, {}))
    facts = phases.masses(shocked(("iron", "ice")), 8.0)
    page = report_matter.molten(facts)
    assert "not known" in page and "begins to boil" in page and "vapour</th>" not in page


def test_critical_pressures_of_every_material_rise():
    known = {name: list(phases.pressures(name).values()) for name in material.names()}
    assert any(known.values())
    for values in known.values():
        assert values == sorted(values)
