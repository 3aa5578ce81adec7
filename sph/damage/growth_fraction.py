"""Damage growth by the active fraction of the flaws, as in Spheral (its scalar form of Benz & Asphaug 1994).

    d(D^(1/3))/dt = (n_act / n) c_g / R_s,   D^(1/3) <= (n_act / n)^(1/3)

R_s is the radius of the sphere of the particle's volume.
"""

from matter.compilation.jit import law

SOURCES = ("BenzAsphaug1994",)


@law
def rate(active, total, crack_speed, radius, support):
    """d(D^(1/3))/dt [1/s] with ``active`` of ``total`` flaws, c_g [m/s], R_s [m]."""
    return active / total * crack_speed / radius


@law
def cap(active, total):
    """The largest D^(1/3) that the active flaws can bring."""
    return (active / total) ** (1.0 / 3.0)
