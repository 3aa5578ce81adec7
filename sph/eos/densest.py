"""The densest density at which matter has a pressure, for laws whose P(rho, u) has no inverse in closed form.

From rho0 in steps of 2 %, up where the pressure there is below P and down where it is above, to the first step that
P lies in, and 60 bisections of it. Down from rho0 that is the condensed branch: a pressure that rises again at lower
densities is not found.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from matter.compilation.jit import law

STEP = 1.02
DENSEST, THINNEST = 1e4, 1e-9
"""How far it goes, in rho0."""


def density_at_pressure(pressure: Callable[..., Any]) -> Callable[..., float]:
    """The compiled ``density(P, u, rho0, p)`` [kg/m^3] of a law's ``pressure(rho, u, p)``, whose first value is P
    [Pa]; -1 where no density has that pressure."""

    @law
    def density(P, u, rho0, p):
        low = high = rho0
        if pressure(rho0, u, p)[0] < P:
            while pressure(high, u, p)[0] < P:
                low, high = high, STEP * high
                if high > DENSEST * rho0:
                    return -1.0
        else:
            while pressure(low, u, p)[0] > P:
                low, high = (2.0 - STEP) * low, low
                if low < THINNEST * rho0:
                    return -1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            if pressure(middle, u, p)[0] > P:
                high = middle
            else:
                low = middle
        return 0.5 * (low + high)

    return density
