"""Tabulated equation of state: u, P and s at nodes of density and temperature, read from a file in the SESAME-like
format of SWIFT and WoMa (``matter.formats.sesame``).

At start the table is put in the form that a particle asks in, (rho, u). Along each isotherm j, u, q = P / rho and s
are cubics in x = ln rho, whose slopes at the nodes are limited so that they do not swing about a phase boundary
(Hyman 1983); at the density of a particle its energy lies between those of two isotherms,

    f = (u - u_j) / (u_(j+1) - u_j),    P = rho [q_j + f (q_(j+1) - q_j)],    T = T_j + f (T_(j+1) - T_j),
    s = s_j + (s_(j+1) - s_j) ln(T / T_j) / ln(T_(j+1) / T_j)

which is exact for an ideal gas and for a Mie-Grueneisen solid of constant c_v, but for the cubics. Bilinear in
logarithms, as other codes do it, needs P > 0 and mixes cold with hot matter between two densities. Derivatives are
those of these formulas, so c^2 = dP/drho|u + (P / rho^2) dP/du|rho belongs to this P; the sound speeds of the file
only serve to find wrong units.

Zero of energy: u = 0 is the table's energy at rho0 and ``temperature``, so that matter at rest has u = 0 as with every
other law; the table's pressure there has to be small (a gas apart, whose P is of the order of rho c^2).

Off the table: below its coldest isotherm matter is as at that isotherm; above its hottest, P and T rise on with u at
the last rate; above its highest density q, u and s go on straight in ln rho; below its lowest they are those of an
ideal gas (q and u of the first node). Where phases coexist, the table's own states hold (a mixture in balance if the
table was made so); c there is that of the mixture, never below the floor of ``sph.state``. Tension is what the table
holds, cut at what the material bears like that of every law; a table without tension has none.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from matter.errors import InputError
from matter.formats import sesame
from matter.jit import law
from matter.material import TABLES
from matter.quantity import PositiveDensity, PositiveTemperature

SOURCES = ("Hyman1983",)
Row = None
# rho0, modulus, energy of the zero, numbers of densities and temperatures, first ln rho, places of the index in each
# unit of ln rho, and in all
HEAD = 8
WIDTH = HEAD
"""Least numbers of a row: the head, before the table's own."""
JUMPS = True
"""Derivatives jump at the isotherms of the table."""
U, SLOPE_U, Q, SLOPE_Q, S, SLOPE_S, FIELDS = range(7)
REST = 2e-3
"""Largest pressure at rest, as a share of the bulk modulus."""
GAS = 0.2
"""From this share on it is a gas."""


class Parameters(NamedTuple):
    """rho0 [kg/m^3] at rest, ``file`` the table (from a case: relative to it), ``temperature`` at rest [K]."""

    rho0: PositiveDensity
    file: Annotated[str, Field(min_length=1)]
    temperature: PositiveTemperature = 298.0


EXAMPLE = Parameters(2650.0, str(TABLES / "quartz.txt.xz"), 298.0)
"""Quartz of Melosh 2007."""


def row(p: Parameters) -> np.ndarray:
    """What the compiled functions read: the head, an index into the densities, ln rho (n,), T (k,), and per
    node u, q, s with their slopes in ln rho.

    Raises ``InputError`` for a table that cannot be read, or whose matter is not at rest at ``rho0``.
    """
    return _made(p, sesame.read(p.file))


def _made(p: Parameters, table: sesame.Table) -> np.ndarray:
    known = _ROWS.get(p)
    if known is None or known[0] is not table:  # the file has changed
        if len(_ROWS) > 3:
            _ROWS.clear()
        known = _ROWS[p] = (table, _inverted(p, table))
    return known[1]


_ROWS: dict[Parameters, tuple[sesame.Table, np.ndarray]] = {}
"""The last rows made: settings are validated several times before a run."""


