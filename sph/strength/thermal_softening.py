"""Thermal softening: strength falls linearly with specific energy and is gone at the melt energy (Benz & Asphaug 1999,
section 2).

    Y(u) = Y max(1 - u / u_melt, 0)

One law for every yield surface of this folder. u below zero softens nothing; an infinite u_melt means none.
"""

from matter.compilation.jit import law

SOURCES = ("BenzAsphaug1999",)


@law
def softening(u, melt_energy):
    """The factor of the yield stress, 1 (cold) to 0 (molten), at specific energy u [J/kg]."""
    return min(max(1.0 - u / melt_energy, 0.0), 1.0)
