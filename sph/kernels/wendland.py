"""Wendland C2 kernel in three dimensions with support radius h (Wendland 1995; Dehnen & Aly 2012, table 1).

    W(r, h) = 21 / (2 pi h^3) (1 - q)^4 (1 + 4 q),   q = r / h < 1

Its Fourier transform is positive, so that particles do not pair up however many neighbours they have; it wants more of
them than the cubic spline.
"""

import math

from matter.compilation.jit import law

SOURCES = ("Wendland1995", "DehnenAly2012")


@law
def kernel(r, h):
    """W [1/m^3] at distance r [m] for the support radius h [m]."""
    if r >= h:
        return 0.0
    hinv = 1.0 / h
    q = r * hinv
    return 21.0 / (2.0 * math.pi) * hinv * hinv * hinv * (1.0 - q) ** 4 * (1.0 + 4.0 * q)


@law
def gradient_factor(r, h):
    """(1/r) dW/dr [1/m^5]: the gradient is this times the separation vector. Finite at r = 0, zero beyond the
    support."""
    hinv = 1.0 / h
    rest = max(1.0 - r * hinv, 0.0)
    return -210.0 / math.pi * hinv * hinv * hinv * hinv * hinv * rest * rest * rest
