"""What a bed is like: packing fraction, bulk density, stress against weight, coordination, against distance from the
centre."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from dem.beds.flat_ground import FlatGround
from dem.contact import contact, walls
from dem.contact.columns import RADIUS, RATIO, ROLL, SLIP, STIFFNESS, TOUCHING
from dem.contact.walls import WALL_RADIUS
from dem.grains.assembly import Assembly
from matter.compilation.jit import kernel
from matter.geometry.ground_region import Cone, Upright

SOURCES = ("Christoffersen1981",)

BULK_MARGIN = 5.0
"""Mean radii from the walls and the datum at which the bulk of flat ground begins."""


class Shells:
    """Equidistant concentric shells, fine against the grains, and the volume of every grain that falls into each.

    The part of a sphere beyond a shell boundary is that beyond the tangent plane (grains are small against the body).
    """

    def __init__(self, position: np.ndarray, radius: np.ndarray, domain: Cone, width: float, top: float):
        count = max(8, round((top - domain.floor) / width))
        self.edges = np.linspace(domain.floor, top, count + 1)
        self.middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        self.volume = domain.solid_angle * np.diff(self.edges**3) / 3.0
        height = (self.edges[None, :] - np.linalg.norm(position, axis=1)[:, None]) / radius[:, None]
        np.clip(height, -1.0, 1.0, out=height)
        below = np.pi / 3.0 * radius[:, None] ** 3 * (2.0 + 3.0 * height - height**3)
        self.grain_volume = sparse.csr_matrix(np.diff(below, axis=1))  # (grains, shells) volume [m^3]

    def smooth(self, quantity: np.ndarray, window: float) -> np.ndarray:
        """Volume average of a per-volume sum in windows of full width ``window`` about each shell, cut at the ends."""
        inside = np.abs(self.middle[:, None] - self.middle[None, :]) <= 0.5 * window
        return (inside @ quantity) / (inside @ self.volume)


def static_contact(
    bed: Assembly, first: np.ndarray, second: np.ndarray, overlap: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normal (tangent) stiffness [N/m] and normal force [N], cohesion included, of contacts at rest between the grains
    of these indices."""
    radii = np.column_stack([bed.X[first, RADIUS], bed.X[second, RADIUS]])
    k = np.minimum(bed.V[first, STIFFNESS], bed.V[second, STIFFNESS])
    return contact.at_rest(overlap, radii, k, bed.pair_table[bed.kind[first], bed.kind[second]], bed.scheme)


