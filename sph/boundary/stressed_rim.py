"""A fixed rim that answers with the stress of what leans on it, as a rough wall does.

A rim whose own stress stays (``sph.boundary.fixed``) carries half of a shear stress in the layer next to it. Here its
particles take the stress of their moving neighbours j, carried over without a gradient (as Adami, Hu & Adams 2012, J.
Comput. Phys. 231, 7057, carry over the pressure),

    sigma_i = sum_j V_j sigma_j W_ij / sum_j V_j W_ij

A rim particle that no moving one is near keeps its own. What leans on the rim is held off by its own density, in which
the rim's particles count as ever. Pressure and deviator go together: with the deviator alone the layer above slides,
its friction being that of another pressure (dry sand 2 degrees below its angle gains 28 % of free sliding, with both 1
%). The work of moving matter against the rim is not booked: the rim holds no energy.
"""

from __future__ import annotations

import math

import numpy as np

from matter.compilation.jit import parallel_kernel, prange
from sph.kernels import dispatch as kernels
from sph.pairs.row import SUPPORT, VOLUME, XX, XY, XZ, YY, YZ, ZZ, X, Y, Z

SOURCES = ("Adami2012",)


@parallel_kernel
def _carry(kernel, row, index, entry, listed, still):
    for i in prange(len(listed)):
        if not still[i]:
            continue
        weight, xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(entry[i], entry[i] + listed[i]):
            j = index[k]
            if still[j]:
                continue
            dx, dy, dz = row[i, X] - row[j, X], row[i, Y] - row[j, Y], row[i, Z] - row[j, Z]
            r, h = math.sqrt(dx * dx + dy * dy + dz * dz), 0.5 * (row[i, SUPPORT] + row[j, SUPPORT])
            W = row[j, VOLUME] * kernels.kernel(kernel, r, h)
            weight += W
            xx, xy, xz = xx + W * row[j, XX], xy + W * row[j, XY], xz + W * row[j, XZ]
            yy, yz, zz = yy + W * row[j, YY], yz + W * row[j, YZ], zz + W * row[j, ZZ]
        if weight > 1e-12:
            row[i, XX], row[i, XY], row[i, XZ] = xx / weight, xy / weight, xz / weight
            row[i, YY], row[i, YZ], row[i, ZZ] = yy / weight, yz / weight, zz / weight


def carry(row, neighbours, fixed: np.ndarray, owner: np.ndarray | None, kernel: int) -> None:
    """Put the stress into the rows of the rim, ``fixed`` (n,) bool in the order of the cloud; ``owner`` (g,) of the
    images behind them, None without."""
    still = fixed if owner is None else np.concatenate([fixed, fixed[owner]])
    _carry(kernel, row, neighbours.index, neighbours.entry, neighbours.count, still)
