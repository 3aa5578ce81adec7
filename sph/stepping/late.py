"""The late stage with a low sound speed (Raducan & Jutzi 2022): long times at steps of the flow, not of sound.

From the time ``at`` on every material is a linear medium of the sound speed c, in which energy does not count,

    P = c^2 (rho - rho_r),   K' = rho_0 c^2,   mu' = mu K' / K
        (K, mu: moduli at rest; a softer material keeps its own)

Poisson's ratio, strength, friction, flaws and tension cuts stay. rho_r is the particle's own: strains last, whatever
made them, and so

    P' = P_k + (P - P_k) K' / K,   S' = S (b + (1 - b) K' / K)
    P_k = max(P_g, b P),           b = min(1, rho c' |v| / P)      for P > 0, else b = P_k = 0

at the switch. P_g is the part of P that carries weight, that of the body in balance at that depth and at most P:
ground under gravity does not feel the switch. b is what the particle's own motion can hold up, v in the frame of the
run: a flow of speed v stays what it is by pressures of some rho v^2, whatever the modulus, and bears friction by them.
Scaled down they come back over R / c', by compression, and until then it flows without friction. Waves on their way, P
= rho c v, lose what their motion does not hold up in the new medium, 1 - c' / c of their stress, and the new elastic
energy is at most the kinetic one. Material in tension or expanded takes the density at which it had no pressure. u
goes on with the same sums, so that the total energy is kept to rounding across the switch; the difference between the
elastic energies stays in u, and both are reported.

Pores go on closing, under the pressure at which their own law has them give way: P = P_c(alpha), alpha rho_r stays and
rho_r rises (``compact_linear`` of ``sph.porosity``). The wave that closes the pores of loose ground makes a tenth of
the speed of sound; where a switch froze them, the crater of ``first_crater`` lost a quarter of its depth.

Flaws go by Young's modulus at rest, sigma_max / E: what pulls in a slow flow is inertia and weight, and rock takes the
stress that broke it before. By the softer modulus they would open at a strain of some v / c in any flow.

Artificial viscosity acts on a smooth flow with nu = alpha c hbar / 20 (``sph.viscosity``), so that the (2, 10) that a
shock needs eats a flow of metres a second or less, before the switch above all: with c = 3,145 m/s a crater of 0.5 m
that grows at 0.14 m/s has a Reynolds number of 0.003 (``sph.stepping.flow_reynolds``). From ``viscosity_at`` on, by
default with the switch, it is that of ``alpha, beta``. What is left then is slow, of Mach v / c << 1, and holds no
shock: the linear term only has to damp what the particles' disorder excites, for which 0.1 is the least in use (Morris
& Monaghan 1997, J. Comput. Phys. 136, 41, where nothing has been compressed); beta stays: it counts only where
particles close in on each other faster than alpha c / beta.

Particles finer than those of the crater are softer still (``sph.stepping.fine_particles``).

It holds while c exceeds the speeds of the flow and rho c^2 the stresses and weights that matter; results have to be
the same for another ``at``. A crater's flow slows down as it opens: ``slower`` lowers c again at later times, by the
same formulas from one linear medium to the next (P and rho_r those of the present one, K'/K the ratio of the two).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from matter.case.body import Model
from matter.case.quantity import PositiveSpeed, PositiveTime
from matter.compilation.jit import parallel_kernel, prange
from sph.bodies.particle_cloud import Cloud
from sph.eos import dispatch as eos
from sph.materials.rows import Materials, Rows
from sph.stepping import fine_particles
from sph.stepping.state import interaction_fraction

SOURCES = ("RaducanJutzi2022", "MorrisMonaghan1997")


class Slower(Model):
    """A lower sound speed from a later time on, ``[[sph.late.slower]]``."""

    at: PositiveTime
    """Time after the impact at which the sound speed is lowered again."""
    sound_speed: PositiveSpeed
    """Bulk sound speed from then on."""


BETA = 10.0
"""Quadratic artificial viscosity of the late stage."""


class Settings(Model):
    """The late stage with a low bulk modulus, ``[sph.late]``. A case that gives neither this table nor its end has the
    one that follows from its expected crater, where it grows after the shock (``sph.planning.late_speeds``)."""

    at: PositiveTime | None = None
    """Time after the impact at which the sound speed is lowered; by default it stays."""
    sound_speed: PositiveSpeed | None = None
    """Bulk sound speed from then on."""
    alpha: Annotated[float, Field(ge=0, le=10)] = 0.1
    """Linear artificial viscosity from ``viscosity_at`` on."""
    viscosity_at: PositiveTime | None = None
    """Time after the impact from which on ``alpha`` acts; by default when the shock has left a crater that weight
    ends (``sph.planning.late_speeds``), at the latest ``at``."""
    slower: tuple[Slower, ...] = ()
    """Later times and still lower sound speeds, in order: long runs take steps of the flow as it slows down."""

    @model_validator(mode="after")
    def _in_order(self) -> Settings:
        if (self.at is None) != (self.sound_speed is None):
            raise ValueError("at and sound_speed: give both, or leave both out")
        if self.at is None and (self.viscosity_at is None or self.slower):
            raise ValueError("at is missing; without it only viscosity_at changes anything")
        for (before, faster), (at, speed) in pairwise(self.switches):
            if at <= before or speed >= faster:
                raise ValueError(
                    f"slower: {speed:g} m/s at {at:g} s comes after {faster:g} m/s at {before:g} s; each has to be "
                    f"later and slower than the one before"
                )
        return self

    @property
    def switches(self) -> tuple[tuple[float, float], ...]:
        """Times [s] and the sound speeds [m/s] from then on."""
        if self.at is None or self.sound_speed is None:
            return ()
        return (self.at, self.sound_speed), *((one.at, one.sound_speed) for one in self.slower)

    def spans(self, end: float) -> list[tuple[float, float, float]]:
        """Parts of the late stage until ``end`` [s]: when each begins, how long it is [s] and its sound speed [m/s],
        infinite where materials keep their own."""
        begins = list(self.switches)
        if not begins or self.viscosity_time < begins[0][0]:
            begins.insert(0, (self.viscosity_time, math.inf))
        ends = [*(at for at, _ in begins[1:]), end]
        return [(at, until - at, speed) for (at, speed), until in zip(begins, ends)]

    @property
    def viscosity_time(self) -> float:
        """When the low viscosity begins [s]."""
        begins = self.at if self.viscosity_at is None else self.viscosity_at
        assert begins is not None  # ``_in_order``
        return begins


class LateStageMedium(NamedTuple):
    """Moduli of the late stage: ``rows`` of the materials with them, ``c2`` (m,) squared sound speeds [m^2/s^2],
    ``ratio`` (m,) = K' / K, ``full`` (m,) mass [kg] from which on a particle has them, 0 where all do."""

    rows: Rows
    c2: np.ndarray
    ratio: np.ndarray
    full: np.ndarray


