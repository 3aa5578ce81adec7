"""Tabulated equation of state: u, P and s at nodes of density and temperature, read from a file in the SESAME-like
format of SWIFT and WoMa (``matter.formats.sesame``).

At start the table is put in the form that a particle asks in, (rho, u). Along each isotherm j, u, q = P / rho, s and
r = dq/du at constant density are cubics in x = ln rho, whose slopes at the nodes are limited so that they do not swing
(Hyman 1983); at the density of a particle its energy lies between those of two isotherms,

    f = (u - u_j) / (u_(j+1) - u_j),   d = r_j (u_(j+1) - u_j),   e = r_(j+1) (u_(j+1) - u_j),   w = q_(j+1) - q_j
    P / rho = q_j + w [w f^2 + d f (1 - f)] / [w + (d + e - 2 w) f (1 - f)],      T = T_j + f (T_(j+1) - T_j),
    s = s_j + (s_(j+1) - s_j) ln(T / T_j) / ln(T_(j+1) / T_j)

P rises or falls steadily in a step, and as steeply as along a vapour curve (Gregory & Delbourgo 1982). The formulas
are exact for an ideal gas and for a Mie-Grueneisen solid of constant c_v, but for the cubics. Bilinear in logarithms,
as other codes do it, needs P > 0 and mixes cold with hot matter between two densities. Derivatives are those of these
formulas and continuous, so c^2 = dP/drho|u + (P / rho^2) dP/du|rho belongs to this P; the sound speeds of the file
only serve to find wrong units. A bend where a phase boundary cuts a cell is rounded off inside it, and only there
(``sph.eos.table_slopes``).

Held against M-ANEOS itself in the middle of all 38,640 cells of the quartz that ships: in one phase (30,515) P and s
within 1 % and c within 3 %, but for 7; along the vapour curve and in the transition to stishovite (7,059) P within 1 %
above 1 bar, 4 % below, c off by more than 3 % in 631, by at most 6 m/s; 1,066 (2.8 %) are cut, where nothing is
promised. (M-ANEOS itself goes straight between its own temperatures along the vapour curve.)

Zero of energy: u = 0 is the table's energy at rho0 and ``temperature``, so that matter at rest has u = 0 as with every
other law; the table's pressure there has to be small (a gas apart, whose P is of the order of rho c^2).

Off the table: below its coldest isotherm matter is as at that isotherm; above its hottest, P and T rise on with u at
the last rate; above its highest density q, u and s go on straight in ln rho; below its lowest they are those of an
ideal gas (q and u of the first node). Where phases coexist, the table's own states hold (a mixture in balance if the
table was made so); c there is that of the mixture, never below the floor of ``sph.stepping.state``. Tension is what
the table holds, cut at what the material bears like that of every law; a table without tension has none.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from matter.case.identity_fields import Follows
from matter.case.material import TABLES
from matter.case.quantity import PositiveDensity, PositiveTemperature
from matter.compilation.jit import law
from matter.errors import InputError
from matter.formats import sesame
from sph.eos import densest, table_slopes

SOURCES = ("Hyman1983", "GregoryDelbourgo1982", "DelbourgoGregory1985")
Row = None
RHO0, MODULUS, ZERO, DENSITIES, TEMPERATURES = range(5)
X_FIRST, X_RATE, X_BINS = range(5, 8)
HEAT_LEAST, HEAT_FIRST, HEAT_RATE, HEAT_BINS = range(8, 12)
"""The head of a row: rho0, bulk modulus, energy of the zero, numbers of densities and of temperatures; of the index of
the densities the first ln rho, bins in each unit of ln rho and in all; of that of the energies the least heat, its
logarithm, bins in each unit of ln heat and in all."""
HEAD = 12
WIDTH = HEAD
"""Least numbers of a row: the head, before the table's own."""
U, SLOPE_U, Q, SLOPE_Q, RISE, SLOPE_RISE, S, SLOPE_S, FIELDS = range(9)
REST = 2e-3
"""Largest pressure at rest, as a fraction of the bulk modulus."""
GAS = 0.2
"""From this fraction on it is a gas."""
BINS = 2
"""Places of the index of energies for each isotherm."""


