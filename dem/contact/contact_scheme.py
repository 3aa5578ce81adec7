"""What the loops over grains and contacts are compiled for, and what they are given: arrays and numbers under one name
each.

Columns of the tables: ``dem.contact.columns``; n grains, the first of them in the contact search; m entries of the
list of pairs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dem.contact.columns import HISTORY, REFERENCE_STIFFNESS, USUAL


class Scheme(NamedTuple):
    """The choices; each is a constant to the compiler, so that a case pays for no law that it does not use.

    ``normal``, ``tangential``, ``rolling``, ``twisting``, ``cohesion``: numbers of the laws in their families
    (``dem.laws.dispatch``); ``rescale`` 1: the stiffness of springs follows the contact
    (``retained_fraction`` of the tangential law); ``offset`` 1: contacts carry an offset to their overlap
    (``dem.stiffness.change``); ``attract`` 1: grains attract each other (``dem.grains.self_gravity``); ``shaken`` 1:
    vibration takes friction from them (``dem.laws.shaken_friction``).
    """

    normal: int = 0
    tangential: int = 0
    rolling: int = 0
    twisting: int = 0
    cohesion: int = 0
    rescale: int = 0
    offset: int = 0
    attract: int = 0
    shaken: int = 0

    @property
    def history(self) -> int:
        """Columns of a contact's history (``dem.contact.columns``)."""
        return USUAL + 1 if self.offset else REFERENCE_STIFFNESS + 1 if self.rescale else HISTORY


class Chunk(NamedTuple):
    """What one thread works on: its ``number``, grains ``lo`` to ``hi``, and entries ``begin`` to ``end`` of the list;
    ``active`` grains are searched."""

    number: int
    lo: int
    hi: int
    begin: int
    end: int
    active: int


class Step(NamedTuple):
    """``dt`` [s] and ``half`` of it (0: forces are only evaluated); ``over_speed``: limit on the closing speed of a
    returned grain over the contact wave speed (0: none); ``warn``: overlaps above this are counted, in radii."""

    dt: float
    half: float
    over_speed: float
    warn: float


class Grains(NamedTuple):
    """``X``, ``V``, ``W``, ``A``, ``E``, ``F``: tables of ``dem.contact.columns``; ``kind`` (n,) species; ``returned``
    (n,) 1 for grains that have been ballistic."""

    X: np.ndarray
    V: np.ndarray
    W: np.ndarray
    A: np.ndarray
    E: np.ndarray
    F: np.ndarray
    kind: np.ndarray
    returned: np.ndarray


class Listed(NamedTuple):
    """The half list: grains ``first`` and ``col`` (m,) of each entry, ``known`` (m,) 1 where the history is not
    empty, ``hist`` (m, columns), ``table`` (species, species, columns) the numbers of a contact; ``bearing`` (n,) the
    fraction of a grain's normal forces that friction is made of (one number, not read, where nothing shakes)."""

    first: np.ndarray
    col: np.ndarray
    known: np.ndarray
    hist: np.ndarray
    table: np.ndarray
    bearing: np.ndarray


class Halo(NamedTuple):
    """Forces that chunks add to grains of later chunks: ``force`` (chunks, n, 6), each up to grain ``last``
    (chunks,)."""

    force: np.ndarray
    last: np.ndarray


class Boundaries(NamedTuple):
    """Walls: ``rows`` (w, columns; ``dem.contact.walls``), ``near`` (n,) 1 for grains that can reach one before the
    next list, ``table`` (w, species, columns) the numbers of a contact, ``hist`` (n, w, columns)."""

    rows: np.ndarray
    near: np.ndarray
    table: np.ndarray
    hist: np.ndarray


class ExternalField(NamedTuple):
    """Body forces: ``uniform`` (3,) gravity [m/s^2]; central gravity ``table`` up to ``radius`` [m]
    (``dem.contact.gravity``), times ``weight`` (n,); ``drag`` (n,) linear damping of velocity and spin [1/s]; ``pull``
    (n, 3) acceleration by all other grains."""

    uniform: np.ndarray
    table: np.ndarray
    radius: float
    weight: np.ndarray
    drag: np.ndarray
    pull: np.ndarray
