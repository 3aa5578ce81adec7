"""A block of cells about the axis, and its course in time."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sph.materials.rows import Materials
from studies.eulerian import friction, godunov, tracers

COURANT = 0.45
EMPTY = 1e-3
"""Fraction of the density at rest up to which a cell counts as empty: thinner spray costs steps and does nothing."""


@dataclass
class Flow:
    """``conserved`` (nr, nz, 5, or 8 with friction: columns of ``godunov``) in square cells of size ``h`` [m], the
    lowest face at ``bottom`` [m]; one material of ``materials``; markers at ``position`` (n, 2: r, z) [m] with their
    largest pressure ``peak`` (n,) [Pa]. ``ends``: what the boundaries are in r (inner, outer) and z (lower, upper);
    ``empty``: fraction of the density at rest up to which a cell counts as empty.
    """

    conserved: np.ndarray
    h: float
    bottom: float
    materials: Materials
    position: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    ends: tuple[tuple[int, int], tuple[int, int]] = ((godunov.REFLECTING, godunov.OPEN), (godunov.OPEN, godunov.OPEN))
    empty: float = EMPTY
    time: float = 0.0
    steps: int = 0

    def __post_init__(self) -> None:
        nr, nz = self.conserved.shape[:2]
        self.state = np.zeros((nr, nz, 10))
        self.peak = np.zeros(len(self.position))
        faces = np.arange(nr + 1.0) * self.h
        self.lines = (faces, 0.5 * np.diff(faces**2)), (np.ones(nz + 1), np.full(nz, self.h))
        self.fastest = self._states()

    @property
    def _sheared(self) -> bool:
        return self.conserved.shape[2] > godunov.SHEARED

    def _states(self) -> float:
        rows = self.materials.rows
        shear = rows.shear[0] if self._sheared else 0.0
        material = (
            rows.eos[0], rows.eos_row[0], rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0],
            rows.strength[0], rows.strength_row[0], shear
        )  # fmt: skip
        return godunov.states(self.conserved, self.state, material, self.empty * rows.rho0[0] / rows.alpha0[0])

    def totals(self) -> np.ndarray:
        """Mass [kg], momentum along z [N s] and energy [J] of the whole block."""
        volume = 2.0 * np.pi * self.lines[0][1] * self.h
        columns = [godunov.MASS, godunov.ALONG_Z, godunov.ENERGY]
        return np.einsum("i,ikc->c", volume, self.conserved[:, :, columns])

    def run(self, end: float) -> None:
        """Goes on until ``end`` [s]."""
        while end - self.time > 1e-12 * end:
            dt = min(COURANT * self.h / self.fastest, end - self.time)
            soft = np.inf
            for axis in (0, 1) if self.steps % 2 == 0 else (1, 0):
                godunov.sweep(self.conserved, self.state, axis, *self.lines[axis], dt, self.ends[axis])
                self.fastest = self._states()
                if self._sheared:  # matter whose pores close in one sweep may rest in the other
                    soft = np.minimum(soft, self.state[:, :, godunov.CLOSING])
            if self._sheared:
                self.state[:, :, godunov.CLOSING] = soft
                friction.strain(self.conserved, self.state, self.h, dt)
                friction.accelerate(self.conserved, self.state, self.h, dt)
                self.fastest = self._states()
            tracers.carry(self.position, self.peak, self.state, self.bottom, self.h, dt)
            self.time += dt
            self.steps += 1
