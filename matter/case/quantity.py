"""Physical quantities at the border: unit strings in files, SI floats inside.

A field typed ``Length`` takes ``"150 km"`` (any compatible unit) and holds ``150000.0``. In a case file a bare number
is refused, because its unit would be a guess; from Python a bare float is SI. The reader of case files says which of
the two holds by pydantic's validation context ``{"units": "required"}``.
"""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo

_SI = {
    "length": "m",
    "volume": "m^3",
    "speed": "m/s",
    "time": "s",
    "mass": "kg",
    "angle": "rad",
    "density": "kg/m^3",
    "pressure": "Pa",
    "specific_energy": "J/kg",
    "acceleration": "m/s^2",
    "number_density": "1/m^3",
    "stiffness": "N/m",
    "temperature": "K",
    "heat_capacity": "J/(kg K)",
    "rate": "1/s",
}

REQUIRED = {"units": "required"}
"""The validation context of values from a file: a bare number is refused."""

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
TEXT = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?(\s+[^\s,][^,]*|[^\s\d.,][^,]*)$"
"""What the text of a quantity looks like, for schemas: a number and a unit."""


# the unit that people write, where it is not the SI unit
_WRITTEN = {"rad": "deg"}
# far beyond anything that a case can mean, near enough for products of six of them
_LEAST, _MOST = 1e-50, 1e50


@dataclass(frozen=True)
class Unit:
    """The SI unit of an annotated field: whoever writes a value back (``case.used.toml``) finds it in the
    annotation."""

    symbol: str

    def __get_pydantic_json_schema__(self, core: Any, handler: Any) -> dict[str, Any]:
        """In a file a quantity is a text with a unit; ``x-unit`` says which dimension it has, ``x-number`` the limits
        of its SI value."""
        limits = {key: value for key, value in handler(core).items() if key != "type"}
        return {"type": "string", "pattern": TEXT, "x-unit": self.symbol, "x-number": limits}


@functools.lru_cache(maxsize=1)
def _units():
    import pint

    registry = pint.UnitRegistry()
    registry.define("@alias astronomical_unit = AU")  # unknown to pint in capitals, which is how astronomers write it
    return registry


@functools.lru_cache(maxsize=4096)
def parse(text: str, unit: str = "") -> float:
    """The SI value of a quantity string.

    ``text`` is one number and its unit (``"18.234 km/s"``, ``"4e35 m^-3"``); ``unit`` is the SI unit whose dimension
    it must have, or empty for whatever dimension the text itself has (angles become radians, a bare number stays one).

    Raises ``ValueError`` with the reason: unreadable, unknown unit, wrong dimension. Arithmetic and commas are
    refused, because a unit library reads ``"1,5 km"`` as 15 km.
    """
    import pint

    quantity = measured(text, unit)
    try:
        return float((quantity.to(unit) if unit else quantity.to_base_units()).magnitude)
    except pint.DimensionalityError:
        raise ValueError(f"{text!r} is not a quantity in {unit}") from None
    except (ArithmeticError, pint.errors.PintError) as reason:
        raise ValueError(f"cannot read {text!r} as a quantity ({reason})") from None


def measured(text: str, unit: str = "") -> Any:
    """The quantity of a text in its own unit, for arithmetic (``pint.Quantity``); ``unit``: the one that a message
    names. Raises ``ValueError`` as ``parse`` does."""
    match = _NUMBER.match(text)
    if match is None or "," in text:
        raise ValueError(
            f"cannot read {_cut(text)!r} as a quantity: write a number and a unit, "
            f"'1.5 {_WRITTEN.get(unit, unit) or 'km'}' for example"
        )
    number, symbol = float(match.group(1)), match.group(2).strip()
    if len(symbol) > _LONGEST or not _powers_are_small(symbol):
        raise ValueError(
            f"cannot read {_cut(text)!r} as a quantity: a unit is short, its powers are numbers below 100 and stand "
            f"alone, 'kg/m^3' for example"
        )
    if not symbol and unit:
        raise ValueError(f"{text!r} has no unit: write it like '{match.group(1)} {_WRITTEN.get(unit, unit)}'")
    try:
        return _units().Quantity(number, _units().parse_units(symbol))
    except Exception as reason:  # pint lets several kinds through, its own and those of Python's tokenizer
        raise ValueError(f"cannot read {text!r} as a quantity ({reason or 'its unit is unreadable'})") from None


def unit_in(text: str) -> str:
    """The unit of a quantity string as it is written there; empty where it has none, or cannot be read."""
    match = _NUMBER.match(text)
    return match.group(2).strip() if match else ""


