"""Artificial viscosity (Monaghan 1992, eqs. 4.1-4.2), with the smoothing scale hbar = h / 2 of a support radius h.

    mu = hbar v.x / (x^2 + 0.01 hbar^2)  for v.x < 0, else 0
    Pi = (-alpha cbar mu + beta mu^2) / rhobar;
        force -m_j Pi grad W, heating w m_j Pi v.grad W, with w of both partners
    together 1 (1/2 in the source; here by volume, see ``sph.pairs.rates``)

Codes differ in what they call h: with the full support instead of hbar the same alpha, beta act twice and four times
as strongly, so that the (1, 2) of miluphcuda is (2, 8) here. With the 33 neighbours of h = 2 spacings, single
projectile particles of an 18 km/s ice impact overshoot the planar limit of 111 GPa to 289 GPa with (1, 2), 209 with
(1.5, 3), 124 with (2, 8) and 114 with (2, 10), what ``numerics = "monaghan"`` takes (heat shared by halves).

Smooth flow sees it too, as a kinematic viscosity of some alpha c hbar / 20 (Meglicki et al. 1993: / 10 in three
dimensions; half of it here, where parting pairs have none). A crater of radius R that grows at v has a Reynolds number
of 20 v R / (alpha c hbar): 5 in a body of 50 km particles. The default, ``sph.viscosity.reconstructed``, leaves a
tenth of it there.
"""

from matter.compilation.jit import law

SOURCES = ("MonaghanGingold1983", "Monaghan1992")


@law
def approach(vx, r2, h):
    """mu [m/s] (negative for approaching pairs, else 0) from v.x [m^2/s], |x|^2 [m^2] and the support radius h [m]."""
    half = 0.5 * h
    return min(vx, 0.0) * half / (r2 + 0.01 * half * half)


@law
def viscous_pressure(mu, c, alpha, beta):
    """Pi rhobar [m^2/s^2] from mu [m/s] and the mean sound speed [m/s]."""
    return mu * (beta * mu - alpha * c)
