"""A material's file that somebody writes: a value of another dimension, without its unit, misspelt or missing is one
message that says where."""

from __future__ import annotations

import pytest

from matter.case import material
from matter.errors import InputError
from sph.materials.rows import collect

FILE = (material.FOLDER / "granite.toml").read_text()


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """Writes a material's file, granite with one text replaced; gives its name, a new one each time."""
    monkeypatch.setattr(material, "FOLDER", tmp_path)

    def write(old: str, new: str) -> str:
        assert old in FILE
        name = f"mine_{abs(hash((old, new, str(tmp_path))))}"
        (tmp_path / f"{name}.toml").write_text(FILE.replace(old, new, 1))
        return name

    return write


def test_the_file_as_it_is_is_read(mine):
    name = mine('rho0 = "2680 kg/m^3"', 'rho0 = "2.6 g/cm^3"')
    assert collect((name,), {}).rows.rho0[0] == pytest.approx(2600.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('rho0 = "2680 kg/m^3"', 'rho0 = "2680 m"', r"\[tillotson\]: rho0: '2680 m' is not a quantity in kg/m\^3"),
        ('rho0 = "2680 kg/m^3"', 'rho0 = "2680"', r"\[tillotson\]: rho0: '2680' has no unit"),
        ('rho0 = "2680 kg/m^3"', "rho0 = 2680", r"\[tillotson\]: rho0: the unit is missing"),
        ('a = "0.5"', 'a = "0.5 m"', r"\[tillotson\]: a: '0.5 m' is not a plain number"),
        ('cohesion = "90 MPa"', 'cohesion = "90 m"', r"\[collins\]: cohesion: '90 m' is not a quantity in Pa"),
        ("shear_modulus", "shear_modolus", "shear_modulus is missing; shear_modolus: unknown, did you mean 'shear"),
        ('rho0 = "2680 kg/m^3"', "rho0 = true", r"toml, \[tillotson\] rho0: True is no number"),
        ('rho0 = "2680 kg/m^3"', "rho0 = { x = 1 }", r"toml, \[tillotson\] rho0: {'x': 1} is no number"),
        ('rho0 = "2680 kg/m^3"', 'rho0 = "many"', r"toml, \[tillotson\] rho0: cannot read 'many'"),
        ('rho0 = "2680 kg/m^3"', 'rho0 "2680 kg/m^3"', r"toml cannot be read: Expected '=' .*line 7"),
    ],
)  # fmt: skip
def test_a_mistake_in_the_file_is_one_message_that_says_where(mine, old, new, words):
    with pytest.raises(InputError, match=words):
        collect((mine(old, new),), {})
