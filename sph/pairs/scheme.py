"""What the loops over pairs are compiled for and what they read. A choice (``Scheme``) is a constant to the compiler,
so that a run pays for nothing that it does not use."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sph.pairs.row import NARROW, WIDTH


class Scheme(NamedTuple):
    """The choices, named as in a case file.

    kernel : number of the kernel in ``sph.kernels.dispatch``; reconstructed : ``numerics = "reconstructed"``, its
    viscosity and sums weighted by the volumes of the start; corrected : ``gradients = "corrected"``; switched : a
    ``viscosity_switch``; with_bodies : whether there is more than the ground, a projectile or blocks
    (``sph.pairs.body_contact``).
    """

    kernel: int = 0
    reconstructed: bool = False
    corrected: bool = False
    switched: bool = False
    with_bodies: bool = False

    @property
    def conducting(self) -> bool:
        """Whether heat is conducted (``sph.pairs.conductivity``), which asks to know the smooth flow, and for room in
        the extra rows (``sph.pairs.row``)."""
        return self.reconstructed and not (self.switched or self.corrected)

    @property
    def extra_rows(self) -> bool:
        """Whether the pair loop reads extra columns (``Rows.extra``)."""
        return self.corrected or self.switched or self.reconstructed

    @property
    def extra_width(self) -> int:
        """Number of extra columns: narrow rows halve what the loop gathers."""
        return WIDTH if self.corrected else NARROW


class Pairs(NamedTuple):
    """A neighbour list: ``partner[first[i] : first[i] + number[i]]`` are the neighbours of particle i, filled up with
    i itself to a multiple of ``matter.compilation.gather.LANES``."""

    partner: np.ndarray
    first: np.ndarray
    number: np.ndarray

    @classmethod
    def from_neighbours(cls, neighbours) -> Pairs:
        """Of ``matter.geometry.neighbours.Neighbours``."""
        return cls(neighbours.index, neighbours.entry, neighbours.count)


class Rows(NamedTuple):
    """What the particles bring to the pairs: ``row`` and ``extra`` (n and images, 16; ``sph.pairs.row``),
    ``start_density`` (n,) [kg/m^3], ``inverse`` (n, 6), the correction B of the gradients, and how ``filled`` (n,) the
    neighbourhoods are (``sph.pairs.length_terms``); empty where the scheme does not read them."""

    row: np.ndarray
    extra: np.ndarray
    start_density: np.ndarray
    inverse: np.ndarray
    filled: np.ndarray


class Matter(NamedTuple):
    """What the particles are of: ``material`` (n,) number, ``shear`` (m,) modulus of the materials [Pa],
    ``strain_ratio`` (n, 2) strain of the matrix over that of the porous material in compression and in expansion,
    ``stress`` (n, 5) deviator [Pa], ``strength`` whether it follows the strain."""

    material: np.ndarray
    shear: np.ndarray
    strain_ratio: np.ndarray
    stress: np.ndarray
    strength: bool


class Damping(NamedTuple):
    """Coefficients of the artificial viscosity (``sph.viscosity``) and of the artificial conductivity
    (``sph.pairs.conductivity``); ``near``: spacing over support (of ``sph.viscosity.reconstructed``)."""

    alpha: float
    beta: float
    near: float = 0.5
    conductivity: float = 0.0
