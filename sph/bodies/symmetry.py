"""A half or a quarter of an impact that is its own mirror image: mirrors where the rest would be.

    half       y > 0: a projectile that flies in the plane y = 0
    quarter    x > 0 and y > 0: one that falls straight down

Particles meet their images in the mirrors (``sph.boundary.wall``), which push as the rest of the ground would: the
same sums as in a whole whose particles lie as mirror images of each other. What a run leaves is the whole: snapshots
hold the images as particles of their own, and the history's sums count them,

    x' = s x,   v' = s v,   sigma'_ij = s_i s_j sigma_ij,   identity' = identity + k n   (copy k of n particles)
        s = -1 along the axis of a mirror

so that momentum along it and angular momenta about axes in the mirror are zero. Flaws are dealt out in the part that
is computed, as many per volume as in the whole; broken ground is its own mirror image too, and so are fragments.
"""

from __future__ import annotations

import itertools
from typing import Literal

import numpy as np

from matter.case.body import Impact, Target
from matter.particles import Particles

Symmetry = Literal["none", "half", "quarter"]
MIRRORS: dict[str, tuple[int, ...]] = {"none": (), "half": (1,), "quarter": (0, 1)}
"""Axes that mirrors are square to."""


def copies(symmetry: str) -> int:
    """Parts that the whole is made of."""
    return int(2 ** len(MIRRORS[symmetry]))


def fault(symmetry: str, target: Target, impact: Impact) -> str:
    """What of target and impact is not its own mirror image, or an empty text."""
    if symmetry == "none":
        return ""
    if target.solid:
        return f'symmetry = "{symmetry}": a target of shape "{target.shape}" is not its own mirror image'
    if impact.projectile.parts:
        return f'symmetry = "{symmetry}": a projectile of parts is not taken for its own mirror image'
    if symmetry == "quarter" and impact.angle_from_vertical != 0.0:
        return 'symmetry = "quarter" needs an impact straight down (angle_from_vertical = "0 deg"): take "half"'
    return ""


def signs(symmetry: str) -> np.ndarray:
    """Sign of each axis in each copy (copies, 3); the first is the part itself."""
    axes = MIRRORS[symmetry]
    found = np.ones((copies(symmetry), 3))
    for k, flips in enumerate(itertools.product((1.0, -1.0), repeat=len(axes))):
        found[k, list(axes)] = flips
    return found


def unfolded(points: np.ndarray, symmetry: str) -> np.ndarray:
    """Points (n, 3) of the part, and behind them those of its images."""
    return np.concatenate([points * s for s in signs(symmetry)])


def whole(part: Particles, symmetry: str) -> Particles:
    """The particles of the whole: the part as it is, and its images behind it."""
    if symmetry == "none":
        return part
    turned = signs(symmetry)
    fields: dict[str, np.ndarray] = {}
    for name, values in part.items():
        pieces = [values]
        for k, s in enumerate(turned[1:], start=1):
            if name == "identity":
                pieces.append(values + k * len(values))
            elif values.ndim == 2 and values.shape[1] == 3:
                pieces.append(values * s)
            elif values.ndim == 2 and values.shape[1] == 6:
                pieces.append(values * np.array([1.0, s[0] * s[1], s[0] * s[2], 1.0, s[1] * s[2], 1.0]))
            else:
                pieces.append(values)
        fields[name] = np.concatenate(pieces)
    return Particles(fields, part.attributes)


def summed(vector: np.ndarray, symmetry: str, axial: bool = False) -> np.ndarray:
    """The sum over all copies of a vector (3,) of the part; ``axial``: of an angular momentum, which turns its sign
    with the two other axes."""
    turned = signs(symmetry)
    if axial:
        turned = turned.prod(axis=1)[:, None] * turned
    return np.asarray(turned.sum(axis=0) * vector)


def folded(points: np.ndarray, symmetry: str, off: float) -> np.ndarray:
    """Those of a ball's points (n, 3) that lie in the part, at least ``off`` [m] from its mirrors."""
    for axis in MIRRORS[symmetry]:
        points = points[points[:, axis] > 0.0]
        points[:, axis] = np.maximum(points[:, axis], off)
    return points
