"""Which fraction of the artificial viscosity a particle takes, where a case asks for a law of it: ``[sph]
viscosity_switch``.

The fraction is that of the step before (of its divergence, ``sph.pairs.rates``), so that a pair still needs one pass.
"""

from __future__ import annotations

from matter.compilation.jit import parallel_kernel, prange
from sph.viscosity import morris_monaghan


@parallel_kernel
def follow(dt, divergence, sound, h, fraction):
    """One step of ``dt`` [s]: ``fraction`` (n,) in place, from div v (n,) [1/s], the speed of sound [m/s] and h
    [m]."""
    for i in prange(len(fraction)):
        fraction[i] = morris_monaghan.next_fraction(fraction[i], dt, divergence[i], sound[i], h[i])
