"""Damage growth by one crack (Benz & Jutzi 2007, eq. 2.13; Benz & Asphaug 1994).

    d(D^(1/3))/dt = c_g / R_s     from the first active flaw on, up to D = 1

R_s is the radius of the sphere of the particle's volume.
"""

from matter.compilation.jit import law

SOURCES = ("BenzJutzi2007", "BenzAsphaug1994")


@law
def rate(active, total, crack_speed, radius, support):
    """d(D^(1/3))/dt [1/s]; c_g [m/s], R_s [m]."""
    return crack_speed / radius if active > 0.0 else 0.0


@law
def cap(active, total):
    """1 as soon as a flaw is active."""
    return 1.0 if active > 0.0 else 0.0
