"""Damage growth by the number of active flaws, as in miluphcuda (Schäfer et al. 2016, Astron. Astrophys. 590, A19).

    d(D^(1/3))/dt = n_act c_g / h,   D^(1/3) <= (n_act / n)^(1/3),   c_g = 0.4 sqrt((K + 4/3 mu (1 - D)) / rho)

with the support radius h for the size of the volume, and the crack speed of the damaged material at its present
density.
"""

import math

from matter.compilation.jit import law

SOURCES = ("Schaefer2016",)


@law
def crack_speed(at_rest, bulk, shear, rho, D):
    """c_g [m/s] from the moduli [Pa], density [kg/m^3] and damage; that of the material at rest is not used."""
    return 0.4 * math.sqrt((bulk + 4.0 / 3.0 * shear * (1.0 - D)) / rho)


@law
def rate(active, total, crack_speed, radius, support):
    """d(D^(1/3))/dt [1/s] with ``active`` flaws, c_g [m/s], h [m]."""
    return active * crack_speed / support


@law
def cap(active, total):
    """The largest D^(1/3) that the active flaws can bring."""
    return (active / total) ** (1.0 / 3.0)
