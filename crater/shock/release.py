"""What melts and boils once the shock has passed, by the entropy that it left and by the temperature at the end.

By entropy: matter keeps its entropy as it comes down to 1 bar, so that what lies above a critical entropy there melts
or boils (``sph.shock_states.isentropic_release``, from the table of the run's own equation of state):

    melting_begins   mass with s > s(T_m, 1 bar), T_m the material's melting temperature (of a table without a melting
                     curve: as hot as its melting point, not the heat to melt)
    boiling_begins   s > s_l;   vapour   s > s_v;   boiled   sum of m (s - s_l) / (s_v - s_l), between 0 and m

By peak pressure, beside it: the mass shocked above the pressures at which the table's own Hugoniot reaches the same
entropies (``shock_...``). Of one resolved shock both say the same; where a shock is smeared over the length in which
it weakens, peak pressure says too little, and entropy, below some ten particles to the projectile's radius, too much.
Dunite into dunite at 25 km/s: docs/results/melt_of_dunite.

By temperature: the mass that is hotter than T_m in the last snapshot of the shock stage, at the pressure that it then
has; matter that was hot before the impact counts too.

In masses of the projectile; errors are those of counting particles, sqrt(sum y^2 - (sum y)^2 / N) of the parts y of
the N particles.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.case.shock_phases import shocked
from matter.particles import Particles

WORDS = {
    "melting_begins": "as hot as its melting point at 1 bar",
    "boiling_begins": "begins to boil",
    "vapour": "vapour wholly",
    "shock_melting_begins": "as hot as its melting point, by peak pressure",
    "shock_boiling_begins": "begins to boil, by peak pressure",
    "boiled": "boiled, by the fraction of each particle",
    "hotter": "hotter than its melting point at the end",
}
"""Keys of the masses, and what they are called."""
BY_PRESSURE = ("shock_melting_begins", "shock_boiling_begins")


def masses(particles: Particles, projectile_mass: float) -> list[dict[str, Any]]:
    """What ``measures.json`` says: for each material of target and projectile that the snapshot knows critical
    entropies or a melting temperature of (attribute ``release``), the masses over ``projectile_mass`` [kg], with what
    they go by (``critical``); empty where it knows none."""
    known = particles.attributes.get("release", {})
    if not known or not projectile_mass > 0.0 or "mass" not in particles or "material" not in particles:
        return []
    foreign = particles.layer < 0 if "layer" in particles else np.zeros(len(particles), dtype=bool)
    found: list[dict[str, Any]] = []
    pressures = {
        name: {key: of[f"{key}_Pa"] for key in BY_PRESSURE if f"{key}_Pa" in of} for name, of in known.items()
    }
    above = shocked(particles, pressures) if "peak_pressure" in particles else {}
    for number, name in enumerate(particles.attributes.get("materials", ())):
        for body, of_body in (("target", ~foreign), ("projectile", foreign)):
            mine = of_body & (particles.material == number)
            if name in known and mine.any():
                melted = {key: above[key][mine] for key in pressures[name] if key in above}
                parts = _parts(particles.select(mine), known[name], melted, projectile_mass)
                if parts:
                    found.append({"material": name, "body": body, "critical": dict(known[name]), **_summed(parts)})
    return found


def _parts(
    matter: Particles, critical: Mapping[str, Any], melted: Mapping[str, np.ndarray], unit: float
) -> dict[str, np.ndarray]:
    """The part (n,) of each particle's mass, over ``unit``, by what it counts for; ``melted`` by peak pressure."""
    mass, parts = matter.mass / unit, {}
    if "entropy" in matter:
        for key in ("melting_begins", "boiling_begins", "vapour"):
            if key in critical:
                parts[key] = mass * (matter.entropy > critical[key])
        if "vapour" in critical:
            low, high = critical["boiling_begins"], critical["vapour"]
            parts["boiled"] = mass * np.clip((matter.entropy - low) / (high - low), 0.0, 1.0)
    parts |= {key: mass * shocked_above for key, shocked_above in melted.items()}
    if "temperature" in matter and "melting_temperature_K" in critical:
        parts["hotter"] = mass * (matter.temperature > critical["melting_temperature_K"])
    return parts


def _summed(parts: Mapping[str, np.ndarray]) -> dict[str, dict[str, float]]:
    return {
        "over_projectile_mass": {key: float(part.sum()) for key, part in parts.items()},
        "counting_error": {
            key: float(np.sqrt(max((part**2).sum() - part.sum() ** 2 / len(part), 0.0))) for key, part in parts.items()
        },
    }


def release_lines(facts: list[Mapping[str, Any]]) -> list[str]:
    """The same in words, one line for each material of each body."""
    return [
        f"{part['material']} of the {part['body']} in projectile masses, by entropy and temperature: "
        + ", ".join(f"{WORDS[key]}: {value:.3g}" for key, value in part["over_projectile_mass"].items())
        for part in facts
    ]
