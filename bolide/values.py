"""A measured value with its error and unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple


class Value(NamedTuple):
    """``value`` and its standard error ``sigma`` (None: not known) in the SI ``unit``; ``parts``: what the error is
    made of.

    >>> print(Value(482e3, 10e3, "m"))
    482 ± 10 km
    >>> Value(482e3, 10e3, "m").sigma
    10000.0
    """

    value: float
    sigma: float | None
    unit: str
    parts: Mapping[str, float] = {}

    def __str__(self) -> str:
        from matter.wording import readable

        return readable.measured(self.value, self.sigma, self.unit)


def of_entry(cell: Any) -> Value | None:
    """The value of an entry of ``measures.json``; None where it holds none."""
    if not isinstance(cell, Mapping) or not isinstance(cell.get("value"), int | float):
        return None
    sigma = cell.get("sigma")
    parts = {
        name: float(part) for name, part in (cell.get("sigma_parts") or {}).items() if isinstance(part, int | float)
    }
    return Value(
        float(cell["value"]),
        float(sigma) if isinstance(sigma, int | float) else None,
        str(cell.get("unit", "1")),
        parts,
    )


def of_column(name: str) -> str:
    """The SI unit of a column of a table, which its name ends with; empty where the name does not say.

    >>> of_column("depth_m_sigma"), of_column("energy_J"), of_column("grains")
    ('m', 'J', '')
    """
    if "angular_momentum" in name:
        return "kg m^2/s"
    if name.removeprefix("outside_").startswith("momentum_"):
        return "kg m/s"
    for ending, unit in (("_m3", "m^3"), ("_kg", "kg"), ("_Pa", "Pa"), ("_J", "J"), ("_m", "m"), ("_s", "s")):
        if name.removesuffix("_sigma").endswith(ending):
            return unit
    return ""
