"""The step and what limits it.

    sound         C (h/2) / (c_l (1 + a alpha f) + b beta max(-mu))   (Courant with the viscous signal: Monaghan 1992,
                                                                      eq. 10.5, a = b = 0.6)
    viscosity     the same, where the term with beta is the larger one
    acceleration  0.3 sqrt((h/2) / |a|)
    divergence    0.2 / |div v|          a Courant limit on c alone misses v dt at contact
    energy        0.3 (u + 0.05 c^2) / |du/dt|
    growth        1.1 times the step before

c_l is the longitudinal speed where there is shear strength. Particles that have lost their neighbours have no say.

f is 1 with Monaghan's viscosity. With reconstructed jumps it is the fraction of the neighbours, weighted as in the
mean pressure (``sph.pairs.bearing_pressure``), whose approach the viscosity sees: up to 1 in a front, near 1/2 in
disordered flow, 0 where matter expands. There a = 0.62 and b = 0.67, so that C = 0.5 gives the step of a = b = 0.6 and
C = 0.45 where f = 1 (1.09 times) and where beta acts, and up to 3.1 times that step where nothing is braked.

Where all neighbours of a particle approach it, viscosity slows it down at the rate

    (4 pi / 3) alpha c h int W dr = (7/3) alpha c / (h/2)            Wendland's kernel: int W dr = 7 / (2 pi h^2)

and explicit steps are stable below two over that. At C = 0.5 and alpha = 3 the step is 1.22 over it with f = 1; in
a front no more than three quarters of the neighbours approach: 1.46 over the rate of all. Friction
asks for C <= 0.5 where only sound is carried: sand at rest under 500 g creeps with 0.75 (docs/results/time_step).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from matter.compilation.jit import parallel_kernel, prange
from sph.bodies.particle_cloud import Cloud
from sph.pairs.rate_arrays import Rates
from sph.pairs.scheme import Damping
from sph.stepping.state import Evaluated, interaction_fraction

SOURCES = ("Monaghan1992",)


class Signal(NamedTuple):
    """Weights a and b of alpha and beta in the signal speed."""

    linear: float
    quadratic: float


MONAGHAN, RECONSTRUCTED = Signal(0.6, 0.6), Signal(0.62, 0.67)

REASONS = ("sound", "viscosity", "acceleration", "divergence", "energy", "growth", "output")


@parallel_kernel
def _limits(cloud, rates, evaluated, alpha, beta, courant, signals, step, reason):
    """Fill ``step`` (n,) [s] and ``reason`` (n,) from ``sph.bodies.particle_cloud.Fields``,
    ``sph.pairs.rate_arrays.Sums`` and ``sph.stepping.state.Response``."""
    h, u, gravity, count = cloud.support_radius, cloud.specific_energy, cloud.gravity, cloud.neighbours
    wave, sound = evaluated.wave, evaluated.sound
    approach, acceleration, divergence = rates.approach, rates.acceleration, rates.divergence
    energy_rate, approaching = rates.energy, rates.approaching
    for i in prange(len(h)):
        if interaction_fraction(count[i]) <= 0.0:
            step[i], reason[i] = 1e30, 0
            continue
        half = 0.5 * h[i]
        signal = wave[i] * (1.0 + signals.linear * alpha * approaching[i])
        viscous = signals.quadratic * beta * approach[i]
        best, why = courant * half / (signal + viscous), 1 if viscous > signal else 0
        a2 = 0.0
        for c in range(3):
            a2 += (acceleration[i, c] + gravity[i, c]) ** 2
        limit = 0.3 * math.sqrt(half / math.sqrt(a2 + 1e-60))
        if limit < best:
            best, why = limit, 2
        limit = 0.2 / (abs(divergence[i]) + 1e-30)
        if limit < best:
            best, why = limit, 3
        limit = 0.3 * (max(u[i], 0.0) + 0.05 * sound[i] ** 2) / (abs(energy_rate[i]) + 1e-30)
        if limit < best:
            best, why = limit, 4
        step[i], reason[i] = best, why


def steps(
    cloud: Cloud, rates: Rates, evaluated: Evaluated, damping: Damping, courant: float, signal: Signal
) -> tuple[np.ndarray, np.ndarray]:
    """The largest step (n,) [s] that each particle allows, 1e30 where it has no say, and the index (n,) into
    ``REASONS`` of what limits it."""
    step, reason = np.empty(len(cloud.mass)), np.empty(len(cloud.mass), dtype=np.int8)
    _limits(cloud.fields, rates.sums, evaluated.response, damping.alpha, damping.beta, courant, signal, step, reason)
    return step, reason


def limit(
    cloud: Cloud, rates: Rates, evaluated: Evaluated, damping: Damping, courant: float, signal: Signal
) -> tuple[float, int, int]:
    """The largest allowed step [s], the index into ``REASONS`` of what limits it, and the particle that does."""
    step, reason = steps(cloud, rates, evaluated, damping, courant, signal)
    i = int(np.argmin(step))
    return float(step[i]), int(reason[i]), i
