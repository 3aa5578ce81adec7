"""The time step of a run: the limits of ``sph.stepping.timestep``, growth by at most 10 % a step, and the next
output."""

from __future__ import annotations

import numpy as np

from sph.bodies.particle_cloud import Cloud
from sph.pairs.rate_arrays import Rates
from sph.pairs.scheme import Damping
from sph.stepping import timestep
from sph.stepping.state import Evaluated

GROWTH = 1.1
"""Largest ratio of a step to the one before it."""


class StepLimit:
    """``dt`` : the last step [s] before it was cut to an output, 0 where growth is free; ``why`` : what limited the
    last step; ``counts`` : steps by reason (``timestep.REASONS``)."""

    def __init__(self, courant: float, signal: timestep.Signal):
        self.courant, self.signal, self.dt, self.why = courant, signal, 0.0, "growth"
        self.counts = np.zeros(len(timestep.REASONS), dtype=np.int64)

    def next(self, cloud: Cloud, rates: Rates, evaluated: Evaluated, damping: Damping, left: float) -> float:
        """The next step [s], no longer than the time ``left`` [s]; counts what limits it."""
        dt, why, _ = timestep.limit(cloud, rates, evaluated, damping, self.courant, self.signal)
        if self.dt > 0.0 and dt > GROWTH * self.dt:
            dt, why = GROWTH * self.dt, timestep.REASONS.index("growth")
        self.dt = dt
        if dt >= left:
            dt, why = left, timestep.REASONS.index("output")
        elif dt > 0.5 * left:
            dt = 0.5 * left  # two even steps rather than one and a sliver
        self.counts[why] += 1
        self.why = timestep.REASONS[why]
        return dt
