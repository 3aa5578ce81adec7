"""Critical pressures of a material: the shock pressures above which it begins to melt, is molten, begins to boil, is
vapour once it has come down to no pressure along its isentrope (``[shock_phases]`` of its file, each with its source).

They hold for dense matter at the temperature that their source names; a porous target melts earlier.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pydantic import TypeAdapter

from matter.case import material
from matter.case.quantity import PositivePressure

SECTION = "shock_phases"
WORDS = {
    "melting_begins": "begins to melt",
    "molten": "molten",
    "boiling_begins": "begins to boil",
    "vapour": "vapour",
}
"""Keys of the section, in the order of their pressures, and what they are called."""


class Parameters(NamedTuple):
    """Critical pressures [Pa]; one that the source does not give is left out."""

    melting_begins: PositivePressure = math.inf
    molten: PositivePressure = math.inf
    boiling_begins: PositivePressure = math.inf
    vapour: PositivePressure = math.inf


def pressures(name: str) -> dict[str, float]:
    """The critical pressures [Pa] of a material that its file gives; empty where it gives none."""
    if name not in material.names() or SECTION not in material.load(name):
        return {}
    values: Any = TypeAdapter(Parameters).validate_python(material.section(name, SECTION))
    return {key: value for key, value in values._asdict().items() if value < math.inf}
