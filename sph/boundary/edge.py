"""The outer edge of a run: which particles are fixed, which lie in a layer before them, and what they fade to."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from matter.errors import InputError
from matter.files import checkpoint
from sph.boundary import fixed
from sph.boundary.dispatch import FAMILY

LAYERS = {name: law for name, law in zip(FAMILY.names, FAMILY.laws) if hasattr(law, "fade")}
"""Boundaries that have a layer before the rim."""


class Edge:
    """Laws of the edge, by particle identity: ``fixed`` (n,) bool, ``layers`` with the coefficient (n,) of each
    boundary's, and density and specific energy at the start."""

    ARRAYS = ("fixed", "density", "energy")

    def __init__(
        self,
        depth: np.ndarray,
        h: np.ndarray,
        density: np.ndarray,
        energy: np.ndarray,
        widths: Mapping[str, np.ndarray | float] = {},
    ):
        """All in order of identity: ``depth`` (n,) [m] of every particle below the edge (infinite where there is
        none), ``h`` (n,) its support, and ``widths`` (n,) [m] of the layers by the names of their boundaries, 0 for
        none.
        """
        self.fixed = fixed.rim(depth, h)
        rim = np.where(np.isfinite(depth), h, 0.0)
        self.layers: dict[str, np.ndarray] = {}
        for name, given in widths.items():
            width = np.broadcast_to(np.asarray(given, dtype=float), depth.shape)
            coefficient = self.layers[name] = np.zeros(len(depth))
            for w in np.unique(width[(width > 0.0) & np.isfinite(depth)]):
                mine = (width == w) & np.isfinite(depth) & ~self.fixed
                coefficient[mine] = LAYERS[name].coefficient(depth[mine] - rim[mine], float(w))
        self.density, self.energy = density.copy(), energy.copy()
        if self.fixed.all():
            raise InputError("every particle lies in the fixed rim: enlarge the target or refine its spacing")

    def state(self) -> dict[str, np.ndarray]:
        """Every array, for a checkpoint."""
        return {name: getattr(self, name) for name in self.ARRAYS} | checkpoint.under("layer", self.layers)

    @classmethod
    def restored(cls, saved: checkpoint.State) -> Edge:
        """The edge of a ``state``."""
        edge = cls.__new__(cls)
        for name in cls.ARRAYS:
            setattr(edge, name, saved[name])
        edge.layers = {name: saved[f"layer/{name}"] for name in LAYERS if f"layer/{name}" in saved}
        return edge

    def zero_rates(self, cloud, rates) -> None:
        """Set the rates of the fixed rim to zero."""
        fixed.zero_rates(
            cloud.identity, self.fixed, cloud.gravity, rates.acceleration, rates.density, rates.energy, rates.stress
        )

    def fade(self, cloud, wave: np.ndarray, dt: float) -> None:
        """One step of the layers."""
        for name, coefficient in self.layers.items():
            LAYERS[name].fade(
                dt,
                cloud.identity,
                coefficient,
                self.density,
                self.energy,
                wave,
                cloud.velocity,
                cloud.density,
                cloud.specific_energy,
                cloud.stress,
            )