class Parameters(NamedTuple):
    """rho0 [kg/m^3] at rest, ``file`` the table (from a case: relative to it), ``temperature`` at rest [K], that of
    ``[thermal]``."""

    rho0: PositiveDensity
    file: Annotated[str, Field(min_length=1)]
    temperature: Annotated[PositiveTemperature, Follows()] = 298.0


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
    if not (table.rho[0] < p.rho0 < table.rho[-1] and table.T[0] <= p.temperature <= table.T[-1]):
        raise InputError(
            f"{p.file} holds {table.rho[0]:.4g} to {table.rho[-1]:.4g} kg/m^3 and {table.T[0]:.4g} to "
            f"{table.T[-1]:.4g} K; matter at rest ({p.rho0:g} kg/m^3, {p.temperature:g} K) lies outside"
        )
    x, (n, k) = np.log(table.rho), table.u.shape
    u, q = table_slopes.rising(table.u), table.P / table.rho[:, None]
    across, up = table_slopes.cut_sides(x, table.u, table.P)
    nodes = np.empty((n, k, FIELDS))
    for at, value in ((U, u), (Q, q), (RISE, table_slopes.along_energy(u, q, up)), (S, table.s)):
        nodes[:, :, at], nodes[:, :, at + 1] = value, table_slopes.along_density(x, value, across)
    bins = min(math.ceil((x[-1] - x[0]) / np.diff(x).min()), 16 * n)
    rate = bins / (x[-1] - x[0])
    index = np.clip(np.searchsorted(x, x[0] + np.arange(bins) / rate, side="right") - 1, 0, n - 2)
    heat, energies = _energy_index(u)
    head = [p.rho0, 0.0, 0.0, n, k, x[0], rate, bins, *heat]
    numbers = np.concatenate([head, index, x, table.T, u[:, 0], energies.ravel(), nodes.ravel()])
    numbers[ZERO] = _energy_at(p.rho0, p.temperature, numbers)
    P, d_rho, d_u = pressure_and_derivatives(p.rho0, 0.0, numbers)
    K = p.rho0 * (d_rho + P / p.rho0**2 * d_u)
    if K <= 0.0:
        raise InputError(f"{p.file}: matter at {p.rho0:g} kg/m^3 and {p.temperature:g} K has no stiffness, a mixture")
    if abs(P) < GAS * K:
        numbers[MODULUS] = K
        if abs(P) > REST * K:
            raise InputError(
                f"{p.file}: at {p.temperature:g} K and rho0 = {p.rho0:g} kg/m^3 the pressure is {P / 1e6:.4g} MPa; "
                f"it is at rest near rho0 = {p.rho0 * (1.0 - P / K):.5g} kg/m^3"
            )
    return numbers


def _energy_index(u: np.ndarray) -> tuple[list[float], np.ndarray]:
    """Least heat, its logarithm, bins in each unit of ln heat and in all; and for each cell of density (n - 1) and
    bin the last isotherm at or below it. Heat is u - u_0 above the coldest isotherm, plus the least heat."""
    k = u.shape[1]
    heat = u - u[:, :1]
    least = float(np.median(heat[:, 1]))
    bins = BINS * k
    first, last = math.log(least), math.log(heat.max() + least)
    rate = bins / (last - first)
    edges = np.exp(first + np.arange(bins) / rate) - least
    isotherm = np.array([np.searchsorted(one, edges, side="right") - 1 for one in heat])
    both = np.clip(np.minimum(isotherm[:-1], isotherm[1:]), 0, k - 2)
    return [least, first, rate, bins], both.astype(float)


def fault(p: Parameters) -> str:
    """What is wrong with the table or with matter at rest in it, or nothing."""
    try:
        row(p)
    except InputError as reason:
        return str(reason)
    return ""