def _inverted(p: Parameters, table: sesame.Table) -> np.ndarray:
    x, (n, k) = np.log(table.rho), table.u.shape
    u = np.maximum.accumulate(table.u, axis=1)
    u += np.arange(k) * 1e-12 * np.ptp(u, axis=1)[:, None]  # strictly rising: f divides by the step
    nodes = np.empty((n, k, FIELDS))
    for at, value in ((U, u), (Q, table.P / table.rho[:, None]), (S, table.s)):
        nodes[:, :, at], nodes[:, :, at + 1] = value, slopes(x, value)
    places = 4 * n
    rate = places / (x[-1] - x[0])
    index = np.clip(np.searchsorted(x, x[0] + np.arange(places) / rate, side="right") - 1, 0, n - 2)
    head = [p.rho0, 0.0, 0.0, n, k, x[0], rate, places]
    numbers = np.concatenate([head, index, x, table.T, nodes.ravel()])
    if not (table.rho[0] < p.rho0 < table.rho[-1] and table.T[0] <= p.temperature <= table.T[-1]):
        raise InputError(
            f"{p.file} holds {table.rho[0]:.4g} to {table.rho[-1]:.4g} kg/m^3 and {table.T[0]:.4g} to "
            f"{table.T[-1]:.4g} K; matter at rest ({p.rho0:g} kg/m^3, {p.temperature:g} K) lies outside"
        )
    numbers[2] = _energy_at(p.rho0, p.temperature, numbers)
    P, d_rho, d_u = pressure_and_derivatives(p.rho0, 0.0, numbers)
    K = p.rho0 * (d_rho + P / p.rho0**2 * d_u)
    if K <= 0.0:
        raise InputError(f"{p.file}: matter at {p.rho0:g} kg/m^3 and {p.temperature:g} K has no stiffness, a mixture")
    if abs(P) < GAS * K:
        numbers[1] = K
        if abs(P) > REST * K:
            raise InputError(
                f"{p.file}: at {p.temperature:g} K and rho0 = {p.rho0:g} kg/m^3 the pressure is {P / 1e6:.4g} MPa; "
                f"it is at rest near rho0 = {p.rho0 * (1.0 - P / K):.5g} kg/m^3"
            )
    return numbers


def fault(p: Parameters) -> str:
    """What is wrong with the table or with matter at rest in it, or nothing."""
    try:
        row(p)
    except InputError as reason:
        return str(reason)
    return ""


def slopes(x: np.ndarray, value: np.ndarray) -> np.ndarray:
    """df/dx at the nodes ``x`` (n,) of ``value`` (n, k): of the parabola through three, at most three times the lesser
    of the two steps beside it."""
    h, step = np.diff(x)[:, None], np.diff(value, axis=0) / np.diff(x)[:, None]
    left, right = step[:-1], step[1:]
    middle = (h[1:] * left + h[:-1] * right) / (h[:-1] + h[1:])
    limit = 3.0 * np.minimum(np.abs(left), np.abs(right))
    return np.concatenate([step[:1], np.clip(middle, -limit, limit), step[-1:]])


@law
def modulus(t):
    """Bulk modulus at rest [Pa], rho0 c^2; 0 for a gas."""
    return t[1]


@law
def _cell(x, t):
    """The last density node at or below ``x`` = ln rho, and the weights of the cubic: of the values and slopes at both
    ends, in the value and in its slope."""
    n, places = int(t[3]), int(t[7])
    first = HEAD + places
    i = int(t[HEAD + min(max(int((x - t[5]) * t[6]), 0), places - 1)])
    while i < n - 2 and t[first + i + 1] <= x:
        i += 1
    low, high = t[first + i], t[first + i + 1]
    if x <= low:
        return i, (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)
    if x >= high:
        return i, (0.0, 0.0, 1.0, x - high), (0.0, 0.0, 0.0, 1.0)
    h = high - low
    w = (x - low) / h
    v = 1.0 - w
    return (
        i,
        (v * v * (1.0 + 2.0 * w), h * w * v * v, w * w * (3.0 - 2.0 * w), -h * w * w * v),
        (-6.0 * w * v / h, v * (1.0 - 3.0 * w), 6.0 * w * v / h, w * (3.0 * w - 2.0)),
    )


@law
def _cubic(at, across, a, t):
    """A cubic whose value stands at ``at`` in the row and, at the next density, ``across`` further on."""
    return a[0] * t[at] + a[1] * t[at + 1] + a[2] * t[at + across] + a[3] * t[at + across + 1]


