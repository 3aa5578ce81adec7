"""Viscosity that shear does not feel (Balsara 1995, J. Comput. Phys. 121, 357).

    f = |div v| / (|div v| + |curl v| + 1e-4 c / hbar),   hbar = h / 2;   a pair takes (f_i + f_j) / 2 of Pi

1 in plain compression, near 0 where matter turns or slides. A strain without rotation (a converging shell, a jet) it
takes for compression wherever div v is not exactly zero: for those ``sph.viscosity.morris_monaghan``.
"""

from matter.compilation.jit import law

SOURCES = ("Balsara1995",)

START = 1.0  # share before anything has moved


@law
def share(before, dt, divergence, curl, c, h):
    """f from div v and |curl v| [1/s], the speed of sound c [m/s] and the support radius h [m]; neither ``before`` nor
    ``dt`` enters."""
    size = abs(divergence)
    return size / (size + curl + 2e-4 * c / h + 1e-300)
