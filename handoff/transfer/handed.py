"""What one transfer made and measured, as the ledger, the report and the control runs read it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from handoff.domains.domain import Domain
from handoff.source.cavity import Cavity
from handoff.source.cloud_surface import Split
from handoff.transfer.blocks.whole_blocks import WholeBlocks
from handoff.transfer.carve import Samples
from handoff.transfer.compare_clouds import Fields
from handoff.transfer.correction import Sums
from handoff.transfer.ejecta import Ejecta
from matter.geometry.alpha_shape import OffsetShape
from matter.particles import Particles


@dataclass(frozen=True)
class Compact:
    """The source's compact matter between the domain's floor and top: ``indices`` (k,) in the source, ``fraction``
    (k,) of each particle inside the domain, ``centre`` (k, 3) of that part [m]."""

    indices: np.ndarray
    fraction: np.ndarray
    centre: np.ndarray

    def among(self, some: np.ndarray) -> Compact:
        """The part of it among ``some`` (n,) particles of the source."""
        mine = some[self.indices]
        return Compact(self.indices[mine], self.fraction[mine], self.centre[mine])


@dataclass(frozen=True)
class Carving:
    """The surface and what it leaves of the bed: the ``solid`` below the surface and its ``offset`` [spacings], which
    grains ``stays`` (n,) says to stay, the ``volume`` (n,) [m^3] that each of them stands for, ``samples`` of the
    solid and the grain that is ``receiver`` of each of them, the ``size`` of the cavity, and ``columns`` of ground:
    foot, distance from the axis, height of the solid and of the grains [m]."""

    solid: OffsetShape
    offset: float
    stays: np.ndarray
    volume: np.ndarray
    samples: Samples
    receiver: np.ndarray
    size: Cavity
    columns: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Mapped:
    """How grains took over motion and mass: the velocity's ``own_gradient`` inside each particle and the
    ``linear_share`` of it that was taken, the ``fields`` of source and grains before any correction, the ``change``
    (k, 3) of velocity by the correction [m/s], the ``scale`` of the masses, and the
    ``plain_mass`` [kg] with each grain at its nearest particle's density."""

    own_gradient: np.ndarray
    linear_share: float
    fields: Fields
    change: np.ndarray
    scale: float
    plain_mass: float


@dataclass(frozen=True)
class Balance:
    """Sums of mass, momenta and energy: of the source's matter that is handed over (``before``) and that stays
    ``outside``, of the grains ``raw`` and ``after`` the corrections."""

    before: Sums
    outside: Sums
    raw: Sums
    after: Sums


@dataclass(frozen=True)
class Handoff:
    """One transfer: the ``start`` of the granular stage, the source's ``split`` into compact matter and ejecta, how
    each was handed over, in which ``region``, and the kinetic energy [J] of compact matter and of its grains
    ``against_ground`` that turns (None where it does not); the whole ``blocks``, in ``start`` behind all others."""

    start: Particles
    split: Split
    compact: Compact
    carving: Carving
    mapped: Mapped
    ejecta: Ejecta
    sums: Balance
    region: Domain
    against_ground: tuple[float, float] | None
    blocks: WholeBlocks | None = None

    @property
    def ejecta_energy(self) -> float:
        """Kinetic energy of the ejecta [J]: the same before and after, since each particle becomes one grain of its
        mass and velocity."""
        return 0.5 * float(self.ejecta.mass @ np.einsum("ij,ij->i", self.ejecta.velocity, self.ejecta.velocity))

    @property
    def moving(self) -> tuple[float, float]:
        """Kinetic energy [J] of the compact matter against the ground, and of the grains that it became."""
        if self.against_ground is not None:
            return self.against_ground
        return self.sums.before.kinetic - self.ejecta_energy, self.sums.after.kinetic - self.ejecta_energy
