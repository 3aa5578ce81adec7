"""Pictures of a run for a notebook: in units of the crater's size."""

from __future__ import annotations

import pandas
import pytest

from bolide.plots import Plots


def table(radius_m: float) -> pandas.DataFrame:
    depth = 0.2 * radius_m
    columns = {"radius_m": [0.0, radius_m], "height_m": [-depth, 0.0]}
    return pandas.DataFrame({**columns, "height_p16_m": [-depth, 0.0], "height_p84_m": [-depth, 0.0]})


@pytest.mark.parametrize(("radius_m", "end", "unit"), [(80.0, 80.0, "[m]"), (4e5, 400.0, "[km]")])
def test_a_profile_is_drawn_in_units_of_its_size(radius_m, end, unit):
    pytest.importorskip("matplotlib")
    axes = Plots(lambda stage: table(radius_m), "run").profile()
    assert axes.get_xlabel().endswith(unit) and axes.get_ylabel().endswith(unit)
    assert axes.lines[0].get_xdata()[-1] == pytest.approx(end)


def test_a_second_profile_keeps_the_unit_of_the_first():
    pytest.importorskip("matplotlib")
    axes = Plots(lambda stage: table(4e5), "large").profile()
    Plots(lambda stage: table(80.0), "small").profile(axes=axes)
    assert axes.lines[1].get_xdata()[-1] == pytest.approx(0.08)
