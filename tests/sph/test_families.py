"""Every law of every family: listed once, complete, and the same through the family's compiled branch as called by
itself."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
import pytest

from matter.compilation.law_family import Family
from pipeline.case import bibliography
from sph.eos import table
from sph.kernels.dispatch import FAMILY as KERNELS
from sph.materials.families import FAMILIES as MATERIAL
from sph.porosity.matrix import Matrix
from sph.strength import dispatch as strength

FAMILIES = (*MATERIAL, KERNELS)
LAWS = [(family, number) for family in FAMILIES for number, name in enumerate(family.names) if name != "none"]
MATRIX = Matrix(2700.0, 2.67e10, 1e7)


def title(case):
    return f"{case[0].key}-{case[0].names[case[1]]}" if isinstance(case, tuple) else None


def padded(family, numbers):
    row = np.zeros(family.width)
    row[: len(numbers)] = numbers
    return row


def compiled(module):
    """Names of the compiled functions that a file itself defines."""
    return {
        name
        for name, value in vars(module).items()
        if hasattr(value, "py_func") and value.py_func.__module__ == module.__name__
    }


def test_no_law_file_is_left_out_of_its_list():
    """A law is a file of the family's folder that has every compiled function which the listed laws share."""
    listed = {module.__name__ for family in FAMILIES for module in family.laws}
    shared = {family.key: set.intersection(*map(compiled, family.laws)) for family in FAMILIES}
    assert all(shared.values())
    for folder in ("eos", "strength", "porosity", "damage", "kernels"):
        package = importlib.import_module(f"sph.{folder}")
        for info in pkgutil.iter_modules(package.__path__, f"sph.{folder}."):
            if not info.name.endswith("__main__"):
                module = importlib.import_module(info.name)
                law = not hasattr(module, "FAMILY") and any(
                    functions <= compiled(module) for functions in shared.values()
                )
                assert law == (info.name in listed), f"{info.name} is in no family's list, or no law"


@pytest.mark.parametrize("case", LAWS, ids=title)
def test_every_source_of_a_law_is_in_the_bibliography(case):
    family, number = case
    missing = set(family.module(number).SOURCES) - set(bibliography.entries())
    assert not missing, f"add to pipeline/settings/references.bib: {', '.join(sorted(missing))}"


@pytest.mark.parametrize("case", [case for case in LAWS if hasattr(case[0].module(case[1]), "EXAMPLE")], ids=title)
def test_the_example_of_a_law_fits_together_and_fills_its_row(case):
    family, number = case
    example = family.module(number).EXAMPLE
    assert family.fault(number, example) == ""
    row = family.row(number, example, MATRIX) if family.key == "porosity" else family.row(number, example)
    assert np.isfinite([x for x in row if x != np.inf]).all()
    if family.module(number) is table:  # its own head says how long it is
        n, k, places, of_energy = (int(row[at]) for at in (3, 4, 7, 11))
        assert len(row) == table.HEAD + places + 2 * n + k + (n - 1) * of_energy + n * k * table.FIELDS
    else:
        assert 0 < len(row) <= family.width


def test_the_family_calls_the_law_with_its_own_parameters():
    """Damage, pressure and energy reach the law in the right places, for every yield law."""
    for number, module in enumerate(strength.FAMILY.laws, 1):
        row = strength.FAMILY.row(number, module.EXAMPLE)
        values = row if hasattr(module, "Row") else module.EXAMPLE
        for state in ((1e8, 1e5, 0.25), (3e9, 0.0, 1.0), (-1e6, 2e6, 0.0)):
            assert strength.yield_stress(number, padded(strength.FAMILY, row), *state) == module.yield_stress(
                *state, values
            )


@pytest.mark.parametrize("module", strength.FAMILY.laws, ids=strength.FAMILY.title)
def test_a_yield_law_mixes_damage_if_and_only_if_it_says_so(module):
    number = strength.FAMILY.laws.index(module) + 1
    row = padded(strength.FAMILY, strength.FAMILY.row(number, module.EXAMPLE))
    whole, broken = (strength.yield_stress(number, row, 1e8, 0.0, D) for D in (0.0, 1.0))
    assert (broken < whole) == module.MIXES_DAMAGE


@pytest.mark.parametrize("module", strength.FAMILY.laws, ids=strength.FAMILY.title)
def test_a_yield_law_ends_in_tension_rubs_and_hardens_as_it_says(module):
    """Its tip and its hardening reach it through the family, and pressure raises it if and only if it ``RUBS``."""
    number = strength.FAMILY.laws.index(module) + 1
    row = strength.FAMILY.row(number, module.EXAMPLE)
    values, one = (row if hasattr(module, "Row") else module.EXAMPLE), padded(strength.FAMILY, row)
    low, high = (strength.yield_stress(number, one, P, 0.0, 1.0) for P in (1e6, 1e8))
    assert (high > low) == getattr(module, "RUBS", False), "RUBS = True where pressure raises the yield stress"
    tip = module.apex(0.0, 0.5, values) if hasattr(module, "apex") else 1e300
    assert strength.apex(number, one, 0.0, 0.5) == tip
    assert strength.yield_stress(number, one, -1.01 * tip, 0.0, 0.5) == 0.0 or tip == 1e300, "it ends: define apex"
    hard = module.hardening(0.3, values) if getattr(module, "HARDENS", False) else 1.0
    assert strength.hardening(number, one, 0.3) == hard


@pytest.mark.parametrize("module", strength.FAMILY.laws, ids=strength.FAMILY.title)
def test_a_yield_law_is_softened_by_the_melt_energy_of_its_material(module):
    number = strength.FAMILY.laws.index(module) + 1
    assert "melt_energy" in module.Parameters._fields, "Parameters ends in melt_energy: Annotated[..., Follows()]"
    row = strength.FAMILY.row(number, module.EXAMPLE._replace(melt_energy=1e6))
    cold, half, molten = (
        strength.yield_stress(number, padded(strength.FAMILY, row), 1e8, u, 0.0) for u in (0.0, 5e5, 1e6)
    )
    assert cold > half > molten == 0.0


def test_a_law_without_a_needed_function_is_named():
    from sph.eos import murnaghan, tillotson

    with pytest.raises(TypeError, match="trial: tillotson, murnaghan has no function 'colour'"):
        Family("trial", "trial law", (tillotson, murnaghan)).choose("colour", "P", about="")
    with pytest.raises(TypeError, match="trial: none has no function 'density'"):
        Family("trial", "trial law", (tillotson, murnaghan), none=True).choose("density", "P, u", about="")
