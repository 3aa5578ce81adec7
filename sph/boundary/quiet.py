"""A quiet layer before the outer edge: waves run into it and do not come back.

Velocity and the departures of density, energy and stress from their start all fade at one rate,

    d(v, rho - rho_0, u - u_0, S)/dt = -kappa c (v, rho - rho_0, u - u_0, S),   kappa(d) = 3 A d^2 / D^3

with c the longitudinal wave speed, d the depth in the layer and D its width. Because velocity and stress fade alike,
the impedance of the layer is that of the matter at every frequency (the matched layer of one dimension): no continuous
profile reflects, only its resolution does. A wave crosses the layer with exp(-A) of its amplitude left, turns at the
fixed rim and leaves with exp(-2 A).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from matter.case.body import Target
from matter.case.quantity import PositiveLength
from matter.compilation.jit import parallel_kernel, prange
from sph.boundary import fixed

WORDS = "a layer that absorbs waves, before a rim that never moves"
TAKES_MOMENTUM = FLOOR = RIM = True
RESTS_ON = (fixed,)

ATTENUATION = 2.5  # A: exp(-2 A) = 0.7 %
SPACINGS, LARGEST_FRACTION = 4.0, 0.37
"""Width that is not given: these far spacings, at most this fraction of the ground."""


class Parameters(NamedTuple):
    """``edge_width``: D [m]."""

    edge_width: Annotated[
        PositiveLength | None,
        Field(
            description="Width of the quiet layer; by default four times ``spacing_far``, at most 0.37 of the ground."
        ),
    ] = None


def width(p: Parameters, target: Target, spacing_far: float) -> float:
    """D [m], for ground whose particles are ``spacing_far`` [m] apart at the edge."""
    if p.edge_width is not None:
        return p.edge_width
    return min(SPACINGS * spacing_far, LARGEST_FRACTION * min(target.radius, target.half_width))


def coefficient(inside: np.ndarray, width: float) -> np.ndarray:
    """kappa (n,) [1/m] at the distance ``inside`` (n,) [m] from the rim (the outer end of the layer), for a layer of
    ``width`` [m]."""
    depth = np.clip(width - inside, 0.0, width)
    return 3.0 * ATTENUATION * depth**2 / width**3


@parallel_kernel
def fade(dt, identity, kappa, rest_density, rest_energy, wave, velocity, density, energy, stress):
    """One step ``dt`` [s] of the law above, in place; ``kappa``, ``rest_density`` and ``rest_energy`` by identity."""
    for i in prange(len(identity)):
        k = kappa[identity[i]]
        if k > 0.0:
            keep = math.exp(-k * wave[i] * dt)
            rho0, u0 = rest_density[identity[i]], rest_energy[identity[i]]
            density[i] = rho0 + keep * (density[i] - rho0)
            energy[i] = u0 + keep * (energy[i] - u0)
            for c in range(3):
                velocity[i, c] *= keep
            for c in range(5):
                stress[i, c] *= keep
