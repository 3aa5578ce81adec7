"""Numbers as people read them, for terminals, pictures and pages alike: craters here are from millimetres to thousands
of kilometres wide."""

from __future__ import annotations

import math
import re


def length_unit(metres: float) -> tuple[float, str]:
    """Factor and unit for lengths of about this size [m]: pictures and tables with one unit for many values."""
    size = abs(metres)
    return (1e-3, "km") if size >= 2e3 else (1.0, "m") if size >= 0.2 else (1e3, "mm") if size >= 1e-4 else (1e6, "um")


def time_unit(seconds: float) -> tuple[float, str]:
    """Factor and unit for times of about this size [s]."""
    size = abs(seconds)
    return (
        (1.0 / 60.0, "min")
        if size >= 120.0
        else (1.0, "s")
        if size >= 0.2
        else (1e3, "ms")
        if size >= 2e-4
        else (1e6, "us")
        if size >= 2e-7
        else (1e9, "ns")
        if size >= 2e-10
        else (1e12, "ps")
    )


def pressure_unit(pascals: float) -> tuple[float, str]:
    """Factor and unit for pressures of about this size [Pa]."""
    size = abs(pascals)
    return (
        (1e-9, "GPa")
        if size >= 2e9
        else (1e-6, "MPa")
        if size >= 2e5
        else (1e-3, "kPa")
        if size >= 2e2
        else (1.0, "Pa")
    )


def length(metres: float) -> str:
    """A length [m] as text: ``'612 km'``, ``'14.5 m'``, ``'3.4 mm'``."""
    size = abs(metres)
    factor, unit = (1e-3, "km") if size >= 1e3 else (1.0, "m") if size >= 0.1 or size == 0.0 else length_unit(size)
    value = metres * factor
    return f"{value:.3g} {unit}" if abs(value) < 999.5 else f"{value:.0f} {unit}"


def volume(cubic_metres: float) -> str:
    """A volume [m^3] as text for terminals and ledgers: "17.84 million km3", "5.2 km3", "30 cm3"."""
    return terminal(amount(cubic_metres, "m^3"))


def clock(seconds: float) -> str:
    """A simulated time [s] as text: ``'7.5 min'``, ``'30 ms'``."""
    factor, unit = time_unit(seconds) if seconds else (1.0, "s")
    return f"{seconds * factor:.1f} min" if unit == "min" else f"{seconds * factor:.3g} {unit}"


_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_PLAIN_DIGITS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_TERMINAL = (("±", "+-"), ("−", "-"), ("× 10⁶ km³", "million km3"), ("10⁶ km³", "million km3"), ("°", " deg"))


