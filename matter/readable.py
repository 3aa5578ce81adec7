"""Lengths and simulated times in the unit in which people read them: craters here are from millimetres to thousands of kilometres wide."""

from __future__ import annotations


def length_unit(metres: float) -> tuple[float, str]:
    """Factor and unit for lengths of about this size [m]: pictures and tables with one unit for many values."""
    size = abs(metres)
    return (1e-3, "km") if size >= 2e3 else (1.0, "m") if size >= 0.2 else (1e3, "mm")


def time_unit(seconds: float) -> tuple[float, str]:
    """Factor and unit for times of about this size [s]."""
    size = abs(seconds)
    return (1.0 / 60.0, "min") if size >= 120.0 else (1.0, "s") if size >= 0.2 else (1e3, "ms") if size >= 2e-4 else (1e6, "us")


def length(metres: float) -> str:
    """A length [m] as text: ``'612 km'``, ``'14.5 m'``, ``'3.4 mm'``."""
    size = abs(metres)
    factor, unit = (1e-3, "km") if size >= 1e3 else (1.0, "m") if size >= 0.1 or size == 0.0 else (1e3, "mm")
    value = metres * factor
    return f"{value:.3g} {unit}" if abs(value) < 999.5 else f"{value:.0f} {unit}"


def clock(seconds: float) -> str:
    """A simulated time [s] as text: ``'7.5 min'``, ``'30 ms'``."""
    factor, unit = time_unit(seconds) if seconds else (1.0, "s")
    return f"{seconds * factor:.1f} min" if unit == "min" else f"{seconds * factor:.3g} {unit}"
