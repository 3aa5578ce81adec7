"""Temperature of a particle, and how far it is on its way to melting.

A law that knows its temperature (a table) gives it. For any other, with c_v from the material's ``[thermal]``,

    T = T_0 + (u - u_c(rho)) / c_v,      du_c/drho = P(rho, u_c) / rho^2,   u_c(rho_0) = 0

u_c the energy of matter compressed without heat from rest at T_0: integrated once at the start of a run, with the
law's own pressure (Runge and Kutta, fourth order), tabulated with its slopes up to four times the density at rest and
read by cubics (error below 1e-6 of u_c). Stretched matter is charged with no more than it bears before its tension is
cut: below that density u_c stays. A gas (no modulus) has u_c = 0 and T_0 = 0. Latent heats stand in neither u_c nor
c_v: above melting T is that of matter that did not melt, an upper bound, and there is no entropy.

Where ``melt_temperature`` is given, heat weakens by temperature instead of energy (``sph.strength.thermal_softening``
with u / u_melt = (T - T_0) / (T_m - T_0)).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from matter.case.quantity import HeatCapacity, PositiveTemperature
from matter.compilation.jit import law, parallel_kernel, prange
from sph.eos import dispatch as eos

HOW, BASE, CAPACITY, SPAN, FIRST, RATE, HEAD = range(7)
"""Columns of a row: 0 (no temperature), ``COLD`` or ``OWN``; T_0 [K], c_v [J/(kg K)], T_m - T_0 [K] (0: melting is not
by temperature), first density [kg/m^3] of the cold curve and its nodes a kg/m^3; then u_c and its slope by node."""
COLD, OWN = 1, 2
NODES = 400
MOST = 4.0
"""Highest density of the cold curve, in densities at rest; beyond it goes straight on."""
WIDTH = HEAD + 2 * NODES


class Parameters(NamedTuple):
    """heat_capacity c_v [J/(kg K)] (not needed with a table), temperature T_0 [K] of matter at rest with u = 0,
    melt_temperature T_m [K] at which strength is gone (default: strength does not go by temperature)."""

    heat_capacity: Annotated[HeatCapacity, Field(ge=0)] = 0.0
    temperature: PositiveTemperature = 298.0
    melt_temperature: PositiveTemperature = math.inf


def fault(p: Parameters) -> str:
    """What is wrong with the values together, or nothing."""
    return "" if p.melt_temperature > p.temperature else "melt_temperature must be above temperature"


def knows(kind: int, function: str = "temperature") -> bool:
    """Whether the law of a number has the function itself."""
    return hasattr(eos.FAMILY.module(kind), function)


def row(p: Parameters, kind: int, eos_row: np.ndarray, rho0: float, cut: float) -> np.ndarray:
    """The numbers of a material that compiled loops read; ``cut`` the tension that it bears [Pa]."""
    numbers = np.zeros(WIDTH)
    numbers[SPAN] = p.melt_temperature - p.temperature if p.melt_temperature < math.inf else 0.0
    numbers[HOW], numbers[BASE], numbers[CAPACITY] = OWN if knows(kind) else COLD, p.temperature, p.heat_capacity
    if not knows(kind):
        if eos.modulus(kind, eos_row) > 0.0:
            rho, u, slope = _cold_curve(lambda r, e: eos.pressure_and_derivatives(kind, eos_row, r, e)[0], rho0, cut)
            numbers[HEAD::2], numbers[HEAD + 1 :: 2] = u, slope
            numbers[FIRST], numbers[RATE] = rho[0], (NODES - 1) / (rho[-1] - rho[0])
        else:
            numbers[BASE], numbers[FIRST], numbers[RATE] = 0.0, rho0, 1.0
    return numbers


def _cold_curve(
    pressure: Callable[[float, float], float], rho0: float, cut: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Densities, u_c and its slope at the nodes."""
    low, u = rho0, 0.0
    while low > 0.8 * rho0 and pressure(low, u) > -cut:
        low, u = low - 1e-3 * rho0, _stepped(pressure, low, u, -1e-3 * rho0)
    rho = np.linspace(low, MOST * rho0, NODES)
    energies = [u]
    for one, step in zip(rho, np.diff(rho)):
        for part in range(4):
            u = _stepped(pressure, one + 0.25 * part * step, u, 0.25 * step)
        energies.append(u)
    slopes = [pressure(r, e) / r**2 for r, e in zip(rho, energies)]
    return rho, np.array(energies), np.array(slopes)


def _stepped(pressure: Callable[[float, float], float], rho: float, u: float, step: float) -> float:
    """u_c a step of density on."""

    def slope(r: float, e: float) -> float:
        return pressure(r, e) / r**2

    a = slope(rho, u)
    b = slope(rho + 0.5 * step, u + 0.5 * step * a)
    c = slope(rho + 0.5 * step, u + 0.5 * step * b)
    d = slope(rho + step, u + step * c)
    return u + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)


@law
def cold_energy(rho, t):
    """u_c [J/kg] at density rho [kg/m^3]; ``t`` as ``row`` makes it."""
    coordinate = max((rho - t[FIRST]) * t[RATE], 0.0)
    i = min(int(coordinate), NODES - 2)
    w, h, at = min(coordinate - i, 1.0), 1.0 / t[RATE], HEAD + 2 * i
    v = 1.0 - w
    u = v * v * (1.0 + 2.0 * w) * t[at] + w * w * (3.0 - 2.0 * w) * t[at + 2]
    u += h * w * v * (v * t[at + 1] - w * t[at + 3])
    return u + max(coordinate - (NODES - 1), 0.0) * h * t[at + 3]


@law
def temperature(kind, eos_row, t, rho, u):
    """T [K] at the density [kg/m^3] of the solid and u [J/kg]; 0 where nothing is known."""
    if t[HOW] == OWN:
        return eos.temperature(kind, eos_row, rho, u)
    if t[HOW] == COLD:
        return t[BASE] + (u - cold_energy(rho, t)) / t[CAPACITY]
    return 0.0


@law
def melting(kind, eos_row, t, rho, u):
    """(T - T_0) / (T_m - T_0)."""
    return (temperature(kind, eos_row, t, rho, u) - t[BASE]) / t[SPAN]


@parallel_kernel
def _fill(material, rows, rho, u, T, s):
    """Temperature and entropy of every particle."""
    for i in prange(len(u)):
        m = material[i]
        T[i] = temperature(rows.eos[m], rows.eos_row[m], rows.thermal[m], rho[i], u[i])
        s[i] = eos.entropy(rows.eos[m], rows.eos_row[m], rho[i], u[i])


def fields(material, rows, density, u) -> dict[str, np.ndarray]:
    """``temperature`` (n,) [K] and ``entropy`` (n,) [J/(kg K)] where a material of the run knows them, 0 for particles
    of those that do not; ``density`` (n,) of the solid [kg/m^3]."""
    known = rows.thermal[:, HOW] > 0
    if not known.any():
        return {}
    T, s = np.zeros(len(u)), np.zeros(len(u))
    _fill(material, rows, density, u, T, s)
    return {"temperature": T, **({"entropy": s} if any(knows(kind, "entropy") for kind in rows.eos) else {})}
