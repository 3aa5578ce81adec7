"""Shock states by solving Rankine-Hugoniot on an equation of state.

A shock that runs at us into material of density rho0, energy u0, pressure P0 and velocity v0 leaves it with the
velocity up:

    rho0 (us - v0) = rho (us - up),   P - P0 = rho0 (us - v0) (up - v0),   u - u0 = (P + P0) (1/rho0 - 1/rho) / 2,
    P = P(rho, u)

Where matter gives way (a transition to a denser phase) a shock may be slower than a weaker one: it splits into that
one, the fastest on the way, and a second one that follows into the matter behind it (Zel'dovich & Raizer 1967,
chapter XI).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from sph.eos import dispatch
from sph.materials.rows import Rows


class State(NamedTuple):
    """Density [kg/m^3], specific energy [J/kg], pressure [Pa], velocity [m/s], and the speed of the shock that made it
    [m/s] (0: none)."""

    rho: float
    u: float
    P: float
    v: float
    shock_speed: float = 0.0


def solid(rows: Rows, m: int) -> tuple[Callable[[float, float], float], State]:
    """P(rho, u) of material ``m`` without its pores, and its state at rest."""
    kind, row = rows.eos[m], rows.eos_row[m]
    return lambda rho, u: dispatch.pressure_and_derivatives(kind, row, rho, u)[0], State(
        float(rows.rho0[m]), 0.0, 0.0, 0.0
    )


def behind(pressure: Callable[[float, float], float], ahead: State, velocity: float) -> State:
    """The state behind a shock that brings material from ``ahead`` to ``velocity`` [m/s] (above that of ``ahead``).

    The fastest shock that obeys the jump conditions. Raises ``ValueError`` when there is none up to a compression of
    1e6.
    """
    jump = velocity - ahead.v
    if jump <= 0.0:
        raise ValueError(f"a shock speeds material up: {velocity} m/s is not above {ahead.v} m/s")

    def state_at(x: float) -> State:  # x = (up - v0) / (us - v0), in (0, 1)
        rho = ahead.rho / (1.0 - x)
        P = ahead.P + ahead.rho * jump * jump / x
        u = ahead.u + 0.5 * (P + ahead.P) * (1.0 / ahead.rho - 1.0 / rho)
        return State(rho, u, P, velocity, ahead.v + jump / x)

    def miss(x: float) -> float:
        state = state_at(x)
        return state.P - pressure(state.rho, state.u)

    grid = np.concatenate(
        [np.geomspace(1e-6, 0.01, 120), np.linspace(0.01, 0.999, 400)[1:], 1.0 - np.geomspace(1e-3, 1e-6, 20)[1:]]
    )
    for low, high in itertools.pairwise(grid.tolist()):
        if miss(low) > 0.0 >= miss(high):
            return state_at(float(brentq(miss, low, high, xtol=1e-15, rtol=1e-14)))
    raise ValueError(f"no shock to {velocity} m/s obeys the jump conditions")


def waves(
    pressure: Callable[[float, float], float], ahead: State, velocity: float, steps: int = 60
) -> tuple[State, ...]:
    """The states behind the one shock, or the two, that bring material from ``ahead`` to ``velocity`` [m/s], the
    faster first; ``steps``: weaker shocks tried. Raises ``ValueError`` as ``behind``."""
    jump = velocity - ahead.v
    tried = [behind(pressure, ahead, ahead.v + fraction * jump) for fraction in np.linspace(0.0, 1.0, steps + 1)[1:]]
    speeds = [state.shock_speed for state in tried]
    k = int(np.argmax(speeds))
    if k >= steps - 1:
        return (tried[-1],)
    bracket = tried[max(k - 1, 0)].v, tried[k + 1].v
    best = minimize_scalar(lambda v: -behind(pressure, ahead, v).shock_speed, bounds=bracket, method="bounded")
    first = behind(pressure, ahead, float(best.x))
    return first, behind(pressure, first, velocity)
