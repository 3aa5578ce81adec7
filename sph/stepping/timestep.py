"""The step and what limits it.

    sound         C (h/2) / (c_l (1 + 0.6 alpha) + 0.6 beta max(-mu))  (Courant with the viscous signal: Monaghan 1992,
                                                                       eq. 10.5)
    viscosity     the same, where the term with beta is the larger one
    acceleration  0.3 sqrt((h/2) / |a|)
    divergence    0.2 / |div v|          a Courant limit on c alone misses v dt at contact
    energy        0.3 (u + 0.05 c^2) / |du/dt|
    growth        1.1 times the step before

c_l is the longitudinal speed where there is shear strength. Particles that have lost their neighbours have no say.

Where all neighbours of a particle approach it, viscosity slows it down at the rate

    (4 pi / 3) alpha c h int W dr = (7/3) alpha c / (h/2)            Wendland's kernel: int W dr = 7 / (2 pi h^2)

and explicit steps are stable below two over that: C < (6/7) (1 + 0.6 alpha) / alpha, 0.80 for alpha = 3. Measured in
columns of 60 layers (ice 0.5 and 10, basalt 2, aluminium 5 km/s): C = 0.6 leaves P, rho, u and the shock's speed as
C = 0.3 does within 0.2 %, at 0.7 weakly shocked ice is 1 % too hot, at 0.9 energies are up to 8 % too large.
"""

from __future__ import annotations

import math

import numpy as np

from matter.compilation.jit import parallel_kernel, prange
from sph.bodies.particle_cloud import Cloud
from sph.pairs.rate_arrays import Rates
from sph.pairs.row import SOUND
from sph.stepping.state import Evaluated, interaction_fraction

SOURCES = ("Monaghan1992",)

REASONS = ("sound", "viscosity", "acceleration", "divergence", "energy", "growth", "output")


@parallel_kernel
def _limits(cloud, rates, evaluated, alpha, beta, courant, step, reason):
    """Fill ``step`` (n,) [s] and ``reason`` (n,) from ``sph.bodies.particle_cloud.Fields``,
    ``sph.pairs.rate_arrays.Sums`` and ``sph.stepping.state.Response``."""
    h, u, gravity, count = cloud.support_radius, cloud.specific_energy, cloud.gravity, cloud.neighbours
    wave, row = evaluated.wave, evaluated.row
    approach, acceleration, divergence = rates.approach, rates.acceleration, rates.divergence
    energy_rate = rates.energy
    for i in prange(len(h)):
        if interaction_fraction(count[i]) <= 0.0:
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
        limit = 0.3 * (max(u[i], 0.0) + 0.05 * row[i, SOUND] ** 2) / (abs(energy_rate[i]) + 1e-30)
        if limit < best:
            best, why = limit, 4
        step[i], reason[i] = best, why


def steps(
    cloud: Cloud, rates: Rates, evaluated: Evaluated, alpha: float, beta: float, courant: float
) -> tuple[np.ndarray, np.ndarray]:
    """The largest step (n,) [s] that each particle allows, 1e30 where it has no say, and the index (n,) into
    ``REASONS`` of what limits it."""
    step, reason = np.empty(len(cloud.mass)), np.empty(len(cloud.mass), dtype=np.int8)
    _limits(cloud.fields, rates.sums, evaluated.response, alpha, beta, courant, step, reason)
    return step, reason


def limit(
    cloud: Cloud, rates: Rates, evaluated: Evaluated, alpha: float, beta: float, courant: float
) -> tuple[float, int, int]:
    """The largest allowed step [s], the index into ``REASONS`` of what limits it, and the particle that does."""
    step, reason = steps(cloud, rates, evaluated, alpha, beta, courant)
    i = int(np.argmin(step))
    return float(step[i]), int(reason[i]), i
