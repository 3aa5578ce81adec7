"""What matter grains stand for, carried along with them by identity.

The handoff says of each grain which fractions of its matter melted, how strongly it was shocked and where it lay
before the impact (``matter.particles.ORIGINS``), or which block it is. No step changes that: neither the loops nor the
checkpoints hold it, and every engine's snapshots are given it from the start of the run, which a resumed run reads
again.
"""

from __future__ import annotations

import numpy as np

from matter.particles import OF_BLOCKS, ORIGINS, Particles


class Origins:
    """The fields of the ``start`` that say where matter came from, as far as it has them."""

    def __init__(self, start: Particles):
        order = np.argsort(start.identity, kind="stable")
        self.identity = start.identity[order]
        self.fields = {name: start[name][order] for name in (*ORIGINS, *OF_BLOCKS) if name in start}

    def blocks(self, identity: np.ndarray) -> np.ndarray | None:
        """Which block (n,) each of these grains is, -1 for none; None where the ground holds none."""
        if "block" not in self.fields:
            return None
        return np.asarray(self.fields["block"][np.searchsorted(self.identity, identity)])

    def onto(self, grains: Particles) -> Particles:
        """``grains``, given those fields."""
        row = np.searchsorted(self.identity, grains.identity)
        for name, values in self.fields.items():
            grains[name] = values[row]
        return grains
