"""What shocked matter is once it has come down to 1 bar along its isentrope, read from a table's own entropies.

On the isobar of 1 bar the entropy rises with the temperature, and jumps at the boiling point T_b:

    boiling begins   s > s_l = s(T_b, liquid)
    vapour           s > s_v = s(T_b, gas);   between them the mass fraction (s - s_l) / (s_v - s_l) is vapour
    melting begins   s > s_m = s(T_m, dense), where the material has a melt_temperature T_m

T_b is where the plateau of an isotherm (liquid and gas in balance) is at 1 bar, ln P linear in 1 / T between two
isotherms; s_l and s_v are read on the nearest isotherms on their side of it, linear in ln T. The mixtures in the
tables that ship, which nothing here reads, say the same by ds/dv = (s_v - s_l) / (v_v - v_l), within 1 %. A table
without a melting curve (both that ship) has no entropy of molten matter: s_m then says that released matter is as hot
as its melting point, not that it has the heat to melt.

``shocks_of``: the pressures at which the table's own Hugoniot from rest reaches these entropies.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from matter.formats import sesame
from sph.eos import table
from sph.shock_states import hugoniot

BAR = 1e5
_PLATEAU = 1e-3
"""Largest change of P between neighbouring densities of a plateau, over P."""
_SLOWEST, _FASTEST = 200.0, 60e3
"""Slowest and fastest piston that is tried [m/s]."""
CRITICAL = ("melting_begins", "boiling_begins", "vapour")


class Boiling(NamedTuple):
    """At 1 bar: T_b [K], entropies [J/(kg K)] and specific volumes [m^3/kg] of liquid and gas."""

    temperature: float
    liquid: float
    gas: float
    liquid_volume: float
    gas_volume: float


class _Dense(NamedTuple):
    """The dense side of the isobar, rising in temperature [K]: entropies [J/(kg K)], volumes [m^3/kg]."""

    T: np.ndarray
    s: np.ndarray
    v: np.ndarray


def _plateau(rho: np.ndarray, P: np.ndarray) -> float:
    """Pressure [Pa] of the plateau of an isotherm; NaN where it has none."""
    flat = (np.abs(np.diff(P)) <= _PLATEAU * np.abs(P[1:])) & (P[1:] > 0.0)
    # the longest run of flat steps
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flat.astype(int), [0]])))
    if not len(edges):
        return float("nan")
    first, last = edges[::2], edges[1::2]
    k = int(np.argmax(last - first))
    return float(P[(first[k] + last[k]) // 2]) if last[k] - first[k] >= 2 else float("nan")


def _at_bar(nodes: sesame.Table, j: int) -> tuple[float, float]:
    """Entropy and volume at 1 bar on isotherm ``j`` of a table, the densest state of that pressure. Of dense matter
    s and ln rho are linear in P between the nodes on both sides; of a gas in ln P through the two nodes below, since
    the next may be a mixture."""
    P, rho = nodes.P[:, j], nodes.rho
    i = int(np.flatnonzero(P < BAR).max())
    gas = P[i + 1] < 10.0 * BAR  # a step of the nodes takes dense matter far beyond
    a, b = (i - 1, i) if gas else (i, i + 1)
    part = np.log(BAR / P[a]) / np.log(P[b] / P[a]) if gas else (BAR - P[a]) / (P[b] - P[a])
    return (
        float(nodes.s[a, j] + part * (nodes.s[b, j] - nodes.s[a, j])),
        float(1.0 / np.exp(np.log(rho[a]) + part * np.log(rho[b] / rho[a]))),
    )


def boiling(nodes: sesame.Table) -> Boiling | None:
    """Where the table's matter boils at 1 bar; None of a table that does not hold it."""
    plateau = np.array([_plateau(nodes.rho, nodes.P[:, j]) for j in range(len(nodes.T))])
    below = np.flatnonzero(plateau < BAR)
    if not len(below) or below[-1] + 2 >= len(nodes.T) or below[-1] < 1:
        return None
    j = int(below[-1])
    if not (BAR <= plateau[j + 1] and nodes.P[0, j + 1] < BAR):
        return None
    one, other = 1.0 / nodes.T[j], 1.0 / nodes.T[j + 1]
    rate = np.log(plateau[j + 1] / plateau[j]) / (other - one)
    T = 1.0 / (one + np.log(BAR / plateau[j]) / rate)
    liquid, gas = ([_at_bar(nodes, k) for k in pair] for pair in ((j - 1, j), (j + 1, j + 2)))
    s_l, v_l = _on(nodes.T[[j - 1, j]], liquid, T)
    s_v, v_v = _on(nodes.T[[j + 1, j + 2]], gas, T)
    return Boiling(float(T), s_l, s_v, v_l, v_v)


