"""Artificial conductivity: heat flows between partners that a strong shock brings together, so that matter does not
keep what the shock's first step left in one layer ("wall heating": Noh 1987).

    du_i += k sum_j m_j (2 / (rho_i + rho_j)) w (u_j - u_i) |dW/dr|
    w = |mu| mu^2 / (mu^2 + (m0 c)^2),   m0 = 0.3

mu is the approach that the artificial viscosity sees (``sph.viscosity``, of what the smooth flow leaves:
``sph.viscosity.reconstructed``). Where pairs meet at the speed of sound and beyond, w is that speed, the signal speed
of the exchange; below, it falls with the cube, so that bodies keep their layers of heat: the flow of a crater, sound,
and the unrest of a turning ball carry nothing. (Price 2008 takes the root of the jump in pressure, which would let
heat creep through any body under its own weight; with the root of the viscosity's own pressure a spinning ball lost
0.6 of its core's heat in a turn.) What one partner loses the other gains, and heat flows from hot to cold. Between
particles of one material only: the specific energy of another says nothing of its temperature.

What single particles at first contact overshoot is in part this heat: of an ice ball on ice at 18.2 km/s, planar limit
111 GPa, the largest pressures are 125 (target) and 130 GPa (ball) without, 109 and 118 with k = 8. Weak shocks keep
the heat of their first layer: nothing is overshot there that matters.
"""

from matter.compilation.jit import law
from sph.viscosity.reconstructed import MACH

SOURCES = ("Noh1987", "Price2008")
TINY = 1e-200


@law
def exchange(mu, c):
    """w [m/s] from mu <= 0 and the mean sound speed c [m/s]; 0 for parting pairs."""
    slow = MACH * c
    return -mu * mu * mu / (mu * mu + slow * slow + TINY)
