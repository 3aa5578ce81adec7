"""What a support that follows the density adds to the density's own rate ("grad-h": Springel & Hernquist 2002; Monaghan 2002).

With h = h_0 (rho_0 / rho)^(1/3) the sum whose change is the density, sum_j V0_j W(r_ij, h_ij) (``sph.start_volumes``), changes by dh too. If neighbours change
theirs in proportion (the sources let W depend on h_i alone, which needs no such assumption and a second kernel for each pair),

    drho_i = (1 / Omega_i) (the rate at fixed h),   Omega_i = 1 + (rho_0i / 3 rho_i) sum_j V0_j h_ij dW/dh(r_ij, h_ij)

and the pressure in force and heat is P_i / Omega_i, so that both stay conjugate. In matter of even density Omega = 1; next to a void it is not, and without it
the density of what has expanded falls through zero: in the hot centre of a blast it stood at its floor, while that of the shell was up to a half too
high and the blast ran ahead. Omega is 1 where h stands at one of its limits, and is kept within ``LEAST`` and ``MOST``.

h dW/dh = -3 W - r dW/dr for a kernel of three dimensions; the particle itself, r = 0, belongs to the sum.
"""

from __future__ import annotations

import math

import numpy as np

from matter.gather import LANES, columns
from matter.jit import parallel_kernel, prange
from sph import kernel, kernel_wendland
from sph.state import WIDTH

LEAST, MOST = 0.2, 5.0
_BLOCK = 64


@parallel_kernel(fastmath=True)
def _scale(row, index, entry, listed, wendland, start_density, start_length, least, most, omega):
    n = len(omega)
    for block in prange((n + _BLOCK - 1) // _BLOCK):
        wide = 0
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            wide = max(wide, listed[i])
        s = np.empty((WIDTH, wide + 2 * LANES))
        for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
            padded = (listed[i] + LANES - 1) // LANES * LANES
            for k in range(0, padded, LANES):
                columns(row, index, entry[i], k, s)
            x, y, z, h = row[i, 0], row[i, 1], row[i, 2], row[i, 8]
            total = 0.0
            for k in range(padded):
                dx, dy, dz = x - s[0, k], y - s[1, k], z - s[2, k]
                hij = 0.5 * (h + s[8, k])
                r2 = dx * dx + dy * dy + dz * dz
                r = math.sqrt(r2)
                if wendland is None:  # compiled for one of the two
                    W, F = kernel.kernel(r, hij), kernel.gradient_factor(r, hij)
                else:
                    W, F = kernel_wendland.kernel(r, hij), kernel_wendland.gradient_factor(r, hij)
                total -= s[6, k] * (3.0 * W + r2 * F)
            if wendland is None:
                W = kernel.kernel(0.0, h)
            else:
                W = kernel_wendland.kernel(0.0, h)
            total -= 3.0 * (1 - (padded - listed[i])) * row[i, 6] * W  # what fills the list up is the particle itself, which belongs to the sum once
            eta = row[i, 7] * start_density[i]
            free = h > 1.0001 * least * start_length[i] and h < 0.9999 * most * start_length[i]
            value = min(max(1.0 + total / (3.0 * eta), LEAST), MOST)
            omega[i] = value if free else 1.0


@parallel_kernel
def _apply(row, omega):
    for i in prange(len(omega)):
        change = (row[i, 10] + row[i, 13] + row[i, 15]) / 3.0 * (1.0 / omega[i] - 1.0)  # of -P
        row[i, 10] += change
        row[i, 13] += change
        row[i, 15] += change


@parallel_kernel
def _divide(density_rate, divergence, omega):
    for i in prange(len(omega)):
        density_rate[i] /= omega[i]
        divergence[i] /= omega[i]


def scale(row, neighbours, wendland: bool | None, start_density, start_length, limits: tuple[float, float], omega: np.ndarray) -> None:
    """Fill ``omega`` (n,) from rows turned by ``sph.start_volumes`` (images included), and put P / Omega into the first n of them."""
    _scale(row, neighbours.index, neighbours.entry, neighbours.count, wendland, start_density, start_length, limits[0], limits[1], omega)
    _apply(row, omega)


def divide(rates, omega: np.ndarray) -> None:
    """The rates of the density and the divergence over ``omega`` (n,)."""
    _divide(rates.density, rates.divergence, omega)
