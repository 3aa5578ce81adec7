"""What is marked experimental is taken by no shipped case, is a key that exists, and is said where it is described and
taken."""

from __future__ import annotations

import functools
import tomllib
from pathlib import Path

import pytest

from dem.laws.dispatch import COHESION, NORMAL
from pipeline.case import experimental, keys, read
from pipeline.settings import sense
from pipeline.settings.compose import compose
from sph.materials.families import FAMILIES as MATERIAL

CASES = Path(__file__).parents[2] / "cases"
EVERY = [
    (path.parent.name, preset)
    for path in sorted(CASES.glob("*/case.toml"))
    for preset in (None, *tomllib.loads(path.read_text()).get("preset", {}))
]


@functools.cache
def composed(name, preset, sets=()):
    chosen = read.read(CASES / name, preset, sets)
    return {stage: one for stage, one in compose(chosen).items() if stage in chosen.stages}


def taken(name, preset, sets=()):
    return list(experimental.used(composed(name, preset, sets)))


@pytest.mark.parametrize(("name", "preset"), EVERY)
def test_no_shipped_case_takes_what_is_marked(name, preset):
    assert taken(name, preset) == []


@pytest.mark.parametrize("path", experimental.CHOICES)
def test_a_marked_key_exists_and_its_description_says_so(path):
    found = keys.find(path)[1]
    assert [key.name for key in found] == [path]
    assert "(no shipped case takes it)" in found[0].meaning
    assert all(
        str(value).lower() in found[0].allowed.lower() or isinstance(value, bool)
        for value in experimental.CHOICES[path]
    )


def test_a_law_that_no_shipped_case_takes_is_marked():
    """Of the families that a case chooses from: equation of state, yield, pores, normal force, cohesion."""
    used = {key: {"none"} for key in ("eos", "strength", "porosity", "normal", "cohesion")}
    for settings in (composed(*one) for one in EVERY):
        if dem := settings.get("dem"):
            used["normal"].add(dem.contact.normal)
            used["cohesion"].add(dem.contact.cohesion)
        for family in MATERIAL if "sph" in settings else ():
            if family.key in used:
                materials = settings["sph"].chosen_materials()
                numbers = getattr(materials.rows, family.key)
                own = {"table"} if family.key == "eos" else set()  # a library's material brings its table
                used[family.key] |= {family.names[number] for number in numbers} - own
    for family in (*MATERIAL, NORMAL, COHESION):
        if family.key in used:
            path = f"dem.contact.{family.key}" if family in (NORMAL, COHESION) else f"sph.materials.NAME.{family.key}"
            marked = set(experimental.CHOICES.get(path, ()))
            assert {*family.names} - used[family.key] == marked, f"{path}: mark in pipeline/case/experimental.py"


def test_what_is_not_marked_is_described_without_a_remark():
    assert "xperimental" not in keys.find("sph.courant")[1][0].meaning


def test_a_case_that_takes_one_is_told():
    sets = ('dem.contact.normal="hertz"', 'dem.contact.shell.elastic_modulus="1 GPa"')
    words = taken("valhalla_980km", "quick", sets)
    assert [line.split(" is ")[0] for line in words] == ['[dem.contact] normal = "hertz"']
    chosen = read.read(CASES / "valhalla_980km", "quick", sets)
    assert set(words) <= set(sense.judged(compose(chosen), {}, chosen.stages)[1])


def test_a_table_of_one_material_is_told_with_its_name():
    from matter.case.material import TABLES

    sets = ('sph.materials.basalt.eos="table"', 'sph.materials.basalt.table.rho0="2650 kg/m^3"')
    words = taken("momentum_transfer", None, (*sets, f'sph.materials.basalt.table.file="{TABLES / "quartz.txt.xz"}"'))
    assert [line.split(" is ")[0] for line in words] == ['[sph.materials.basalt] eos = "table"']
