"""What steps of their own would gain: which step each particle could take, and the visits of neighbours saved. Only
measured: all take the least.

    k_i = floor(log2(dt_i / dt_min)),   k_i <= k_j + 2 for neighbours j
        steps by powers of two, those of neighbours within a factor of 4
    saved = 1 - sum_i n_i 2^(-k_i) / sum_i n_i                                 n_i neighbours inside the support

dt_i by all of ``sph.stepping.timestep`` but growth, output and error. A particle that has lost its neighbours takes
``MOST``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from matter.compilation.jit import kernel
from sph.pairs.scheme import Pairs
from sph.stepping import timestep
from sph.stepping.integrator import Integrator

MOST = 12
"""The largest k: steps 4096 times the shortest."""
WITHIN = 2
"""Neighbours' steps differ by at most this power of two."""
FRACTIONS = (0.03, 0.1, 0.3, 1.0)
"""When it is measured, over the end time: at the first output from then on."""


@kernel
def _limit_by_neighbours(level, pairs, owner):
    """Lower ``level`` (n,) in place to ``WITHIN`` above the least of the neighbours, images (``owner``) included; the
    number of particles that changed."""
    n, changed = len(level), 0
    for i in range(n):
        most = level[i]
        for k in range(pairs.first[i], pairs.first[i] + pairs.number[i]):
            j = pairs.partner[k]
            most = min(most, level[j if j < n else owner[j - n]] + WITHIN)
        if most < level[i]:
            level[i] = most
            changed += 1
    return changed


def levels(step: np.ndarray, pairs: Pairs, owner: np.ndarray) -> np.ndarray:
    """k (n,) of the steps (n,) [s]."""
    level = np.clip(np.floor(np.log2(step / step.min())), 0, MOST).astype(np.int64)
    while _limit_by_neighbours(level, pairs, owner) > 0:
        pass
    return level


def measure(i: Integrator) -> dict[str, Any]:
    """Time and shortest step [s], particles by k, and the fraction of visits that would be saved."""
    c = i.cloud
    step = timestep.steps(
        c, i.forces.rates, i.forces.evaluated, i.damping, i.forces.numerics.courant, i.forces.numerics.signal
    )[0]
    owner = np.zeros(0, dtype=np.int64) if i.environment.images is None else i.environment.images.owner
    level = levels(step, Pairs.from_neighbours(i.neighbourhood.pairs), owner)
    visits = np.maximum(c.neighbours, 0).astype(float)
    saved = 1.0 - float(visits @ 0.5**level) / max(float(visits.sum()), 1.0)
    return {
        "time_s": i.time,
        "shortest_s": float(step.min()),
        "particles_by_power_of_two": np.bincount(level).tolist(),
        "visits_saved": saved,
    }
