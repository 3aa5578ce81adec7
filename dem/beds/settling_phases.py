"""The phases in which a bed settles.

======= ======== ========== ======================= ===================================================================
phase   friction steering   weight above the datum  purpose
======= ======== ========== ======================= ===================================================================
pack    off      FIRE       (no gravity, a lid)     random points become a stable close packing (radii are exchanged)
load    off      FIRE       fades; 0.5 -> 0.001     the bed takes up its weight, the headroom comes to lie on it
                                                    nearly without load
trim    on       FIRE       0.001                   (twice) equilibrium with the masses that the measured packing
                                                    fraction asks for
grip    on       drag       (headroom taken away)   friction and its springs
rest    on       drag       (headroom taken away)   until grains move at a tenth of the limit in their cages, and none
                                                    faster than half of it
free    on       none       (headroom taken away)   proof: by itself the bed stays below the limit, no grain beyond
                                                    four times it
lay     off      FIRE       0                       the headroom is laid back onto the bed, which is held still:
                                                    touching, no load
======= ======== ========== ======================= ===================================================================

In ``load`` weight fades over ``dem.beds.settling.FADES`` radii above the datum. If it ended at the datum, grains
without friction would lie in layers along it. Friction keeps them from doing so in ``trim``, where it ends there.

A loose bed (``dem.beds.loose_packing``) begins otherwise, and goes on from ``grip``:

======= ======== ========== ======================= ===================================================================
pack    off      FIRE       (no gravity, a lid)     random points, somewhat too loose, come apart
grow    off      FIRE       (no gravity, a lid)     (twice) radii grow until the bulk is filled as it is to begin:
                                                    grains touch, none presses
sink    on       drag       1                       grains come down onto each other, friction holds them
trim    on       FIRE       0.001                   (twice, with liquid layers only) these come to equilibrium with the
                                                    masses that the measured packing fraction asks for
======= ======== ========== ======================= ===================================================================

It ends with the phases ``lay``, ``cover``, ``lay``. While a loose bed comes to rest it sinks, by half a radius in a
cap of Callisto. ``lay`` alone only moves the headroom out of the bed's way, which leaves a gap between the two.

======= ======== ========== ======================= ===================================================================
cover   on       drag       1                       headroom falls onto the bed, which is held still
======= ======== ========== ======================= ===================================================================
"""

from __future__ import annotations

from typing import NamedTuple

LIGHT = 1e-3
"""Weight of the headroom while it settles onto the bed: its load moves the bed's surface by less than 1e-4 radii."""


class Phase(NamedTuple):
    """``length`` in travel times of a wave through the bed at the collision step (of ``sink`` and ``cover`` in
    sqrt(r/g)); ``light`` weight above the datum at start and end, or, where weight ``fades``, far above it."""

    name: str
    length: float
    fire: bool
    light: tuple[float, float]
    masses: bool = False
    exchange: bool = False
    held: bool = False
    fades: bool = False

    @property
    def friction(self) -> bool:
        """FIRE phases have none, but where friction has ``held`` the grains before."""
        return not self.fire or self.held


_FROM_GRIP = (
    Phase("grip", 1.5, False, (0.0, 0.0)),
    Phase("rest", 1.5, False, (0.0, 0.0)),
    Phase("free", 1.0, False, (0.0, 0.0)),
    Phase("lay", 2.0, True, (0.0, 0.0)),
)
PHASES = (
    Phase("pack", 3.0, True, (0.0, 0.0), exchange=True),
    Phase("load", 3.0, True, (0.5, LIGHT), masses=True, exchange=True, fades=True),
    Phase("trim", 2.0, True, (LIGHT, LIGHT), masses=True, held=True),
    Phase("trim", 3.0, True, (LIGHT, LIGHT), held=True),
    *_FROM_GRIP,
)
LOOSE_PHASES = (
    Phase("pack", 1.0, True, (0.0, 0.0)),
    Phase("grow", 0.7, True, (0.0, 0.0)),
    Phase("grow", 0.7, True, (0.0, 0.0)),
    Phase("sink", 4.0, False, (1.0, 1.0), masses=True, exchange=True),
    Phase("trim", 4.0, True, (LIGHT, LIGHT), masses=True, exchange=True, held=True),
    Phase("trim", 4.0, True, (LIGHT, LIGHT), held=True),
    _FROM_GRIP[0]._replace(length=8.0),
    *_FROM_GRIP[1:],
    Phase("cover", 4.0, False, (1.0, 1.0)),
    _FROM_GRIP[-1],
)
