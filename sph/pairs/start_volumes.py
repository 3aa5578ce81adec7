"""Sums weighted by the volumes of the start, in which the density is a function of the positions alone.

With V0 = m / rho_0 and eta = rho / rho_0 (rho_0 the density of the particle at the start of the phase),
``sph.pairs.rates`` then computes

    drho_i = rho_0i sum_j V0_j v_ij . grad_i W    so that rho_i / rho_0i - 1 = change of sum_j V0_j W_ij, while h stays
    a_i    = (1 / rho_0i) sum_j V0_j (sigma_i / eta_i^2 + sigma_j / eta_j^2) . grad_i W  -  viscosity

In one material this is the form of Monaghan (1992) with m / rho^2; between materials volumes replace masses,
so that jumps of the density at rest do no harm (Ott & Schnetter 2003; Price 2012). With the present volumes of
``sph.pairs.rates`` the divergence is the smoothed one, and what a particle integrates across a steep front is not what
its neighbourhood is compressed by: behind strong shocks the density is up to 3 % and P up to 5.5 % too high (ice, 10
km/s). The viscosity's 1 / rhobar becomes 2 / (1/psi_i + 1/psi_j) / (rho_0i rho_0j), psi = rho_0 / eta: the same in one
material, and at rest.
"""

from __future__ import annotations

from matter.compilation.jit import parallel_kernel, prange
from sph.pairs.row import RHO_INVERSE, VOLUME, XX, ZZ

SOURCES = ("Monaghan1992", "OttSchnetter2003", "Price2012")


@parallel_kernel
def turn(row, start_density):
    """Rows of ``sph.stepping.state`` (at least n, 16) for these sums, in place: volume V0, 1 / psi for 1 / rho, sigma
    / eta^2; ``start_density`` (n,) [kg/m^3]."""
    for i in prange(len(start_density)):
        r = row[i]
        eta = 1.0 / (r[RHO_INVERSE] * start_density[i])
        r[VOLUME] *= eta
        r[RHO_INVERSE] = eta / start_density[i]
        for k in range(XX, ZZ + 1):
            r[k] /= eta * eta
