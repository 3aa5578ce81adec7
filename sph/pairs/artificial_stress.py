"""Artificial stress against clumping in tension (Monaghan 2000; Gray, Monaghan & Swift 2001).

Where the stress along the line of a pair is tensile, a repulsion of a fraction eps of it is added between close
particles,

    a_i = ... - V_j / rho_i  R f^4 grad W,   R = eps max(n.(sigma_i + sigma_j).n, 0),   f = W(r) / W(s),   n = x_ij / r

with s the spacing of a regular arrangement (the support over ``[sph] support``) and W the kernel of the sums. The
sources turn the stress to its principal axes; here the pair's own line is the axis, which is along the line (angular
momentum is kept) and needs nothing that a row does not hold. Its work is heat of both partners by halves: force and
energy stay conjugate.
"""

from matter.compilation.jit import law

SOURCES = ("Monaghan2000", "Gray2001")


@law
def pressure(pull, f, r2, h, strength):
    """R f^4 [Pa] from x.(sigma_i + sigma_j).x = ``pull`` [Pa m^2], f, the squared distance r^2 [m^2], the support
    radius h [m] and eps."""
    f2 = f * f
    return strength * max(pull, 0.0) / (r2 + 1e-12 * h * h) * f2 * f2
