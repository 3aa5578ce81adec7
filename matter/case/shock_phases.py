"""Critical pressures of a material: the shock pressures above which it begins to melt, is molten, begins to boil, is
vapour once it has come down to no pressure along its isentrope (``[shock_phases]`` of its file, each with its source);
and which particles were shocked above them.

They hold for dense matter at the temperature that their source names; a porous target melts earlier.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter

from matter.case import material
from matter.case.quantity import PositivePressure
from matter.particles import Particles

SECTION = "shock_phases"
WORDS = {
    "melting_begins": "begins to melt",
    "molten": "molten",
    "boiling_begins": "begins to boil",
    "vapour": "vapour",
}
"""Keys of the section, in the order of their pressures, and what they are called."""
OF_GRAINS = {"melting_fraction": "melting_begins", "melt_fraction": "molten", "vapour_fraction": "vapour"}
"""Fields of grains that are mass fractions shocked above a critical pressure, and its key."""


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


def shocked(particles: Particles, critical: Mapping[str, Mapping[str, float]] | None = None) -> dict[str, np.ndarray]:
    """By key of a critical pressure which particles (n,) have felt more: peak pressure > P_c of their material.

    ``critical`` holds the pressures [Pa] by key for each material's name; by default those of the materials' files. A
    material without one is never above it.
    """
    names = [str(name) for name in particles.attributes.get("materials", ())] or [""]
    known = {name: pressures(name) for name in names} if critical is None else critical
    index = np.clip(particles.material, 0, len(names) - 1)
    keys = WORDS if critical is None else {key: None for values in known.values() for key in values}
    limit = {key: np.array([known.get(name, {}).get(key, np.inf) for name in names]) for key in keys}
    return {key: particles.peak_pressure > at[index] for key, at in limit.items()}
