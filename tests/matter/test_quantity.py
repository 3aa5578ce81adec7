"""Quantities: what is read is what was written, and what is ambiguous is refused."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from matter.case import quantity
from matter.case.quantity import REQUIRED, Angle, Length, PositiveLength, Speed

numbers = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e300, max_value=1e300)


class Body(BaseModel):
    radius: PositiveLength = 1.0
    offset: Length = 0.0
    speed: Speed = 0.0
    angle: Angle = 0.0


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("18.234 km/s", "m/s", 18234.0),
        ("150 km", "m", 150e3),
        ("150km", "m", 150e3),
        ("9.47 GPa", "Pa", 9.47e9),
        ("4e35 m^-3", "1/m^3", 4e35),
        ("0.917 g/cm^3", "kg/m^3", 917.0),
        ("40 deg", "rad", math.radians(40)),
        ("60 min", "s", 3600.0),
        ("4.72 MJ/kg", "J/kg", 4.72e6),
        ("0.3", "", 0.3),
        ("1 AU", "m", 149597870700.0),
        ("-2.5e1 mm", "m", -0.025),
    ],
)
def test_values_in_si(text, unit, value):
    assert quantity.parse(text, unit) == pytest.approx(value, rel=1e-15)


@given(numbers)
def test_a_number_in_si_units_comes_back_to_the_last_bit(number):
    for unit in ("m", "m/s", "Pa", "rad", "kg/m^3", "1/m^3"):
        assert quantity.parse(f"{number!r} {unit}", unit) == number
    assert quantity.parse(repr(number)) == number


@given(numbers, st.sampled_from([("km", 1e3), ("cm", 1e-2), ("mm", 1e-3)]))
def test_prefixes_scale(number, prefix):
    assert quantity.parse(f"{number!r} {prefix[0]}", "m") == pytest.approx(number * prefix[1], rel=1e-12, abs=1e-300)


@given(st.text(max_size=20))
def test_any_text_is_a_float_or_a_reason(text):
    try:
        assert isinstance(quantity.parse(text, "m"), float)
    except ValueError as reason:
        assert repr(text) in str(reason)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "m",
        "km 5",
        "5 kg",
        "5 m/s",
        "5",
        "1,5 km",
        "5 parsnips",
        "2 * 3 m",
        "5 m + 3 m",
        "1_000 m",
        "nan m",
        "inf m",
        "10**9 m",
        "5 km/m",
    ],
)
def test_what_is_not_a_length_is_refused(text):
    with pytest.raises(ValueError):
        quantity.parse(text, "m")


def test_a_bare_angle_is_refused_too():
    with pytest.raises(ValueError, match="has no unit"):
        quantity.parse("40", "rad")


def test_a_case_file_needs_units_and_python_does_not():
    assert Body(radius=3.0).radius == 3.0
    assert Body.model_validate({"radius": "3 km"}, context=REQUIRED).radius == 3000.0
    with pytest.raises(ValidationError) as caught:
        Body.model_validate({"radius": 3.0, "offset": 0, "speed": "3 km", "angle": True}, context=REQUIRED)
    assert [error["loc"] for error in caught.value.errors()] == [("radius",), ("offset",), ("speed",), ("angle",)]
    assert "the unit is missing" in str(caught.value)


@pytest.mark.parametrize("value", ["-3 km", "0 m", "1e999 m", float("nan"), float("inf"), None, [1], "abc"])
def test_a_positive_length_is_positive_and_finite(value):
    with pytest.raises(ValidationError):
        Body(radius=value)


@pytest.mark.parametrize("text", ["1e-300 m", "1e300 m", "-1e300 m", "5e-324 m", "1e-51 m"])
def test_a_size_out_of_this_world_is_refused(text):
    """Its cube would overflow or vanish: a traceback far from the case that said so."""
    with pytest.raises(ValidationError, match=r"must lie between 1e-50 and 1e\+50 m"):
        Body(offset=text)


def test_nothing_and_the_smallest_and_largest_that_are_meant_pass():
    assert [Body(offset=text).offset for text in ("0 m", "1e-10 m", "1e20 km")] == [0.0, 1e-10, 1e23]
