"""Corrected gradients in everything that a particle's stress does: force, density and heat as well as the strain
(Bonet & Lok 1999).

    M_i = sum_j V_j x_ji (x) grad_i W,   B_i = M_i^-1,   L_i = (sum_j V_j v_ji (x) grad_i W) B_i
        exact for any linear field, at a free surface too
    a_i = (1 / rho_i) sum_j V_j (sigma_i B_i + sigma_j B_j) . grad_i W,   drho_i = -rho_i tr L_i,
    du_i = (1 / rho_i) sigma_i : L_i

The force is the one whose power is the heat, so that momentum and total energy are kept as with plain gradients.
Beyond them: a rigid rotation heats nothing and its conjugate, the net torque of the stress, is zero; the work done on
a linear flow is that of the continuum in the layers next to a surface too, where plain gradients see but a part of it.
What is lost: the density is no longer a function of the positions alone (``sph.pairs.start_volumes``). For bodies that
keep their strength: thin shells, spinning bodies, plates.

A lopsided neighbourhood (surface spray) has no useful inverse: B = 1 there, plain gradients.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from matter.compilation.gather import LANES, columns, scratch_width
from matter.compilation.jit import parallel_kernel, prange
from sph.kernels import dispatch as kernels
from sph.pairs.row import RHO_INVERSE, SUPPORT, TENSOR, VOLUME, WIDTH, XX, XY, XZ, YY, YZ, ZZ, X, Y, Z
from sph.pairs.scheme import Pairs, Rows, Scheme

SOURCES = ("BonetLok1999",)

_BLOCK = 64


@functools.cache
def _loop(scheme: Scheme):
    """The compiled loop (rows, pairs) of a scheme; fills ``rows.inverse`` and the tensor of ``rows.extra``."""
    kernel, reconstructed = scheme.kernel, scheme.reconstructed

    @parallel_kernel(fastmath=True)
    def _correct(rows, pairs):
        row, extra, start_density, inverse = rows.row, rows.extra, rows.start_density, rows.inverse
        n = len(inverse)
        for block in prange((n + _BLOCK - 1) // _BLOCK):
            most = 0
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                most = max(most, pairs.number[i])
            s = np.empty((WIDTH, scratch_width(most)))
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                # filled up with the particle itself, which adds exact zeros
                padded = (pairs.number[i] + LANES - 1) // LANES * LANES
                for k in range(0, padded, LANES):
                    columns(row, pairs.partner, pairs.first[i], k, s)
                x, y, z, h = row[i, X], row[i, Y], row[i, Z], row[i, SUPPORT]
                cxx, cxy, cxz, cyy, cyz, czz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for k in range(padded):
                    dx, dy, dz = x - s[X, k], y - s[Y, k], z - s[Z, k]
                    hij = 0.5 * (h + s[SUPPORT, k])
                    r = math.sqrt(dx * dx + dy * dy + dz * dz)
                    F = kernels.gradient_factor(kernel, r, hij) * s[VOLUME, k]
                    cxx -= dx * dx * F
                    cxy -= dx * dy * F
                    cxz -= dx * dz * F
                    cyy -= dy * dy * F
                    cyz -= dy * dz * F
                    czz -= dz * dz * F
                if reconstructed:
                    # 1 / eta: sums over first volumes as sums over present ones
                    volume_ratio = 1.0 / (row[i, RHO_INVERSE] * start_density[i])
                    cxx, cxy, cxz, cyy, cyz, czz = (
                        cxx * volume_ratio,
                        cxy * volume_ratio,
                        cxz * volume_ratio,
                        cyy * volume_ratio,
                        cyz * volume_ratio,
                        czz * volume_ratio,
                    )
                det = cxx * (cyy * czz - cyz * cyz) - cxy * (cxy * czz - cyz * cxz) + cxz * (cxy * cyz - cyy * cxz)
                B = inverse[i]
                B[0], B[1], B[2], B[3], B[4], B[5] = 1.0, 0.0, 0.0, 1.0, 0.0, 1.0
                if det > 0.05 and det < 20.0:
                    inv = 1.0 / det
                    B[0], B[1], B[2] = (
                        (cyy * czz - cyz * cyz) * inv,
                        (cxz * cyz - cxy * czz) * inv,
                        (cxy * cyz - cxz * cyy) * inv,
                    )
                    B[3], B[4], B[5] = (
                        (cxx * czz - cxz * cxz) * inv,
                        (cxy * cxz - cxx * cyz) * inv,
                        (cxx * cyy - cxy * cxy) * inv,
                    )
                txx, txy, txz, tyy, tyz, tzz = row[i, XX], row[i, XY], row[i, XZ], row[i, YY], row[i, YZ], row[i, ZZ]
                T = extra[i, TENSOR:]
                T[0], T[1], T[2] = (
                    txx * B[0] + txy * B[1] + txz * B[2],
                    txx * B[1] + txy * B[3] + txz * B[4],
                    txx * B[2] + txy * B[4] + txz * B[5],
                )
                T[3], T[4], T[5] = (
                    txy * B[0] + tyy * B[1] + tyz * B[2],
                    txy * B[1] + tyy * B[3] + tyz * B[4],
                    txy * B[2] + tyy * B[4] + tyz * B[5],
                )
                T[6], T[7], T[8] = (
                    txz * B[0] + tyz * B[1] + tzz * B[2],
                    txz * B[1] + tyz * B[3] + tzz * B[4],
                    txz * B[2] + tyz * B[4] + tzz * B[5],
                )

    return _correct


def correct(scheme: Scheme, rows: Rows, neighbours) -> None:
    """Fill ``rows.inverse`` (n, 6) with B (xx xy xz yy yz zz), and the tensor in ``rows.extra`` with sigma B [Pa],
    row by row."""
    _loop(scheme)(rows, Pairs.from_neighbours(neighbours))
