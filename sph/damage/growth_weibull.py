"""Damage growth by a power of strain fitted to the particle's own flaws, as in OpenSPH (after Benz & Asphaug 1994).

    d(D^(1/3))/dt = c_g / h min[(eps / eps_min)^m0, n]^(1/3),   m0 = ln n / ln(eps_max / eps_min),   up to D = 1

for eps > eps_min, the strains at which the weakest and the strongest of the n flaws open; m0 = 1 for a single flaw. h
is the support radius.
"""

import math

from matter.compilation.jit import law

SOURCES = ("BenzAsphaug1994",)


@law
def active(strain, least, most, total):
    """The fitted number of active flaws, 0 below ``least``."""
    if strain <= least:
        return 0.0
    m0 = math.log(total) / math.log(most / least) if total > 1.0 and most > least else 1.0
    return min((strain / least) ** m0, total)


@law
def counted(opened, total, strain, least, most):
    """The fitted number of active flaws instead of those that are ``opened``, and of how many."""
    return active(strain, least, most, float(total)), float(total)


@law
def rate(active, total, crack_speed, radius, support):
    """d(D^(1/3))/dt [1/s] with the fitted number ``active``, c_g [m/s], h [m]."""
    return active ** (1.0 / 3.0) * crack_speed / support


@law
def cap(active, total):
    """1 as soon as a flaw is active."""
    return 1.0 if active > 0.0 else 0.0
