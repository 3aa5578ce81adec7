"""A fixed rim that answers with the stress of what leans on it, as a rough wall does.

A rim whose own stress stays (``sph.boundary.fixed``) carries half of a shear stress in the layer next to it. Here its particles take the stress of their moving
neighbours j, carried over without a gradient (as Adami, Hu & Adams 2012, J. Comput. Phys. 231, 7057, carry over the pressure),

    sigma_i = sum_j V_j sigma_j W_ij / sum_j V_j W_ij

A rim particle that no moving one is near keeps its own. What leans on the rim is held off by its own density, in which the rim's particles count as ever.
Pressure and deviator go together: with the deviator alone the layer above slides, its friction being that of another pressure (dry sand 2 degrees below its
angle gains 28 % of free sliding, with both 1 %). The work of moving matter against the rim is not booked: the rim holds no energy.
"""

from __future__ import annotations

import math

import numpy as np

from matter.jit import parallel_kernel, prange
from sph import kernel, kernel_wendland


@parallel_kernel
def _carry(row, index, entry, listed, still, wendland):
    for i in prange(len(listed)):
        if not still[i]:
            continue
        weight, xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(entry[i], entry[i] + listed[i]):
            j = index[k]
            if still[j]:
                continue
            dx, dy, dz = row[i, 0] - row[j, 0], row[i, 1] - row[j, 1], row[i, 2] - row[j, 2]
            r, h = math.sqrt(dx * dx + dy * dy + dz * dz), 0.5 * (row[i, 8] + row[j, 8])
            if wendland is None:  # compiled for one of the two
                W = row[j, 6] * kernel.kernel(r, h)
            else:
                W = row[j, 6] * kernel_wendland.kernel(r, h)
            weight += W
            xx, xy, xz = xx + W * row[j, 10], xy + W * row[j, 11], xz + W * row[j, 12]
            yy, yz, zz = yy + W * row[j, 13], yz + W * row[j, 14], zz + W * row[j, 15]
        if weight > 1e-12:
            row[i, 10], row[i, 11], row[i, 12] = xx / weight, xy / weight, xz / weight
            row[i, 13], row[i, 14], row[i, 15] = yy / weight, yz / weight, zz / weight


def carry(row, neighbours, fixed: np.ndarray, owner: np.ndarray | None, wendland: bool | None) -> None:
    """Put the stress into the rows of the rim, ``fixed`` (n,) bool in the order of the cloud; ``owner`` (g,) of the images behind them, None without."""
    still = fixed if owner is None else np.concatenate([fixed, fixed[owner]])
    _carry(row, neighbours.index, neighbours.entry, neighbours.count, still, wendland)