def base_unit(text: str) -> str:
    """The SI unit of a quantity string's dimension, ``"rad"`` of an angle; empty for a bare number.

    Raises ``ValueError`` where it cannot be read, or where zero of its unit is not zero: the sum of temperatures in
    degC depends on their zero.
    """
    base = measured(text).to_base_units()
    if parse(f"0 {unit_in(text)}") != 0.0:
        raise ValueError(f"{text!r} has a zero of its own: write it in {base.units:~C}")
    return f"{base.units:~C}"


def si_unit(text: str) -> str:
    """``base_unit`` by the name that settings have for it: "Pa", "kg/m^3"; empty for a bare number."""
    base = base_unit(text)
    return next((symbol for symbol in _SI.values() if base == base_unit(f"1 {symbol}")), base)


_LONGEST = 80
_EXPONENT = re.compile(r"\s*[-+]?\d{1,2}(?:\.\d{1,3})?(?![\w.])")
_RAISED = re.compile("[\u2070\u00b9\u00b2\u00b3\u2074-\u2079]+")


def _powers_are_small(symbol: str) -> bool:
    """Whether every power of a unit is a number below 100, and none is the power of a power: the unit library would
    work out 9**9**9 to its last digit."""
    plain = _RAISED.sub(lambda found: f"**{'9' * len(found.group())} ", symbol)
    parts = re.split(r"\*\*|\^", plain)
    exponents = [_EXPONENT.match(part) for part in parts[1:]]
    towers = any(found and not part[found.end() :].strip() for found, part in zip(exponents[:-1], parts[1:-1]))
    bracketed = len(exponents) > 1 and any(part.rstrip().endswith(")") for part in parts[:-1])
    return all(exponents) and not towers and not bracketed


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _reader(kind: str):
    unit = _SI[kind]

    def read(value: Any, info: ValidationInfo) -> float:
        if isinstance(value, str):
            result = parse(value, unit)
        elif isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError(f"must be a number with a unit, '1 {_WRITTEN.get(unit, unit)}' for example")
        elif info.context and info.context.get("units") == "required":
            raise ValueError(
                f"the unit is missing: write it as a string, '{value} {_WRITTEN.get(unit, unit)}' for example"
            )
        else:
            result = float(value)
        if result != result or result in (float("inf"), float("-inf")):
            raise ValueError("must be a finite number")
        if result != 0.0 and not _LEAST <= abs(result) <= _MOST:
            raise ValueError(
                f"must lie between {_LEAST:g} and {_MOST:g} {unit}: powers and ratios of it would leave the range of "
                f"floating-point numbers"
            )
        return result

    return BeforeValidator(read)


Length = Annotated[float, Unit(_SI["length"]), _reader("length")]
Volume = Annotated[float, Unit(_SI["volume"]), _reader("volume")]
Speed = Annotated[float, Unit(_SI["speed"]), _reader("speed")]
Time = Annotated[float, Unit(_SI["time"]), _reader("time")]
Angle = Annotated[float, Unit(_SI["angle"]), _reader("angle")]
Pressure = Annotated[float, Unit(_SI["pressure"]), _reader("pressure")]
SpecificEnergy = Annotated[float, Unit(_SI["specific_energy"]), _reader("specific_energy")]
Acceleration = Annotated[float, Unit(_SI["acceleration"]), _reader("acceleration")]
NumberDensity = Annotated[float, Unit(_SI["number_density"]), _reader("number_density")]

PositiveLength = Annotated[float, Unit(_SI["length"]), _reader("length"), Field(gt=0)]
PositiveSpeed = Annotated[float, Unit(_SI["speed"]), _reader("speed"), Field(gt=0)]
PositiveTime = Annotated[float, Unit(_SI["time"]), _reader("time"), Field(gt=0)]
PositiveMass = Annotated[float, Unit(_SI["mass"]), _reader("mass"), Field(gt=0)]
PositiveDensity = Annotated[float, Unit(_SI["density"]), _reader("density"), Field(gt=0)]
Rate = Annotated[float, Unit(_SI["rate"]), _reader("rate")]
HeatCapacity = Annotated[float, Unit(_SI["heat_capacity"]), _reader("heat_capacity")]
PositiveTemperature = Annotated[float, Unit(_SI["temperature"]), _reader("temperature"), Field(gt=0)]
PositivePressure = Annotated[float, Unit(_SI["pressure"]), _reader("pressure"), Field(gt=0)]
