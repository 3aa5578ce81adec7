"""What the shock melted and boiled, by the largest pressure that each particle has felt.

    M(P_c) = sum of m_i over peak pressure P_i > P_c,   in masses of the projectile

P_c the critical pressures of the material (``matter.case.shock_phases``). Coarse runs lose peak pressure
(``crater.results.soundness``), and mass with it. No entropy stands behind the masses: Tillotson's equation knows none.

Their errors are those of counting alone, sqrt((1 - f) sum m_i^2), f the fraction of the particles that are above: how
much a mass of few particles may be off by chance.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.case import material
from matter.case.shock_phases import SECTION, WORDS, pressures, shocked
from matter.particles import Particles


def masses(particles: Particles, projectile_mass: float) -> dict[str, Any]:
    """What ``measures.json`` says: for each material of target and projectile the mass above each critical pressure
    over ``projectile_mass`` [kg], with the pressures; and the materials whose file gives none. Empty where the
    snapshot does not hold peak pressures."""
    if any(name not in particles for name in ("peak_pressure", "material", "mass")) or not projectile_mass > 0.0:
        return {}
    foreign = particles.layer < 0 if "layer" in particles else np.zeros(len(particles.mass), dtype=bool)
    found: list[dict[str, Any]] = []
    without: list[str] = []
    melted = shocked(particles)
    for number, name in enumerate(particles.attributes.get("materials", ())):
        critical = pressures(name)
        for body, mine in (("target", ~foreign), ("projectile", foreign)):
            mine = mine & (particles.material == number)
            if not mine.any():
                continue
            if not critical:
                without += [name] if name not in without else []
                continue
            fraction = particles.mass[mine] / projectile_mass
            above = {key: fraction[melted[key][mine]] for key in critical}
            found.append(
                {
                    "material": name,
                    "body": body,
                    "pressures_Pa": critical,
                    "over_projectile_mass": {key: float(part.sum()) for key, part in above.items()},
                    "counting_error": {
                        key: float(np.sqrt((part**2).sum() * (1.0 - len(part) / len(fraction))))
                        for key, part in above.items()
                    },
                    "source": material.load(name)[SECTION]["source"],
                }
            )
    return {"by": "peak pressure", "projectile_mass_kg": projectile_mass, "parts": found, "not_known_of": without}


def shock_melt_lines(facts: Mapping[str, Any]) -> list[str]:
    """The same in words, one line for each material of each body."""
    said = []
    for part in facts.get("parts", []):
        words = ", ".join(
            f"{WORDS[key]} above {part['pressures_Pa'][key] * 1e-9:.3g} GPa: {value:.3g}"
            for key, value in part["over_projectile_mass"].items()
        )
        said.append(
            f"shocked {part['material']} of the {part['body']} in projectile masses, by peak pressure: {words}"
        )
    return said
