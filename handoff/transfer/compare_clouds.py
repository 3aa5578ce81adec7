"""The two clouds side by side on the same small volumes: velocity field, local momentum, density, surface, M(>v).

Both are spread over the sample points of ``carve.Samples``: a particle's mass over the points of its cell inside the
surface, a grain's mass over the points of its cell, each point moving with its owner. Fields are then averaged over
cubes of max(3 grain radii, kernel support), larger where the source is coarser.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from handoff.domains.domain import Domain
from handoff.transfer.carve import Samples
from handoff.transfer.interpolation import local_linear
from matter.particles import Particles

_SHELLS = 8
_NEIGHBOURS = 20
_SLOW = 0.05
_FILLED = 0.25


@dataclass(frozen=True)
class Fields:
    """Point masses [kg] and velocities [m/s] of both clouds: ``before`` the source, ``after`` the grains."""

    samples: Samples
    mass_before: np.ndarray
    mass_after: np.ndarray
    velocity_before: np.ndarray
    velocity_after: np.ndarray


def fields_of(
    bed: Particles,
    kept: np.ndarray,
    samples: Samples,
    receiver: np.ndarray,
    before: tuple[np.ndarray, np.ndarray, np.ndarray],
    mass: np.ndarray,
    velocity: np.ndarray,
    volume: np.ndarray,
) -> Fields:
    """Both clouds on the sample points; ``before`` is (mass, velocity, gradient) of the particles, ``mass`` and
    ``velocity`` those of the kept grains, whose gradient is found from themselves."""
    tree = cKDTree(bed.position[kept])
    gradient = local_linear(tree, velocity, volume[kept], tree.data, _NEIGHBOURS)[1]
    whole_mass, whole_velocity, whole_gradient = (
        np.zeros(len(bed)),
        np.zeros((len(bed), 3)),
        np.zeros((len(bed), 3, 3)),
    )
    whole_mass[kept], whole_velocity[kept], whole_gradient[kept] = mass, velocity, gradient
    return spread(samples, receiver, *before, whole_mass, whole_velocity, whole_gradient)


def spread(
    samples: Samples,
    receiver: np.ndarray,
    mass: np.ndarray,
    velocity: np.ndarray,
    gradient: np.ndarray,
    grain_mass: np.ndarray,
    grain_velocity: np.ndarray,
    grain_gradient: np.ndarray,
) -> Fields:
    """Spread both clouds over the points.

    ``mass``, ``velocity`` and ``gradient`` of the compact particles (mass: the fraction inside the domain), and the
    same of all grains of the uncarved bed; ``receiver`` (s,) as from ``carve.receivers``. A velocity varies linearly
    over its owner's cell, with the owner's own as the mean, so that its momentum is kept.
    """
    inside = np.flatnonzero(receiver >= 0)
    before, after = np.zeros(len(receiver)), np.zeros(len(receiver))
    moving, moving_after = np.zeros((len(receiver), 3)), np.zeros((len(receiver), 3))
    owner = samples.particle[inside]
    weight = samples.weight[inside]
    before[inside] = _even(mass, owner, weight)
    moving[inside] = _linear_in_cells(owner, samples.position[inside], weight, velocity, gradient)
    after[inside] = _even(grain_mass, receiver[inside], weight)
    moving_after[inside] = _linear_in_cells(
        receiver[inside], samples.position[inside], weight, grain_velocity, grain_gradient
    )
    return Fields(samples, before, after, moving, moving_after)


def _even(mass: np.ndarray, owner: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Mass of each point: its owner's, spread evenly over the volume of the owner's points."""
    whole = np.bincount(owner, weights=weight, minlength=len(mass))
    return (mass / np.where(whole > 0.0, whole, 1.0))[owner] * weight


def _linear_in_cells(
    owner: np.ndarray, position: np.ndarray, weight: np.ndarray, velocity: np.ndarray, gradient: np.ndarray
) -> np.ndarray:
    whole = np.bincount(owner, weights=weight, minlength=len(velocity))
    total = np.stack(
        [np.bincount(owner, weights=weight * position[:, k], minlength=len(velocity)) for k in range(3)], axis=1
    )
    centre = total / np.where(whole > 0.0, whole, 1.0)[:, None]
    return velocity[owner] + np.einsum("sa,sab->sb", position - centre[owner], gradient[owner])


