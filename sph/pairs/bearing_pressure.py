"""The pressure that friction goes by: the mean over the neighbours, of the evaluation before.

    P_b,i = eta_i^2 sum_j q_j P_j / eta_j^2 / sum_j q_j,    q_j = -V0_j (r_ij . grad_i W) (eta_j / rho_0j)^2

V0, eta and rho_0 of ``sph.pairs.start_volumes``; where present volumes V weigh the sums, eta = 1 and q_j = -V_j r_ij
. grad_i W.

The pressures of disordered particles scatter by as much as their mean, and a third of them bears nothing. Friction by
each particle's own pressure yields where that happens to be low: shear goes to the weak ones, and dry sand creeps on
slopes below its angle, the more the finer it is resolved (``fixtures.slopes``: 28 layers two degrees below it gained a
tenth of free sliding, and three times what is right two degrees above). The mean is smooth. It lags one step, while a
wave takes several to cross a particle. P_j is what acts in the sums of force, with the factors that it has there, so
that the mean is what bears a weight; expanded neighbours count little.

At a free surface all neighbours lie beneath: the uppermost particles rub as if two thirds of a spacing deeper. What
has expanded to less than ``TOUCHING`` of its density at rest rubs by its own pressure, that is not at all in cold
matter: grains of the loosest packing (0.55 for 0.6 of the volume) no longer touch.
"""

from matter.compilation.jit import law

UNKNOWN = 1e300
"""[Pa] of a particle without neighbours and before the first sum: friction goes by its own pressure."""
TOUCHING = 0.9
"""Least density, over that at rest, at which a particle rubs on its neighbours."""


@law
def mean(total, weight, eta):
    """P_b [Pa] of the sums of q_j P_j / eta_j^2 (``total``) and q_j (``weight``); ``UNKNOWN`` without neighbours."""
    return eta * eta * total / weight if weight > 0.0 else UNKNOWN


@law
def of_friction(mean, own, density):
    """The pressure [Pa] that friction goes by; ``own``: the particle's; ``density`` over that at rest."""
    return mean if mean < UNKNOWN and density > TOUCHING else own
