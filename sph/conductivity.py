"""Artificial conductivity: heat flows between partners that the artificial viscosity heats, so that matter does not
keep what a shock's first step left in one layer ("wall heating": Noh 1987).

    du_i += k sum_j m_j (2 / (rho_i + rho_j)) w (u_j - u_i) |dW/dr|
    w = b^2 sqrt(q),   q = -alpha c mu + beta mu^2,   b = min(s, 0) / min(v.x, 0)

q is the pressure over the density that the viscosity holds up (``sph.viscosity``), so that sqrt(q) is the signal speed
of Price (2008) with the viscosity's own pressure for the jump in pressure (which would let heat creep through any body
at rest under its own weight); b is what the smooth flow leaves of a pair's approach
(``sph.viscosity_reconstructed``): 1 in a shock's front, a tenth or less in the flow of a crater, where next to
nothing is left of the exchange. What one partner loses the other gains, heat flows from hot to cold, and none flows
where viscosity does nothing: a contact that is carried along keeps its width. Between particles of one material only:
the specific energy of another says nothing of its temperature.

What single particles at first contact overshoot is this heat too: of an ice ball on ice at 18.2 km/s, planar limit 111
GPa, the largest pressures are 169 (target) and 222 GPa (ball) without, 123 and 153 with k = 2.
"""

import math

from matter.jit import fast_min, law

SOURCES = ("Noh1987", "Price2008")
TINY = 1e-200


@law
def exchange(closing, vx, mu, c, alpha, beta):
    """w [m/s] from ``closing`` = s and v.x [m^2/s], mu (of s) and the mean sound speed [m/s]; 0 for parting pairs."""
    share = fast_min(closing, 0.0) / (fast_min(vx, 0.0) - TINY)
    return share * share * math.sqrt(mu * (beta * mu - alpha * c))
