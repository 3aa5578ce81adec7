"""The bibliography: readable entries, every key that anything names is in it, and a run cites what ran."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from matter.case import material
from matter.errors import InputError
from pipeline.case import bibliography, read, stages
from pipeline.settings import describe, references
from pipeline.settings.compose import compose, hash8

ROOT = Path(__file__).parents[2]
CASES = ROOT / "cases"
NAMING = [
    file
    for room in ("matter", "nbody", "sph", "handoff", "dem", "crater")
    for file in sorted((ROOT / room).rglob("*.py"))
    if "\nSOURCES = " in file.read_text()
]
HERTZ = (
    'dem.contact.normal="hertz"',
    'dem.contact.shell={"elastic_modulus" = "1 GPa"}',
    'dem.springs_for="bed"',
)


def cited(tmp_path, name, preset="quick", sets=(), only=None):
    """Keys of the bibliography of a case's run, of all its stages or ``only`` some."""
    chosen = read.read(CASES / name, preset, sets)
    settings = {stage: one for stage, one in compose(chosen).items() if stage in (only or chosen.stages)}
    return set(references.write(tmp_path / "references.bib", chosen, settings, describe.materials(settings.values())))


def test_every_entry_has_what_a_citation_needs():
    found = bibliography.entries()
    assert len(found) > 20
    for key, entry in found.items():
        assert entry.count("{") == entry.count("}"), key
        for part in ("author", "title", "year"):
            assert re.search(rf"^  {part} = \{{.+\}}", entry, re.MULTILINE), (key, part)


def test_no_key_stands_twice():
    assert bibliography.FILE.read_text().count("\n@") + 1 == len(bibliography.entries())


@pytest.mark.parametrize("file", NAMING, ids=lambda file: str(file.relative_to(ROOT)))
def test_every_source_of_a_file_is_in_the_bibliography(file):
    assert bibliography.named_by(file) or file.stem == "ideal_gas"
    assert bibliography.fault(bibliography.named_by(file)) == ""


@pytest.mark.parametrize("folder", sorted(path.parent.name for path in CASES.glob("*/case.toml")))
def test_every_shipped_case_names_its_sources(folder):
    table = tomllib.loads((CASES / folder / "case.toml").read_text())["case"]
    assert table["sources"] and bibliography.fault(table["sources"]) == ""


def test_a_key_that_is_not_in_the_bibliography_is_named_with_the_nearest(tmp_path):
    with pytest.raises(InputError, match=r"'Winter2018' is not in references.bib; did you mean 'Winter2017'"):
        compose(read.read(CASES / "valhalla_980km", "quick", ('case.sources=["Winter2018"]',)))


def test_citations_do_not_rename_a_run_folder():
    one, other = (read.read(CASES / "valhalla_980km", "quick", sets) for sets in ((), ()))
    other.document["case"]["sources"] = ["Melosh1989"]
    assert one.sources != other.sources and hash8(one) == hash8(other)


@pytest.mark.parametrize("name", material.names())
def test_every_equation_of_state_of_a_material_is_cited(name):
    assert material.load(name)[material.choices(name).get("eos", "tillotson")]["sources"]


def test_a_hertz_mindlin_run_cites_hertz_and_mindlin(tmp_path):
    hooke, hertz = cited(tmp_path, "valhalla_980km"), cited(tmp_path, "valhalla_980km", sets=HERTZ)
    assert {"Hertz1882", "Mindlin1949"} <= hertz - hooke
    assert "CundallStrack1979" in hooke and not {"Johnson1971", "Zhang2018", "Thompson2022", "Kloss2012"} & (
        hooke | hertz
    )


def test_an_asteroids_run_does_not_cite_the_thesis_on_callisto(tmp_path):
    ryugu, valhalla = cited(tmp_path, "sci_ryugu"), cited(tmp_path, "valhalla_980km")
    assert "Winter2017" in valhalla - ryugu
    assert {"Arakawa2020", "RaducanJutzi2022", "HousenHolsapple2011", "Zhang2017"} <= ryugu
    assert not {"BarnesHut1986", "Kessler1981", "CashKarp1990"} & ryugu


@pytest.mark.parametrize("name", ["valhalla_980km", "sci_ryugu", "dart_dimorphos"])
def test_files_that_a_run_leaves_idle_exist(name):
    """A law that was moved would be cited by every run, and nothing would say so."""
    for stage, settings in compose(read.read(CASES / name, "quick")).items():
        idle = getattr(stages.load(stage), "idle_sources", lambda settings: set())
        assert [path for path in idle(settings) if not path.is_file()] == []


def test_gravity_by_a_tree_is_cited_where_the_body_attracts_itself(tmp_path):
    assert "BarnesHut1986" in cited(tmp_path, "valhalla_980km", only=("sph",))
    assert "BarnesHut1986" not in cited(tmp_path, "valhalla_980km", only=("bed", "dem", "crater"))


def test_the_integrator_of_the_encounters_is_cited(tmp_path):
    from nbody.integrators import cash_karp

    found = cited(tmp_path, "valhalla_980km", only=("nbody",))
    assert "Hairer1993" in found and "CashKarp1990" in cash_karp.SOURCES and "CashKarp1990" not in found


def test_laws_that_a_run_does_not_take_are_not_cited(tmp_path):
    sets = ('sph.materials.basalt={"porosity" = "p_alpha", "p_alpha" = {"alpha0" = 1.2}}',)
    plain, porous = (cited(tmp_path, "valhalla_980km", sets=chosen, only=("sph",)) for chosen in ((), sets))
    assert {"Tillotson1962", "GradyKipp1980", "Winter2017"} <= plain
    assert not {"Collins2004", "DruckerPrager1952", "Murnaghan1944", "Wuennemann2006", "CarrollHolt1972"} & plain
    assert "Jutzi2008" in porous - plain


def test_numerics_that_a_run_does_not_take_are_not_cited(tmp_path):
    former = ('sph.numerics="monaghan"',)
    changed = (*former, 'sph.late={"at" = "10 us", "sound_speed" = "500 m/s"}')
    plain, late = (cited(tmp_path, "nakamura_fujiwara", sets=chosen, only=("sph",)) for chosen in (former, changed))
    assert late - plain == {"RaducanJutzi2022", "MorrisMonaghan1997"}  # the last: alpha of the late stage
    assert {"OttSchnetter2003", "Price2012"} <= cited(tmp_path, "nakamura_fujiwara", only=("sph",)) - plain
    assert not {"Rosswog2000", "SpringelHernquist2002", "Monaghan2002"} & late
    assert "MonaghanLattanzio1985" in plain
