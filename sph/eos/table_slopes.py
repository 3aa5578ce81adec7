"""Slopes at the nodes of a table, and which of its cells a phase boundary cuts.

A file says nothing of phases, but its columns do. Where two phases coexist isotherms are flat,

    |dP| < FLAT |P| dx,   x = ln rho    (a gas: dP = P dx, all else is stiffer)

and nodes at either end of such a step are a mixture. Where a boundary is crossed, u, q = P / rho or P bend: of the
steps s of slope along a line of nodes, those before and after the bend differ, and much more than neighbours on
either side of it do:

    |s_(m+1) - s_(m-1)| > BEND (|s_(m-1) - s_(m-2)| + |s_(m+2) - s_(m+1)|) + LEAST (|s_(m-1)| + |s_(m+1)|)

(1/4 of that for a smooth curve). A cell is cut where some of its corners are a mixture and others are not, where a
bend lies on one of its sides, or where the energy falls back. A slope at a node beside such a side is that of the
whole side alone, so that the bend does not spoil the neighbour.
"""

from __future__ import annotations

import numpy as np

FLAT = 0.03
BEND, LEAST = 4.0, 0.05
FALLEN = 1e-6
"""Fraction of the span of the energies at one density by which one may fall back before it is more than rounding."""


def mixed(x: np.ndarray, P: np.ndarray) -> np.ndarray:
    """Which nodes are mixtures of two phases; ``x`` (n,) = ln rho, ``P`` (n, k) [Pa]."""
    flat = np.abs(np.diff(P, axis=0)) < FLAT * np.diff(x)[:, None] * np.minimum(np.abs(P[1:]), np.abs(P[:-1]))
    none = np.zeros_like(P[:1], dtype=bool)
    return np.concatenate([flat, none]) | np.concatenate([none, flat])


def rising(u: np.ndarray) -> np.ndarray:
    """Energies (n, k) that rise with temperature: where those of a file stand still (its digits) or fall back (a
    stretched solid that gives way to the mixture), straight from the last node before to the first above it."""
    mended = u.copy()
    index = np.arange(u.shape[1])
    tops = np.maximum.accumulate(u, axis=1)
    fresh = np.diff(tops, axis=1, prepend=-np.inf) > 0.0
    for one, new, span in zip(mended, fresh, np.ptp(u, axis=1)):
        if not new.all():
            one[:] = np.interp(index, index[new], one[new]) + 1e-9 * span * np.maximum(index - index[new][-1], 0)
    return mended


def cut_sides(x: np.ndarray, u: np.ndarray, P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which steps along the isotherms (n - 1, k) and along the densities (n, k - 1) a phase boundary cuts, of the
    nodes (n, k); ``u`` as the file has it."""
    mixture, q = mixed(x, P), P / np.exp(x)[:, None]
    along = (mixture[1:] != mixture[:-1]) | _bent(np.diff(P, axis=0) / np.diff(x)[:, None])
    up = (mixture[:, 1:] != mixture[:, :-1]) | _bent((np.diff(q, axis=1) / np.diff(rising(u), axis=1)).T).T
    behind = np.maximum.accumulate(u, axis=1) - u > FALLEN * np.ptp(u, axis=1)[:, None]
    return along, up | behind[:, 1:] | behind[:, :-1]


def _bent(step: np.ndarray) -> np.ndarray:
    """Which of the steps of slope (n - 1, k) hold a bend."""
    bent = np.zeros(step.shape, dtype=bool)
    jump, size = np.abs(step[3:-1] - step[1:-3]), np.abs(step[3:-1]) + np.abs(step[1:-3])
    beside = np.abs(step[1:-3] - step[:-4]) + np.abs(step[4:] - step[3:-1])
    bent[2:-2] = jump > BEND * beside + LEAST * size
    return bent


def along_density(x: np.ndarray, value: np.ndarray, cut: np.ndarray) -> np.ndarray:
    """df/dx at the nodes ``x`` (n,) of ``value`` (n, k): of the parabola through three, at most three times the lesser
    of the two steps beside it (Hyman 1983); ``cut`` (n - 1, k): steps across a phase boundary."""
    h = np.broadcast_to(np.diff(x)[:, None], cut.shape)
    step = np.diff(value, axis=0) / h
    left, right, near, far = step[:-1], step[1:], h[:-1], h[1:]
    limit = 3.0 * np.minimum(np.abs(left), np.abs(right))
    both = np.clip((far * left + near * right) / (near + far), -limit, limit)
    return _chosen(step, cut, both, _straight_on(step, h, cut), _straight_on(step[::-1], h[::-1], cut[::-1])[::-1])


def along_energy(u: np.ndarray, q: np.ndarray, cut: np.ndarray) -> np.ndarray:
    """dq/du along each density at the nodes (n, k): the geometric mean of the steps on both sides (Delbourgo & Gregory
    1985: right for an exponential, as along the vapour curve), 0 at a turn; ``cut`` (n, k - 1) as above."""
    h, cut = np.diff(u, axis=1).T, cut.T
    step = np.diff(q, axis=1).T / h
    left, right, near, far = step[:-1], step[1:], h[:-1], h[1:]
    fraction = far / (near + far)
    size = np.abs(left) ** fraction * np.abs(right) ** (1.0 - fraction)
    both = np.where(left * right > 0.0, np.sign(left) * size, 0.0)
    return _chosen(step, cut, both, _power_on(step, h, cut), _power_on(step[::-1], h[::-1], cut[::-1])[::-1]).T


def _chosen(step: np.ndarray, cut: np.ndarray, both: np.ndarray, ahead: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """The slope of each node: of both sides, or of the one that is whole; ``ahead`` (n - 1,) those of the steps at
    their first node, ``behind`` at their last."""
    middle = np.where(cut[:-1] & ~cut[1:], ahead[1:], np.where(cut[1:] & ~cut[:-1], behind[:-1], both))
    return np.concatenate([ahead[:1], middle, behind[-1:]])


def _straight_on(step: np.ndarray, h: np.ndarray, cut: np.ndarray) -> np.ndarray:
    """The slope at the first node of each step, from it and the next: of a parabola, of its sign and at most three
    times it."""
    on = step.copy()
    grown = step[:-1] + (step[:-1] - step[1:]) * h[:-1] / (h[:-1] + h[1:])
    low, high = np.minimum(3.0 * step[:-1], 0.0), np.maximum(3.0 * step[:-1], 0.0)
    on[:-1] = np.where(cut[1:], step[:-1], np.clip(grown, low, high))
    return on


def _power_on(step: np.ndarray, h: np.ndarray, cut: np.ndarray) -> np.ndarray:
    """The same, of an exponential."""
    on = step.copy()
    same = (step[:-1] * step[1:] > 0.0) & ~cut[1:]
    ratio = np.where(same, step[:-1], 1.0) / np.where(same, step[1:], 1.0)
    on[:-1] = step[:-1] * np.clip(ratio, 1.0 / 9.0, 9.0) ** (h[:-1] / (h[:-1] + h[1:]))
    return on
