"""Support radii that follow the density: as many neighbours in what has been compressed or has expanded as at the
start.

    h = h_0 (rho_0 / rho)^(1/3), not below ``least`` h_0 and not above ``most`` h_0
        (Monaghan 1992, in its integrated form)

h_0 and rho_0 are those of the particle at the start. Force and heating of ``sph.pairs.rates`` are conjugate for any h
at the moment of the sums, so that total energy is kept whatever h does; no terms in grad h are needed where the
density is integrated with the same divergence that heats.
"""

from __future__ import annotations

from matter.compilation.jit import parallel_kernel, prange

SOURCES = ("Monaghan1992",)


@parallel_kernel
def follow(density, start_density, start_support, least, most, longest, length):
    """Fill ``length`` (n,) [m] by the law above, at most ``longest`` [m]."""
    for i in prange(len(density)):
        factor = (start_density[i] / density[i]) ** (1.0 / 3.0)
        length[i] = min(min(max(factor, least), most) * start_support[i], longest)
