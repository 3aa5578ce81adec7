"""The step and what limits it.

    sound         C (h/2) / (c_l (1 + 0.6 alpha) + 0.6 beta max(-mu))       Courant with the viscous signal (Monaghan 1992, eq. 10.5)
    viscosity     the same, where the term with beta is the larger one
    acceleration  0.3 sqrt((h/2) / |a|)
    divergence    0.2 / |div v|                                            a Courant limit on c alone misses v dt at contact
    energy        0.3 (u + 0.05 c^2) / |du/dt|
    growth        1.1 times the step before
    error         of a step with control of its error (``sph.runge_kutta``)

c_l is the longitudinal speed where there is shear strength. Particles that have lost their neighbours have no say.
"""

from __future__ import annotations

import math

import numpy as np

from matter.jit import parallel_kernel, prange
from sph.state import holding

SOURCES = ("Monaghan1992",)

REASONS = ("sound", "viscosity", "acceleration", "divergence", "energy", "growth", "output", "error")


@parallel_kernel
def _limits(h, wave, sound, approach, acceleration, gravity, divergence, u, energy_rate, count, alpha, beta, courant, step, reason):
    for i in prange(len(h)):
        if holding(count[i]) <= 0.0:
            step[i], reason[i] = 1e30, 0
            continue
        half = 0.5 * h[i]
        signal, viscous = wave[i] * (1.0 + 0.6 * alpha), 0.6 * beta * approach[i]
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


def limit(cloud, rates, evaluated, alpha: float, beta: float, courant: float) -> tuple[float, int, int]:
    """The largest allowed step [s], the index into ``REASONS`` of what limits it, and the particle that does."""
    step, reason = np.empty(len(cloud.mass)), np.empty(len(cloud.mass), dtype=np.int8)
    _limits(
        cloud.smoothing_length, evaluated.wave, evaluated.sound, rates.approach, rates.acceleration, cloud.gravity, rates.divergence,
        cloud.specific_energy, rates.energy, cloud.neighbours, alpha, beta, courant, step, reason,
    )  # fmt: skip
    i = int(np.argmin(step))
    return float(step[i]), int(reason[i]), i
