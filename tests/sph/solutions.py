"""Exact solutions beyond plane shocks, set up with the production kernels: a blast, elastic waves, a slope, a spinning ball, a collapse, rings, a rod.

Numerics as in ``columns`` (viscosity, step, kernel, support, volumes, smoothing) unless a function says why not.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import columns
import numpy as np
from scipy.integrate import quad, solve_ivp

from matter import tree
from sph.boundary.edge import Edge
from sph.cloud import Cloud
from sph.integrator import Integrator
from sph.material_settings import Choice
from sph.materials import Materials, collect
from sph.target import Body


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
    chosen = {**columns.NUMERICS, "theta": 0.5, "gravity_shift": 0.0, "self_gravity": False} | options
    i = Integrator(Cloud.of(matter), materials, radius, **chosen)
    i.strength, i.damage = strength, False
    return i


def advance(i: Integrator, until: float) -> None:
    """Steps up to the time ``until`` [s]."""
    while i.time < until:
        i.step(i.next_step(until))


# ---------------------------------------------------------------- blast
def blast_constant(gamma: float) -> float:
    """beta of the blast wave r = (E t^2 / (beta rho))^(1/5) in a cold gas (Sedov 1959; the self-similar equations integrated from the front inwards)."""

    def slopes(x, y):  # density, velocity and pressure over those behind the front, scaled: rho = g, v = (2/5) (r/t) f, P = rho_0 (2/5)^2 (r/t)^2 p
        g, f, p = y
        # continuity, momentum and energy of the similarity solution, linear in dg, df, dp per d ln(x)
        A = np.array([[(f - 1.0) / g, 1.0, 0.0], [0.0, f - 1.0, 1.0 / g], [-gamma * (f - 1.0) / g, 0.0, (f - 1.0) / p]])
        b = np.array([-3.0 * f, -f * (f - 2.5) - 2.0 * p / g, -2.0 * (f - 2.5)])
        return np.linalg.solve(A, b) / x

    front = [(gamma + 1.0) / (gamma - 1.0), 2.0 / (gamma + 1.0), 2.0 / (gamma + 1.0)]
    found = solve_ivp(slopes, (1.0, 0.02), front, rtol=1e-9, atol=1e-12, dense_output=True)
    whole = quad(lambda x: (0.5 * found.sol(x)[0] * found.sol(x)[1] ** 2 + found.sol(x)[2] / (gamma - 1.0)) * x**4, 0.02, 1.0, limit=200)[0]
    return 4.0 * math.pi * 4.0 / 25.0 * whole


def blast(across: int = 30, gamma: float = 1.4) -> tuple[float, float]:
    """Radius of the blast over Sedov's, and the largest density (mean over shells half a spacing wide) over that behind a strong shock.

    A ball ``across`` spacings wide; the energy is laid into the particles within h of the centre, weighted by the kernel; read off at 0.7 of the ball.
    """
    half = 0.5 * across
    i = body(closest_packing(lambda x: np.linalg.norm(x, axis=1) < half, half, 0.05), gas(gamma), half)
    c = i.cloud
    r = np.linalg.norm(c.position, axis=1)
    share = np.maximum(1.0 - r / columns.SUPPORT, 0.0) ** 4 * (1.0 + 4.0 * r / columns.SUPPORT)
    c.specific_energy[:] = share / (c.mass @ share) + 1e-9
    i.dt = 1e-6
    i.start()
    end = math.sqrt(blast_constant(gamma) * (0.7 * half) ** 5)
    advance(i, end)
    r = np.linalg.norm(c.position, axis=1)
    edges = np.arange(0.0, half, 0.5)
    shell = np.digitize(r, edges)
    density = np.bincount(shell, c.density, minlength=len(edges) + 1) / np.maximum(np.bincount(shell, minlength=len(edges) + 1), 1)
    peak = int(np.argmax(density))
    outer = peak + int(np.flatnonzero(density[peak:] < 0.5 * (density[peak] + 1.0))[0])  # half-way down the front
    step = (density[outer - 1] - 0.5 * (density[peak] + 1.0)) / (density[outer - 1] - density[outer])
    return (edges[outer - 2] + 0.25 + 0.5 * step) / (0.7 * half), float(density[peak] * (gamma - 1.0) / (gamma + 1.0))


# ---------------------------------------------------------------- elastic waves
def elastic_speed(name: str, transverse: bool, width: float = 8.0) -> float:
    """Speed of a pulse of velocity along or across a column of the solid ``name``, over that of its moduli; ``width`` its half width at 1/e [spacings]."""
    column = columns.Column(collect((name,)), 160, piston=0.0, ends=True)
    i, c = column.integrator, column.cloud
    i.strength = True
    shear, bulk, rho = float(i.rows.shear[0]), float(i.rows.bulk[0]), column.rho0
    axis, modulus = (0, shear) if transverse else (2, bulk + 4.0 / 3.0 * shear)
    speed = math.sqrt(modulus / rho)
    c.velocity[:, axis] = 1e-3 * np.exp(-(((c.position[:, 2] - 0.5 * column.height) / width) ** 2))
    i.start()
    times, places = [], []
    for part in range(5):  # the half that goes up, once the two have parted
        column.run((30.0 + 5.0 * part) / speed)
        v, z = column.layers(c.velocity[:, axis]), column.layers(c.position[:, 2])
        up = z > 0.5 * column.height
        weight = np.where(up, np.maximum(v, 0.0), 0.0) ** 2
        times.append(i.time)
        places.append(float(weight @ z / weight.sum()))
    return float(np.polyfit(times, places, 1)[0]) / speed


# ---------------------------------------------------------------- a slope of dry sand
class _Tilted(Integrator):
    """Uniform gravity ``pull`` (3,) [m/s^2]."""

    pull = np.zeros(3)

    def _gravity(self) -> None:
        self.cloud.gravity[:] = self.pull
        self.cloud.gravity_position[:] = self.cloud.position


def slope(tilt: float, friction_angle: str = "30 deg", layers: int = 14) -> float:
    """Velocity along an endless slope of dry sand under the ``tilt`` [rad] over that of free sliding, after three times sqrt(H / g).

    Sheared in a plane the cone of Drucker and Prager slides at tan(theta) = B (``angle_of_slope``), not at the angle of triaxial compression.
    """
    sand = Choice(strength="drucker_prager", damage="none", drucker_prager={"friction_angle": friction_angle, "cohesion": "0 Pa"}, tension={"cut": "0 Pa"})
    materials = collect(("basalt",), {"basalt": sand})
    column = columns.Column(materials, layers)
    i, c, height = column.integrator, column.cloud, column.height
    g = 1e-4 * 26.7e9 / (2700.0 * height)  # the weight strains it by 1e-4
    i.__class__ = _Tilted
    i.pull = np.array([g * math.sin(tilt), 0.0, -g * math.cos(tilt)])
    weight = 2700.0 * g * math.cos(tilt) * (height - c.position[:, 2])
    c.density[:] = 2700.0 * (1.0 + weight / 26.7e9)
    c.start_density[:] = c.density
    order = np.argsort(c.identity)
    i.edge = Edge(c.position[order, 2], c.smoothing_length[order], c.density[order], np.zeros(len(order)), 0.0)
    i.strength = True
    i.start()
    time = 3.0 * math.sqrt(height / g)
    advance(i, time)
    top = c.initial_position[:, 2] > 0.6 * height
    return float(c.velocity[top, 0].mean()) / (g * math.sin(tilt) * time)


def angle_of_slope(friction_angle: float) -> float:
    """Angle [rad] at which an endless slope of Drucker-Prager sand without cohesion slides: tan(theta) = B."""
    return math.atan(6.0 * math.sin(friction_angle) / (math.sqrt(3.0) * (3.0 - math.sin(friction_angle))))


# ---------------------------------------------------------------- collapse without pressure
def collapse(across: int = 20, share: float = 0.9) -> float:
    """Half-mass radius of a cold, uniform, self-attracting ball at ``share`` of its free-fall time, over that of free fall."""
    half = 0.5 * across
    i = body(
        closest_packing(lambda x: np.linalg.norm(x, axis=1) < half, half), gas(1.4), half, self_gravity=True, alpha=0.0, beta=0.0, limits_of_h=None
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