def cells(fields: Fields, support: np.ndarray, smallest: float) -> tuple[np.ndarray, np.ndarray]:
    """Cell number (s,) of each sample point, and the size [m] of each cell: ``smallest``, doubled until it holds the
    kernel ``support`` (s,) [m] of the particle there."""
    level = np.maximum(np.ceil(np.log2(np.maximum(support / smallest, 1e-9)) - 1e-9), 0.0).astype(np.int64)
    size = smallest * 2.0**level
    index = np.floor(fields.samples.position / size[:, None]).astype(np.int64)
    _, first, number = np.unique(_key(np.column_stack([level, index])), return_index=True, return_inverse=True)
    return number, size[first]


def _key(index: np.ndarray) -> np.ndarray:
    """One number (s,) for each row of small whole numbers (s, k)."""
    key = np.zeros(len(index), dtype=np.int64)
    for column in (index - index.min(axis=0)).T:
        key = key * (int(column.max()) + 1) + column
    return key


def sums_by(number: np.ndarray, mass: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass (c,), momentum (c, 3) and sum of m |v| (c,) per cell."""
    count = int(number.max()) + 1
    total = np.bincount(number, weights=mass, minlength=count)
    momentum = np.stack(
        [np.bincount(number, weights=mass * velocity[:, k], minlength=count) for k in range(3)], axis=1
    )
    return total, momentum, np.bincount(number, weights=mass * np.linalg.norm(velocity, axis=1), minlength=count)


@dataclass(frozen=True)
class FieldDifference:
    """Cell velocities [m/s] of both clouds where both have mass, their centres [m], and the measures of the ledger."""

    centre: np.ndarray
    mass: np.ndarray
    before: np.ndarray
    after: np.ndarray
    l2: float
    direction_deg: float
    direction_errors_deg: np.ndarray


def field_difference(fields: Fields, number: np.ndarray, size: np.ndarray) -> FieldDifference:
    """L2 = sqrt(sum M |v' - v|^2 / sum M |v|^2) over the cells with |v| above 5 % of the largest, and the mean angle
    between v' and v.

    ``size`` [m] of each cell: cells that hold less than a quarter of their volume (cut off by the surface or a wall)
    hold too few particles for a mean and are left out.
    """
    mass, momentum, _ = sums_by(number, fields.mass_before, fields.velocity_before)
    mass_after, momentum_after, _ = sums_by(number, fields.mass_after, fields.velocity_after)
    filled = (
        np.bincount(number, weights=fields.samples.inside * fields.samples.weight, minlength=len(mass))
        * fields.samples.volume
    )
    both = (filled > _FILLED * size**3) & (mass > 0.0) & (mass_after > 0.0)
    before = momentum[both] / mass[both, None]
    after = momentum_after[both] / mass_after[both, None]
    count = np.bincount(number, minlength=len(mass))
    centre = np.stack(
        [np.bincount(number, weights=fields.samples.position[:, k], minlength=len(mass)) for k in range(3)], axis=1
    )
    weight = mass[both]
    speed = np.linalg.norm(before, axis=1)
    flowing = (speed > _SLOW * speed.max(initial=0.0)) & (speed > 0.0)
    if not flowing.any():
        return FieldDifference(
            (centre / np.maximum(count, 1)[:, None])[both], weight, before, after, 0.0, 0.0, np.empty(0)
        )
    w, b, a = weight[flowing], before[flowing], after[flowing]
    l2 = float(np.sqrt(np.sum(w * np.sum((a - b) ** 2, axis=1)) / np.sum(w * np.sum(b**2, axis=1))))
    cosine = np.sum(a * b, axis=1) / np.maximum(np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), 1e-300)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return FieldDifference(
        (centre / np.maximum(count, 1)[:, None])[both],
        weight,
        before,
        after,
        l2,
        float(np.sum(w * angle) / w.sum()),
        angle,
    )


def local_momentum(fields: Fields, domain: Domain) -> list[tuple[str, float, float]]:
    """(region, |dp| / sum m|v|, fraction of the total sum m|v|) for 8 octants and 8 shells.

    The octants meet in the m|v|-weighted centre of the flow; the shells around the impact hold equal parts of sum m|v|
    each.
    """
    position = fields.samples.position
    weight = fields.mass_before * np.linalg.norm(fields.velocity_before, axis=1)
    if weight.sum() == 0.0:
        return []
    octant = (position > (weight[:, None] * position).sum(axis=0) / weight.sum()) @ np.array([1, 2, 4])
    distance = np.linalg.norm(position - domain.pole, axis=1)
    order = np.argsort(distance, kind="stable")
    shell = np.empty(len(position), dtype=np.int64)
    shell[order] = np.minimum((_SHELLS * np.cumsum(weight[order]) / weight.sum()).astype(np.int64), _SHELLS - 1)
    rows = []
    for title, number, count in (("octant", octant, 8), ("shell", shell, _SHELLS)):
        _, momentum, scale = sums_by(number, fields.mass_before, fields.velocity_before)
        _, after, _ = sums_by(number, fields.mass_after, fields.velocity_after)
        for k in range(min(count, len(scale))):
            if scale[k] > 0.0:
                name = (
                    "".join(axis + ("+" if k >> bit & 1 else "-") for bit, axis in enumerate("xyz"))
                    if title == "octant"
                    else str(k + 1)
                )
                rows.append(
                    (
                        f"{title} {name}",
                        float(np.linalg.norm(after[k] - momentum[k]) / scale[k]),
                        float(scale[k] / scale.sum()),
                    )
                )
    return rows


def energy_split(fields: Fields, receiver: np.ndarray) -> tuple[float, float]:
    """Kinetic energy [J] of the source's matter in the cells of the grains: of each cell's mean motion, and of the
    motion about it."""
    inside = receiver >= 0
    mass, momentum, _ = sums_by(receiver[inside], fields.mass_before[inside], fields.velocity_before[inside])
    total = 0.5 * float(
        np.sum(
            fields.mass_before[inside]
            * np.einsum("ij,ij->i", fields.velocity_before[inside], fields.velocity_before[inside])
        )
    )
    bulk = 0.5 * float(np.sum(np.einsum("ij,ij->i", momentum, momentum) / np.where(mass > 0.0, mass, 1.0)))
    return bulk, total - bulk


def density_difference(fields: Fields, radius: float) -> float:
    """rms of the relative difference of bulk density, coarse grained over cubes of the volume of a ball of 5
    ``radius`` [m]."""
    size = 5.0 * radius * (4.0 * np.pi / 3.0) ** (1.0 / 3.0)
    index = np.floor(fields.samples.position / size).astype(np.int64)
    number = np.unique(_key(index), return_inverse=True)[1]
    before = np.bincount(number, weights=fields.mass_before)
    after = np.bincount(number, weights=fields.mass_after)
    full = (
        np.bincount(number, weights=fields.samples.inside * fields.samples.weight)
        >= 0.98 * size**3 / fields.samples.volume
    )
    if not full.any():
        return float("nan")
    return float(np.sqrt(np.mean((after[full] / before[full] - 1.0) ** 2)))


def mass_curve_difference(
    mass: np.ndarray, speed: np.ndarray, mass_after: np.ndarray, speed_after: np.ndarray, above: float
) -> float:
    """Largest |M'(>v) - M(>v)| over v > ``above`` [m/s], relative to M(> above) of the first; zero when nothing is
    that fast."""
    fast, fast_after = speed > above, speed_after > above
    total = mass[fast].sum()
    if total == 0.0:
        return 0.0 if not fast_after.any() else float("inf")
    value = np.r_[speed[fast], speed_after[fast_after]]
    signed = np.r_[mass[fast], -mass_after[fast_after]]
    order = np.argsort(-value, kind="stable")
    value, running = value[order], np.cumsum(signed[order])
    last = np.r_[value[1:] < value[:-1], True]
    return float(np.max(np.abs(running[last])) / total)


def surface_distance(one, other, chosen) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Distances [m] from the surface ``one`` to ``other`` and back (meshes), from their vertices and face centres
    where ``chosen`` holds, each followed by the area [m^2] that its points stand for: a surface is cut into smaller
    triangles where it bends, and counting points would give such places more weight than their area."""
    return *_one_way(one, other, chosen), *_one_way(other, one, chosen)


def _one_way(one, other, chosen) -> tuple[np.ndarray, np.ndarray]:
    import trimesh

    face = np.asarray(one.area_faces)
    # half of a triangle goes to its centre, a sixth to each corner
    corner = np.bincount(one.faces.ravel(), weights=np.repeat(face / 6.0, 3), minlength=len(one.vertices))
    points = np.concatenate([np.asarray(one.vertices), np.asarray(one.triangles_center)])
    here = chosen(points)
    points, area = points[here], np.r_[corner, 0.5 * face][here]
    if len(points) == 0:
        return np.empty(0), np.empty(0)
    near = min(16, len(other.faces))
    candidates = cKDTree(other.triangles_center).query(points, k=near)[1].reshape(len(points), near)
    best = np.full(len(points), np.inf)
    for column in range(near):
        closest = trimesh.triangles.closest_point(other.triangles[candidates[:, column]], points)
        best = np.minimum(best, np.linalg.norm(closest - points, axis=1))
    return best, area
