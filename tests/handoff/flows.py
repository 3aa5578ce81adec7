"""Six flows of a half space with a hemispherical cavity, and how well a bed takes them over at a given number of grains per cavity radius."""

from __future__ import annotations

import numpy as np

from handoff import account, hydrostatic, surface, transfer
from tests.handoff import clouds
from tests.handoff.clouds import ARC_FLAT, CAVITY, DEPTH

HEADROOM, SPACING, DENSITY = 5.0, 1.7, 1100.0  # particle spacing in grain radii; the bed is made at 950 kg/m^3


def hemisphere(points):
    """Height of the surface."""
    return -np.sqrt(np.maximum(CAVITY**2 - points[:, 0] ** 2 - points[:, 1] ** 2, 0.0))


def vortices(points):
    """Two columns of fluid that turn against each other, Gaussian vorticity."""
    total = np.zeros_like(points)
    for sign, x in ((1.0, 11.0), (-1.0, -11.0)):
        dx, dz = points[:, 0] - x, points[:, 2] + 9.0
        swirl = sign * np.exp(-(dx**2 + dz**2) / 50.0)
        total += swirl[:, None] * np.stack([dz, np.zeros(len(points)), -dx], axis=1)
    return total


FIELDS = {
    "translation": lambda p: np.tile([1.0, 2.0, -0.5], (len(p), 1)),
    "rotation": lambda p: np.cross([0.3, -0.2, 0.5], p - np.array([5.0, 3.0, -2.0])),
    "shear": lambda p: np.stack([p[:, 2], np.zeros(len(p)), np.zeros(len(p))], axis=1),
    "expansion": lambda p: p - np.array([1.0, 2.0, -3.0]),
    "z_model": lambda p: clouds.z_model(p, 3.0, 1.0, CAVITY),
    "vortices": vortices,
}
LINEAR = ("translation", "rotation", "shear", "expansion")


def ground() -> hydrostatic.Column:
    """Gravity so strong that nothing below 200 m/s counts as ejecta."""
    return hydrostatic.uniform(5e3, 1000.0, 30.0)


def bed(grains_per_radius: float):
    """Random grains, ``grains_per_radius`` mean radii in the cavity's radius."""
    return clouds.flat_bed(CAVITY / grains_per_radius, ARC_FLAT, DEPTH, HEADROOM)


def handed(name: str, grains_per_radius: float, grains, **rules):
    """One transfer: the source, what was made of it, its ledger."""
    spacing = SPACING * CAVITY / grains_per_radius
    source = clouds.flat_source(spacing, ARC_FLAT, DEPTH, hemisphere, FIELDS[name], density=DENSITY)
    made = transfer.hand_over(source, grains, surface.Rules(**rules), ground())
    return source, made, account.ledger_of(made, source, grains, ground(), {})


def seats(made) -> np.ndarray:
    """Centroids (k, 3) of the kept grains' cells: what a grain's momentum is that of; a grain without a sample point of its own: its centre."""
    here = made.heir >= 0
    grain, place = np.cumsum(made.stays)[made.heir[here]] - 1, made.samples.position[here]
    count = np.bincount(grain, minlength=len(made.start))
    total = np.stack([np.bincount(grain, weights=place[:, k], minlength=len(made.start)) for k in range(3)], axis=1)
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], made.start.position)


def against_the_truth(name: str, made) -> float:
    """Mass-weighted rms of the grains' velocities against the exact field at their centroids, over that of the field."""
    start, truth = made.start, FIELDS[name](seats(made))
    return float(np.sqrt(np.sum(start.mass * np.sum((start.velocity - truth) ** 2, axis=1)) / np.sum(start.mass * np.sum(truth**2, axis=1))))


def measured(name: str, grains_per_radius: float, grains) -> dict[str, float]:
    """The rows of the table for one flow at one resolution."""
    source, made, ledger = handed(name, grains_per_radius, grains)
    wanted = {
        "mass_raw": "mass_raw_rel", "p_raw": "momentum_linear_raw_rel", "L_raw": "momentum_angular_raw_rel", "field_L2": "velocity_field_L2",
        "direction_deg": "velocity_direction_deg_mean", "local_p": "momentum_local_rel", "p_after": "momentum_linear_rel_after",
        "L_after": "momentum_angular_rel_after", "correction": "correction_max_dv_over_rms_v", "energy_change": "kinetic_energy_change_max",
    }  # fmt: skip
    row = {key: float(ledger[row]["value"]) for key, row in wanted.items()}
    return {"grains_per_radius": grains_per_radius, "particles": len(source), "grains": int(made.stays.sum()), **row, "truth": against_the_truth(name, made)}


def order(counts, errors) -> float:
    """Order of convergence: minus the slope of log error against log grains per radius (least squares)."""
    return float(-np.polyfit(np.log(counts), np.log(np.maximum(errors, 1e-300)), 1)[0])
