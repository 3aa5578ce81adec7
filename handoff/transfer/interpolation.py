"""A velocity field between particles: first-order moving least squares, exact for every linear field.

At a point x the field is fitted as v(x') = v0 + G (x' - x) over the k nearest particles, weighted by their volume and
the Wendland C2 kernel W(q) = (1 - q)^4 (4 q + 1), q = |x' - x| / H with H the distance of the (k+1)-th particle. v0 is
the value, curl v / 2 from G the rotation rate that a grain's spin takes over. Translations, rigid rotations, shears
and uniform expansions come out exactly, in any cloud.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

_CHUNK = 20_000
# a fit whose smallest scaled moment falls below this fraction of the largest (particles in one plane) loses its
# gradient there
_RIDGE = 1e-4
_REACH = 2.0


def local_linear(
    tree: cKDTree, velocity: np.ndarray, volume: np.ndarray, query: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Velocity (m, 3) [m/s] and its gradient (m, 3, 3) [1/s], ``gradient[:, a, b]`` = d v_b / d x_a, at the points
    ``query`` (m, 3).

    ``tree`` over the particle positions, ``velocity`` (n, 3), ``volume`` (n,), ``count`` neighbours used. The linear
    part is limited to ``_REACH`` times the largest deviation among the neighbours from their mean, so that no velocity
    is made up beyond the free surface.
    """
    count = min(count, tree.n - 1)
    value, gradient = np.empty((len(query), 3)), np.zeros((len(query), 3, 3))
    for begin in range(0, len(query), _CHUNK):
        rows = slice(begin, begin + _CHUNK)
        distance, near = tree.query(query[rows], k=count + 1)
        reach = distance[:, -1:]
        near = near[:, :-1]
        q = distance[:, :-1] / reach
        weight = volume[near] * (1.0 - q) ** 4 * (4.0 * q + 1.0)
        weight = np.maximum(weight, 1e-300)
        weight /= weight.sum(axis=1, keepdims=True)
        offset = (tree.data[near] - query[rows, None]) / reach[..., None]
        centre = np.einsum("ik,ika->ia", weight, offset)
        mean = np.einsum("ik,ikb->ib", weight, velocity[near])
        offset -= centre[:, None]
        around = velocity[near] - mean[:, None]
        moment = np.einsum("ik,ika,ikb->iab", weight, offset, offset)
        ridge = _RIDGE * np.trace(moment, axis1=1, axis2=2)
        eigenvalue, vector = np.linalg.eigh(moment)
        inverse = np.where(eigenvalue > ridge[:, None], 1.0 / np.maximum(eigenvalue, 1e-300), 0.0)
        cross = np.einsum("ik,ika,ikb->iab", weight, offset, around)
        slope = np.einsum("iac,ic,idc,idb->iab", vector, inverse, vector, cross)
        step = -np.einsum("ia,iab->ib", centre, slope)
        largest = _REACH * np.sqrt(np.max(np.einsum("ikb,ikb->ik", around, around), axis=1))
        length = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, largest / np.maximum(length, 1e-300))[:, None]
        value[rows] = mean + step
        gradient[rows] = slope / reach[..., None]
    return value, gradient


def matching_factor(
    tree: cKDTree, wanted: np.ndarray, own: np.ndarray, count: int = 24, passes: int = 2
) -> np.ndarray:
    """Smooth factor (n,) such that ``own`` times it has the local sums of ``wanted``; 1 where nothing is there.

    The kernel mean of ``wanted`` over that of ``own`` among the ``count`` nearest points of ``tree``, W = (1 - q^2)^2
    with q the distance over that of the last one; every further pass adds the same of what is left.
    """
    count = min(count, tree.n - 1)
    distance, near = tree.query(tree.data, k=count + 1)
    weight = (1.0 - (distance / distance[:, -1:]) ** 2) ** 2

    def around(values: np.ndarray) -> np.ndarray:
        return np.einsum("ik,ik->i", weight, values[near])

    mean = around(own)
    factor = np.zeros(len(own))
    for _ in range(passes):
        factor += np.where(
            mean > 0.0, around(wanted - own * factor) / np.where(mean > 0.0, mean, 1.0), 0.0 if factor.any() else 1.0
        )
    return factor


def rotation_rate(gradient: np.ndarray) -> np.ndarray:
    """Half the vorticity (m, 3) [rad/s] of a gradient d v_b / d x_a (m, 3, 3)."""
    return 0.5 * np.stack(
        [
            gradient[:, 1, 2] - gradient[:, 2, 1],
            gradient[:, 2, 0] - gradient[:, 0, 2],
            gradient[:, 0, 1] - gradient[:, 1, 0],
        ],
        axis=1,
    )
