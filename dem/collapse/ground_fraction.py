"""Solid fraction of the ground round the cavity while it collapses: whether the ground swells.

The ring is the same at every time. With R half the expected transient diameter it reaches from ``NEAREST`` to
``FARTHEST`` R along the datum, from ``SHALLOWEST`` to ``DEEPEST`` R below it: outside the transient cavity, below the
blanket. Grains in flight or gone are not counted. Half of a bed of random close packing is a few hundred grains there;
the fraction is then known within 0.002 (``bed_measures.bulk_fraction_where``).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dem.beds import bed_measures
from dem.beds.bed_walls import Domain
from matter.files import snapshot
from matter.particles import Particles

NEAREST, FARTHEST = 1.1, 1.7
SHALLOWEST, DEEPEST = 0.15, 0.6
FEWEST = 100
"""Grains in the ring below which nothing is said."""


def in_ring(position: np.ndarray, domain: Domain, crater_radius: float) -> np.ndarray:
    """Which of these positions (n, 3) lie in the ring, as a mask."""
    away, depth = domain.along(position), domain.datum - domain.height(position)
    return np.asarray(
        (away > NEAREST * crater_radius)
        & (away < FARTHEST * crater_radius)
        & (depth > SHALLOWEST * crater_radius)
        & (depth < DEEPEST * crater_radius)
    )


def measured(grains: Particles, domain: Domain, crater_radius: float) -> float | None:
    """Solid fraction of the ring; None where it holds fewer than ``FEWEST`` grains."""
    rests = grains.state == 0 if "state" in grains else np.ones(len(grains), dtype=bool)
    position, radius = grains.position[rests], grains.radius[rests]
    inner = in_ring(position, domain, crater_radius)
    return bed_measures.bulk_fraction_where(position, radius, inner) if inner.sum() >= FEWEST else None


def report(out: Path, domain: Any, carried: Mapping[str, Any]) -> dict[str, Any]:
    """``ground_fraction`` of the snapshots in a folder: times, fractions, the first (``before``), the least and the
    last (``at_rest``). Empty for a whole body, and where the ring holds too few grains at some time."""
    diameter = carried.get("measuring", {}).get("expected_transient_diameter_m")
    if not isinstance(domain, Domain) or not diameter:
        return {}
    times, fractions = [], []
    for path in snapshot.series(out):
        grains = snapshot.read(path)
        found = measured(grains, domain, 0.5 * diameter)
        if found is None:
            return {}
        times.append(float(grains.attributes["time"]))
        fractions.append(found)
    if not fractions:
        return {}
    ends = {"before": fractions[0], "least": min(fractions), "at_rest": fractions[-1]}
    return {"ground_fraction": {**ends, "time_s": times, "fraction": fractions}}
