"""Which share of the artificial viscosity a particle takes, where a case chooses a law for it: ``[sph]
viscosity_switch``.

The share is that of the step before (of its divergence and curl, ``sph.rates``), so that a pair still needs one pass.
"""

from __future__ import annotations

from types import ModuleType

from matter.jit import parallel_kernel, prange
from sph import viscosity_balsara, viscosity_morris_monaghan

LAWS: dict[str, ModuleType] = {"balsara": viscosity_balsara, "morris_monaghan": viscosity_morris_monaghan}


@parallel_kernel
def _balsara(dt, divergence, curl, c, h, share):
    for i in prange(len(share)):
        share[i] = viscosity_balsara.share(share[i], dt, divergence[i], curl[i], c[i], h[i])


@parallel_kernel
def _morris_monaghan(dt, divergence, curl, c, h, share):
    for i in prange(len(share)):
        share[i] = viscosity_morris_monaghan.share(share[i], dt, divergence[i], curl[i], c[i], h[i])


_KERNELS = {"balsara": _balsara, "morris_monaghan": _morris_monaghan}


def follow(name: str, dt: float, divergence, curl, sound, h, share) -> None:
    """One step of ``dt`` [s] of the law ``name``: ``share`` (n,) in place, from div v and |curl v| (n,) [1/s], the
    speed of sound [m/s] and h [m]."""
    _KERNELS[name](dt, divergence, curl, sound, h, share)
