"""Central gravity for engines that take forces as formulas of x, y, z: one polynomial instead of the table of
``dem.contact.gravity``.

    a = -q(s) x,   s = |x|^2,   q = g(r) / r = sum_k c_k u^k  with u = (s - s_m) / s_w  between two radii,
    G M s^(-3/2) above the upper one

The polynomial is fitted to the table between the core and the surface; ``error`` is its largest relative error there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dem.contact.gravity import Field

DEGREES = range(3, 10)
ENOUGH = 5e-4
"""Relative error of g below which no higher degree is tried."""


@dataclass(frozen=True)
class Polynomial:
    """``coefficients`` c_k [1/s^2] from k = 0; ``middle``, ``half_width`` [m^2]; ``upper`` radius [m]; ``gm``
    [m^3/s^2]; ``error`` of g, relative."""

    coefficients: np.ndarray
    middle: float
    half_width: float
    upper: float
    gm: float
    error: float

    @staticmethod
    def fit(field: Field, lower: float) -> Polynomial:
        """The lowest degree whose error is below ``ENOUGH``, else the highest, for radii from ``lower`` [m] to the
        field's own."""
        upper = field.radius
        r = np.linspace(lower, upper, 4001)
        s, g = r * r, field.strength(r)
        middle, width = 0.5 * (lower**2 + upper**2), 0.5 * (upper**2 - lower**2)
        fits = []
        for degree in DEGREES:
            fitted = np.polynomial.Chebyshev.fit((s - middle) / width, g / r, degree, domain=[-1.0, 1.0])
            coefficients = np.polynomial.chebyshev.cheb2poly(fitted.coef)
            error = float(
                np.max(np.abs(np.polynomial.polynomial.polyval((s - middle) / width, coefficients) * r / g - 1.0))
            )
            fits.append(
                Polynomial(coefficients, float(middle), float(width), float(upper), float(g[-1] * upper**2), error)
            )
            if error < ENOUGH:
                break
        return min(fits, key=lambda one: one.error)

    def formula(self, squared: str) -> str:
        """q as text in the variable syntax that both engines share; ``squared`` names a variable that holds r^2."""
        u = f"(({squared}-{self.middle:.17g})*{1.0 / self.half_width:.17g})"
        horner = f"{self.coefficients[-1]:.17g}"
        for c in self.coefficients[-2::-1]:
            horner = f"({horner}*{u}{c:+.17g})"
        edge = f"{self.upper**2:.17g}"
        return f"({squared}<={edge})*{horner}+({squared}>{edge})*{self.gm:.17g}*{squared}^(-1.5)"
