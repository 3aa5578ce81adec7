"""Which share of the artificial viscosity a particle takes, where a case chooses a law for it: ``[sph]
viscosity_switch``.

The share is that of the step before (of its divergence and curl, ``sph.pairs.rates``), so that a pair still needs one
pass.
"""

from __future__ import annotations

from types import ModuleType

from matter.compilation.jit import parallel_kernel, prange
from sph.viscosity import balsara, morris_monaghan

LAWS: dict[str, ModuleType] = {"balsara": balsara, "morris_monaghan": morris_monaghan}


@parallel_kernel
def _balsara(dt, divergence, curl, c, h, share):
    for i in prange(len(share)):
        share[i] = balsara.share(share[i], dt, divergence[i], curl[i], c[i], h[i])


@parallel_kernel
def _morris_monaghan(dt, divergence, curl, c, h, share):
    for i in prange(len(share)):
        share[i] = morris_monaghan.share(share[i], dt, divergence[i], curl[i], c[i], h[i])


_KERNELS = {"balsara": _balsara, "morris_monaghan": _morris_monaghan}


def follow(name: str, dt: float, divergence, curl, sound, h, share) -> None:
    """One step of ``dt`` [s] of the law ``name``: ``share`` (n,) in place, from div v and |curl v| (n,) [1/s], the
    speed of sound [m/s] and h [m]."""
    _KERNELS[name](dt, divergence, curl, sound, h, share)
