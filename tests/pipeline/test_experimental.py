"""What is marked experimental is taken by no shipped case, is a key that exists, and is said where it is described and
taken."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from pipeline.case import experimental, keys, read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASES = Path(__file__).parents[2] / "cases"
EVERY = [
    (path.parent.name, preset)
    for path in sorted(CASES.glob("*/case.toml"))
    for preset in (None, *tomllib.loads(path.read_text()).get("preset", {}))
]


def taken(name, preset, sets=()):
    chosen = read.read(CASES / name, preset, sets)
    return list(experimental.used({stage: one for stage, one in compose(chosen).items() if stage in chosen.stages}))


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