def scale(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit for values of about ``size`` in the SI ``unit`` ("m", "m^3", "s", "deg", "1" or any other):
    those of everyday use.

    Volumes of 10^14 m^3 and more come in "10⁶ km³"; what is neither length, volume nor time keeps its unit, written
    with superscripts.
    """
    size = abs(size)
    if unit == "m":
        return (1e-3, "km") if size >= 1e3 else length_unit(size) if size else (1.0, "m")
    if unit == "s":
        return time_unit(size) if size else (1.0, "s")
    if unit == "m^3":
        return (
            (1e-15, "10⁶ km³")
            if size >= 1e14
            else (1e-9, "km³")
            if size >= 1e8
            else (1.0, "m³")
            if size >= 1e-2 or not size
            else (1e6, "cm³")
        )
    return 1.0, {"1": "", "deg": "°"}.get(unit, superscripts(unit))


def number(value: float, digits: int = 4) -> str:
    """A number with ``digits`` significant ones: "0.0016", "12,600", "3.9 × 10⁻¹⁶"; counts below a million are given
    in full."""
    if not math.isfinite(value):
        return str(value)
    if value == int(value) and abs(value) < 1e6:
        return f"{int(value):,}".replace("-", "−")
    size = abs(value)
    if 1e-3 <= size < 1e6:
        decimals = max(0, digits - 1 - math.floor(math.log10(size)))
        text = f"{value:,.{decimals}f}"
        return (text.rstrip("0").rstrip(".") if "." in text else text).replace("-", "−")
    mantissa, exponent = f"{value:.{max(digits - 1, 1)}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    power = f"10{str(int(exponent)).translate(_SUPERSCRIPT)}"
    return (power if mantissa == "1" else f"{mantissa} × {power}").replace("-", "−")


def amount(value: float, unit: str = "1", digits: int = 4) -> str:
    """A value in the SI ``unit`` as text in the unit of everyday use: "214.3 km", "17.11 × 10⁶ km³", "1.705 × 10²¹
    kg", "0.9°"."""
    factor, name = scale(value, unit)
    return _joined(number(value * factor, digits), name)


def measured(value: float, sigma: float | None, unit: str = "1") -> str:
    """A value with its standard error, both in one unit: "569 ± 15 km", "(24.16 ± 0.72) × 10⁶ km³",
    "(2.245 ± 0.065) × 10⁷ kg"; no error for 0; for None, an error that is not known, three digits and no error."""
    if not sigma or not math.isfinite(sigma):
        return amount(value, unit, 3 if sigma is None else 4)
    factor, name = scale(max(abs(value), sigma), unit)
    size = max(abs(value), sigma) * factor
    if name in ("kg", "m³") and size >= 1e6:
        power = math.floor(math.log10(size))
        factor, name = factor / 10.0**power, f"10{str(power).translate(_SUPERSCRIPT)} {name}"
    value, sigma = value * factor, sigma * factor
    decimals = min(
        max(1 - math.floor(math.log10(sigma)), 0), max(4 - math.floor(math.log10(max(abs(value), 1e-9))), 0)
    )
    text = (
        f"{value:.{decimals}f} ± {sigma:.{decimals}f}"
        if round(sigma, decimals)
        else f"{value:.{decimals}f} ± {sigma:.1g}"
    )
    text = text.replace("-", "−")
    return _joined(f"({text})" if name[:2] in ("10", "°") else text, name)


def between(value: float, plus: float, minus: float, unit: str = "1") -> str:
    """A value with unequal errors: "980 +20/−30 km", "(25 +2/−1) × 10⁶ km³"; with equal ones like ``measured``."""
    if abs(plus - minus) <= 1e-9 * max(abs(plus), abs(minus)):
        return measured(value, plus, unit)
    factor, name = scale(max(abs(value), plus, minus), unit)
    text = f"{number(value * factor)} +{number(plus * factor, 3)}/−{number(minus * factor, 3)}"
    return _joined(f"({text})" if name[:2] in ("10", "°") else text, name)


def _joined(value: str, unit: str) -> str:
    return value + unit if unit in ("", "°") else f"{value} × {unit}" if unit.startswith("10") else f"{value} {unit}"


def superscripts(text: str) -> str:
    """Powers of units as they are printed: "kg m^2/s" as "kg m²/s"."""
    return re.sub(r"\^(-?\d+)", lambda match: match.group(1).translate(_SUPERSCRIPT), text)


def prose(text: str) -> str:
    """Text of a log or a ledger as it is printed: "1.7e+21 kg" as "1.7 × 10²¹ kg", "m^3" as "m³"."""
    power = r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]?)0*(\d+)\b"

    def raised(match: re.Match[str]) -> str:
        factor, sign, exponent = match.groups()
        return f"{factor} × 10{(sign.replace('+', '') + exponent).translate(_SUPERSCRIPT)}"

    text = re.sub(power, raised, text)
    text = text.replace(" million km3", " × 10⁶ km³")
    return superscripts(re.sub(r"(?<=\d )(km|m|cm)3\b", "\\1³", text))


def terminal(text: str) -> str:
    """The same text in ASCII, for terminals and logs: "(24.16 +- 0.72) million km3", "1.7e21 kg"."""
    for sign, plain in _TERMINAL:
        text = text.replace(sign, plain)
    text = re.sub(r" × 10(?=[⁰¹²³⁴⁵⁶⁷⁸⁹⁻])", "e", text)
    text = re.sub(r"(?<![\d.])10(?=[⁰¹²³⁴⁵⁶⁷⁸⁹⁻])", "1e", text)
    return text.translate(_PLAIN_DIGITS)
