"""Where the ground far from a crater stands: the datum fitted to it together with the blanket that lies on it.

Outside the crater h(s, a) = e(s, a) + b f(s / s0): e is what the datum is off (a level and a tilt; on a sphere also
what a lower centre and a smaller radius make of its curvature), b the height of the blanket at s0, the inner edge of
the fit. All are linear but f, which no crater tells beforehand (ejecta fall as s^-3, McGetchin et al. 1973; a slumped
rim ends far more steeply): each f of a list is fitted and counts by how well it fits, so that what is not known of it
is in the error of the datum. A blanket taken out with a fixed power and only where it is positive pulls a fitted
sphere down: what is left of it looks like curvature and grows from turn to turn.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from crater.datum import Datum, plane, sphere
from crater.radial_profile import RINGS_SHARE, Relief, ring_mean
from matter.errors import InputError

FAR = 3.0
"""Ground that carries next to no blanket begins at three crater radii."""
INNER, BEYOND_CREST = 1.8, 1.5
"""The fit begins at 1.8 apparent radii, and at 1.5 times the distance of the crest: a crest stays where it is when the
datum is moved."""
FALLS = {
    "power": (2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 8.0, 11.0),
    "exponential": (3.0, 5.0, 8.0, 12.0),
    "gaussian": (4.0, 8.0, 14.0),
}
"""How a blanket may fall from s0 outwards: steepness q = -d ln f / d ln s there of u^-q, exp(-q (u - 1)), exp(-q (u^2
- 1) / 2) with u = s / s0."""
SLOW, SHARE_OF_SLOW = 3.5, 0.5
"""Ejecta blankets fall as a power up to ``SLOW``: that has half of the weight before the ground has been looked at,
everything steeper the other half."""
FEWEST_RINGS = 12
"""Fewer rings (two to a spacing) outside of ``INNER`` radii than this do not tell a blanket from the datum."""


def far_field(ground: Relief, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Mask of the rings beyond three crater ``radius`` (or the outermost quarter where the cloud ends before), and
    whether it is far."""
    s = ground.columns.distance
    known = np.isfinite(ring_mean(ground.cell))
    far = known & (s > FAR * radius)
    enough = far.sum() >= 4
    if not enough:
        outer = np.flatnonzero(known)
        far = np.zeros(len(s), dtype=bool)
        far[outer[-max(4, len(outer) // 4) :]] = True
        far &= s > 1.3 * radius
    return far, np.array(enough)


@dataclass(frozen=True)
class _Ground:
    """Cells outside the crater: distance ``s`` [m], azimuth ``a``, height ``h`` [m], root of the weight ``w``,
    ``group`` of those that err together."""

    s: np.ndarray
    a: np.ndarray
    h: np.ndarray
    w: np.ndarray
    group: np.ndarray
    scale: float


def _cells(ground: Relief, rings: np.ndarray) -> _Ground:
    columns = ground.columns
    cells = ground.cell[rings]
    azimuth = (np.arange(columns.sectors) + 0.5) * 2.0 * np.pi / columns.sectors
    area = ground.datum.area_between(columns.edges[:-1], columns.edges[1:])[rings]
    s, a = np.broadcast_to(columns.distance[rings][:, None], cells.shape), np.broadcast_to(azimuth, cells.shape)
    w = np.broadcast_to(np.sqrt(area / area.mean())[:, None], cells.shape)
    group = np.broadcast_to(np.arange(columns.sectors), cells.shape)
    good = np.isfinite(cells)
    if good.sum() < 8:
        raise InputError(
            f"too few points to fit a datum: {int(good.sum())} cells of far field; give its radius (--datum-radius)"
        )
    scale = 0.5 * float(np.median(columns.spacing[rings]))
    return _Ground(s[good], a[good], cells[good], w[good], group[good], scale)


def _robust(basis: np.ndarray, cells: _Ground, turns: int = 12) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Least squares with soft_l1 loss beyond ``scale`` by reweighting: parameters, their covariance (the sandwich over
    groups), the weighted sum of squares over its mean (the cells that count), and how much the grouping widens the
    first parameter's variance."""
    k = cells.w**2
    for _ in range(turns):
        normal = (basis * k[:, None]).T @ basis
        coefficients = np.linalg.lstsq(normal, basis.T @ (k * cells.h), rcond=1e-13)[0]
        left = cells.h - basis @ coefficients
        k = cells.w**2 / np.sqrt(1.0 + (cells.w * left / cells.scale) ** 2)
    inverse = np.linalg.pinv(normal, rcond=1e-13, hermitian=True)
    scores = basis * (k * left)[:, None]
    grouped = np.stack([scores[cells.group == g].sum(axis=0) for g in np.unique(cells.group)])
    many = len(grouped) / max(len(grouped) - 1, 1)
    covariance = many * inverse @ (grouped.T @ grouped) @ inverse
    alone = inverse @ (scores.T @ scores) @ inverse
    return (
        coefficients,
        covariance,
        float(np.sum(k * left**2)),
        float(max(1.0, covariance[0, 0] / max(alone[0, 0], 1e-300))),
    )


def _datum_basis(datum: Datum, cells: _Ground, centre_free: bool, radius_free: bool) -> np.ndarray:
    """Columns: 1, cos(psi) (what does not depend on azimuth), and the two tilts; a sphere's are those of its radius
    and its centre, as far as they are free."""
    if not datum.is_sphere:
        x = cells.s / cells.s.max()
        return np.column_stack([np.ones(len(x)), x * np.cos(cells.a), x * np.sin(cells.a)])
    psi = cells.s / datum.radius
    tilts = [np.sin(psi) * np.cos(cells.a), np.sin(psi) * np.sin(cells.a)] if centre_free else []
    return np.column_stack(
        ([np.ones(len(psi))] if radius_free else []) + ([np.cos(psi)] if centre_free else []) + tilts
    )


def _falls(u: np.ndarray) -> list[np.ndarray]:
    """Every way in which a blanket may fall, at distances ``u`` in units of the inner edge."""
    power = [u**-q for q in FALLS["power"]]
    return (
        power
        + [np.exp(-q * (u - 1.0)) for q in FALLS["exponential"]]
        + [np.exp(-0.5 * q * (u**2 - 1.0)) for q in FALLS["gaussian"]]
    )


def _prior() -> np.ndarray:
    """Weight of every way to fall before the ground has been looked at, in the order of ``_falls``."""
    slow = np.array([kind == "power" and q <= SLOW for kind, steepness in FALLS.items() for q in steepness])
    return np.where(slow, SHARE_OF_SLOW / slow.sum(), (1.0 - SHARE_OF_SLOW) / (~slow).sum())


def _joint(basis: np.ndarray, cells: _Ground, inner: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Parameters of the datum and their covariance, with the blanket beyond ``inner`` [m] averaged over (None: no
    blanket)."""
    if inner is None:
        coefficients, covariance, _, _ = _robust(basis, cells)
        return coefficients, covariance
    n = basis.shape[1]
    fits = [_robust(np.column_stack([basis, f]), cells) for f in _falls(cells.s / inner)]
    squares = np.array([fit[2] for fit in fits])
    best = fits[int(np.argmin(squares))]
    variance = best[2] / np.sum(cells.w > 0.0)
    weight = _prior() * np.exp(-0.5 * (squares - squares.min()) / (variance * max(best[3], RINGS_SHARE)))
    weight /= weight.sum()
    points = np.array([fit[0][:n] for fit in fits])
    mean = weight @ points
    apart = points - mean
    return mean, np.einsum("p,pij->ij", weight, np.array([fit[1][:n, :n] for fit in fits])) + (
        apart * weight[:, None]
    ).T @ apart


def _outside(ground: Relief, radius: float, rough: bool) -> tuple[np.ndarray, float | None]:
    """Mask of the rings that the datum is fitted to, and the inner edge of the blanket on them [m]; None where they
    tell no blanket."""
    s, mean = ground.columns.distance, ring_mean(ground.cell)
    near = (s > 0.8 * radius) & (s < 2.0 * radius)
    crest = float(s[near][np.argmax(np.where(np.isfinite(mean[near]), mean[near], -np.inf))]) if near.any() else radius
    inner = max(INNER * radius, BEYOND_CREST * crest)
    outside = np.isfinite(mean) & (s > inner)
    if rough or outside.sum() < FEWEST_RINGS:
        return far_field(ground, radius)[0], None
    return outside, inner


def refit(
    ground: Relief, datum: Datum, radius: float, centre=None, fixed_radius: float | None = None, rough: bool = False
) -> Datum:
    """The datum fitted to the ground outside a crater of apparent ``radius`` [m], blanket and all; its axis keeps
    passing through the crater.

    A sphere's ``centre`` and radius are kept where given. A ``rough`` fit, for a datum that is still far off, takes
    the far ground as bare. ``errors`` of the result are the ways in which it may be off.
    """
    outside, inner = _outside(ground, radius, rough)
    if outside.sum() < 2:
        raise InputError(
            f"the cloud ends at {ground.columns.edges[-1] / max(radius, 1e-300):.1f} crater radii: "
            "no far field to fit a datum to; give its radius (--datum-radius)"
        )
    cells = _cells(ground, outside)
    centre_free, radius_free = centre is None, fixed_radius is None
    if datum.is_sphere and not (centre_free or radius_free):
        return datum
    coefficients, covariance = _joint(_datum_basis(datum, cells, centre_free, radius_free), cells, inner)
    if not datum.is_sphere:
        slope = coefficients[1:] / cells.s.max()
        point = datum.outside(np.array([[0.0, 0.0, coefficients[0]]]))[0]
        normal = np.array([-slope[0], -slope[1], 1.0]) @ np.asarray(datum.axes)
        flat = plane(float(point[2]), (float(point[0]), float(point[1])), tuple(normal), "fitted to the far field")
        return replace(flat, sigma=float(np.sqrt(covariance[0, 0])), errors=((float(np.sqrt(covariance[0, 0])), 0.0),))
    pole = datum.outside(np.array([[0.0, 0.0, datum.radius]]))[0]
    rise = float(coefficients[0]) if radius_free else 0.0
    shift = np.zeros(3)
    if centre_free:
        shift[[2, 0, 1]] = coefficients[int(radius_free) :]
    size = datum.radius + rise
    if not size > 0.0 or size > 1e3 * float(cells.s.max()):
        raise InputError(
            "the far field is too flat to fit a sphere to it: give the datum's radius or centre, or take a plane"
        )
    middle = np.asarray(datum.centre) + shift @ np.asarray(datum.axes)
    errors = _error_shapes(covariance, centre_free, radius_free)
    ball = sphere(size, middle, pole - middle, "fitted to the far field")
    return replace(ball, sigma=float(np.sqrt(sum((c + k) ** 2 for c, k in errors))), errors=errors)


def _error_shapes(covariance: np.ndarray, centre_free: bool, radius_free: bool) -> tuple[tuple[float, float], ...]:
    """Independent ways (c, k) in which a sphere's height may be off, by c + k cos(psi) [m]: the principal axes of the
    covariance of its free parts."""
    if not centre_free:
        return ((float(np.sqrt(covariance[0, 0])), 0.0),)
    if not radius_free:
        return ((0.0, float(np.sqrt(covariance[0, 0]))),)
    values, vectors = np.linalg.eigh(covariance[:2, :2])
    rows = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    return tuple((float(c), float(k)) for c, k in rows)


def level_of_far_field(ground: Relief, radius: float) -> tuple[float, float]:
    """Mean height of the far field over the datum and its standard error [m], robust (soft_l1)."""
    far, _ = far_field(ground, radius)
    cells = ground.cell[far]
    if cells.size == 0 or not np.isfinite(cells).any():
        return 0.0, 0.0
    area = ground.datum.area_between(ground.columns.edges[:-1], ground.columns.edges[1:])[far]
    w = np.sqrt(np.broadcast_to(area[:, None], cells.shape)[np.isfinite(cells)] / area.mean())
    h = cells[np.isfinite(cells)]
    scale = max(1.4826 * float(np.median(np.abs(h - np.median(h)))), 1e-3 * float(ground.columns.spacing.min()))
    fit = least_squares(lambda p: w * (h - p[0]) / scale, [np.median(h)], loss="soft_l1", x_scale=scale)
    return float(fit.x[0]), scale * float(np.sqrt(RINGS_SHARE / len(h)))


def level_of_method(ground: Relief, radius: float) -> tuple[float, float]:
    """How far the colour field stands above the column method outside the crater [m], and half of it as an error.

    The column method counts volume and is right on average; the colour field stands low on very irregular clouds (by
    0.03 spacings for a shaken lattice, 0.2 for independent random points). Which shows only when the datum is given
    and not fitted by the same method.
    """
    columns = ground.columns
    ring = columns.distance > 1.3 * radius
    difference = (ground.methods["colour"] - ground.methods["column"])[ring]
    if not np.isfinite(difference).any():
        return 0.0, 0.1 * float(columns.spacing.min())
    area = np.broadcast_to(
        ground.datum.area_between(columns.edges[:-1], columns.edges[1:])[ring][:, None], difference.shape
    )
    good = np.isfinite(difference) & (np.abs(difference) < 2.0 * columns.spacing[ring][:, None])
    level = float(np.average(difference[good], weights=area[good])) if good.any() else 0.0
    return level, 0.5 * abs(level)
