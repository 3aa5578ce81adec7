"""Where the matter of the settled crater came from and how strongly it was shocked: rim, blanket, breccia lens.

Grains carry what matter they stand for from the handoff on (``matter.particles.ORIGINS``). R is the apparent radius
of the final crater, distances are from its axis, heights above the undisturbed ground:

    rim            between 1 and 1.5 R, above the undisturbed ground
    blanket        beyond 1.5 R, higher than a mean grain radius above it
    breccia lens   below the final crater and above the floor of the transient crater at its largest volume: what fills
                   it now (Melosh 1989, section 8.2: shocked and broken matter that slid back, and what fell into it)

First depths are means of the target's matter in each grain, below the undisturbed ground, and their quantiles go by
mass. Melt and vapour: sum of m_g x_g over the grains, x_g the fraction of a grain's mass shocked above the material's
critical pressure, inside R (whatever the depth), beyond it, still in flight, and gone (left the bed or escaped);
errors are those of counting grains, sqrt(sum (m_g x_g)^2). What lies beside and below the bed is in none of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from crater.ejecta import excavation, layer_order
from crater.ejecta.excavation import quantile
from crater.ground.datum import Datum
from crater.measures.measure import Measures
from matter.case import shock_phases
from matter.particles import Particles
from matter.wording import readable

SOURCES = ("Melosh1989",)
RIM, BLANKET, LENS = "rim", "blanket", "breccia lens"
FRACTIONS = {field: shock_phases.WORDS[key] for field, key in shock_phases.OF_GRAINS.items()}
"""Fields of grains that are fractions above critical pressures, and what they are called."""
PARTS = ("inside", "outside", "in flight", "gone")
RESTING, FLYING, REMOVED = 0, 1, 2


def facts(grains: Particles, final: Measures, transient: Measures | None, projectile_mass: float) -> dict[str, Any]:
    """What ``measures.json`` says of the settled ``grains``; empty where they do not say where their matter came from,
    or the final crater has no diameter. ``transient`` is the crater at its largest volume (without it no lens)."""
    diameter = final["diameter_apparent_m"].value or float("nan")
    if "first_depth" not in grains or not diameter > 0.0:
        return {}
    radius, datum = 0.5 * diameter, final.datum
    away, azimuth, height = datum.polar(grains.position)
    state = grains.state if "state" in grains else np.zeros(len(grains), dtype=int)
    rests = state == RESTING
    margin = float(grains.radius[rests].mean()) if "radius" in grains and rests.any() else 0.0
    at_rim = rests & (away > radius) & (away < layer_order.RIM * radius) & (height > 0.0)
    zones = {
        RIM: at_rim,
        BLANKET: rests & (away >= layer_order.RIM * radius) & (height > margin),
        LENS: rests & (away < radius) & _above_floor(grains, transient),
    }
    known = at_rim & np.isfinite(grains.first_depth)
    found: dict[str, Any] = {
        "radius_m": radius,
        "zones": {name: _zone(grains.select(rows)) for name, rows in zones.items() if rows.any()},
        "by_distance": _by_distance(grains.select(zones[RIM] | zones[BLANKET]), datum, radius),
        "rim": layer_order.order(
            -grains.first_depth[known].astype(float), height[known], away[known] / radius, azimuth[known]
        ),
    }
    names = [str(name) for name in grains.attributes.get("materials", ())]
    unknown = [name for name in names if not shock_phases.pressures(name)]
    if "melt_fraction" in grains and projectile_mass > 0.0 and len(unknown) < len(names):
        masks = rests & (away < radius), rests & (away >= radius), state == FLYING, state == REMOVED
        where = dict(zip(PARTS, masks, strict=True))
        found["over_projectile_mass"] = {
            field: {part: _summed(grains, field, rows, projectile_mass) for part, rows in where.items()}
            for field in FRACTIONS
        }
        found["not_known_of"] = unknown
        found["without_vapour"] = [name for name in names if "vapour" not in shock_phases.pressures(name)]
    return found


def _above_floor(grains: Particles, transient: Measures | None) -> np.ndarray:
    """Which grains lie where the transient crater was empty: above its floor, within its apparent radius."""
    size = (transient["diameter_apparent_m"].value if transient is not None else None) or float("nan")
    if transient is None or not size > 0.0:
        return np.zeros(len(grains), dtype=bool)
    away, _, height = transient.datum.polar(grains.position)
    seen = np.isfinite(transient.profile.height)
    floor = np.interp(away, transient.profile.radius[seen], transient.profile.height[seen])
    return (away < 0.5 * size) & (height > floor)


def _zone(grains: Particles) -> dict[str, Any]:
    """Mass, first depths and distances, shock and projectile of one zone."""
    fraction = grains.projectile_fraction.astype(float) if "projectile_fraction" in grains else np.zeros(len(grains))
    target = grains.mass * (1.0 - fraction)
    some = np.isfinite(grains.first_depth) & (target > 0.0)
    depth, mass = grains.first_depth[some].astype(float), target[some]
    total = float(grains.mass.sum())
    found: dict[str, Any] = {
        "mass_kg": total,
        "grains": len(grains),
        "first_depth_m": {name: quantile(depth, mass, q) for name, q in (("low", 0.1), ("half", 0.5), ("high", 0.9))},
        "first_distance_half_m": quantile(grains.first_distance[some].astype(float), mass, 0.5),
        "projectile_share": float(grains.mass @ fraction) / total,
    }
    for field in FRACTIONS:
        if field in grains:
            found[field] = float(grains.mass @ grains[field].astype(float)) / total
    if "peak_pressure_mean" in grains:
        found["peak_pressure_half_Pa"] = quantile(grains.peak_pressure_mean.astype(float), grains.mass, 0.5)
    return found


def _by_distance(grains: Particles, datum: Datum, radius: float) -> list[dict[str, Any]]:
    """Mass of the target [kg] by class of first depth, in final apparent diameters, for each class of distance, as
    ``excavation`` gives it of what lands in free flight."""
    known = grains.select(np.isfinite(grains.first_depth))
    fraction = known.projectile_fraction if "projectile_fraction" in known else np.zeros(len(known))
    away, depth = datum.polar(known.position)[0] / radius, known.first_depth / (2.0 * radius)
    return excavation.classes(away, depth, known.mass * (1.0 - fraction))


def _summed(grains: Particles, field: str, rows: np.ndarray, unit: float) -> dict[str, float]:
    part = grains.mass[rows] * grains[field][rows].astype(float) / unit
    return {"value": float(part.sum()), "counting_error": float(np.sqrt(np.sum(part**2)))}


def settled_lines(found: Mapping[str, Any]) -> list[str]:
    """The same in two lines; none where nothing is known."""
    said = []
    # in a file what is not known is null
    depths = {name: zone["first_depth_m"]["half"] for name, zone in found.get("zones", {}).items()}
    if zones := {
        name: found["zones"][name] for name, half in depths.items() if half is not None and np.isfinite(half)
    }:
        said.append(
            "depth of origin of the deposits (median, 90th percentile): "
            + ", ".join(
                f"{name} {readable.length(zone['first_depth_m']['half'])}, "
                f"{readable.length(zone['first_depth_m']['high'])}"
                for name, zone in zones.items()
            )
        )
    molten = found.get("over_projectile_mass", {}).get("melt_fraction")
    if molten and sum(part["value"] for part in molten.values()) > 0.0:
        said.append(
            "molten matter in grains, in projectile masses: "
            + ", ".join(f"{name} {part['value']:.3g}" for name, part in molten.items())
        )
    return said
