"""A rim that never moves: its particles keep position, density, energy and stress, and carry what leans on them,
though only half of a shear stress.

One support radius thick, it is a rough rigid wall of any shape: the particles inside have full neighbourhoods.
"""

from __future__ import annotations

import numpy as np

from matter.compilation.jit import parallel_kernel, prange

WORDS = "a rim that never moves"
TAKES_MOMENTUM = FLOOR = RIM = True


@parallel_kernel
def zero_rates(identity, fixed, gravity, acceleration, density_rate, energy_rate, stress_rate):
    """No rates for the particles with ``fixed[identity]``: the acceleration answers gravity."""
    for i in prange(len(identity)):
        if fixed[identity[i]]:
            for c in range(3):
                acceleration[i, c] = -gravity[i, c]
            density_rate[i], energy_rate[i] = 0.0, 0.0
            for c in range(5):
                stress_rate[i, c] = 0.0


def rim(depth: np.ndarray, h: np.ndarray) -> np.ndarray:
    """(n,) bool: particles within one support radius ``h`` [m] of the edge, ``depth`` (n,) [m] their distance from
    it."""
    return depth < h
