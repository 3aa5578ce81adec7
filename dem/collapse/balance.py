"""What the balances of a collapse are held against: momentum, angular momentum and energy of its start, and the scales
of their errors."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from dem.beds.bed_files import RESIDUAL_SPEED
from dem.contact.columns import (
    ALL_DISSIPATED,
    ANGULAR_IMPULSE,
    ANGULAR_REMOVED,
    AT_WALLS,
    DISSIPATED,
    DRAGGED,
    ENERGY_REMOVED,
    IMPULSE,
    MOMENTUM_REMOVED,
    RADIUS,
    WX,
)
from dem.grains.assembly import Assembly
from dem.grains.cached_gravity import WORK
from matter.files import checkpoint


class Errors(NamedTuple):
    """``total`` energy [J], and the relative errors of momentum, angular momentum and energy."""

    total: float
    momentum: float
    angular_momentum: float
    energy: float


@dataclass
class Balance:
    """``momentum`` (3,) [kg m/s], ``angular`` (3,) [kg m^2/s] and ``energy`` [J] at the start; ``handed`` [J] kinetic
    energy of its compact grains; ``scale_p`` and ``scale_l`` the sums of m |v| and m |x| |v|, of m sqrt(g r) where
    nothing moves."""

    momentum: np.ndarray
    angular: np.ndarray
    energy: float
    handed: float
    scale_p: float
    scale_l: float

    @classmethod
    def begin(cls, bed: Assembly, gravity: float, handed: float) -> Balance:
        """That of the present state; ``gravity`` g [m/s^2] at the surface."""
        m, speed = bed.mass, np.linalg.norm(bed.velocity, axis=1)
        if not speed.any():  # a control run: errors count against sqrt(g r), what a fall by half a radius gives
            speed = np.full(len(m), np.sqrt(gravity * bed.mean_radius))
        arms = np.linalg.norm(bed.position, axis=1)
        return cls(
            bed.momentum(), bed.angular_momentum(), sum(bed.energies().values()), handed, float(np.sum(m * speed)),
            float(np.sum(m * arms * speed))
        )  # fmt: skip

    def errors(self, bed: Assembly) -> Errors:
        """Those of the present state. What fast ejecta lose in flight does not count as spent: it would hide errors of
        the bed."""
        booked = bed.booked.sum(axis=0)
        total = (
            sum(bed.energies().values())
            + float(bed.report[ALL_DISSIPATED].sum())
            + booked[ENERGY_REMOVED]
            - bed.weight_energy
        )
        total -= bed.pull_state[WORK]
        dissipated = float(bed.report[[DISSIPATED, DRAGGED, AT_WALLS]].sum()) - bed.lost_in_flight
        off_p = np.linalg.norm(bed.momentum() + booked[MOMENTUM_REMOVED] - bed.report[IMPULSE] - self.momentum)
        off_l = np.linalg.norm(
            bed.angular_momentum() + booked[ANGULAR_REMOVED] - bed.report[ANGULAR_IMPULSE] - self.angular
        )
        return Errors(
            total,
            float(off_p / max(self.scale_p, 1e-300)),
            float(off_l / max(self.scale_l, 1e-300)),
            (total - self.energy) / max(self.handed + dissipated, 1e-300),
        )

    def state(self) -> dict[str, Any]:
        """What a checkpoint must hold."""
        return asdict(self)

    @classmethod
    def restored(cls, saved: checkpoint.State) -> Balance:
        """That of a ``state``."""
        return cls(**{name: saved[name] for name in cls.__dataclass_fields__})


def handed_energy(bed: Assembly, gravity: float) -> float:
    """Kinetic energy [J] of the compact grains, what errors of energy count against, at least that of a bed which
    counts as settled, m (``RESIDUAL_SPEED`` sqrt(g r))^2 / 2: a bed at rest is not judged by the millijoules that it
    still moves with. Where nothing moves that of a fall by half a radius, m g r / 2."""
    compact = bed.returned == 0
    m, r, w = bed.mass[compact], bed.X[compact, RADIUS], bed.W[compact]
    moving = 0.5 * m @ np.sum(w[:, :3] ** 2, axis=1) + 0.2 * (m * r**2) @ np.sum(w[:, WX:] ** 2, axis=1)
    fall = 0.5 * gravity * (m @ r)
    return float(max(moving, RESIDUAL_SPEED**2 * fall) if moving > 0.0 else fall)
