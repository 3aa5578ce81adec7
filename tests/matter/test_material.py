"""Material files: every value has a unit, every group of values a source."""

from __future__ import annotations

import tomllib

import pytest

from matter.case import material, quantity
from matter.errors import InputError
from pipeline.case import bibliography
from sph.materials.families import FAMILIES

DIMENSIONS = {
    "tillotson": {"rho0": "kg/m^3"}
    | dict.fromkeys(("A", "B"), "Pa")
    | dict.fromkeys(("E0", "Eiv", "Ecv"), "J/kg")
    | dict.fromkeys("ab", ""),
    "elastic": {"shear_modulus": "Pa", "bulk_modulus": "Pa"},
    "von_mises": {"Y0": "Pa"},
    "weibull": {"k": "1/m^3", "m": ""},
    "murnaghan": {"rho0": "kg/m^3", "K0": "Pa", "n": ""},
    "drucker_prager": {"friction_angle": "rad", "cohesion": "Pa"},
    "collins": {"cohesion": "Pa", "limiting_strength": "Pa", "internal_friction": ""},
    "p_alpha": {"alpha0": ""},
    "crush_quadratic": {"Pe": "Pa", "Ps": "Pa"},
    "crush_two_power": dict.fromkeys(("Pe", "Pt", "Ps"), "Pa") | dict.fromkeys(("alpha_e", "alpha_t", "n1", "n2"), ""),
}


LAWS = {family.key: family.names for family in FAMILIES}


@pytest.mark.parametrize("name", material.names())
def test_every_value_has_a_unit_and_every_group_a_source(name):
    content = tomllib.loads((material.FOLDER / f"{name}.toml").read_text())
    assert content["title"]
    assert content.get("eos", "tillotson") in content and "elastic" in content
    assert material.reference_density(name) > 100.0
    for title, section in content.items():
        if isinstance(section, str):
            assert title == "title" or section in LAWS[title], f"{name}: {title} = {section!r}"
            continue
        assert len(section["source"]) > 8, f"{name} [{title}] names no source"
        assert bibliography.fault(section["sources"]) == "", f"{name} [{title}]"
        for key, value in section.items():
            if key in material.WORDS:
                continue
            assert isinstance(value, str), f"{name} [{title}] {key}: write it as a text with its unit"
            if (title, key) == ("table", "file"):
                assert (material.FOLDER / value).is_file(), f"{name} [{title}] {key}: no {value} ships"
                continue
            unit = DIMENSIONS.get(title, {}).get(key)
            assert quantity.parse(value, unit or "") >= 0 if unit is not None else quantity.parse(value) is not None
        if title in DIMENSIONS:
            assert set(DIMENSIONS[title]) <= set(section), f"{name} [{title}] is not complete"


def test_values_are_si():
    ice = material.section("ice", "tillotson")
    assert ice["rho0"] == 917.0 and ice["A"] == pytest.approx(9.47e9) and ice["E0"] == pytest.approx(1e7)
    assert material.section("basalt", "weibull")["k"] == pytest.approx(4e35)


def test_sound_speeds_are_those_of_the_materials():
    """c = sqrt(A / rho0) at rest: basalt 3145, ice 3214, water 1478, iron 4051 m/s."""
    for name, speed in {
        "basalt": 3145,
        "ice": 3214,
        "water": 1478,
        "iron": 4051,
        "aluminum": 5277,
        "copper": 3952,
    }.items():
        values = material.section(name, "tillotson")
        assert (values["A"] / values["rho0"]) ** 0.5 == pytest.approx(speed, abs=1)


def test_what_is_unknown_is_a_message_with_the_nearest_name():
    with pytest.raises(
        InputError,
        match=r"unknown material 'basat'; did you mean 'basalt'.*to make one: docs/site/howto/own_material\.md",
    ):
        material.load("basat")
    with pytest.raises(InputError, match=r"'water' has no \[weibull\]"):
        material.section("water", "weibull")


@pytest.mark.parametrize("name", ["../materials/basalt", "./basalt", "../../x", "/etc/passwd", "", "basalt.toml"])
def test_a_name_is_no_path(name):
    with pytest.raises(InputError, match="unknown material"):
        material.load(name)
