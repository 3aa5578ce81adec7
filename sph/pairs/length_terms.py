"""What a support that follows the density adds to the density's own rate ("grad-h": Springel & Hernquist 2002;
Monaghan 2002).

With h = h_0 (rho_0 / rho)^(1/3) the sum whose change is the density, sum_j V0_j W(r_ij, h_ij)
(``sph.pairs.start_volumes``), changes by dh too. If neighbours change theirs in proportion (the sources let W depend
on h_i alone, which needs no such assumption and a second kernel for each pair),

    drho_i = (1 / Omega_i) (the rate at fixed h),   Omega_i = 1 + (rho_0i / 3 rho_i) sum_j V0_j h_ij dW/dh(r_ij, h_ij)

and the pressure in force and heat is P_i / Omega_i, so that both stay conjugate. In matter of even density Omega = 1;
the sum over a lattice says 0.988 (Wendland's kernel, h = 2.6 spacings) or 0.973 (cubic spline, 2.0), by which it is
divided (``at_rest``): sound and weak shocks would be that much too fast. Next to a void it is not 1, and without it
the density of what has expanded falls through zero: in the hot centre of a blast it stood at its floor, while that of
the shell was up to a half too high and the blast ran ahead. Omega is 1 where h stands at one of its limits, and is
kept within ``LEAST`` and ``MOST``.

h dW/dh = -3 W - r dW/dr for a kernel of three dimensions; the particle itself, r = 0, belongs to the sum.

The loop also sums how full each neighbourhood is, -(1 / 3 eta_i) sum_j V0_j r dW/dr over the same sum in a lattice;
the contact of two bodies depends on it (``sph.pairs.body_contact``).
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import numpy as np

from matter.compilation.gather import LANES, narrow_columns, scratch_width
from matter.compilation.jit import parallel_kernel, prange
from sph.kernels import dispatch as kernels
from sph.pairs.lattice_gradients import hexagonal_distances
from sph.pairs.row import NARROW, RHO_INVERSE, SUPPORT, VOLUME, XX, YY, ZZ, X, Y, Z
from sph.pairs.scheme import Pairs, Rows, Scheme

SOURCES = ("SpringelHernquist2002", "Monaghan2002")

LEAST, MOST = 0.2, 5.0
_BLOCK = 64


@functools.cache
def _loop(scheme: Scheme):
    """The compiled loop (rows, pairs, start_support, least, most, at_rest, omega) of a scheme; fills ``omega`` and
    ``rows.filled``."""
    kernel = scheme.kernel

    @parallel_kernel(fastmath=True)
    def _scale(rows, pairs, start_support, least, most, at_rest, omega):
        row, start_density, filled = rows.row, rows.start_density, rows.filled
        n = len(omega)
        for block in prange((n + _BLOCK - 1) // _BLOCK):
            wide = 0
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                wide = max(wide, pairs.number[i])
            s = np.empty((NARROW, scratch_width(wide)))
            for i in range(block * _BLOCK, min(n, (block + 1) * _BLOCK)):
                padded = (pairs.number[i] + LANES - 1) // LANES * LANES
                for k in range(0, padded, LANES):
                    narrow_columns(row, pairs.partner, pairs.first[i], k, s)
                x, y, z, h = row[i, X], row[i, Y], row[i, Z], row[i, SUPPORT]
                total, around = 0.0, 0.0
                for k in range(padded):
                    dx, dy, dz = x - s[X, k], y - s[Y, k], z - s[Z, k]
                    hij = 0.5 * (h + s[SUPPORT, k])
                    r2 = dx * dx + dy * dy + dz * dz
                    r = math.sqrt(r2)
                    W, F = kernels.kernel(kernel, r, hij), kernels.gradient_factor(kernel, r, hij)
                    around -= s[VOLUME, k] * r2 * F
                    total -= 3.0 * s[VOLUME, k] * W
                total += around
                W = kernels.kernel(kernel, 0.0, h)
                total -= 3.0 * (1 - (padded - pairs.number[i])) * row[i, VOLUME] * W
                eta = row[i, RHO_INVERSE] * start_density[i]
                free = h > 1.0001 * least * start_support[i] and h < 0.9999 * most * start_support[i]
                value = min(max((1.0 + total / (3.0 * eta)) / at_rest.omega, LEAST), MOST)
                omega[i] = value if free else 1.0
                filled[i] = around / (3.0 * eta * at_rest.full)

    return _scale


@parallel_kernel
def _apply(row, omega):
    for i in prange(len(omega)):
        change = (row[i, XX] + row[i, YY] + row[i, ZZ]) / 3.0 * (1.0 / omega[i] - 1.0)  # of -P
        row[i, XX] += change
        row[i, YY] += change
        row[i, ZZ] += change


@parallel_kernel
def _divide(density_rate, divergence, omega):
    for i in prange(len(omega)):
        density_rate[i] /= omega[i]
        divergence[i] /= omega[i]


class LatticeSums(NamedTuple):
    """What the sums say of an undisturbed lattice: of ``omega``, and how ``full`` a neighbourhood is."""

    omega: float
    full: float


CONTINUUM = LatticeSums(1.0, 1.0)


def at_rest(support: float, kernel: str) -> LatticeSums:
    """The sums in an undisturbed lattice, for the support radius [spacings] of a kernel."""
    law, r = kernels.FAMILY.laws[kernels.FAMILY.kind(kernel)], hexagonal_distances(support)
    full = -sum(x * x * law.gradient_factor(x, support) for x in r) / 3.0
    number = law.kernel(0.0, support) + sum(law.kernel(x, support) for x in r)
    return LatticeSums(float(1.0 - number + full), float(full))


def scale(
    scheme: Scheme,
    rows: Rows,
    neighbours,
    start_support: np.ndarray,
    limits: tuple[float, float],
    omega: np.ndarray,
    at_rest: LatticeSums = CONTINUUM,
) -> None:
    """Fill ``omega`` (n,) from rows turned by ``sph.pairs.start_volumes`` (images included), and put P / Omega into
    the first n of them; ``rows.filled`` (n,) becomes how full their neighbourhoods are.

    ``at_rest``: the sums in an undisturbed lattice.
    """
    _loop(scheme)(rows, Pairs.from_neighbours(neighbours), start_support, limits[0], limits[1], at_rest, omega)
    _apply(rows.row, omega)


def divide(rates, omega: np.ndarray) -> None:
    """The rates of the density and the divergence over ``omega`` (n,)."""
    _divide(rates.density, rates.divergence, omega)
