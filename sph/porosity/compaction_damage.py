"""Damage by crushing (Benz & Jutzi 2007, eqs. 3.14-3.17): cell walls break as pores close.

    D_c = 1 - (alpha - 1) / (alpha_0 - 1),   D^(1/3) = min(D_tension^(1/3) + D_c^(1/3), 1)

The second is the integral of the sum of rates, eq. 3.17, from D = 0: the rate of D_c^(1/3) itself (eq. 3.16) is
infinite at alpha = alpha_0, so that codes which integrate it need a cut-off. alpha is the resting distention, so
elastic changes break nothing; alpha_0 is that at the start of the impact: what the weight of the body has closed
before counts as intact. alpha_0 = 1 gives D_c = 0.
"""

from matter.compilation.jit import law

SOURCES = ("BenzJutzi2007",)


@law
def root(alpha, alpha0):
    """D_c^(1/3) at the distention ``alpha`` of a material that started at ``alpha0``."""
    if alpha0 <= 1.0 or alpha >= alpha0:
        return 0.0
    return min(1.0 - (alpha - 1.0) / (alpha0 - 1.0), 1.0) ** (1.0 / 3.0)


@law
def total(root_tension, root_compaction):
    """D^(1/3) of both together."""
    return min(root_tension + root_compaction, 1.0)
