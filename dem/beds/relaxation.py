"""FIRE: relaxation of frictionless grains to mechanical equilibrium, several times faster than damped dynamics.

The step of velocity Verlet is kept; after each step the velocity is steered along the acceleration,

    v <- (1 - alpha) v + alpha |v| a / |a|        while P = sum m a.v > 0 (the step grows, alpha shrinks)
    v <- 0, dt <- dt/2, alpha <- alpha_0          as soon as P < 0

with norms weighted by mass. Contacts have no friction; dashpots may stay (they quench the stiff modes). alpha
(``mixing``) keeps a floor: without it the stiff modes gain energy between two stops, and the imbalance falls ten times
more slowly.

Source: Bitzek, Koskinen, Gaehler, Moseler & Gumbsch 2006, Phys. Rev. Lett. 97, 170201.
"""

from __future__ import annotations

import math

import numpy as np

from dem.contact.columns import XYZ
from dem.grains.assembly import Assembly
from matter.files import checkpoint

SOURCES = ("Bitzek2006",)

_MIXING, _FLOOR, _SHRINK, _GROW, _HALVE, _PATIENCE = 0.1, 0.03, 0.99, 1.1, 0.5, 5
LARGEST_STEP = 3.0
"""Largest step over the collision step t_c/30: the stiffest mode of a packing is 2.5 times that of a pair, Verlet
without dashpots is stable to 7 of these."""


class Fire:
    """Steering state for one assembly; ``dt`` is the assembly's own."""

    def __init__(self, bed: Assembly):
        self.bed = bed
        self.unit = bed.dt
        self.mixing, self.patience = _MIXING, 0

    def step(self) -> None:
        """One step of the assembly and the steering after it."""
        bed = self.bed
        bed.step()
        v, a, m = bed.velocity, bed.A[:, XYZ], bed.mass
        # einsum, not @: a threaded BLAS costs far more than it saves on vectors of this size
        power = float(np.einsum("i,ij,ij->", m, v, a))
        if power > 0.0:
            v2, a2 = float(np.einsum("i,ij,ij->", m, v, v)), float(np.einsum("i,ij,ij->", m, a, a))
            v *= 1.0 - self.mixing
            v += self.mixing * math.sqrt(v2 / a2) * a
            self.patience += 1
            if self.patience > _PATIENCE:
                bed.dt = min(bed.dt * _GROW, LARGEST_STEP * self.unit)
                self.mixing = max(_FLOOR, self.mixing * _SHRINK)
        else:
            bed.W[:] = 0.0
            bed.dt = max(bed.dt * _HALVE, 0.1 * self.unit)
            self.mixing, self.patience = _MIXING, 0

    def state(self) -> dict[str, float]:
        """What a checkpoint must hold besides the assembly."""
        return {"unit": self.unit, "mixing": self.mixing, "patience": self.patience}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        self.unit, self.mixing, self.patience = saved["unit"], saved["mixing"], int(saved["patience"])
