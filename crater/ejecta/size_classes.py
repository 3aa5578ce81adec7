"""How large the pieces are that were thrown out, as far as the shock stage resolves them.

In the last snapshot of the shock stage the whole particles that hang together are a fragment, broken ones (D >= 1/2)
are in pieces smaller than a particle (``matter.geometry.connected``; flaws and damage of the run's own Grady-Kipp
law). Three classes come of it:

    smaller than a particle    broken; the size is that of the particle, an upper limit
    one particle               whole and alone: about as large as a particle
    several particles          a fragment; the size is that of a sphere of its volume

A size below a particle would need the strain rate at which each particle broke (Grady & Kipp 1980), which snapshots do
not hold: no smaller class is made up. Where nothing broke in the run (no damage, a fluid), or nothing of the target is
whole (loose ground, broken from the start) there are no classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from crater.ejecta.catalogue import Catalogue, where
from crater.ground.datum import Datum
from matter.geometry import connected
from matter.particles import Particles

CLASSES = ("smaller than a particle", "one particle", "several particles")
DUST, ONE, SEVERAL = range(3)


class Sizes(NamedTuple):
    """Of each row of a catalogue (n,): its class, its size [m], and the mass [kg] of the fragment that it belongs to
    (NaN of what is broken)."""

    number: np.ndarray
    size: np.ndarray
    fragment_mass: np.ndarray


def sizes(catalogue: Catalogue, last: Particles) -> Sizes | None:
    """The sizes of what the catalogue holds, from the ``last`` snapshot; None where it does not hold damage and
    supports, or the target is all whole or all broken in it."""
    if any(name not in last for name in ("damage", "support_radius", "density", "layer")):
        return None
    broken = last.damage[last.layer >= 0] >= connected.BROKEN
    if not broken.any() or broken.all():
        return None
    group = np.full(len(last), connected.NONE)
    for body in (last.layer >= 0, last.layer < 0):
        mine = connected.groups(last, body)
        group = np.where(mine != connected.NONE, mine + max(int(group.max()) + 1, 0), group)
    whole = group != connected.NONE
    count = int(group.max()) + 1
    members, mass, volume = (
        np.bincount(group[whole], weights, count)
        for weights in (np.ones(whole.sum()), last.mass[whole], (last.mass / last.density)[whole])
    )
    own, intact = group[catalogue.number], whole[catalogue.number]
    number = np.where(intact, np.where(members[own] > 1, SEVERAL, ONE), DUST)
    room = np.where(intact, volume[own], (last.mass / last.density)[catalogue.number])
    return Sizes(number, np.cbrt(6.0 * room / np.pi), np.where(intact, mass[own], np.nan))


def masses(catalogue: Catalogue, sizes: Sizes, crater: Datum, radius: float) -> dict[str, dict[str, float]]:
    """Mass of the target [kg] by size class and fate (``catalogue.where``)."""
    target, fates = catalogue.layer >= 0, where(catalogue, crater, radius)
    return {
        name: {fate: float(catalogue.mass[target & rows & (sizes.number == k)].sum()) for fate, rows in fates.items()}
        for k, name in enumerate(CLASSES)
    }


def columns(sizes: Sizes | None) -> Mapping[str, Any]:
    """What the file of the catalogue holds of it."""
    if sizes is None:
        return {}
    return {
        "size_class": (sizes.number, "1", "index into the file's attribute 'size_classes'"),
        "size": (sizes.size, "m", "diameter of its fragment; of 'smaller than a particle' an upper limit"),
        "fragment_mass": (
            sizes.fragment_mass,
            "kg",
            "mass of the fragment that it belongs to; NaN where it is broken",
        ),
    }
