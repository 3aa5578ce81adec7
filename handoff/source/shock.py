"""What of the shock is still in the source: residual pressure and the strain energy that a handoff would discard."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from handoff.source.hydrostatic import Column
from matter.case import material
from matter.particles import Particles

_LEAST_MODULUS = 0.25
_SUPPORT = 32


@dataclass(frozen=True)
class Residual:
    """``pressure`` (n,) excess over bulk modulus; ``elastic`` (n,) excess strain energy [J]."""

    pressure: np.ndarray
    elastic: np.ndarray


def moduli(source: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Bulk modulus (local rho c^2 where the sound speed is known) and shear modulus [Pa]; NaN and 0 where a material
    is not known here.

    Particles that have parted have next to no modulus of their own, and any pressure is large over nothing: none
    counts as less than a quarter of the median of its material.

    The shear modulus is that with which the source was made where it says so (attribute ``shear_moduli_Pa``): softened
    matter stores as much more.
    """
    bulk, shear = [], []
    for name in source.attributes.get("materials", []):
        elastic = material.load(name).get("elastic", {}) if name in material.names() else {}
        bulk.append(float(elastic.get("bulk_modulus", np.nan)))
        shear.append(float(elastic.get("shear_modulus", 0.0)))
    number = np.clip(source.material, 0, max(len(bulk) - 1, 0))
    table = np.array(bulk or [np.nan])[number]
    if "sound_speed" in source:
        own = source.density * source.sound_speed**2
        table = np.where(source.sound_speed > 0.0, own, table)
        for one in np.unique(number):
            of_it = (number == one) & (source.sound_speed > 0.0)
            if of_it.any():
                table[of_it] = np.maximum(table[of_it], _LEAST_MODULUS * np.median(own[of_it]))
    said = source.attributes.get("shear_moduli_Pa")
    shear = [float(value) for value in said] if said is not None and len(said) == len(shear) else shear
    return table, np.array(shear or [0.0])[number]


@dataclass(frozen=True)
class Weight:
    """What weight alone does around a cavity, shock or no shock: ``pressure`` over bulk modulus, and strain ``energy``
    [J]."""

    pressure: float
    energy: float


def by_weight(source: Particles, fraction: np.ndarray, cavity_radius: float, column: Column) -> Weight:
    """The scale of what a flow under gravity changes: matter moved by the cavity's radius R [m] carries rho g R more
    or less than before.

    p = rho g R over K (medians by particle), and sum V p^2 / (2 K); ``fraction`` (n,) is the part of each particle's
    volume V that counts. In a granite cavity of R = 10 km on Earth p / K is 5e-3: no moment of its growth is quieter
    than that.
    """
    bulk, _ = moduli(source)
    counts = (fraction > 0.5) & np.isfinite(bulk)
    if not counts.any():
        return Weight(0.0, 0.0)
    pressure = float(np.median(source.density[counts])) * column.surface_gravity * cavity_radius
    volume = fraction[counts] * source.mass[counts] / source.density[counts]
    return Weight(
        pressure / float(np.median(bulk[counts])), float(np.sum(volume * pressure**2 / (2.0 * bulk[counts])))
    )


def residual(source: Particles, domain: Domain, column: Column) -> Residual | None:
    """Excess pressure and strain energy over the undisturbed column at the same height; None when the source carries
    no pressure.

    |P - P_0(h)| / K, and V [(P - P_0)^2 / (2 K) + S:S / (4 mu)] with the deviatoric stress S.
    """
    if "pressure" not in source:
        return None
    bulk, shear = moduli(source)
    excess = source.pressure - column.pressure_at(domain.frame.height(source.position))
    volume = source.mass / source.density
    energy = volume * excess**2 / (2.0 * bulk)
    if "deviatoric_stress" in source:
        xx, xy, xz, yy, yz, zz = source.deviatoric_stress.T
        double = xx**2 + yy**2 + zz**2 + 2.0 * (xy**2 + xz**2 + yz**2)
        energy = energy + np.where(shear > 0.0, volume * double / (4.0 * np.maximum(shear, 1.0)), 0.0)
    return Residual(np.abs(excess) / bulk, energy)


def over_support(position: np.ndarray, pressure: np.ndarray) -> np.ndarray:
    """Mean of the ``pressure`` (n,), an absolute value, over the ``_SUPPORT`` particles nearest to each ``position``
    (n, 3). A front is as wide as a kernel's support, so that what is left of a shock shows in its mean; what a single
    particle carries alone, the expanded lining of a cavity for one, is noise. Absolute values do not cancel."""
    if len(position) == 0:
        return pressure
    nearest = cKDTree(position).query(position, k=min(_SUPPORT, len(position)))[1].reshape(len(position), -1)
    return pressure[nearest].mean(axis=1)