def late_medium(materials: Materials, sound_speed: float, spacing: float) -> LateStageMedium:
    """The rows of softer materials; a gas (no modulus at rest) and what is softer already keep their bulk modulus.
    ``young``, by which flaws open, stays that at rest. ``spacing`` [m]: that of the particles of the crater."""
    rows = materials.rows
    stiff = np.array([eos.modulus(kind, row) for kind, row in zip(rows.eos, rows.eos_row)])
    stiff = np.where(stiff > 0.0, stiff, rows.rho0 * sound_speed**2)
    ratio = np.minimum(rows.rho0 * sound_speed**2 / stiff, 1.0)
    changed = rows._replace(
        shear=rows.shear * ratio,
        bulk=rows.bulk * ratio,
        crack_speed=rows.crack_speed * np.sqrt(ratio),
    )
    full = np.where(ratio < 1.0, materials.bulk_density * spacing**3, 0.0)
    return LateStageMedium(changed, ratio * stiff / rows.rho0, ratio, full)


class Moduli(NamedTuple):
    """What the compiled switch needs of a ``LateStageMedium``; ``ratio`` (m,) = K' / K of this switch."""

    c2: np.ndarray
    ratio: np.ndarray
    full: np.ndarray


@parallel_kernel
def _pressure_by_law(cloud, rows, pressure, empty):
    """Fill ``pressure`` (n,) [Pa], before damage and tension cut, from the materials' own laws, and ``empty`` (n,)
    [kg/m^3]: of matter in tension the density without pressure, of other matter its own."""
    rho, u, distention, material = cloud.density, cloud.specific_energy, cloud.distention, cloud.material
    for i in prange(len(rho)):
        m = material[i]
        opened = distention[i]
        P = eos.pressure_and_derivatives(rows.eos[m], rows.eos_row[m], opened * rho[i], u[i])[0] / opened
        pressure[i], empty[i] = P, rho[i]
        if P < 0.0:
            empty[i] = eos.density(rows.eos[m], rows.eos_row[m], 0.0, u[i]) / opened


