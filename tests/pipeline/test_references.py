"""The bibliography: readable entries, and every source that a material names is in it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from matter import material
from pipeline import case, references


def test_every_entry_has_what_a_citation_needs():
    found = references.entries()
    assert len(found) > 20
    for key, entry in found.items():
        assert entry.count("{") == entry.count("}"), key
        for part in ("author", "title", "year"):
            assert re.search(rf"^  {part} = \{{.+\}}", entry, re.MULTILINE), (key, part)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("Benz & Asphaug 1999, Icarus 142", "BenzAsphaug1999"),
        ("Benz and Asphaug (1994), eq. 12", "BenzAsphaug1994"),
        ("(Zhang et al., 2017)", "Zhang2017"),
        ("Schäfer et al. 2016", "Schaefer2016"),
        ("Schaefer et al. (2016)", "Schaefer2016"),
        ("Winter 2017, Table 8", "Winter2017"),
    ],
)
def test_a_citation_in_words_is_recognised(text, key):
    assert references.cited(text) == [key]


def test_another_year_is_another_paper():
    assert references.cited("Benz & Asphaug 2001; Zhang 1917; Melosh et al. 2017") == []


@pytest.mark.parametrize("name", material.names())
def test_every_equation_of_state_of_a_material_is_cited(name):
    assert references.cited(str(material.load(name)[material.choices(name).get("eos", "tillotson")]["source"]))


def test_laws_that_a_run_does_not_take_are_not_cited(tmp_path):
    folder = Path(__file__).parents[2] / "cases" / "valhalla_980km"
    keys = {}
    for name, sets in (("plain", ()), ("porous", ('sph.materials.basalt={"porosity" = "p_alpha", "p_alpha" = {"alpha0" = 1.2}}',))):
        chosen = case.read(folder, "quick", sets)
        keys[name] = set(references.write(tmp_path / "references.bib", chosen, {"sph": case.compose(chosen)["sph"]}, ("basalt", "water", "ice")))
    assert {"Tillotson1962", "GradyKipp1980", "Winter2017"} <= keys["plain"]
    assert not {"Collins2004", "DruckerPrager1952", "Murnaghan1944", "Wuennemann2006", "CarrollHolt1972"} & keys["plain"]
    assert "Jutzi2008" in keys["porous"] - keys["plain"]


def test_numerics_that_a_run_does_not_take_are_not_cited(tmp_path):
    folder = Path(__file__).parents[2] / "cases" / "valhalla_980km"
    keys = {}
    changed = ('sph.volumes="start"', 'sph.late={"at" = "10 min", "sound_speed" = "500 m/s"}')
    for name, sets in (("plain", ()), ("late", changed)):
        chosen = case.read(folder, "quick", sets)
        keys[name] = set(references.write(tmp_path / "references.bib", chosen, {"sph": case.compose(chosen)["sph"]}, ("basalt", "water", "ice")))
    assert keys["late"] - keys["plain"] == {"RaducanJutzi2022", "OttSchnetter2003", "Price2012", "MorrisMonaghan1997"}  # the last: alpha of the late stage
    assert not {"Balsara1995", "Rosswog2000", "SpringelHernquist2002", "Monaghan2002", "Adami2012"} & keys["late"]
    assert "MonaghanLattanzio1985" in keys["plain"] and "Kutta1901" not in keys["late"]
