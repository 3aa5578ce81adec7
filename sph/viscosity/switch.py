"""Which share of the artificial viscosity a particle takes, where a case asks for a law of it: ``[sph]
viscosity_switch``.

The share is that of the step before (of its divergence, ``sph.pairs.rates``), so that a pair still needs one pass.
"""

from __future__ import annotations

from matter.compilation.jit import parallel_kernel, prange
from sph.viscosity import morris_monaghan


@parallel_kernel
def follow(dt, divergence, sound, h, share):
    """One step of ``dt`` [s]: ``share`` (n,) in place, from div v (n,) [1/s], the speed of sound [m/s] and h [m]."""
    for i in prange(len(share)):
        share[i] = morris_monaghan.share(share[i], dt, divergence[i], sound[i], h[i])