@law
def modulus(t):
    """Bulk modulus at rest [Pa], rho0 c^2; 0 for a gas."""
    return t[MODULUS]


@law(forceinline=True)
def _cell(x, t):
    """The last density node at or below ``x`` = ln rho, and the weights of the cubic: of the values and slopes at both
    ends, in the value and in its slope."""
    n, bins = int(t[DENSITIES]), int(t[X_BINS])
    first = HEAD + bins
    i = int(t[HEAD + min(max(int((x - t[X_FIRST]) * t[X_RATE]), 0), bins - 1)])
    i += int(i < n - 2 and t[first + i + 1] <= x)
    while i < n - 2 and t[first + i + 1] <= x:  # nodes closer than a bin
        i += 1
    low, high = t[first + i], t[first + i + 1]
    h = high - low
    w = min(max((x - low) / h, 0.0), 1.0)
    v, inside = 1.0 - w, 1.0 if x >= low else 0.0
    return (
        i,
        (v * v * (1.0 + 2.0 * w), h * w * v * v, w * w * (3.0 - 2.0 * w), max(x - high, 0.0) - h * w * w * v),
        (-6.0 * w * v / h, inside * v * (1.0 - 3.0 * w), 6.0 * w * v / h, w * (3.0 * w - 2.0)),
    )


@law(forceinline=True)
def _cubic(at, across, a, t):
    """A cubic whose value stands at ``at`` in the row and, at the next density, ``across`` further on."""
    low, low_slope, high, high_slope = a
    return low * t[at] + low_slope * t[at + 1] + high * t[at + across] + high_slope * t[at + across + 1]


@law(forceinline=True)
def _slope(at, across, d, t):
    """The slope in x of ``_cubic`` of the same position, of the weights ``d``."""
    low, low_slope, high, high_slope = d
    return low * t[at] + low_slope * t[at + 1] + high * t[at + across] + high_slope * t[at + across + 1]


@law(forceinline=True)
def _isotherm(i, u, a, t):
    """Number of the last isotherm but one whose energy is at or below ``u``, where its node stands in the row, its
    energy, and how much that of the next is above it."""
    n, k, bins = int(t[DENSITIES]), int(t[TEMPERATURES]), int(t[HEAT_BINS])
    across = k * FIELDS
    cold = HEAD + int(t[X_BINS]) + n + k
    index = cold + n
    nodes = index + (n - 1) * bins + i * across
    heat = max(u - t[cold + i] - a[2] * (t[cold + i + 1] - t[cold + i]), 0.0) + t[HEAT_LEAST]
    j = int(t[index + i * bins + min(max(int((math.log(heat) - t[HEAT_FIRST]) * t[HEAT_RATE]), 0), bins - 1)])
    at = nodes + j * FIELDS
    below, above = _cubic(at, across, a, t), _cubic(at + FIELDS, across, a, t)
    while j < k - 2 and above <= u:
        j += 1
        at += FIELDS
        below, above = above, _cubic(at + FIELDS, across, a, t)
    while j > 0 and below > u:
        j -= 1
        at -= FIELDS
        below, above = _cubic(at, across, a, t), below
    return j, at, below, max(above - below, 1e-6)


