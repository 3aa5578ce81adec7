"""Materials and species of the grains that take over a source's matter."""

from __future__ import annotations

import numpy as np

from matter.particles import Particles


def material_numbers(source: Particles, bed: Particles) -> tuple[list[str], np.ndarray]:
    """Material names of the start (the bed's, then the source's further ones), and the new number of each material of
    the source."""
    names = list(bed.attributes.get("materials", []))
    table = []
    for name in source.attributes.get("materials", []):
        if name not in names:
            names.append(name)
        table.append(names.index(name))
    return names, np.array(table or [0])


def species_by_material(bed: Particles, names: list[str]) -> np.ndarray:
    """Species that grains of each material take: what the bed's contact settings say, else that of most of its grains
    of that material, else the first."""
    said = bed.attributes.get("contact", {}).get("species_of_material", {})
    known = list(bed.attributes.get("species", []))
    species = np.zeros(len(names), dtype=np.int32)
    for number, name in enumerate(names):
        mine = bed.species[bed.material == number] if "species" in bed else np.empty(0, dtype=np.int32)
        if said.get(name) in known:
            species[number] = known.index(said[name])
        elif len(mine):
            species[number] = int(np.bincount(mine).argmax())
    return species
