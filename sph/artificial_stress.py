"""Artificial stress against clumping in tension (Monaghan 2000; Gray, Monaghan & Swift 2001).

Where the stress along the line of a pair is tensile, a repulsion of a fraction eps of it is added between close particles,

    a_i = ... - V_j / rho_i  R f^4 grad W,   R = eps max(n.(sigma_i + sigma_j).n, 0),   f = W(r) / W(s),   n = x_ij / r

with s = h/2 the spacing of a regular arrangement; f is taken from the cubic spline. The sources turn the stress to its principal axes; here the pair's own line
is the axis, which is along the line (angular momentum is kept) and needs nothing that a row does not hold. Its work is heat of both partners by halves:
force and energy stay conjugate.
"""

from matter.jit import law

SOURCES = ("Monaghan2000", "Gray2001")


@law
def pressure(pull, r, r2, h, strength):
    """R f^4 [Pa] from x.(sigma_i + sigma_j).x = ``pull`` [Pa m^2], distance r [m], r^2, the support radius h [m] and eps."""
    q = r / h
    rest = max(1.0 - q, 0.0)
    # 4 W / W(h/2): W(h/2) is 1/4 of the central value
    f = 4.0 * (1.0 + 6.0 * q * q * (q - 1.0)) if q < 0.5 else 8.0 * rest * rest * rest
    f2 = f * f
    return strength * max(pull, 0.0) / (r2 + 1e-12 * h * h) * f2 * f2