def _on(T: np.ndarray, states: list[tuple[float, float]], wanted: float) -> tuple[float, float]:
    """Entropy and volume at ``wanted`` on the line, in ln T, through two states."""
    part = np.log(wanted / T[0]) / np.log(T[1] / T[0])
    s, v = np.array(states).T
    return float(s[0] + part * (s[1] - s[0])), float(v[0] * (v[1] / v[0]) ** part)


def dense(nodes: sesame.Table) -> _Dense:
    """The isobar of 1 bar from the coldest isotherm up to the boiling point, or to the last."""
    known = boiling(nodes)
    top = known.temperature if known else float("inf")
    rows = [j for j in range(len(nodes.T)) if nodes.T[j] < top and nodes.P[0, j] < BAR < nodes.P[-1, j]]
    s, v = np.array([_at_bar(nodes, j) for j in rows]).T
    return _Dense(nodes.T[rows], s, v)


@functools.lru_cache(maxsize=16)
def _of_file(file: str, melting: float, _changed: int) -> dict[str, float]:
    nodes = sesame.read(file)
    found: dict[str, float] = {}
    isobar = dense(nodes)
    if melting < isobar.T[-1]:
        found["melting_temperature_K"] = melting
        found["melting_begins"] = float(np.interp(np.log(melting), np.log(isobar.T), isobar.s))
    if known := boiling(nodes):
        found |= {"boiling_temperature_K": known.temperature, "boiling_begins": known.liquid, "vapour": known.gas}
    return found


def entropies(file: str, melting: float) -> dict[str, float]:
    """Critical entropies [J/(kg K)] of a table (``melting_begins``, ``boiling_begins``, ``vapour``, as far as it holds
    them) with the temperatures [K] at which they are taken; ``melting`` is T_m [K] (inf: none)."""
    return dict(_of_file(str(file), float(melting), Path(file).stat().st_mtime_ns))


@functools.lru_cache(maxsize=16)
def _shocks(p: table.Parameters, names: tuple[str, ...], entropies_: tuple[float, ...]) -> dict[str, float]:
    row = table.row(p)
    rest = hugoniot.State(p.rho0, 0.0, 0.0, 0.0)

    def behind(speed: float) -> hugoniot.State:
        return hugoniot.behind(lambda rho, u: table.pressure_and_derivatives(rho, u, row)[0], rest, speed)

    def beyond(speed: float, s: float) -> float:
        state = behind(speed)
        return table.entropy(state.rho, state.u, row) - s

    return {
        f"shock_{name}_Pa": float(behind(brentq(beyond, _SLOWEST, _FASTEST, args=(s,), rtol=1e-10)).P)
        for name, s in zip(names, entropies_)
        if beyond(_FASTEST, s) > 0.0 > beyond(_SLOWEST, s)
    }


def shocks_of(p: table.Parameters, critical: Mapping[str, float]) -> dict[str, float]:
    """Shock pressures ``shock_..._Pa`` from rest at which the entropy behind one shock is each of the ``critical``
    ones; those that no piston of 0.2 to 60 km/s reaches are left out."""
    names = tuple(name for name in CRITICAL if name in critical)
    return dict(_shocks(p, names, tuple(critical[name] for name in names)))
