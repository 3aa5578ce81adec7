"""The vibration of the particles over a step (``sph.strength.block_model``), exact for its decay, and the energy that
it would hold."""

from __future__ import annotations

import numpy as np

from matter.compilation.jit import parallel_kernel, prange
from sph.strength import block_model
from sph.strength.block_model import C_VIB, DECAY_TIME, T_OFF, V_MAX


@parallel_kernel
def follow(dt, time, material, rows, velocity, divergence, vibration):
    """One step of ``dt`` [s] that ends at ``time`` [s]: ``vibration`` (n,) [m/s] in place, from ``velocity`` (n, 3)
    [m/s] and div v (n,) [1/s]; ``rows`` (m, 6) of the materials."""
    for i in prange(len(vibration)):
        m = material[i]
        if rows[m, C_VIB] > 0.0:
            x, y, z = velocity[i, 0], velocity[i, 1], velocity[i, 2]
            vibration[i] = block_model.next_speed(
                vibration[i],
                dt,
                time,
                (x * x + y * y + z * z) ** 0.5,
                divergence[i] < 0.0,
                rows[m, C_VIB],
                rows[m, V_MAX],
                rows[m, T_OFF],
                rows[m, DECAY_TIME],
            )


def energy(mass: np.ndarray, vibration: np.ndarray) -> float:
    """m v_vib^2 / 2 summed up [J]: no part of the total energy, which the block model does not charge for it."""
    return 0.5 * float(mass @ vibration**2)
