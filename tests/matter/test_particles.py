"""Particles: the table of fields is the only truth about shapes, units and meanings."""

from __future__ import annotations

import numpy as np
import pytest

from matter.case import quantity
from matter.errors import InputError
from matter.files import hdf5_input, snapshot
from matter.particles import FIELDS, Particles


@pytest.fixture
def three() -> Particles:
    return Particles(
        {"position": np.arange(9.0).reshape(3, 3), "mass": [1, 2, 3]}, {"time": 1.0}, {"contacts/pair": [[0, 1]]}
    )


@pytest.mark.parametrize("name", FIELDS)
def test_every_field_has_a_readable_unit_and_a_meaning(name):
    entry = FIELDS[name]
    assert len(entry.meaning) > 3
    assert np.dtype(entry.dtype).kind in "if"
    assert entry.unit == "1" or quantity.parse(f"1 {entry.unit}") > 0


def test_a_field_is_an_attribute_and_an_item(three):
    assert three.mass is three["mass"]
    assert (
        three.mass.dtype == np.float64 and len(three) == 3 and "mass" in three and list(three) == ["position", "mass"]
    )
    assert three.tables["contacts/pair"].shape == (1, 2)


def test_the_radius_of_the_support_goes_by_both_names(three, tmp_path):
    """Files call it smoothing_length; who writes or reads support_radius means the same array, in files too."""
    three["support_radius"] = [2.0, 3.0, 4.0]
    assert three.support_radius is three["smoothing_length"] and "support_radius" in three
    assert list(three) == ["position", "mass", "smoothing_length"]
    three.need("support_radius")
    path = tmp_path / "shot.vtkhdf"
    snapshot.write(three, path)
    with hdf5_input.opened(path) as file:
        assert "support_radius" not in file["particles"]
    assert snapshot.read(path, only=("support_radius",)).support_radius.tolist() == [2.0, 3.0, 4.0]
    with pytest.raises(InputError, match=r"lacks smoothing_length \(smoothing_length: support radius of"):
        Particles({"mass": [1.0]}).need("support_radius")


def test_wrong_fields_are_named(three):
    with pytest.raises(InputError, match="unknown particle field 'mas'"):
        three["mas"] = [1, 2, 3]
    with pytest.raises(InputError, match="2 values for 3 particles"):
        three["density"] = [1, 2]
    with pytest.raises(InputError, match=r"'velocity' needs shape \(n, 3\), got \(3, 2\)"):
        three["velocity"] = np.zeros((3, 2))
    with pytest.raises(InputError, match=r"lacks density, damage \(density: bulk density \[kg/m\^3\]"):
        three.need("mass", "density", "damage")
    with pytest.raises(AttributeError, match="have no field 'density'"):
        _ = three.density


def test_a_selection_is_a_copy(three):
    some = three.select(np.array([True, False, True]))
    some.mass[0] = 99.0
    assert three.mass[0] == 1.0 and some.attributes == {"time": 1.0} and len(some) == 2
    np.testing.assert_array_equal(three.select([2, 0]).mass, [3.0, 1.0])


def test_no_particles_are_particles_too():
    nothing = Particles({"position": np.zeros((0, 3)), "mass": []})
    assert len(nothing) == 0 and len(Particles({})) == 0
