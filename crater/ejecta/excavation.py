"""Where the matter that the crater threw out came from: depth and radius of excavation, how strongly it was shocked,
which depths lie at which distance in the blanket, and whether the layers at the rim are turned over.

Excavated is what left the ground before the transient crater was largest and, by the catalogue, lands beyond it or
escapes (``crater.ejecta.catalogue``): neither what is pushed aside below the ground, nor what a collapse throws up
later from deep below (its mass is given). First depths are those at the start of the impact, below the undisturbed
datum; distances are from the crater's axis, in its apparent radius R. Depths and radii are quantiles of mass: single
particles from far below do not decide. (Melosh 1989, section 5.5: a depth of excavation of about a tenth of the
transient diameter.)

Whether layers are turned over is said of what lies above the undisturbed ground between 1 and 1.5 R at the end of the
shock stage (``crater.ejecta.layer_order``).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from crater.ejecta import catalogue as catalogues
from crater.ejecta import layer_order
from crater.ejecta.catalogue import Catalogue
from crater.ground import cloud as clouds
from crater.ground.datum import Datum
from matter.errors import InputError
from matter.particles import Particles
from matter.wording import readable

SOURCES = ("Melosh1989",)
FRACTION = 0.95
"""Quantile of mass that is called the depth, or the radius, of excavation."""
RANGES = (1.0, 1.5, 2.0, 3.0, 5.0)
"""Edges of the landing distances, in R; the last class is open, and what escapes has one of its own."""
DEPTHS = (0.0, 0.05, 0.1, 0.2, 0.4)
"""Edges of the first depths, in transient diameters; the last class is open."""


def quantile(values: np.ndarray, mass: np.ndarray, fraction: float) -> float:
    """The value that ``fraction`` of the mass does not exceed; NaN of nothing."""
    if not len(values):
        return float("nan")
    order = np.argsort(values)
    part = np.cumsum(mass[order]) / mass.sum()
    return float(values[order[min(int(np.searchsorted(part, fraction - 1e-12)), len(values) - 1)]])


def facts(
    found: Catalogue, last: Particles, ground: Datum, crater: Datum, radius: float, until: float
) -> dict[str, Any]:
    """What ``measures.json`` says of it; ``last`` is the last snapshot of the shock stage (with ``initial_position``),
    ``ground`` the undisturbed datum; ``crater``, ``radius`` [m] and ``until`` [s] datum, apparent radius and time of
    the transient crater.

    Raises ``InputError`` where the snapshot does not say where matter came from, or nothing of the target was thrown
    out of the crater.
    """
    last.need("initial_position", "mass", "layer", "position")
    fates = catalogues.where(found, crater, radius)
    out = (found.layer >= 0) & (fates[catalogues.BEYOND] | fates[catalogues.ESCAPES])
    ejected = out & (found.time <= until)
    if not ejected.any():
        raise InputError("nothing of the target was thrown out of the crater")
    rows, mass = found.number[ejected], found.mass[ejected]
    first = last.initial_position[rows]
    depth, away = -ground.polar(first)[2], crater.polar(first)[0]
    result: dict[str, Any] = {
        "mass_kg": float(mass.sum()),
        "particles": int(ejected.sum()),
        "until_s": until,
        "later_kg": float(found.mass[out & ~ejected].sum()),
        "share": FRACTION,
        "depth_m": quantile(depth, mass, FRACTION),
        "depth_half_m": quantile(depth, mass, 0.5),
        "depth_greatest_m": float(depth.max()),
        "radius_m": quantile(away, mass, FRACTION),
        "depth_over_transient_diameter": quantile(depth, mass, FRACTION) / (2.0 * radius),
    }
    if "peak_pressure" in last:
        peak = last.peak_pressure[rows]
        result["peak_pressure_Pa"] = {
            "half": quantile(peak, mass, 0.5),
            "share": quantile(peak, mass, FRACTION),
            "largest": float(peak.max()),
        }
    away_now = np.where(fates[catalogues.ESCAPES], np.inf, catalogues.distance(found, crater))[ejected]
    result["blanket"] = _blanket(away_now / radius, depth / (2.0 * radius), mass, last, rows)
    return {**result, "rim": turned(last, ground, crater, radius)}


def _blanket(
    away: np.ndarray, depth: np.ndarray, mass: np.ndarray, last: Particles, rows: np.ndarray
) -> list[dict[str, Any]]:
    """The classes of landing distance and first depth, one more for what escapes, and the pressure that half of the
    mass of each did not exceed [Pa]."""
    found = [*classes(away, depth, mass), {**_class(np.isinf(away), depth, mass), "escapes": True}]
    if "peak_pressure" in last:
        ring = np.where(np.isinf(away), len(RANGES), np.searchsorted(RANGES, away, side="right") - 1)
        for k, entry in enumerate(found):
            here = ring == k
            entry["peak_pressure_half_Pa"] = quantile(last.peak_pressure[rows[here]], mass[here], 0.5)
    return found


def classes(away: np.ndarray, depth: np.ndarray, mass: np.ndarray) -> list[dict[str, Any]]:
    """For each class of finite distance ``away`` [R]: its edges (None: open) and the ``mass`` [kg] by class of first
    ``depth`` [diameters]."""
    ring = np.where(np.isinf(away), -1, np.searchsorted(RANGES, away, side="right") - 1)
    return [
        {**_class(ring == k, depth, mass), "from_R": edge, "to_R": RANGES[k + 1] if k + 1 < len(RANGES) else None}
        for k, edge in enumerate(RANGES)
    ]


def _class(here: np.ndarray, depth: np.ndarray, mass: np.ndarray) -> dict[str, Any]:
    layer = np.clip(np.searchsorted(DEPTHS, depth, side="right") - 1, 0, len(DEPTHS) - 1)
    parts = [float(mass[here & (layer == d)].sum()) for d in range(len(DEPTHS))]
    return {"from_R": None, "to_R": None, "escapes": False, "mass_kg": parts}


def turned(last: Particles, ground: Datum, crater: Datum, radius: float) -> dict[str, Any]:
    """Whether the layers at the rim are turned over, as ``layer_order.order`` says it."""
    body = last.select(last.layer >= 0)
    away, azimuth, height = crater.polar(body.position)
    first = ground.polar(body.initial_position)[2]
    try:
        held = np.zeros(len(body), dtype=bool)
        whole = np.flatnonzero(body.state == 0) if "state" in body else np.arange(len(body))
        held[whole] = clouds.supported(clouds.particle_cloud(body, "the last snapshot"))
    except InputError as reason:
        return {"order": "undecided", "reason": str(reason), "particles": 0}
    near = held & (away > radius) & (away < layer_order.RIM * radius) & (height > 0.0)
    return layer_order.order(first[near], height[near], away[near] / radius, azimuth[near])


def excavation_lines(known: Mapping[str, Any]) -> list[str]:
    """The same in one line; none where nothing is known."""
    if not known:
        return []
    depth, half = readable.length(known["depth_m"]), readable.length(known["depth_half_m"])
    return [
        f"excavated: {readable.amount(known['mass_kg'], 'kg', 3)}, {known['share']:.0%} of it from above {depth} "
        f"({known['depth_over_transient_diameter']:.2f} of the transient apparent diameter), half from above {half}"
        + ("; the crater still grew when the shock stage ended" if known.get("growing") else "")
    ]
