"""The outer edge of a run: which particles are fixed, which lie in the quiet layer, and what they fade to."""

from __future__ import annotations

import numpy as np

from matter import checkpoint
from matter.errors import InputError
from sph.boundary import fixed, quiet


class Edge:
    """Laws of the edge, by particle identity: ``fixed`` (n,) bool, ``kappa`` (n,) [1/m], and density and specific
    energy at the start."""

    ARRAYS = ("fixed", "kappa", "density", "energy")

    def __init__(
        self, depth: np.ndarray, h: np.ndarray, density: np.ndarray, energy: np.ndarray, width: np.ndarray | float
    ):
        """All in order of identity: ``depth`` (n,) [m] of every particle below the edge (infinite where there is
        none), ``h`` (n,) its support, and ``width`` (n,) of the quiet layer [m], 0 for none.
        """
        self.fixed = fixed.rim(depth, h)
        width = np.broadcast_to(np.asarray(width, dtype=float), depth.shape)
        rim = np.where(np.isfinite(depth), h, 0.0)
        self.kappa = np.zeros(len(depth))
        for w in np.unique(width[(width > 0.0) & np.isfinite(depth)]):
            mine = (width == w) & np.isfinite(depth) & ~self.fixed
            self.kappa[mine] = quiet.fading(depth[mine] - rim[mine], float(w))
        self.density, self.energy = density.copy(), energy.copy()
        if self.fixed.all():
            raise InputError("every particle lies in the fixed rim: enlarge the target or refine its spacing")

    def state(self) -> dict[str, np.ndarray]:
        """Every array, for a checkpoint."""
        return {name: getattr(self, name) for name in self.ARRAYS}

    @classmethod
    def restored(cls, saved: checkpoint.State) -> Edge:
        """The edge of a ``state``."""
        made = cls.__new__(cls)
        for name in cls.ARRAYS:
            setattr(made, name, saved[name])
        return made

    def hold(self, cloud, rates) -> None:
        """Take the rates of the fixed rim away."""
        fixed.hold(
            cloud.identity, self.fixed, cloud.gravity, rates.acceleration, rates.density, rates.energy, rates.stress
        )

    def fade(self, cloud, wave: np.ndarray, dt: float) -> None:
        """One step of the quiet layer."""
        quiet.fade(
            dt,
            cloud.identity,
            self.kappa,
            self.density,
            self.energy,
            wave,
            cloud.velocity,
            cloud.density,
            cloud.specific_energy,
            cloud.stress,
        )
