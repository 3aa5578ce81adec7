"""Pictures of grains are in units that suit their size: a bowl of a metre is no picture in kilometres."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from dem.beds import bed_pictures
from matter.particles import Particles
from matter.wording import readable


def grains(size):
    """A row of grains in the plane of the cut, a tenth of ``size`` in radius."""
    x = np.linspace(-0.5, 0.5, 6) * size
    zero = np.zeros(len(x), dtype=int)
    position = np.column_stack([x, 0.0 * x, np.full(len(x), -0.2 * size)])
    return Particles(
        {"position": position, "radius": np.full(len(x), 0.1 * size), "state": zero, "species": zero, "headroom": zero}
    )


@pytest.mark.parametrize(("size", "unit", "across"), [(0.1, "mm", 100.0), (1.0, "m", 1.0), (30e3, "km", 30.0)])
def test_a_bed_is_drawn_in_a_unit_that_suits_its_size(size, unit, across):
    axes = Figure().add_subplot()
    bed_pictures.flat_slab(axes, grains(size), SimpleNamespace(shape="box", radius=size, floor=-size, top=0.2 * size))
    assert axes.get_xlabel() == f"x [{unit}]" and axes.get_ylabel() == f"z [{unit}]"
    assert axes.get_xlim()[1] == pytest.approx(1.05 * across)
    circles = axes.collections[0]
    assert np.asarray(circles.get_offsets())[:, 0].max() == pytest.approx(0.5 * across)

    axes = Figure().add_subplot()
    domain = SimpleNamespace(half_angle=0.5, floor=size, datum=2.0 * size, top=2.2 * size)
    bed_pictures.slab(axes, grains(size), domain)
    assert axes.get_xlabel() == f"x [{unit}]"
    assert axes.get_xlim()[1] == pytest.approx(1.05 * 2.2 * across * np.sin(0.5))
    assert np.asarray(axes.collections[0].get_offsets())[:, 0].max() == pytest.approx(0.5 * across)


@pytest.mark.parametrize(("pascals", "unit"), [(3e9, "GPa"), (4e8, "MPa"), (5e3, "kPa"), (12.0, "Pa"), (0.0, "Pa")])
def test_pressures_have_a_unit_that_suits_them(pascals, unit):
    factor, word = readable.pressure_unit(pascals)
    assert word == unit and (pascals * factor < 2000.0)