def contact_forces(bed: Assembly) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Static contacts: indices of both grains, force on the second (m, 3), branch vector (m, 3), overlap over the
    smaller radius."""
    first, second, history = bed.touching()
    branch = bed.position[second] - bed.position[first]
    d = np.linalg.norm(branch, axis=1)
    r1, r2 = bed.X[first, RADIUS], bed.X[second, RADIUS]
    overlap = r1 + r2 - d
    k, load = static_contact(bed, first, second, overlap)
    ratio = bed.pair_table[bed.kind[first], bed.kind[second], RATIO]
    force = (load / d)[:, None] * branch - (k * ratio)[:, None] * history[:, SLIP:ROLL]
    return first, second, force, branch, overlap / np.minimum(r1, r2)


def radial_stress(bed: Assembly, shells: Shells, window: float) -> tuple[np.ndarray, np.ndarray]:
    """Radial and mean tangential normal stress [Pa], positive in compression, smoothed over ``window``.

    sigma = (1/V) sum f x b over contacts (Christoffersen et al. 1981), each spread over the shells that its branch
    crosses.
    """
    first, second, force, branch, _ = contact_forces(bed)
    up = bed.position[first] + 0.5 * branch
    up /= np.linalg.norm(up, axis=1)[:, None]
    rr = np.einsum("ij,ij->i", force, up) * np.einsum("ij,ij->i", branch, up)
    tt = 0.5 * (np.einsum("ij,ij->i", force, branch) - rr)
    ends = np.sort(np.linalg.norm(np.stack([bed.position[first], bed.position[second]]), axis=2), axis=0)
    distance = np.linalg.norm(bed.position, axis=1)
    # the branch from a grain to the core is radial
    floor = np.flatnonzero(distance - bed.walls[0, WALL_RADIUS] < bed.X[:, RADIUS])
    gap = distance[floor] - bed.walls[0, WALL_RADIUS]
    rr = np.concatenate([rr, bed.V[floor, STIFFNESS] * (bed.X[floor, RADIUS] - gap) * gap])
    tt = np.concatenate([tt, np.zeros(len(floor))])
    ends = np.concatenate([ends, np.stack([distance[floor] - gap, distance[floor]])], axis=1)
    span = np.maximum(ends[1] - ends[0], 1e-6 * bed.mean_radius)
    below = np.clip((shells.edges[None, :] - ends[0][:, None]) / span[:, None], 0.0, 1.0)
    part = np.diff(below, axis=1)
    return shells.smooth(part.T @ rr, window), shells.smooth(part.T @ tt, window)


def coordination(bed: Assembly, which: np.ndarray) -> tuple[float, float]:
    """Mean contacts per grain among ``which`` (mask), rattlers included, and the fraction of rattlers (fewer than two
    contacts)."""
    first, second, _, _, _ = contact_forces(bed)
    count = np.bincount(first, minlength=len(bed.X)) + np.bincount(second, minlength=len(bed.X))
    count += (bed.wall_history[:, : len(bed.walls), TOUCHING] != 0.0).sum(axis=1)
    return float(count[which].mean()), float((count[which] < 2).mean())


def floor_force(bed: Assembly) -> float:
    """Normal force on wall 0, the core [N]."""
    d = np.linalg.norm(bed.position, axis=1) - bed.walls[0, WALL_RADIUS]
    return float(np.sum(bed.V[:, STIFFNESS] * np.maximum(bed.X[:, RADIUS] - d, 0.0)))


def residual(bed: Assembly, g: float) -> dict[str, float]:
    """Rms and largest speed of the grains below the datum, and rms of the headroom, over sqrt(g r)."""
    speed = np.linalg.norm(bed.velocity, axis=1)
    unit = float(np.sqrt(g * bed.mean_radius))
    below = bed.headroom == 0
    head = float(np.sqrt(np.mean(speed[~below] ** 2)) / unit) if (~below).any() else 0.0
    return {
        "rms": float(np.sqrt(np.mean(speed[below] ** 2)) / unit),
        "max": float(speed[below].max() / unit),
        "headroom_rms": head,
        "unit_m_s": unit,
    }


def creep(bed: Assembly) -> np.ndarray:
    """Horizontal velocity [m/s] at the pole, (x, y), of the rotation about the body's centre that fits the grains
    below the datum best."""
    below = bed.headroom == 0
    x, v = bed.position[below], bed.velocity[below]
    inertia = np.einsum("ij,ij->", x, x) * np.eye(3) - np.einsum("ij,ik->jk", x, x)
    spin = np.linalg.solve(inertia, np.cross(x, v).sum(axis=0))
    return float(np.linalg.norm(x, axis=1).max()) * np.array([spin[1], -spin[0]])


def rearrangement_speed(bed: Assembly, g: float) -> float:
    """Rms speed of the grains below the datum against the mean of the grains that they touch, over sqrt(g r).

    Smooth motions drop out of it, above all the sloshing of the bed in its cone, a mode of hours (omega^2 = g k tanh(k
    H) with k = 1.84 / arc radius) which no settling can wait for; it counts in ``residual`` and is taken out by
    ``grain_masses.levelled``.
    """
    first, second, _ = bed.touching()
    n = len(bed.X)
    count = np.bincount(first, minlength=n) + np.bincount(second, minlength=n)
    here = (bed.headroom == 0) & (count > 0)
    total = np.zeros(int(here.sum()))
    for c in range(3):
        v = bed.W[:, c]
        around = np.bincount(first, v[second], minlength=n) + np.bincount(second, v[first], minlength=n)
        total += (v[here] - around[here] / count[here]) ** 2
    return float(np.sqrt(np.mean(total)) / np.sqrt(g * bed.mean_radius))


def overlaps(bed: Assembly) -> dict[str, Any]:
    """Percentiles of the overlap over the smaller radius."""
    x = contact_forces(bed)[-1]
    if len(x) == 0:
        return {"contacts": 0, "mean": 0.0, "p99": 0.0, "max": 0.0}
    return {"contacts": len(x), "mean": float(x.mean()), "p99": float(np.percentile(x, 99)), "max": float(x.max())}


# -- flat ground


def ground_mass(ground: FlatGround, container: Upright) -> float:
    """Mass [kg] of the undisturbed ground in the container below the datum (midpoint rule)."""
    edges = np.linspace(container.floor, 0.0, 4001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    return float(np.sum(ground.density(middle) * container.cross_section(middle) * np.diff(edges)))


@kernel
def _static_wall_forces(X, k, kind, rows, tables, history, out):
    """Sum the elastic forces of the grains on each wall into ``out`` (w, 3)."""
    for i in range(X.shape[0]):
        for w in range(rows.shape[0]):
            d, nx, ny, nz = walls.distance(rows[w], X[i, 0], X[i, 1], X[i, 2])
            if d < X[i, RADIUS]:
                load, kt = k[i] * (X[i, RADIUS] - d), k[i] * tables[w, kind[i], RATIO]
                out[w, 0] += load * nx - kt * history[i, w, 0]
                out[w, 1] += load * ny - kt * history[i, w, 1]
                out[w, 2] += load * nz - kt * history[i, w, 2]


def wall_forces(bed: Assembly) -> np.ndarray:
    """Force of the resting grains on each wall [N], shape (w, 3): normal and tangential springs."""
    out = np.zeros((len(bed.walls), 3))
    _static_wall_forces(
        bed.X,
        np.ascontiguousarray(bed.V[:, STIFFNESS]),
        bed.kind.astype(np.int64),
        bed.walls,
        bed.wall_tables,
        bed.wall_history,
        out,
    )
    return out


def bulk_fraction(
    position: np.ndarray, radius: np.ndarray, container: Upright, margin: float, points: int = 400_000
) -> float:
    """``bulk_fraction_where`` of the grains at least ``margin`` [m] away from sides, floor and datum."""
    inner = (
        (container.side_depth(position) > margin)
        & (position[:, 2] < -margin)
        & (position[:, 2] > container.floor + margin)
    )
    return bulk_fraction_where(position, radius, inner, points)


def bulk_fraction_where(position: np.ndarray, radius: np.ndarray, inner: np.ndarray, points: int = 400_000) -> float:
    """Grain volume over the volume of the grains' cells, for the grains ``inner`` (n,) bool; nan without any.

    A point of space belongs to the cell of the grain with the smallest d^2 - r^2 (radical Voronoi cells); volumes are
    counted with random points.
    """
    from scipy.spatial import cKDTree

    if not inner.any():
        return float("nan")
    reach = 2.5 * float(radius.max())
    low, high = position[inner].min(axis=0) - reach, position[inner].max(axis=0) + reach
    trial = np.random.default_rng(7).uniform(low, high, (points, 3))
    d, number = cKDTree(position).query(trial, k=6)
    owner = number[np.arange(points), np.argmin(d * d - radius[number] ** 2, axis=1)]
    cells = float(np.prod(high - low)) * float(inner[owner].sum()) / points
    return float(4.0 / 3.0 * np.pi * np.sum(radius[inner] ** 3) / cells)