@parallel_kernel
def _pressure_by_medium(cloud, empty, c2, full, pressure):
    """Fill ``pressure`` (n,) [Pa], before damage and tension cut, in a late stage that is on; ``empty`` (n,)
    [kg/m^3] without pressure."""
    mass, rho, material = cloud.mass, cloud.density, cloud.material
    for i in prange(len(rho)):
        m = material[i]
        pressure[i] = fine_particles.softness(mass[i], full[m]) * c2[m] * (rho[i] - empty[i])


@parallel_kernel
def _switch(cloud, weight, state, rows, to, first, stress, late_density, elastic):
    """Fill ``late_density`` (n,) and ``elastic`` (n, 2) [J], before and after, and scale the ``stress`` (n, 5) in
    place; ``state`` as ``_pressure_by_law`` fills it, ``to.ratio`` (m,) = K' / K of this switch, at the ``first`` one
    for particles of full mass."""
    mass, rho, velocity, material = cloud.mass, cloud.density, cloud.velocity, cloud.material
    count, (pressure, empty) = cloud.neighbours, state
    for i in prange(len(rho)):
        m = material[i]
        P = pressure[i]
        own = fine_particles.softness(mass[i], to.full[m])
        ratio, c2, shear_modulus = to.ratio[m], own * to.c2[m], rows.shear[m]
        if first:
            ratio *= own
        else:
            shear_modulus *= own
        speed2 = velocity[i, 0] ** 2 + velocity[i, 1] ** 2 + velocity[i, 2] ** 2
        borne = min(rho[i] * math.sqrt(c2 * speed2) / P, 1.0) if P > 0.0 else 0.0
        carried = max(min(weight[i], P), borne * P, 0.0)
        softer = carried + ratio * (P - carried)
        kept = borne + (1.0 - borne) * ratio
        rest = rho[i] - softer / c2
        if P < 0.0 and empty[i] > rho[i]:
            rest, softer = empty[i], c2 * (rho[i] - empty[i])
        late_density[i] = rest
        stiff = rows.rho0[m] * c2 / ratio
        J2 = (
            stress[i, 0] ** 2
            + stress[i, 3] ** 2
            + stress[i, 0] * stress[i, 3]
            + stress[i, 1] ** 2
            + stress[i, 2] ** 2
            + stress[i, 4] ** 2
        )
        shear = J2 / (2.0 * shear_modulus) if shear_modulus > 0.0 else 0.0
        pressed, eased = max(P, 0.0), max(softer, 0.0)
        held = interaction_fraction(count[i]) * mass[i] / rho[i]  # lost particles hold nothing
        elastic[i, 0] = held * (0.5 * pressed * pressed / stiff + shear)
        elastic[i, 1] = held * (0.5 * eased * eased / (stiff * ratio) + shear * kept * kept / ratio)
        for k in range(5):
            stress[i, k] *= kept


def switch(
    cloud: Cloud, rows: Rows, to: LateStageMedium, weight: np.ndarray, present: LateStageMedium | None = None
) -> tuple[float, float]:
    """Set ``cloud.late_density`` and scale the stress; the elastic energies [J] before and after.

    ``weight`` (n,) is the pressure of the body in balance where the particles are [Pa]; ``present`` the moduli of a
    late stage that is on already, None where the materials' own laws (``rows``) hold.
    """
    if present is None:
        pressure, empty, ratio = np.empty(len(cloud)), np.empty(len(cloud)), to.ratio
        _pressure_by_law(cloud.fields, rows, pressure, empty)
    else:
        empty, rows, ratio = cloud.late_density, present.rows, to.ratio / present.ratio
        pressure = np.empty(len(cloud))
        _pressure_by_medium(cloud.fields, empty, present.c2, present.full, pressure)
    elastic, late_density = np.empty((len(cloud), 2)), np.empty(len(cloud))
    going = Moduli(to.c2, ratio, to.full)
    _switch(cloud.fields, weight, (pressure, empty), rows, going, present is None, cloud.stress, late_density, elastic)
    cloud.late_density = late_density
    before, after = elastic.sum(axis=0)
    return float(before), float(after)