@law
def _isotherm(i, u, a, t):
    """Number of the last isotherm but one whose energy is at or below ``u``, where its node stands in the row, and
    the share of the way to the next one."""
    k = int(t[4])
    across = k * FIELDS
    nodes = HEAD + int(t[7]) + int(t[3]) + k + i * across
    low, high = 0, k - 1
    while high - low > 1:
        middle = (low + high) // 2
        if _cubic(nodes + middle * FIELDS, across, a, t) <= u:
            low = middle
        else:
            high = middle
    at = nodes + low * FIELDS
    below = _cubic(at, across, a, t)
    gap = _cubic(at + FIELDS, across, a, t) - below
    return low, at, (max(u - below, 0.0) / gap if gap > 0.0 else 0.0)


@law
def pressure_and_derivatives(rho, u, t):
    """P [Pa], dP/drho at constant u, dP/du at constant rho; ``t`` as ``row`` makes it."""
    i, a, d = _cell(math.log(rho), t)
    _j, at, f = _isotherm(i, u + t[2], a, t)
    across = int(t[4]) * FIELDS
    q, q_x = _cubic(at + Q, across, a, t), _cubic(at + Q, across, d, t)
    if f <= 0.0:
        return rho * q, q + q_x, 0.0
    above = at + FIELDS
    gap = _cubic(above, across, a, t) - _cubic(at, across, a, t)
    rise = _cubic(above + Q, across, a, t) - q
    u_x = _cubic(at, across, d, t)
    f_x = -(u_x + f * (_cubic(above, across, d, t) - u_x)) / gap
    slope = q_x + f * (_cubic(above + Q, across, d, t) - q_x) + f_x * rise
    q += f * rise
    return rho * q, q + slope, rho * rise / gap


@law
def temperature(rho, u, t):
    """T [K]."""
    i, a, _d = _cell(math.log(rho), t)
    j, _at, f = _isotherm(i, u + t[2], a, t)
    first = HEAD + int(t[7]) + int(t[3]) + j
    return t[first] + f * (t[first + 1] - t[first])


@law
def entropy(rho, u, t):
    """s [J/(kg K)], on the table's own zero."""
    x = math.log(rho)
    i, a, _d = _cell(x, t)
    j, at, f = _isotherm(i, u + t[2], a, t)
    across = int(t[4]) * FIELDS
    first = HEAD + int(t[7]) + int(t[3]) + j
    cold, hot = t[first], t[first + 1]
    share = math.log1p(f * (hot / cold - 1.0)) / math.log(hot / cold)
    s = (1.0 - share) * _cubic(at + S, across, a, t) + share * _cubic(at + FIELDS + S, across, a, t)
    thin = min(x - t[5], 0.0)  # an ideal gas goes on straight
    return s + thin * ((1.0 - share) * t[at + SLOPE_S] + share * t[at + FIELDS + SLOPE_S])


def _energy_at(rho: float, T: float, t: np.ndarray) -> float:
    """The table's own u [J/kg] at ``rho`` and ``T``."""
    i, a, _d = _cell(math.log(rho), t)
    k, across = int(t[4]), int(t[4]) * FIELDS
    first = HEAD + int(t[7]) + int(t[3])
    temperatures = t[first : first + k]
    energies = [_cubic(first + k + i * across + j * FIELDS, across, a, t) for j in range(k)]
    return float(np.interp(T, temperatures, energies))


@law
def density(P, u, t):
    """The densest density [kg/m^3] with pressure P [Pa] at u [J/kg]; -1 where none exists."""
    low, high = t[0], t[0]
    if pressure_and_derivatives(t[0], u, t)[0] < P:
        while pressure_and_derivatives(high, u, t)[0] < P:
            low, high = high, 1.02 * high
            if high > 1e4 * t[0]:
                return -1.0
    else:
        while pressure_and_derivatives(low, u, t)[0] > P:
            low, high = 0.98 * low, low
            if low < 1e-9 * t[0]:
                return -1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if pressure_and_derivatives(middle, u, t)[0] < P:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@law
def energy(rho, P, t):
    """The specific energy u >= 0 [J/kg] with pressure P [Pa] at rho [kg/m^3]; -1 where none exists."""
    low, high = 0.0, 1e6
    if pressure_and_derivatives(rho, low, t)[0] > P:
        return -1.0
    while pressure_and_derivatives(rho, high, t)[0] < P:
        high *= 2.0
        if high > 1e16:
            return -1.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        if pressure_and_derivatives(rho, middle, t)[0] < P:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
