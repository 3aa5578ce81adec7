"""What published laws say that an impact melts, in masses of the projectile, beside what the run's shock melted.

With v the speed, theta the angle from the vertical, rho_p and rho_t the densities of projectile and target, and E_m
the specific energy behind the shock from which the target's material comes down molten (``[melt_scaling]`` of its
file):

    abramov_2012     M / m = 0.42 (v^2 / E_m)^0.84 cos^1.32(theta)             point source, mu = 0.56
    pierazzo_1997    M / m = 0.25 (v^2 / E_m) (rho_t / rho_p) cos(theta)       energy

The first is that of Abramov, Wong & Kring 2012 (after Bjorkman & Holsapple 1987) as de Vries et al. 2016 write it, the
second that of Pierazzo, Vickery & Melosh 1997 with the sine of Collins et al. 2005 as a public implementation has it;
neither paper was at hand. They hold for dense, cold ground and a projectile much like it, in rock from some 12 km/s
on (v^2 / E_m = 16 in dunite: below ``LEAST`` nothing is said), and differ from one another and from hydrocodes by a
factor of up to two: that is their error.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from crater.scaling.crater_size import ImpactEvent
from matter.case import material

SOURCES = ("Abramov2012", "Pierazzo1997", "Collins2005")
SECTION = "melt_scaling"
LEAST = 15.0
"""v^2 / E_m from which on the laws say something."""
WORDS = {
    "abramov_2012": "Abramov et al. 2012",
    "pierazzo_1997": "energy scaling, Pierazzo et al. 1997",
}
"""Keys of the laws, and what they are called."""


def abramov_2012(s: ImpactEvent, energy: float) -> float:
    """M / m for the specific ``energy`` E_m [J/kg]."""
    return 0.42 * (s.speed**2 / energy) ** 0.84 * math.cos(s.angle) ** 1.32


def pierazzo_1997(s: ImpactEvent, energy: float) -> float:
    """M / m for the specific ``energy`` E_m [J/kg]."""
    return 0.25 * s.speed**2 / energy * s.target_density / s.projectile_density * math.cos(s.angle)


def facts(s: ImpactEvent, name: str) -> dict[str, Any]:
    """What ``measures.json`` says of an impact into the material of this name; empty where its file gives no energy or
    the impact is too slow."""
    if name not in material.names() or SECTION not in material.load(name):
        return {}
    energy = float(material.section(name, SECTION)["energy"])
    if s.speed**2 < LEAST * energy:
        return {}
    return {
        "material": name,
        "energy_J_kg": energy,
        "source": material.load(name)[SECTION]["source"],
        "over_projectile_mass": {"abramov_2012": abramov_2012(s, energy), "pierazzo_1997": pierazzo_1997(s, energy)},
    }


def melt_lines(said: Mapping[str, Any]) -> list[str]:
    """The same in words, one line."""
    if not said:
        return []
    laws = ", ".join(f"{WORDS[key]}: {value:.3g}" for key, value in said["over_projectile_mass"].items())
    return [f"molten {said['material']} of the target in projectile masses, by published laws: {laws}"]
