"""Lengths and times as people read them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matter import quantity, readable


@pytest.mark.parametrize(
    ("metres", "text"),
    [(612_300.0, "612 km"), (1_085_000.0, "1085 km"), (14.5, "14.5 m"), (-3.4e-3, "-3.4 mm"), (999.0, "999 m"), (1000.0, "1 km"), (0.0, "0 m")],
)
def test_lengths(metres, text):
    assert readable.length(metres) == text


@pytest.mark.parametrize(("seconds", "text"), [(450.0, "7.5 min"), (3600.0, "60.0 min"), (0.03, "30 ms"), (2.0, "2 s"), (6e-5, "60 us"), (0.0, "0 s")])
def test_times(seconds, text):
    assert readable.clock(seconds) == text


@settings(deadline=None)
@given(st.floats(1e-3, 1e7))
def test_a_length_reads_back_to_its_three_digits(metres):
    assert quantity.parse(readable.length(metres), "m") == pytest.approx(metres, rel=5.1e-3)


@settings(deadline=None)
@given(st.floats(1e-6, 1e5))
def test_units_say_the_same(value):
    for factor, unit in (readable.length_unit(value), readable.time_unit(value)):
        assert quantity.parse(f"1 {unit}", "m" if unit.endswith("m") and unit != "min" else "s") * factor == pytest.approx(1.0)
