"""Damage growth by the volume of independent cracks: the default.

    d(D^(1/3))/dt = n_act^(1/3) c_g / R_s,   D^(1/3) <= (n_act / n)^(1/3)

n cracks that grow from their own flaws break the fraction D = n (c t / R)^3 of the volume (Grady & Kipp 1980 for a
distribution of flaws; the cap of the active fraction as in Benz & Asphaug 1995). R_s is the radius of the sphere of
the particle's volume.
"""

from matter.compilation.jit import law

SOURCES = ("GradyKipp1980", "BenzAsphaug1995")


@law
def rate(active, total, crack_speed, radius, support):
    """d(D^(1/3))/dt [1/s] with ``active`` of ``total`` flaws, c_g [m/s], R_s [m]."""
    return active ** (1.0 / 3.0) * crack_speed / radius


@law
def cap(active, total):
    """The largest D^(1/3) that the active flaws can bring."""
    return (active / total) ** (1.0 / 3.0)
