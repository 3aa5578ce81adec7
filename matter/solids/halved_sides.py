"""A surface of triangles made finer without gaps: sides that are too long are cut in their middle, for both triangles
that share them.

A triangle with one such side becomes two, with two three, with three four. Cutting whole triangles instead leaves
corners on the uncut sides of their neighbours, which part from these as soon as the corners move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Sides(NamedTuple):
    """The sides of triangles: ``ends`` (e, 2), corners of each, and ``of`` (m, 3), which side of them leads from each
    corner of a triangle to its next."""

    ends: np.ndarray
    of: np.ndarray


def sides(triangles: np.ndarray) -> Sides:
    """Every side of ``triangles`` (m, 3) once."""
    pairs = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    # one number a side, which sorts as the pairs do: six times as fast as unique rows
    width = int(triangles.max(initial=0)) + 1
    numbers, of = np.unique(pairs[:, 0].astype(np.int64) * width + pairs[:, 1], return_inverse=True)
    return Sides(np.stack(np.divmod(numbers, width), axis=1), of.reshape(-1, 3))


def halved(
    vertices: np.ndarray, triangles: np.ndarray, known: Sides, cut: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """``vertices`` (n, 3) [m] with the middles of the sides that are ``cut`` (e,) behind them, and the triangles
    between them, which face as before."""
    number = np.full(len(cut), -1)
    number[cut] = len(vertices) + np.arange(np.count_nonzero(cut))
    middle = number[known.of]
    count = (middle >= 0).sum(axis=1)
    found = [triangles[count == 0]]
    # turned so that a triangle's one cut side comes first, its one uncut side last
    for cuts, sought in ((1, middle >= 0), (2, middle < 0), (3, middle >= 0)):
        here = np.flatnonzero(count == cuts)
        first = (np.argmax(sought[here], axis=1) + (1 if cuts == 2 else 0)) % 3
        order = (first[:, None] + np.arange(3)) % 3
        (a, b, c), (p, q, r) = (array[here[:, None], order].T for array in (triangles, middle))
        if cuts == 1:
            found += [np.stack([a, p, c], 1), np.stack([p, b, c], 1)]
        elif cuts == 2:
            found += [np.stack([p, b, q], 1), np.stack([a, p, q], 1), np.stack([a, q, c], 1)]
        else:
            found += [np.stack(one, 1) for one in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))]
    return np.concatenate([vertices, vertices[known.ends[cut]].mean(axis=1)]), np.concatenate(found)
