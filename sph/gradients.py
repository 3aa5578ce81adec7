"""Corrected gradients in everything that a particle's stress does: force, density and heat as well as the strain (Bonet & Lok 1999).

    M_i = sum_j V_j x_ji (x) grad_i W,   B_i = M_i^-1,   L_i = (sum_j V_j v_ji (x) grad_i W) B_i       exact for any linear field, at a free surface too
    a_i = (1 / rho_i) sum_j V_j (sigma_i B_i + sigma_j B_j) . grad_i W,   drho_i = -rho_i tr L_i,   du_i = (1 / rho_i) sigma_i : L_i

The force is the one whose power is the heat, so that momentum and total energy are kept as with plain gradients. Beyond them: a rigid rotation heats
nothing and its conjugate, the net torque of the stress, is zero; the work done on a linear flow is that of the continuum in the layers next to a surface too,
where plain gradients see but a part of it. What is lost: the density is no longer a function of the places alone (``sph.start_volumes``).
For bodies that keep their strength: thin shells, spinning bodies, plates.

A lopsided neighbourhood (surface spray) has no useful inverse: B = 1 there, plain gradients.
"""

from __future__ import annotations

import math

import numpy as np

from matter.gather import LANES, columns
from matter.jit import parallel_kernel, prange
from sph import kernel, kernel_wendland
from sph.state import WIDTH

TENSOR = 1  # first of the nine columns of sigma B in the rows that ``sph.rates`` reads beside its own; before it the share of the viscosity
_BLOCK = 64


@parallel_kernel(fastmath=True)
def _correct(row, index, entry, listed, wendland, start_density, inverse, beside):
    n = len(inverse)
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        most = 0
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            most = max(most, listed[i])
        s = np.empty((WIDTH, most + 2 * LANES))
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            padded = (listed[i] + LANES - 1) // LANES * LANES  # filled up with the particle itself, which adds exact zeros
            for k in range(0, padded, LANES):
                columns(row, index, entry[i], k, s)
            x, y, z, h = row[i, 0], row[i, 1], row[i, 2], row[i, 8]
            cxx, cxy, cxz, cyy, cyz, czz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(padded):
                dx, dy, dz = x - s[0, k], y - s[1, k], z - s[2, k]
                hij = 0.5 * (h + s[8, k])
                r = math.sqrt(dx * dx + dy * dy + dz * dz)
                if wendland is None:  # compiled for one of the two
                    F = kernel.gradient_factor(r, hij)
                else:
                    F = kernel_wendland.gradient_factor(r, hij)
                F *= s[6, k]
                cxx -= dx * dx * F
                cxy -= dx * dy * F
                cxz -= dx * dz * F
                cyy -= dy * dy * F
                cyz -= dy * dz * F
                czz -= dz * dz * F
            if start_density is not None:
                thin = 1.0 / (row[i, 7] * start_density[i])  # 1 / eta: sums over first volumes as sums over present ones
                cxx, cxy, cxz, cyy, cyz, czz = cxx * thin, cxy * thin, cxz * thin, cyy * thin, cyz * thin, czz * thin
            det = cxx * (cyy * czz - cyz * cyz) - cxy * (cxy * czz - cyz * cxz) + cxz * (cxy * cyz - cyy * cxz)
            B = inverse[i]
            B[0], B[1], B[2], B[3], B[4], B[5] = 1.0, 0.0, 0.0, 1.0, 0.0, 1.0
            if det > 0.05 and det < 20.0:
                inv = 1.0 / det
                B[0], B[1], B[2] = (cyy * czz - cyz * cyz) * inv, (cxz * cyz - cxy * czz) * inv, (cxy * cyz - cxz * cyy) * inv
                B[3], B[4], B[5] = (cxx * czz - cxz * cxz) * inv, (cxy * cxz - cxx * cyz) * inv, (cxx * cyy - cxy * cxy) * inv
            txx, txy, txz, tyy, tyz, tzz = row[i, 10], row[i, 11], row[i, 12], row[i, 13], row[i, 14], row[i, 15]
            T = beside[i]
            T[1], T[2], T[3] = txx * B[0] + txy * B[1] + txz * B[2], txx * B[1] + txy * B[3] + txz * B[4], txx * B[2] + txy * B[4] + txz * B[5]
            T[4], T[5], T[6] = txy * B[0] + tyy * B[1] + tyz * B[2], txy * B[1] + tyy * B[3] + tyz * B[4], txy * B[2] + tyy * B[4] + tyz * B[5]
            T[7], T[8], T[9] = txz * B[0] + tyz * B[1] + tzz * B[2], txz * B[1] + tyz * B[3] + tzz * B[4], txz * B[2] + tyz * B[4] + tzz * B[5]


def correct(row, neighbours, wendland: bool | None, start_density: np.ndarray | None, inverse: np.ndarray, beside: np.ndarray) -> None:
    """Fill ``inverse`` (n, 6) with B (xx xy xz yy yz zz) and columns ``TENSOR`` to ``TENSOR`` + 8 of ``beside`` (at least n, 16) with sigma B [Pa], row by row;
    ``row`` as ``sph.rates`` takes it, with its ``wendland`` and ``start_density``.
    """
    _correct(row, neighbours.index, neighbours.entry, neighbours.count, wendland, start_density, inverse, beside)
