"""Densities at rest of materials, as files and as cases give them, and the gravity that follows from them."""

import math

import pytest

from matter.case import at_rest, material
from matter.case.at_rest import AtRest
from matter.case.body import Target
from matter.constants import G
from sph.materials.rows import collect
from sph.materials.settings import Choice


@pytest.mark.parametrize("name", material.names())
def test_a_file_says_the_densities_that_the_shock_stage_takes(name):
    """To the last bit: nothing that follows from them changes where a case says nothing of its materials."""
    assert collect((name,)).at_rest == {name: at_rest.of_file(name)}
    assert at_rest.own(collect((name,)).at_rest) == {}


def test_pores_of_the_file_count_in_the_bulk():
    pumice = at_rest.of_file("pumice")
    assert pumice.solid / pumice.bulk == pytest.approx(3.64)
    assert at_rest.of_file("basalt") == AtRest(solid=2700.0, bulk=2700.0)  # porous where a case says so


def test_what_a_case_says_is_its_own():
    rubble = Choice(
        tillotson={"rho0": "3500 kg/m^3"},
        porosity="p_alpha",
        p_alpha={"alpha0": 1.4583},
        crush_quadratic={"Pe": "1 MPa", "Ps": "1 GPa"},
    )
    own = at_rest.own(collect(("basalt", "ice"), {"basalt": rubble}).at_rest)
    assert own == {"basalt": AtRest(solid=3500.0, bulk=3500.0 / 1.4583)}
    assert (
        at_rest.densities_at_rest("basalt", own) == own["basalt"]
        and at_rest.densities_at_rest("ice", own).bulk == 917.0
    )


def test_gravity_goes_by_the_bulk_of_every_layer():
    layers = [
        {"name": "core", "material": "basalt", "thickness": 600.0},
        {"name": "shell", "material": "ice", "thickness": 400.0},
    ]
    ball = Target.model_validate({"layers": layers})
    core, shell = 4 / 3 * math.pi * 600.0**3, 4 / 3 * math.pi * (1000.0**3 - 600.0**3)
    own = {"basalt": AtRest(solid=3500.0, bulk=2400.0)}
    assert at_rest.surface_gravity(ball, {}) == pytest.approx(G * (2700.0 * core + 917.0 * shell) / 1e6)
    assert at_rest.surface_gravity(ball, own) == pytest.approx(G * (2400.0 * core + 917.0 * shell) / 1e6)
    flat = Target.model_validate({"layers": layers, "shape": "half_space", "gravity": 1.62})
    assert at_rest.surface_gravity(flat, own) == 1.62
    body = Target.model_validate(
        {"layers": [{"name": "all", "material": "basalt"}], "shape": "ellipsoid", "axes": [400.0, 300.0, 200.0]}
    )
    assert at_rest.surface_gravity(body, own) == pytest.approx(4 / 3 * math.pi * G * 2400.0 * body.radius)
