"""Exact solutions beyond plane shocks, set up with the production kernels: a blast, elastic waves, a slope, a spinning ball, a collapse, rings, a rod.

Numerics as in ``columns`` (viscosity, step, kernel, support, volumes, smoothing) unless a function says why not.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import columns
import numpy as np
from scipy.integrate import quad, solve_ivp
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import brentq
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from matter import tree
from sph import rates
from sph.boundary.edge import Edge
from sph.boundary.images import Images
from sph.boundary.periodic import Periodic
from sph.cloud import Cloud
from sph.damage import seeding
from sph.integrator import Integrator
from sph.material_settings import Choice
from sph.materials import Materials, collect
from sph.rates import Rates
from sph.row import ZZ
from sph.target import Body

TOUGH = {"strength": "von_mises", "damage": "none", "von_mises": {"Y0": "1e4 GPa"}, "tension": {"cut": "1e4 GPa"}}
BASALTIC = {
    "tillotson": {
        "rho0": "2700 kg/m^3", "a": "0.5", "b": "1.5", "A": "26.7 GPa", "B": "26.7 GPa", "E0": "487 MJ/kg", "Eiv": "4.72 MJ/kg", "Ecv": "18.2 MJ/kg"
    },
    "elastic": {"shear_modulus": "22.7 GPa", "bulk_modulus": "26.7 GPa"},
}  # fmt: skip


def gas(gamma: float) -> Materials:
    """An ideal gas of density 1."""
    return collect(("basalt",), {"basalt": Choice(eos="ideal_gas", strength="none", damage="none", ideal_gas={"rho0": "1 kg/m^3", "gamma": gamma})})


def closest_packing(inside: Callable[[np.ndarray], np.ndarray], reach: float, disorder: float = 0.0, seed: int = 1) -> np.ndarray:
    """Points (n, 3) of a hexagonal close packing of spacing 1 about the origin that lie ``inside``, off it by up to ``disorder`` along each axis."""
    a = 2.0 ** (1.0 / 6.0)
    across = 2 * math.ceil(reach / a / math.sqrt(0.75) + 2)
    place, wide, deep, _ = columns.lattice(2 * math.ceil(reach / a / math.sqrt(2.0 / 3.0) + 1), across)
    place = place - np.array([0.5 * wide, 0.5 * deep, 0.5 * place[:, 2].max()])
    place = place[inside(place)]
    return place + np.random.default_rng(seed).uniform(-disorder, disorder, place.shape) * (disorder > 0.0)


def body(place: np.ndarray, materials: Materials, radius: float, strength: bool = False, **options) -> Integrator:
    """An integrator of one material at ``place`` (n, 3), a particle per unit of volume."""
    n, rho = len(place), float(materials.bulk_density[0])
    matter = Body(place, np.full(n, rho), np.full(n, rho), np.full(n, columns.SUPPORT), np.zeros(n, np.int32), np.zeros(n, np.int32))
    i = columns.integrator(Cloud.of(matter), materials, radius, **(columns.NUMERICS | options))
    i.strength, i.damage = strength, False
    return i


def advance(i: Integrator, until: float) -> None:
    """Steps up to the time ``until`` [s]."""
    while i.time < until:
        i.step(i.next_step(until))


# ---------------------------------------------------------------- blast
def _self_similar(gamma: float) -> Callable[[np.ndarray], np.ndarray]:
    """Density, velocity and pressure at a share x > 0.02 of the radius of the blast wave, scaled: rho = g, v = (2/5) (r/t) f, P = rho_0 (2/5)^2 (r/t)^2 p."""

    def slopes(x, y):
        g, f, p = y
        # continuity, momentum and energy of the similarity solution, linear in dg, df, dp per d ln(x)
        A = np.array([[(f - 1.0) / g, 1.0, 0.0], [0.0, f - 1.0, 1.0 / g], [-gamma * (f - 1.0) / g, 0.0, (f - 1.0) / p]])
        b = np.array([-3.0 * f, -f * (f - 2.5) - 2.0 * p / g, -2.0 * (f - 2.5)])
        return np.linalg.solve(A, b) / x

    front = [(gamma + 1.0) / (gamma - 1.0), 2.0 / (gamma + 1.0), 2.0 / (gamma + 1.0)]
    return solve_ivp(slopes, (1.0, 0.02), front, rtol=1e-9, atol=1e-12, dense_output=True).sol


def blast_constant(gamma: float) -> float:
    """beta of the blast wave r = (E t^2 / (beta rho))^(1/5) in a cold gas (Sedov 1959; the self-similar equations integrated from the front inwards)."""
    state = _self_similar(gamma)
    whole = quad(lambda x: (0.5 * state(x)[0] * state(x)[1] ** 2 + state(x)[2] / (gamma - 1.0)) * x**4, 0.02, 1.0, limit=200)[0]
    return 4.0 * math.pi * 4.0 / 25.0 * whole


def kinetic_share(gamma: float) -> float:
    """Of the energy of the blast wave."""
    state = _self_similar(gamma)
    kinetic = quad(lambda x: 0.5 * state(x)[0] * state(x)[1] ** 2 * x**4, 0.02, 1.0, limit=200)[0]
    return kinetic * 16.0 * math.pi / 25.0 / blast_constant(gamma)


def smeared_peak(gamma: float, height: float) -> float:
    """Where the density of the exact blast, smoothed until it is ``height`` of that behind the front, is largest, over the radius of the front.

    A front as thin as a tenth of its radius loses height and moves inwards when it is smoothed, however right it is: by this it is put back. Smoothing is along
    the radius, by a Gaussian.
    """
    r = np.linspace(0.0, 2.0, 2001)
    inner = r < 1.0
    density = np.ones_like(r)
    density[inner] = _self_similar(gamma)(np.maximum(r[inner], 0.02))[0]

    def smoothed(width: float) -> np.ndarray:
        return gaussian_filter1d(density, width / r[1], mode="nearest") * (gamma - 1.0) / (gamma + 1.0)

    width = brentq(lambda w: smoothed(w).max() - height, 5e-4, 0.3)
    return float(r[np.argmax(smoothed(width))])


class Blast(NamedTuple):
    """Radii over Sedov's: of the densest shell, of the half level outside it, and of the front whose smeared profile has its densest shell there
    (``smeared_peak``); the largest density over that behind a strong shock; the kinetic share of the energy, and the relative change of the total.
    """

    radius: float
    half_level: float
    front: float
    density: float
    kinetic: float
    energy: float


def blast(across: int = 30, gamma: float = 1.4, **options) -> Blast:
    """The blast, by means over shells half a spacing wide.

    A ball ``across`` spacings wide; the energy is laid into the particles within h of the centre, weighted by the kernel; read off at 0.7 of the ball. The
    place of the largest density is that of a parabola through the three densest shells.
    """
    half = 0.5 * across
    i = body(closest_packing(lambda x: np.linalg.norm(x, axis=1) < half, half, 0.05), gas(gamma), half, **options)
    c = i.cloud
    r = np.linalg.norm(c.position, axis=1)
    share = np.maximum(1.0 - r / columns.SUPPORT, 0.0) ** 4 * (1.0 + 4.0 * r / columns.SUPPORT)
    c.specific_energy[:] = share / (c.mass @ share) + 1e-9
    begun = float(c.mass @ c.specific_energy)
    i.dt = 1e-6
    i.start()
    wanted = 0.7 * half
    advance(i, math.sqrt(blast_constant(gamma) * wanted**5))
    kinetic = 0.5 * float(c.mass @ np.einsum("ij,ij->i", c.velocity, c.velocity))
    r = np.linalg.norm(c.position, axis=1)
    edges = np.arange(0.0, half, 0.5)
    shell = np.digitize(r, edges)
    density = np.bincount(shell, c.density, minlength=len(edges) + 1) / np.maximum(np.bincount(shell, minlength=len(edges) + 1), 1)
    peak = int(np.argmax(density))
    below, most, above = density[peak - 1 : peak + 2]
    radius = float(edges[peak - 1] + 0.25 + 0.25 * (below - above) / (below - 2.0 * most + above)) / wanted
    outer = peak + int(np.flatnonzero(density[peak:] < 0.5 * (most + 1.0))[0])  # half-way down the front
    step = (density[outer - 1] - 0.5 * (most + 1.0)) / (density[outer - 1] - density[outer])
    height = float(most * (gamma - 1.0) / (gamma + 1.0))
    energy = (kinetic + float(c.mass @ c.specific_energy)) / begun - 1.0
    return Blast(radius, float(edges[outer - 2] + 0.25 + 0.5 * step) / wanted, radius / smeared_peak(gamma, height), height, kinetic / begun, energy)


# ---------------------------------------------------------------- elastic waves
def elastic_speed(name: str, transverse: bool, width: float = 8.0, **options) -> float:
    """Speed of a pulse of velocity along or across a column of the solid ``name``, over that of its moduli; ``width`` its half width at 1/e [spacings]."""
    column = columns.Column(collect((name,)), 160, piston=0.0, ends=True, **options)
    i, c = column.integrator, column.cloud
    i.strength = True
    shear, bulk, rho = float(i.rows.shear[0]), float(i.rows.bulk[0]), column.rho0
    axis, modulus = (0, shear) if transverse else (2, bulk + 4.0 / 3.0 * shear)
    speed = math.sqrt(modulus / rho)
    c.velocity[:, axis] = 1e-3 * np.exp(-(((c.position[:, 2] - 0.5 * column.height) / width) ** 2))
    i.start()
    return _pulse_upwards(i, axis, 0.5 * column.height, [(30.0 + 5.0 * part) / speed for part in range(5)]) / speed


def bar_speed(name: str, radius: float = 6.0, length: float = 240.0, width: float = 24.0, **options) -> float:
    """Speed of a pulse of velocity along a free bar of the solid ``name``, over sqrt(E / rho); lengths in spacings, ``width`` the half width at 1/e.

    Waves of the length 2 pi sqrt(2) ``width`` run slower by (nu pi radius / length)^2 = 1e-3 of it (Rayleigh 1894).
    """
    materials = collect((name,), {name: Choice(**TOUGH)})
    place, wide, deep, _ = columns.lattice(round(length / 0.9), round(2.0 * radius) + 2)
    place = place - 0.5 * np.array([wide, deep, place[:, 2].max()])
    i = body(place[np.hypot(place[:, 0], place[:, 1]) < radius], materials, length, True, **options)
    c = i.cloud
    shear, bulk = float(i.rows.shear[0]), float(i.rows.bulk[0])
    speed = math.sqrt(9.0 * bulk * shear / (3.0 * bulk + shear) / float(materials.bulk_density[0]))
    c.velocity[:, 2] = 1e-3 * np.exp(-((c.position[:, 2] / width) ** 2))
    i.start()
    return _pulse_upwards(i, 2, 0.0, [(50.0 + 5.0 * part) / speed for part in range(5)]) / speed


def _pulse_upwards(i: Integrator, axis: int, middle: float, times: list[float]) -> float:
    """Speed of the half of a pulse of velocity along ``axis`` that goes up from the height ``middle``, once the two halves have parted."""
    c, places = i.cloud, []
    for time in times:
        advance(i, time)
        z = c.position[:, 2]
        weight = np.where(z > middle, np.maximum(c.velocity[:, axis], 0.0), 0.0) ** 2
        places.append(float(weight @ z / weight.sum()))
    return float(np.polyfit(times, places, 1)[0])


# ---------------------------------------------------------------- a slope of dry sand
class _Tilted(Integrator):
    """Uniform gravity ``pull`` (3,) [m/s^2]."""

    pull = np.zeros(3)

    def _gravity(self) -> None:
        self.cloud.gravity[:] = self.pull
        self.cloud.gravity_position[:] = self.cloud.position


def slope(tilt: float, friction_angle: str = "30 deg", layers: int = 14, rock: bool = True) -> float:
    """Velocity that an endless slope of dry sand gains at the ``tilt`` [rad] within 2 sqrt(H / g), over that of free sliding, g sin(tilt) t.

    It lies on ``rock`` that cannot yield (a fixed rim passes on half of a shear stress) or on a rim that is stressed (``sph.boundary.stressed_rim``),
    settles level and damped as the stage relaxes a target (no strength, energy held, then S = 0 and the density as it stands for that of the start), is
    tilted, damped, and let go. Settled with its strength on, the disordered lattice sinks under uniaxial strain: up to a tenth of the weight is then carried by
    the deviator, P and with it the friction is that much lower, and shear stresses of a third of the strength stay locked between particles.
    Sheared in a plane the cone of Drucker and Prager slides at tan(theta) = B
    (``angle_of_slope``), not at the angle of triaxial compression.
    """
    sand = Choice(strength="drucker_prager", damage="none", drucker_prager={"friction_angle": friction_angle, "cohesion": "0 Pa"}, tension={"cut": "0 Pa"})
    materials = collect(("basalt", "ice"), {"basalt": sand, "ice": Choice(**TOUGH, **BASALTIC)})
    column = columns.Column(materials, layers + 6, rim="own" if rock else "stressed")
    i, c, height = column.integrator, column.cloud, column.height
    if rock:
        c.material[c.position[:, 2] < 6.0 * column.gap] = 1
    g = 1e-3 * 26.7e9 / (2700.0 * height)  # the weight strains it by 1e-3
    c.position += np.random.default_rng(1).uniform(-0.1, 0.1, c.position.shape)
    i.neighbourhood.rebuild(c, 0.0)
    c.density[:] = 2700.0 * (1.0 + 2700.0 * g * math.cos(tilt) * np.maximum(height - c.position[:, 2], 0.0) / 26.7e9)
    c.start_density[:] = c.density
    order = np.argsort(c.identity)
    i.edge = Edge(c.position[order, 2], c.smoothing_length[order], c.density[order], np.zeros(len(order)), 0.0)
    i.__class__ = _Tilted
    crossing, fall = height / math.sqrt(26.7e9 / 2700.0), 2.0 * math.sqrt(height / g)

    def top() -> float:
        return float(c.velocity[c.initial_position[:, 2] > 0.5 * height, 0].mean())

    def rest(along: float, time: float, damping: float) -> None:
        i.pull = np.array([g * along, 0.0, -g * math.cos(tilt)])
        i.start()
        until = i.time + time
        while i.time < until:
            dt = i.next_step(until)
            i.step(dt, 1.0 / (1.0 + damping * dt))

    i.strength, i.hold = False, True
    rest(0.0, 20.0 * crossing, 1.0 / crossing)
    i.strength, i.hold = True, False
    c.velocity[:], c.start_density[:], c.start_length[:] = 0.0, c.density, c.smoothing_length
    rest(math.sin(tilt), 10.0 * crossing, 1.0 / crossing)
    begun = top()
    rest(math.sin(tilt), fall, 0.0)
    return (top() - begun) / (g * math.sin(tilt) * fall)


def angle_of_slope(friction_angle: float) -> float:
    """Angle [rad] at which an endless slope of Drucker-Prager sand without cohesion slides: tan(theta) = B."""
    return math.atan(6.0 * math.sin(friction_angle) / (math.sqrt(3.0) * (3.0 - math.sin(friction_angle))))


# ---------------------------------------------------------------- collapse without pressure
def collapse(across: int = 20, share: float = 0.9) -> float:
    """Half-mass radius of a cold, uniform, self-attracting ball at ``share`` of its free-fall time, over that of free fall."""
    half = 0.5 * across
    i = body(
        closest_packing(lambda x: np.linalg.norm(x, axis=1) < half, half), gas(1.4), half, self_gravity=True, alpha=0.0, beta=0.0, smoothing="fixed"
    )  # fmt: skip
    c = i.cloud
    begun = float(np.median(np.linalg.norm(c.position, axis=1)))
    free_fall = math.sqrt(3.0 * math.pi / (32.0 * tree.G * 1.0))
    c.specific_energy[:] = 1e-6 * (half / free_fall) ** 2  # next to no pressure: the limits of the step need a scale
    i.dt = 1e-3 * free_fall
    i.start()
    advance(i, share * free_fall)
    angles = np.linspace(0.0, 0.5 * math.pi, 20001)  # r = cos^2, t = 2/pi (angle + sin 2 angle / 2) of the free-fall time
    wanted = float(np.interp(share, 2.0 / math.pi * (angles + 0.5 * np.sin(2.0 * angles)), np.cos(angles) ** 2))
    return float(np.median(np.linalg.norm(c.position, axis=1))) / begun / wanted


# ---------------------------------------------------------------- a spinning ball with stresses of its own
def spin(radius: float = 7.0, turns: float = 1.0, **options) -> tuple[float, float, float, float]:
    """An elastic ball, its core expanded by heat and held by its shell, turned once in 200 radii over the speed of sound.

    Returns the relative change of the angular momentum, what the correction of the torque took of it, and the relative changes of the mean P (core) and of
    the root of the mean J2 (all but the outermost particles), all from a quarter of a turn on, when it has widened under its spin.
    """
    materials = collect(("basalt",), {"basalt": Choice(**TOUGH)})
    i = body(closest_packing(lambda x: np.linalg.norm(x, axis=1) < radius, radius, 0.05), materials, radius, True, **options)
    c, crossing = i.cloud, radius / math.sqrt(26.7e9 / 2700.0)
    core = np.linalg.norm(c.position, axis=1) < 0.55 * radius
    c.specific_energy[core] = 8e4
    i.hold = True
    i.start()
    while i.time < 30.0 * crossing:
        dt = i.next_step(30.0 * crossing)
        i.step(dt, 1.0 / (1.0 + dt / crossing))
    i.hold = False
    omega = 2.0 * math.pi / (200.0 * crossing)
    c.velocity[:] = np.cross([0.0, 0.0, omega], c.position)
    i.start()

    def state() -> np.ndarray:
        S = c.stress
        J2 = S[:, 0] ** 2 + S[:, 3] ** 2 + S[:, 0] * S[:, 3] + S[:, 1] ** 2 + S[:, 2] ** 2 + S[:, 4] ** 2
        r = np.linalg.norm(c.position, axis=1)
        inner, middle = r < 0.8 * radius, r < 0.45 * radius
        return np.array([i.evaluated.pressure[middle].mean(), math.sqrt(J2[inner].mean())])

    def turning() -> float:
        return float(c.mass @ np.cross(c.position, c.velocity)[:, 2])

    advance(i, i.time + 50.0 * crossing)
    removed, end = i.torque_removed.copy(), i.time + turns * 200.0 * crossing
    before, L = state(), turning()
    advance(i, end)
    after = state()
    changes = after / before - 1.0
    return turning() / L - 1.0, float(np.linalg.norm(i.torque_removed - removed) / L), float(changes[0]), float(changes[1])


# ---------------------------------------------------------------- a shell that stops
def stopping_speed(inner: float, outer: float, stop: float, strength: float, density: float) -> float:
    """A [m^3/s] of the incompressible flow v = -A / r^2 whose kinetic energy yielding takes up until the inner radius is ``stop``.

    A shell from r_0 to r strains by 2 ln(r_0 / r) (equivalent strain, r^3 = r_0^3 - inner^3 + stop^3), so that Verney's (1968) balance is
    2 pi rho A^2 (1 / inner - 1 / outer) = 4 pi Y int 2 ln(r_0 / r) r_0^2 dr_0.
    """
    less = inner**3 - stop**3
    work = 4.0 * math.pi * strength * quad(lambda r: -2.0 / 3.0 * math.log1p(-less / r**3) * r * r, inner, outer)[0]
    return math.sqrt(work / (2.0 * math.pi * density * (1.0 / inner - 1.0 / outer)))


BERYLLIUM = {
    "eos": "murnaghan", "murnaghan": {"rho0": "1845 kg/m^3", "K0": "117 GPa", "n": 4.0}, "elastic": {"shear_modulus": "151 GPa", "bulk_modulus": "117 GPa"},
    "strength": "von_mises", "von_mises": {"Y0": "0.33 GPa"}, "damage": "none", "tension": {"cut": "1e4 GPa"},
}  # fmt: skip


def shell(particles: int = 20_000, stop: float = 0.625, **options) -> tuple[float, float, float]:
    """Verney's shell (outer radius 1.25 of the inner), sent inwards so that it stops at ``stop`` of its inner radius by the balance of energies.

    Returns the inner radius where it stops over that wanted, the share of the kinetic energy that viscosity took, and the relative change of the total energy.
    The inner radius follows from the mean of r^3, which falls by the same for all of incompressible matter; it stops when that no longer falls.
    """
    materials = collect(("basalt",), {"basalt": Choice(**BERYLLIUM)})
    outer = (particles / (4.0 / 3.0 * math.pi * (1.0 - 0.8**3))) ** (1.0 / 3.0)
    inner = 0.8 * outer
    place = closest_packing(lambda x: np.abs(np.linalg.norm(x, axis=1) - 0.5 * (inner + outer)) < 0.5 * (outer - inner), outer, 0.05)
    i = body(place, materials, outer, True, **options)
    c = i.cloud
    r = np.linalg.norm(c.position, axis=1)
    A = stopping_speed(inner, outer, stop * inner, 0.33e9, 1845.0)
    c.velocity[:] = -A * c.position / r[:, None] ** 3
    i.start()

    def energies() -> tuple[float, float]:
        return 0.5 * float(c.mass @ np.einsum("ij,ij->i", c.velocity, c.velocity)), float(c.mass @ c.specific_energy)

    begun, volume, viscous, quiet = sum(energies()), float((r**3).mean()), 0.0, Rates(len(c), curl=True)
    at = 0.0
    while True:
        i.step(i.next_step(1e9))
        if i.steps % 10 == 0:
            matter = rates.Matter(c.material, i.rows.shear, i.evaluated.stiffness, c.stress, True)
            rates.compute(i.scheme, i._rows(), i.neighbourhood.found, matter, i.damping._replace(alpha=0.0, beta=0.0), quiet)
            viscous += (i.time - at) * float(c.mass @ (i.rates.energy - quiet.energy))
            at = i.time
        r2 = np.einsum("ij,ij->i", c.position, c.position)
        if float(np.sqrt(r2) @ np.einsum("ij,ij->i", c.position, c.velocity)) > 0.0:
            break
    left = inner**3 - volume + float((r2**1.5).mean())
    return left ** (1.0 / 3.0) / (stop * inner), viscous / begun, sum(energies()) / begun - 1.0


# ---------------------------------------------------------------- rings
def rings(outer: float = 24.0, until: float = 50.0) -> tuple[float, float, int, float]:
    """Two rubber rings (r_in / r_out = 3/4, K = 1, mu = 0.22, 0.059 of the bulk speed each; Monaghan 2000) until ``until`` outer radii over that speed.

    Returns the relative change of the total energy, the speed of their parting over that of their meeting, the number of pieces, and the largest share of
    particles in one piece.
    """
    rubber = {
        "eos": "murnaghan", "murnaghan": {"rho0": "1 kg/m^3", "K0": "1 Pa", "n": 1.0},
        "elastic": {"shear_modulus": "0.22 Pa", "bulk_modulus": "1 Pa"}, "strength": "von_mises", "von_mises": {"Y0": "1 GPa"}, "damage": "none",
        "tension": {"cut": "1 GPa"},
    }  # fmt: skip
    materials = collect(("basalt",), {"basalt": Choice(**rubber)})
    period = 4.0 * columns.lattice(4, 4)[3]
    flat = closest_packing(
        lambda x: (np.hypot(x[:, 0], x[:, 1]) < outer) & (np.hypot(x[:, 0], x[:, 1]) > 0.75 * outer) & (np.abs(x[:, 2]) < 0.5 * period), outer
    )
    offset = np.array([outer + 1.5, 0.0, 0.0])
    ends = Images((Periodic(2, -0.5 * period, 0.5 * period),))
    i = body(np.concatenate([flat - offset, flat + offset]), materials, 3.0 * outer, True, images=ends, artificial_stress=0.3)
    c = i.cloud
    left = c.position[:, 0] < 0.0
    name = c.identity.copy()
    mine = np.zeros(len(c), dtype=bool)
    mine[name] = left
    c.velocity[:, 0] = np.where(left, 0.059, -0.059)
    i.start()

    def energy() -> float:
        return float(c.mass @ (0.5 * np.einsum("ij,ij->i", c.velocity, c.velocity) + c.specific_energy))

    begun = energy()
    kinetic = begun - float(c.mass @ c.specific_energy)
    advance(i, until * outer)
    first = mine[c.identity]
    parting = float(c.velocity[~first, 0].mean() - c.velocity[first, 0].mean())
    x = c.position.copy()
    x[:, 2] = (x[:, 2] + 0.5 * period) % period
    box = np.array([1e4, 1e4, period])
    x[:, :2] += 5e3
    pairs = cKDTree(x, boxsize=box).query_pairs(1.7, output_type="ndarray")
    count, group = connected_components(coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(c), len(c))), directed=False)
    return (energy() - begun) / kinetic, parting / 0.118, int(count), float(np.bincount(group).max() / len(c))


# ---------------------------------------------------------------- a rod pulled apart
def rod(rate: float, seed: int = 1, length: int = 48) -> float:
    """Largest mean tension [Pa] of basalt pulled along z at the strain ``rate`` [1/s]: 4 x 4 x ``length`` mm out of a plate, periodic across."""
    materials = collect(("basalt",), {"basalt": Choice(tension={"cut": "1e4 GPa"})})
    spacing = 1e-3
    place, wide, deep, gap = columns.lattice(round(length / 0.9), 4)
    place = (place + np.random.default_rng(2).uniform(-0.05, 0.05, place.shape)) * spacing
    n, tall = len(place), round(length / 0.9) * gap * spacing
    matter = Body(
        place, np.full(n, 2700.0 * spacing**3), np.full(n, 2700.0), np.full(n, columns.SUPPORT * spacing), np.zeros(n, np.int32), np.zeros(n, np.int32)
    )
    edge = Edge(np.minimum(place[:, 2], tall - place[:, 2]), matter.h, matter.density, np.zeros(n), 0.0)
    planes = Images((Periodic(0, 0.0, wide * spacing), Periodic(1, 0.0, deep * spacing)))
    i = columns.integrator(Cloud.of(matter), materials, 0.02, edge=edge, images=planes, **columns.NUMERICS)
    c = i.cloud
    seeding.seed_flaws(c, materials, seed)
    c.velocity[:, 2] = rate * (c.position[:, 2] - 0.5 * tall)
    i.start()
    most, end = 0.0, 4e-3 / rate
    while i.time < end:
        i.step(i.next_step(end))
        middle = np.abs(c.initial_position[:, 2] - 0.5 * tall) < 0.35 * tall
        tension = float(i.evaluated.row[:n][middle, ZZ].mean())
        most = max(most, tension)
        if tension < 0.3 * most and most > 1e7:
            break
    return most
