"""The history of contacts in a snapshot: tables by the identities of the grains, read and written.

``contacts/pair`` (c, 2) the two identities, the smaller first, sorted; ``contacts/history`` (c, 7 or 8) the columns of
``dem.contact.columns`` that a snapshot holds; ``contacts/wall_pair`` (w, 2) grain's identity and number of the wall;
``contacts/wall_history`` (w, 7 or 8).
"""

from __future__ import annotations

import numpy as np

from dem.contact.columns import HISTORY, OFFSET, TOUCHING, TWIST
from matter.particles import Particles


def columns(offset: bool) -> list[int]:
    """Columns of the history that a snapshot holds."""
    return [*range(TOUCHING), OFFSET] if offset else [*range(TOUCHING)]


def written(
    identity: np.ndarray,
    touching: tuple[np.ndarray, np.ndarray, np.ndarray],
    wall_history: np.ndarray,
    kept: list[int],
) -> dict[str, np.ndarray]:
    """The four tables of contacts between the grains of present indices, with their rows, and with walls (n, walls,
    columns)."""
    first, second, rows = touching
    pair = np.column_stack([identity[first], identity[second]])
    swap = pair[:, 0] > pair[:, 1]
    rows = rows[:, kept].copy()
    rows[swap, :TWIST] *= -1.0
    pair[swap] = pair[swap, ::-1]
    sort = np.lexsort((pair[:, 1], pair[:, 0]))
    grain, wall = np.nonzero(wall_history[:, :, TOUCHING])
    order = np.lexsort((wall, identity[grain]))
    grain, wall = grain[order], wall[order]
    return {
        "contacts/pair": pair[sort], "contacts/history": rows[sort],
        "contacts/wall_pair": np.column_stack([identity[grain], wall]).astype(np.int64),
        "contacts/wall_history": wall_history[grain, wall][:, kept],
    }  # fmt: skip


def pairs(
    grains: Particles, identity: np.ndarray, width: int, offset: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Contacts of a snapshot as present indices and history rows (c, ``width``); contacts of grains that are gone are
    left out."""
    pair = grains.tables.get("contacts/pair")
    if pair is None or len(pair) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros((0, width))
    first, second = _index_of(identity, pair[:, 0]), _index_of(identity, pair[:, 1])
    good = (first >= 0) & (second >= 0)
    history = np.ones((int(good.sum()), width))
    rows = grains.tables["contacts/history"][good]
    history[:, :TOUCHING] = rows[:, :TOUCHING]
    history[:, HISTORY:] = 0.0
    if offset and rows.shape[1] > TOUCHING:
        history[:, OFFSET] = rows[:, TOUCHING]
    return first[good], second[good], history


def take_walls(grains: Particles, identity: np.ndarray, wall_history: np.ndarray, offset: bool) -> None:
    """Set the rows (n, walls, columns) of the contacts with walls that a snapshot holds."""
    pair = grains.tables.get("contacts/wall_pair")
    if pair is None or len(pair) == 0:
        return
    index = _index_of(identity, pair[:, 0])
    good = (index >= 0) & (pair[:, 1] < wall_history.shape[1])
    index, wall = index[good], pair[good, 1]
    rows = grains.tables["contacts/wall_history"][good]
    wall_history[index, wall, :TOUCHING] = rows[:, :TOUCHING]
    if offset and rows.shape[1] > TOUCHING:
        wall_history[index, wall, OFFSET] = rows[:, TOUCHING]
    wall_history[index, wall, TOUCHING] = 1.0


def _index_of(identity: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Index of each wanted identity, -1 where there is none."""
    order = np.argsort(identity, kind="stable")
    found = np.minimum(np.searchsorted(identity[order], wanted), len(identity) - 1)
    index = order[found]
    return np.where(identity[index] == wanted, index, -1)
