"""Normal contact force: Hertz' spring with a dashpot whose restitution does not depend on the speed.

    F_n = (2/3) k x - C_n u_n,    k = 2 E* sqrt(R x) = 2 E* a
        (the tangent stiffness; (2/3) k x = (4/3) E* sqrt(R) x^(3/2))
    C_n = -2 sqrt(5/6) ln(e_n) sqrt(k m_red / (pi^2 + ln^2 e_n))
    1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2

x overlap [m], u_n separation speed [m/s], R = r1 r2 / (r1 + r2) [m] (on a wall the radius of the grain, and E* = E /
(1 - nu^2): it is rigid), a radius of the contact [m], E Young's modulus [Pa], nu Poisson's ratio, m_red reduced mass
[kg], e_n coefficient of restitution.

With y = x^(5/4) and d tau = x^(1/4) dt the motion is a damped linear oscillator, so a pair rebounds with exactly e_n
at any speed (attractive tail kept). Without damping the contact lasts 2.868 (m_red^2 / (R E*^2 v))^(1/5) and is (15
m_red v^2 / (16 sqrt(R) E*))^(2/5) deep.

Valid for overlaps below about a tenth of the radii and speeds far below that of sound.

Source: Hertz 1882, J. reine angew. Math. 92, 156; dashpot: Antypov & Elliott 2011, EPL 94, 50004 (Tsuji, Tanaka &
Ishida 1992, Powder Technol. 71, 239, has the same x^(1/4) with a numerical fit of its factor). LIGGGHTS: ``model
hertz`` with ``limitForce off``; LAMMPS: ``hertz/material`` with ``damping coeff_restitution``.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from dem.laws import normal_hooke
from matter.case.quantity import PositivePressure
from matter.compilation.jit import law

SOURCES = ("Hertz1882", "AntypovElliott2011")

LINEAR = False
TANGENTIAL = "mindlin"
STIFF = ("elastic_modulus",)
"""Values that ``stiffness_factor`` multiplies."""
EXAMPLE = {"elastic_modulus": 1e7}


class Parameters(NamedTuple):
    """``restitution``: e_n in (0, 1]; ``elastic_modulus``: E [Pa]; ``poisson_ratio``: nu."""

    restitution: normal_hooke.Restitution = 0.55
    elastic_modulus: Annotated[
        PositivePressure | None,
        Field(description="Young's modulus E, for ``normal = \"hertz\"``; an ocean without one takes the shell's."),
    ] = None
    poisson_ratio: Annotated[
        float, Field(ge=0.0, lt=0.5, description='Poisson\'s ratio nu, for ``normal = "hertz"``.')
    ] = 0.25


class Row(NamedTuple):
    """``modulus``: E* [Pa]."""

    modulus: float


def row(one: Parameters, two: Parameters | None) -> tuple[float, ...]:
    """E* of two bodies; of one against a rigid wall (``two`` None) E / (1 - nu^2), twice that of two like it."""
    return (2.0 * effective_modulus(one, one) if two is None else effective_modulus(one, two),)


def fault(p: Parameters) -> str:
    """What is missing."""
    return "needs shell.elastic_modulus (Young's modulus)" if p.elastic_modulus is None else ""


def damping_number(restitution: float) -> float:
    """C_n / sqrt(k m_red), dimensionless: sqrt(5/6) times that of the linear law."""
    return math.sqrt(5.0 / 6.0) * normal_hooke.damping_number(restitution)


def elastic_constants(p: Parameters) -> tuple[float, float]:
    """E [Pa] and nu."""
    assert p.elastic_modulus is not None
    return p.elastic_modulus, p.poisson_ratio


def effective_modulus(first: Parameters, second: Parameters) -> float:
    """E* [Pa] of two bodies."""
    return 1.0 / sum((1.0 - nu * nu) / modulus for modulus, nu in map(elastic_constants, (first, second)))


def deepest(modulus: float, radius: float, reduced_mass: float, speed: float) -> float:
    """Largest overlap [m] of an undamped collision at ``speed`` [m/s]; ``modulus`` E* [Pa], ``radius`` R [m]."""
    return (15.0 / 16.0 * reduced_mass * speed * speed / (math.sqrt(radius) * modulus)) ** 0.4


def contact_time(modulus: float, radius: float, reduced_mass: float, speed: float, restitution: float = 1.0) -> float:
    """Duration of a binary contact [s], attractive tail kept; ``modulus`` E* [Pa], ``radius`` R [m]."""
    from scipy.integrate import quad

    # y'' + damping w y' + 5/4 w^2 y = 0 with w^2 = (4/3) E* sqrt(R) / m_red; t = integral of y^(-1/5) over half a
    # period
    w = math.sqrt(4.0 / 3.0 * modulus * math.sqrt(radius) / reduced_mass)
    damping = math.sqrt(1.5) * damping_number(restitution)
    w1 = w * math.sqrt(1.25 - 0.25 * damping * damping)
    half = math.pi / w1

    def smooth(t: float) -> float:
        # y / (t (half - t)): what the weight of the quadrature leaves
        part = t * (half - t)
        sine = math.sin(w1 * t) / part if 0.0 < part else w1 / half
        return (1.25 * speed / w1 * math.exp(-0.5 * damping * w * t) * sine) ** -0.2

    return float(quad(smooth, 0.0, half, weight="alg", wvar=(-0.2, -0.2))[0])


RAYLEIGH_FRACTION = 0.2
"""Largest step over the Rayleigh time of the smallest grain."""


def rayleigh_time(radius: np.ndarray, density: np.ndarray, shear_modulus: float, poisson_ratio: float) -> np.ndarray:
    """Time [s] in which a Rayleigh wave runs half round a grain; explicit steps stay well below it (Thornton & Randall
    1988)."""
    return np.pi * radius * np.sqrt(density / shear_modulus) / (0.1631 * poisson_ratio + 0.8766)


def grain_stiffness(radius: np.ndarray, overlap: float, p: Parameters) -> np.ndarray:
    """Tangent stiffness [N/m] of two equal grains at an overlap of ``overlap`` radii."""
    return np.asarray(2.0 * effective_modulus(p, p) * radius * np.sqrt(0.5 * overlap))


def longest_step(radius: np.ndarray, mass: np.ndarray, speed: float, p: Parameters, steps_per_contact: int) -> float:
    """Longest step [s] for grains of one species: ``RAYLEIGH_FRACTION`` of the Rayleigh time, and the shortest
    undamped contact with a rigid wall at ``speed`` [m/s] over ``steps_per_contact``."""
    modulus, nu = elastic_constants(p)
    density = mass / (4.0 / 3.0 * np.pi * radius**3)
    step = RAYLEIGH_FRACTION * float(np.min(rayleigh_time(radius, density, modulus / (2.0 * (1.0 + nu)), nu)))
    if speed > 0.0:
        quick = int(np.argmin(mass**2 / radius))
        step = min(
            step,
            contact_time(modulus / (1.0 - nu * nu), float(radius[quick]), float(mass[quick]), speed)
            / steps_per_contact,
        )
    return step


@law(forceinline=True)
def stiffness(overlap, bodies, p):
    """k = 2 E* sqrt(R x) [N/m]."""
    return 2.0 * p.modulus * math.sqrt(bodies.radius * overlap)


@law(forceinline=True)
def elastic_force(overlap, stiffness):
    """(2/3) k x [N]."""
    return 2.0 / 3.0 * stiffness * overlap


@law(forceinline=True)
def elastic_energy(overlap, stiffness):
    """(4/15) k x^2 [J]."""
    return 4.0 / 15.0 * stiffness * overlap * overlap


@law
def force(overlap, separation_speed, stiffness, damping):
    """F_n [N] from overlap [m], u_n [m/s], the tangent stiffness k [N/m], C_n [kg/s]; it may pull at the end
    of a contact."""
    return 2.0 / 3.0 * stiffness * overlap - damping * separation_speed
