"""The pressure with which an ellipsoid or mesh begins (``start = "relaxed"``): the weight of the matter between a
particle and the ground above it,

    P(x) = rho a((x + p) / 2) . (x - p),   P >= 0       p the foot of x on the surface
    a(x) = g(x) - omega x (omega x x)                   g attraction of the particles, by the tree, mean of the nearest

which is the integral of rho a along that way where a is linear, as inside a uniform ellipsoid (Binney & Tremaine 2008,
Table 2.1). The pressure is then 0 on the surface and rises below it as the weight does, everywhere. A shape that turns
more slowly or faster than a fluid of its density would is not in balance by that: what is left acts along the ground,
is the slope of it times the weight, and friction or cohesion takes it as the stress comes on.

Without it (``start = "literal"``) all ground falls at once, by g t until the pressure has run through the body, R / c:
half a minute in the low sound speeds of the late stage of Ryugu.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from matter.case.body import Target
from matter.geometry import tree
from matter.solids.distance import Distance

THETA = 0.3
"""Opening angle of the tree."""
NEAREST = 8
"""Particles whose a is averaged: one alone lies up to a spacing beside the middle of the way."""


def pressure(target: Target, depths: Distance, position: np.ndarray, mass: np.ndarray, density: float) -> np.ndarray:
    """P (n,) [Pa] of the particles of a body at rest in its turning frame, at ``position`` (n, 3) [m], of a ``mass``
    (n,) [kg] and one bulk ``density`` [kg/m^3]; ``depths`` below its surface."""
    softening = 0.5 * np.cbrt(mass / density)
    omega = target.placed.spin(target.spin_period)
    felt = tree.gravity(position, mass, softening, THETA)
    felt -= np.cross(omega, np.cross(omega, position))
    depth, inwards = depths.at(position)
    below = np.maximum(depth, 0.0)[:, None] * inwards
    halfway = felt[cKDTree(position).query(position - 0.5 * below, k=min(NEAREST, len(position)))[1]].mean(axis=1)
    return np.asarray(np.maximum(density * np.einsum("ij,ij->i", halfway, below), 0.0))
