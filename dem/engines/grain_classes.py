"""Grains in classes of like stiffness and mass: what an engine calls atom types, and the contact numbers of each pair
of classes.

An engine's contact parameters belong to pairs of types, ours to pairs of grains: k_n = min(k_i, k_j), dashpots C =
number sqrt(k m_red), moments in beta R. Grains of one species whose k_n and mass lie in the same cells of a
logarithmic grid make a class with the mean k_n, mass and radius; ``rounding`` says by how much a pair's own numbers
differ from those of its classes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dem.contact.settings import SPECIES, Contact, GrainLaw
from dem.laws import normal_hooke
from dem.laws.tangential_spring import STIFFNESS_RATIO
from matter.particles import Particles

STIFFNESS_STEP = 0.04
"""Width of a class in ln k_n: no grain's stiffness is rounded by more than about half of it."""
MASS_STEP = 0.3
"""Width of a class in ln m: a dashpot goes with the root of the mass."""
MOST = 60
"""Most classes; beyond, both widths grow until they suffice."""


class PairNumbers(NamedTuple):
    """The contact of two classes, or a class and a wall: restitution e_n, k_n and k_t [N/m], C_n and C_t [kg/s], mu,
    beta, R [m], m_red [kg], mu_r, mu_t."""

    restitution: float
    k_n: float
    k_t: float
    c_n: float
    c_t: float
    friction: float
    shape: float
    radius: float
    reduced: float
    rolling: float
    twisting: float

    @property
    def arm(self) -> float:
        """beta R [m]."""
        return self.shape * self.radius

    @property
    def rough(self) -> bool:
        """Whether anything acts besides the normal force; without friction our law has no moments either."""
        return self.friction > 0.0


@dataclass(frozen=True)
class Classes:
    """``of`` class of each grain; per class: ``species``, ``stiffness`` [N/m], ``mass`` [kg], ``radius`` [m],
    ``count``."""

    of: np.ndarray
    species: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    radius: np.ndarray
    count: np.ndarray

    def __len__(self) -> int:
        return len(self.species)

    @staticmethod
    def sort(grains: Particles) -> Classes:
        """Classes of these grains, in the order of species, stiffness, mass."""
        k_step, m_step = STIFFNESS_STEP, MASS_STEP
        while True:
            k, m = np.log(grains.stiffness), np.log(grains.mass)
            cells = np.column_stack([grains.species, _cell(k, k_step), _cell(m, m_step)])
            cell, of = np.unique(cells, axis=0, return_inverse=True)
            if len(cell) <= MOST:
                break
            k_step, m_step = 1.15 * k_step, 1.15 * m_step
        of = of.reshape(-1)
        count = np.bincount(of)
        stiffness, mass = (np.exp(np.bincount(of, v) / count) for v in (k, m))
        return Classes(of, cell[:, 0].astype(np.int64), stiffness, mass, np.bincount(of, grains.radius) / count, count)

    def pair(self, contact: Contact, a: int, b: int) -> PairNumbers:
        """The contact of a grain of class ``a`` with one of class ``b``."""
        m, r = self.mass, self.radius
        law = softer(law_of(contact, self.species[a]), law_of(contact, self.species[b]))
        k = min(self.stiffness[a], self.stiffness[b])
        return numbers(contact, law, k, m[a] * m[b] / (m[a] + m[b]), r[a] * r[b] / (r[a] + r[b]))

    def wall(self, contact: Contact, a: int, species: int) -> PairNumbers:
        """The contact of a grain of class ``a`` with a wall of ``species``, or with a smooth one (-1)."""
        own = law_of(contact, self.species[a])
        law = own.model_copy(update=SMOOTH) if species < 0 else softer(own, law_of(contact, species))
        return numbers(contact, law, float(self.stiffness[a]), float(self.mass[a]), float(self.radius[a]))

    def merged(self, most: int) -> tuple[Classes, list[np.ndarray]]:
        """At most ``most`` wider classes of like species and stiffness, and which of these make up each (for walls,
        where an engine has few groups)."""
        step = STIFFNESS_STEP
        while True:
            cells = np.column_stack([self.species, _cell(np.log(self.stiffness), step)])
            cell, of = np.unique(cells, axis=0, return_inverse=True)
            if len(cell) <= most:
                break
            step *= 1.2
        of = of.reshape(-1)
        count = np.bincount(of, self.count)

        def mean(values: np.ndarray) -> np.ndarray:
            return np.bincount(of, self.count * values) / count

        stiffness, mass = np.exp(mean(np.log(self.stiffness))), np.exp(mean(np.log(self.mass)))
        wide = Classes(of[self.of], cell[:, 0].astype(np.int64), stiffness, mass, mean(self.radius), count)
        return wide, [np.flatnonzero(of == k) for k in range(len(cell))]

    def rounding(self, grains: Particles) -> dict[str, float]:
        """Rms and largest relative difference of the grains' own stiffness, root of mass and radius from those of
        their classes."""
        out = {}
        for name, own, mean in (
            ("stiffness", grains.stiffness, self.stiffness), ("root_mass", np.sqrt(grains.mass), np.sqrt(self.mass)),
            ("radius", grains.radius, self.radius),
        ):  # fmt: skip
            off = own / mean[self.of] - 1.0
            out[f"{name}_rms"], out[f"{name}_max"] = float(np.sqrt(np.mean(off**2))), float(np.max(np.abs(off)))
        return out


SMOOTH = {"friction": 0.0, "shape": 0.0, "rolling": 0.0, "twisting": 0.0}


def _cell(values: np.ndarray, step: float) -> np.ndarray:
    """Cells of equal width over the whole range, none wider than ``step``; values that agree to rounding share one."""
    low, high = values.min(), values.max()
    parts = max(1, int(np.ceil((high - low) / step - 1e-9)))
    return np.minimum(((values - low) / max(high - low, 1e-12) * parts).astype(np.int64), parts - 1)


def law_of(contact: Contact, species: int) -> GrainLaw:
    """The law of a species."""
    return getattr(contact, SPECIES[species])


def softer(one: GrainLaw, two: GrainLaw) -> GrainLaw:
    """The law of a contact between two species: the smaller of each value (``Contact.pair_table``)."""
    first, second = one.model_dump(), two.model_dump()
    return GrainLaw.model_construct(
        **{
            name: min(first[name], second[name]) if isinstance(first[name], float | int) else first[name]
            for name in first
        }
    )


def numbers(contact: Contact, law: GrainLaw, k: float, reduced: float, radius: float) -> PairNumbers:
    """Springs and dashpots from the law, k_n, m_red and R."""
    ratio = STIFFNESS_RATIO
    root = np.sqrt(k * reduced)
    c_n = float(normal_hooke.damping_number(law.restitution) * root)
    c_t = float(normal_hooke.damping_number(law.restitution_tangential) * np.sqrt(ratio) * root)
    return PairNumbers(
        law.restitution,
        float(k),
        float(ratio * k),
        c_n,
        c_t,
        law.friction,
        law.shape,
        float(radius),
        float(reduced),
        law.rolling,
        law.twisting,
    )
