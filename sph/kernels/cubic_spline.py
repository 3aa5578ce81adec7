"""Cubic spline kernel with support radius h (Monaghan & Lattanzio 1985; Winter 2017, eq. 28).

    W(r, h) = 8 / (pi h^3) * { 6 q^3 - 6 q^2 + 1   for q < 1/2
                             { 2 (1 - q)^3         for 1/2 <= q < 1,    q = r / h

h is the radius at which W vanishes (the "sml" of miluphcuda, twice the h of codes that count half supports).
"""

import math

from matter.compilation.jit import law

SOURCES = ("MonaghanLattanzio1985",)


@law
def kernel(r, h):
    """W [1/m^3] at distance r [m] for the support radius h [m]."""
    if r >= h:
        return 0.0
    hinv = 1.0 / h
    q = r * hinv
    norm = 8.0 / math.pi * hinv * hinv * hinv
    if q < 0.5:
        return norm * (1.0 + 6.0 * q * q * (q - 1.0))
    return norm * 2.0 * (1.0 - q) ** 3


@law
def gradient_factor(r, h):
    """(1/r) dW/dr [1/m^5]: the gradient is this times the separation vector. Finite at r = 0, zero beyond the
    support."""
    hinv = 1.0 / h
    q = r * hinv
    norm = 8.0 / math.pi * hinv * hinv * hinv * hinv * hinv
    inner = 18.0 * q - 12.0
    outside = max(q, 0.5)
    rest = max(1.0 - q, 0.0)
    outer = -6.0 * rest * rest / outside
    return norm * (inner if q < 0.5 else outer)