@law
def pressure_and_derivatives(rho, u, t):
    """P [Pa], dP/drho at constant u, dP/du at constant rho; ``t`` as ``row`` makes it."""
    i, a, d = _cell(math.log(rho), t)
    u += t[ZERO]
    _j, at, below, gap = _isotherm(i, u, a, t)
    across = int(t[TEMPERATURES]) * FIELDS
    q, q_x = _cubic(at + Q, across, a, t), _slope(at + Q, across, d, t)
    f = (u - below) / gap
    if f <= 0.0:
        return rho * q, q + q_x, 0.0
    above = at + FIELDS
    u_x, high_x = _slope(at, across, d, t), _slope(above, across, d, t)
    high, high_q_x = _cubic(above + Q, across, a, t), _slope(above + Q, across, d, t)
    last, last_x = _cubic(above + RISE, across, a, t), _slope(above + RISE, across, d, t)
    if f >= 1.0:  # hotter than the table
        beyond = u - below - gap
        return (
            rho * (high + last * beyond),
            high + last * beyond + high_q_x + last_x * beyond - last * high_x,
            rho * last,
        )
    gap_x = high_x - u_x
    f_x = -(u_x + f * gap_x) / gap
    first, first_x = _cubic(at + RISE, across, a, t), _slope(at + RISE, across, d, t)
    rise, rise_x = high - q, high_q_x - q_x
    # slopes at both ends over a step of f; neither may go against the rise
    if first * rise <= 0.0:
        first, first_x = 0.0, 0.0
    if last * rise <= 0.0:
        last, last_x = 0.0, 0.0
    first_x, last_x = first_x * gap + first * gap_x, last_x * gap + last * gap_x
    first, last = first * gap, last * gap
    g = f * (1.0 - f)
    part, whole = rise * f * f + first * g, rise * (1.0 - 2.0 * g) + (first + last) * g
    if whole == 0.0:
        return rho * q, q + q_x, 0.0
    fraction, over = part / whole, rise / whole
    q_f = over * over * (last * f * f + 2.0 * rise * g + first * (1.0 - f) * (1.0 - f))
    slope = (
        q_x
        + (fraction + over * (f * f - fraction * (1.0 - 2.0 * g))) * rise_x
        + over * g * ((1.0 - fraction) * first_x - fraction * last_x)
        + q_f * f_x
    )
    q += rise * fraction
    return rho * q, q + slope, rho * q_f / gap


@law
def temperature(rho, u, t):
    """T [K]."""
    i, a, _d = _cell(math.log(rho), t)
    u += t[ZERO]
    j, _at, below, gap = _isotherm(i, u, a, t)
    first = HEAD + int(t[X_BINS]) + int(t[DENSITIES]) + j
    return t[first] + max(u - below, 0.0) / gap * (t[first + 1] - t[first])


@law
def entropy(rho, u, t):
    """s [J/(kg K)], on the table's own zero."""
    x = math.log(rho)
    i, a, _d = _cell(x, t)
    u += t[ZERO]
    j, at, below, gap = _isotherm(i, u, a, t)
    f = max(u - below, 0.0) / gap
    across = int(t[TEMPERATURES]) * FIELDS
    first = HEAD + int(t[X_BINS]) + int(t[DENSITIES]) + j
    cold, hot = t[first], t[first + 1]
    fraction = math.log1p(f * (hot / cold - 1.0)) / math.log(hot / cold)
    s = (1.0 - fraction) * _cubic(at + S, across, a, t) + fraction * _cubic(at + FIELDS + S, across, a, t)
    deficit = min(x - t[X_FIRST], 0.0)  # an ideal gas goes on straight
    return s + deficit * ((1.0 - fraction) * t[at + SLOPE_S] + fraction * t[at + FIELDS + SLOPE_S])


def _energy_at(rho: float, T: float, t: np.ndarray) -> float:
    """The table's own u [J/kg] at ``rho`` and ``T``."""
    i, a, _d = _cell(math.log(rho), t)
    n, k = int(t[DENSITIES]), int(t[TEMPERATURES])
    first, across = HEAD + int(t[X_BINS]) + n, k * FIELDS
    nodes = first + k + n + (n - 1) * int(t[HEAT_BINS]) + i * across
    energies = [_cubic(nodes + j * FIELDS, across, a, t) for j in range(k)]
    return float(np.interp(T, t[first : first + k], energies))


_densest = densest.density_at_pressure(pressure_and_derivatives)


@law
def density(P, u, t):
    """The densest density [kg/m^3] with pressure P [Pa] at u [J/kg]; -1 where none exists."""
    return _densest(P, u, t[RHO0], t)


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
