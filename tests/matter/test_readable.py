"""Lengths and times as people read them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matter.case import quantity
from matter.wording import readable


@pytest.mark.parametrize(
    ("metres", "text"),
    [
        (612_300.0, "612 km"),
        (1_085_000.0, "1085 km"),
        (14.5, "14.5 m"),
        (-3.4e-3, "-3.4 mm"),
        (999.0, "999 m"),
        (1000.0, "1 km"),
        (0.0, "0 m"),
        (1e-6, "1 um"),
        (1.62e-4, "0.162 mm"),
    ],
)
def test_lengths(metres, text):
    assert readable.length(metres) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (450.0, "7.5 min"),
        (3600.0, "60.0 min"),
        (0.03, "30 ms"),
        (2.0, "2 s"),
        (6e-5, "60 us"),
        (2.03e-8, "20.3 ns"),
        (2.92e-11, "29.2 ps"),
        (0.0, "0 s"),
    ],
)
def test_times(seconds, text):
    assert readable.clock(seconds) == text


@settings(deadline=None)
@given(st.floats(1e-8, 1e7))
def test_a_length_reads_back_to_its_three_digits(metres):
    assert quantity.parse(readable.length(metres), "m") == pytest.approx(metres, rel=5.1e-3)


@settings(deadline=None)
@given(st.floats(1e-6, 1e5))
def test_units_say_the_same(value):
    for factor, unit in (readable.length_unit(value), readable.time_unit(value)):
        assert quantity.parse(
            f"1 {unit}", "m" if unit.endswith("m") and unit != "min" else "s"
        ) * factor == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (214_323.2, "m", "214.3 km"), (17.11e15, "m^3", "17.11 × 10⁶ km³"), (1.705e21, "kg", "1.705 × 10²¹ kg"), (0.9,
        "deg", "0.9°"), (0.0, "m", "0 m"),
        (3.9e-16, "1", "3.9 × 10⁻¹⁶"), (1e-12, "1", "10⁻¹²"), (20_000.0, "1", "20,000"), (-0.00754, "1", "−0.00754"),
        (3e-5, "m^3", "30 cm³"),
        (5.5e22, "kg m^2/s", "5.5 × 10²² kg m²/s"), (3600.0, "s", "60 min"),
    ],
)  # fmt: skip
def test_amounts(value, unit, text):
    assert readable.amount(value, unit) == text


@pytest.mark.parametrize(
    ("value", "sigma", "unit", "text", "plain"),
    [
        (569e3, 15e3, "m", "569 ± 15 km", "569 +- 15 km"),
        (24.16e15, 0.72e15, "m^3", "(24.16 ± 0.72) × 10⁶ km³", "(24.16 +- 0.72) million km3"),
        (0.1305, 0.0035, "1", "0.1305 ± 0.0035", "0.1305 +- 0.0035"),
        (25.0, 3.2, "deg", "(25.0 ± 3.2)°", "(25.0 +- 3.2) deg"),
        (0.0, 12_000.0, "m", "0 ± 12 km", "0 +- 12 km"),
        (1.2, None, "m", "1.2 m", "1.2 m"),
        (1.7e21, 0.0, "kg", "1.7 × 10²¹ kg", "1.7e21 kg"),
        (22453921.0, 647485.0, "kg", "(2.245 ± 0.065) × 10⁷ kg", "(2.245 +- 0.065)e7 kg"),
        (1870592.0, 4563.0, "m^3", "(1.8706 ± 0.0046) × 10⁶ m³", "(1.8706 +- 0.0046)e6 m3"),
        (51_700.0, 1032.0, "m^3", "51700 ± 1032 m³", "51700 +- 1032 m3"),
    ],
)
def test_a_value_and_its_error_share_a_unit_and_its_digits(value, sigma, unit, text, plain):
    assert readable.measured(value, sigma, unit) == text
    assert readable.terminal(text) == plain


def test_unequal_errors():
    assert readable.between(980e3, 177e3, 273e3, "m") == "980 +177/−273 km"
    assert readable.between(300e3, 51e3, 51e3, "m") == "300 ± 51 km"
    assert readable.between(25e15, 2e15, 1e15, "m^3") == "(25 +2/−1) × 10⁶ km³"


def test_text_of_a_ledger():
    assert (
        readable.prose("0.3e-5 m^3, 2e+05 kg m^2/s, abc1e5, 8.391e+04")
        == "0.3 × 10⁻⁵ m³, 2 × 10⁵ kg m²/s, abc1e5, 8.391 × 10⁴"
    )


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("10⁶ km³", "million km3"),
        ("10⁻¹²", "1e-12"),
        ("limit 10⁻¹² s", "limit 1e-12 s"),
        ("3.9 × 10⁻¹⁶ kg m²/s", "3.9e-16 kg m2/s"),
        ("1.5 × 10 m", "1.5 × 10 m"),
    ],
)
def test_powers_of_ten_in_ascii(text, plain):
    assert readable.terminal(text) == plain
