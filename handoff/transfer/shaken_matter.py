"""The vibration that grains take over, and the energy that goes with it.

The shock stage lowers the friction of matter of damage D by the pressure D^2 rho c v_vib (``block_model``): only what
is broken shakes apart. Grains are broken as a whole, so that what acts on them is the speed w = D^2 v_vib. A grain of
which each particle p gives the mass m_pg (``handoff.transfer.grain_provenance``) takes the energy per mass,

    w_g^2 = sum_p m_pg w_p^2 / sum_p m_pg
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from handoff.ledger import Ledger
from matter.particles import Particles

ATTRIBUTE = "block_model"
"""Attribute of snapshots of the shock stage: decay time and speed of sound of the materials that shake, by name."""


def acting(source: Particles) -> np.ndarray:
    """w (n,) [m/s] of the particles."""
    damage = source.damage if "damage" in source else 1.0
    return np.asarray(damage**2 * source.vibration)


def give(start: Particles, source: Particles, mean: Callable[[np.ndarray], np.ndarray]) -> None:
    """Give the grains ``start`` the vibration of the ``source``, where it shakes, with how it dies away; ``mean``:
    values (n,) by particle to those of the grains, weighted by mass."""
    if "vibration" in source and ATTRIBUTE in source.attributes:
        start["vibration"] = np.sqrt(mean(acting(source) ** 2))
        start.attributes[ATTRIBUTE] = source.attributes[ATTRIBUTE]


def enter(ledger: Ledger, start: Particles, source: Particles, handed: np.ndarray) -> None:
    """The row on the energy sum m w^2 / 2 of the grains against that of the masses ``handed`` (n,) [kg] of the
    particles, without a limit: cells are matched to masses locally, not one by one."""
    if "vibration" not in start:
        return
    before, after = 0.5 * float(handed @ acting(source) ** 2), 0.5 * float(start.mass @ start.vibration**2)
    ledger.state(
        "vibration_energy_rel",
        after / before - 1.0 if before > 0.0 else 0.0,
        "1",
        f"of broken matter: particles {before:.6e} J, grains {after:.6e} J",
    )
