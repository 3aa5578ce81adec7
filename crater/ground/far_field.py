"""Where the ground far from a crater stands: the datum fitted to it together with the blanket that covers it.

Outside the crater h(s, a) = e(s, a) + b f(s / s0) + u g(s / s0), b >= 0, u >= 0: e is what the datum is off (a level
and a tilt; on a sphere also what a lower centre and a smaller radius make of its curvature), b the ejecta blanket at
s0, the inner edge of the fit, which falls as a power near s^-3 (McGetchin et al. 1973), u the uplifted and slumped
rim, which ends far more steeply. All are linear but f and g, which no crater tells beforehand: each pair of a list is
fitted and counts by how well it fits, so that what the fit cannot tell apart is in the error of the datum. A blanket
taken out with a fixed power and only where it is positive pulls a fitted sphere down: what is left of it looks like
curvature and grows from turn to turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from crater.ground.datum import Datum, plane, sphere
from crater.ground.radial_profile import RINGS_SHARE, Relief, ring_mean
from matter.errors import InputError

FAR = 3.0
"""Ground that carries next to no blanket begins at three crater radii."""
FEWEST_FAR = 4
"""Fewer rings (two to a spacing) than this beyond ``FAR`` radii are no far field."""
NARROWEST = 1.9
"""Ground that ends at fewer times the distance of the crest does not tell its blanket from its datum."""
INNER = 1.15
"""The fit begins at this many times the distance of the crest: a crest stays where it is when the datum is moved."""
BLANKETS = (2.5, 3.0, 3.5)
"""Exponents q with which ejecta blankets fall, as u^-q of u = s / s0."""
RIMS = {
    "power": (5.0, 8.0, 12.0),
    "exponential": (5.0, 10.0),
    "gaussian": (3.0, 6.0, 12.0),
    "rounded": (4.0, 7.0, 11.0),
}
"""How an uplifted rim may end: u^-q, exp(-q (u - 1)), exp(-q (u^2 - 1) / 2), u^2 exp(-q (u^2 - 1) / 2)."""
REARRANGED = 0.05
"""Spacings by which a level of the colour field may differ between ground as it was and ground that was stirred."""
FEWEST_RINGS = 8
"""Fewer rings (two to a spacing) outside of the crest than this do not tell a blanket from the datum."""


def _edge(ground: Relief) -> float:
    """Distance of the outermost ring that has ground [m]."""
    known = np.isfinite(ring_mean(ground.cell))
    return float(ground.columns.edges[1:][known][-1]) if known.any() else 0.0


def radii(ground: Relief, radius: float) -> float:
    """How many crater radii the ground reaches."""
    return _edge(ground) / max(radius, 1e-300)


def _beyond(ground: Relief, radius: float) -> np.ndarray:
    """Mask of the rings beyond ``FAR`` crater radii that have ground."""
    return np.isfinite(ring_mean(ground.cell)) & (ground.columns.distance > FAR * radius)


def outermost(ground: Relief, radius: float) -> np.ndarray:
    """Mask of the rings beyond ``FAR`` crater radii; where the ground ends before, of those in its outermost quarter
    outside the rim."""
    far = _beyond(ground, radius)
    if far.sum() >= FEWEST_FAR:
        return far
    s = ground.columns.distance
    return np.isfinite(ring_mean(ground.cell)) & (s > max(0.75 * _edge(ground), 1.3 * radius))


def outermost_height(ground: Relief, radius: float) -> float:
    """Mean height of the ``outermost`` rings [m], blanket and all; 0 where there are none."""
    rings = outermost(ground, radius)
    if not rings.any():
        return 0.0
    area = ground.datum.area_between(ground.columns.edges[:-1], ground.columns.edges[1:])[rings]
    return float(np.average(ring_mean(ground.cell)[rings], weights=area))


def level(ground: Relief, radius: float) -> tuple[float, float]:
    """How far the ground rose or fell as a whole, and the standard error [m]: the level of the ground outside the
    crater, its blanket fitted with it. NaN where fewer than ``FEWEST_FAR`` rings lie beyond ``FAR`` radii."""
    if _beyond(ground, radius).sum() < FEWEST_FAR:
        return float("nan"), float("nan")
    rings, inner = _outside(ground, radius)
    cells = _cells(ground, rings)
    value, covariance = _joint(np.ones((len(cells.s), 1)), cells, inner)
    return float(value[0]), float(np.sqrt(covariance[0, 0]))


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


class _Fits(NamedTuple):
    """Of several fits of one datum: its parameters ``datum`` (f, n), their ``covariance`` (f, n, n) (the sandwich over
    groups), the weighted sums of ``squares`` (f,), and how much the grouping ``widens`` the first parameter's variance
    (f,)."""

    datum: np.ndarray
    covariance: np.ndarray
    squares: np.ndarray
    widens: np.ndarray


_RCOND, _TURNS = 1e-13, 12


def _not_negative(normal: np.ndarray, right: np.ndarray, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (f, b) of the normal equations of each fit, those from the ``n``-th on not negative: the most
    negative one is left out until none is. And the inverse (f, b, b) of what was kept, zero elsewhere."""
    size, keep = np.sqrt(np.diagonal(normal, axis1=1, axis2=2)), np.ones(right.shape, dtype=bool)
    while True:
        inverse = np.linalg.pinv(normal * keep[:, :, None] * keep[:, None, :], rcond=_RCOND, hermitian=True)
        coefficients = np.einsum("fbc,fc->fb", inverse, right * keep) * keep
        negative = np.where(np.arange(right.shape[1]) >= n, coefficients * size, 0.0)
        wrong = np.flatnonzero(negative.min(axis=1) < 0.0)
        if not len(wrong):
            return coefficients, inverse
        keep[wrong, np.argmin(negative[wrong], axis=1)] = False


def _robust(datum: np.ndarray, falls: np.ndarray, cells: _Ground) -> _Fits:
    """Least squares of the columns of ``datum`` (c, n) and, with coefficients that are not negative, of ``falls``
    (f, c, m), a fit for each; soft_l1 loss beyond ``scale`` by reweighting."""
    n = datum.shape[1]
    basis = np.concatenate([np.broadcast_to(datum, (len(falls), *datum.shape)), falls], axis=2)
    k = np.broadcast_to(cells.w**2, basis.shape[:2])
    for _ in range(_TURNS):
        weighted = np.swapaxes(basis * k[:, :, None], 1, 2)
        coefficients, inverse = _not_negative(weighted @ basis, weighted @ cells.h, n)
        left = cells.h - np.einsum("fcb,fb->fc", basis, coefficients)
        k = cells.w**2 / np.sqrt(1.0 + (cells.w * left / cells.scale) ** 2)
    scores = basis * (k * left)[:, :, None]
    group = np.unique(cells.group, return_inverse=True)[1]
    grouped = (group == np.arange(group.max() + 1)[:, None]).astype(float) @ scores
    many = grouped.shape[1] / max(grouped.shape[1] - 1, 1)
    covariance = many * inverse @ (np.swapaxes(grouped, 1, 2) @ grouped) @ inverse
    alone = inverse @ (np.swapaxes(scores, 1, 2) @ scores) @ inverse
    widens = np.maximum(1.0, covariance[:, 0, 0] / np.maximum(alone[:, 0, 0], 1e-300))
    return _Fits(coefficients[:, :n], covariance[:, :n, :n], np.sum(k * left**2, axis=1), widens)


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


def _covers(u: np.ndarray) -> list[list[np.ndarray]]:
    """What may cover the ground at distances ``u`` in units of the inner edge: the columns of a rim alone, of a
    blanket alone, or of both."""
    blankets = [u**-q for q in BLANKETS]
    rims = [
        *(u**-q for q in RIMS["power"]),
        *(np.exp(-q * (u - 1.0)) for q in RIMS["exponential"]),
        *(np.exp(-0.5 * q * (u**2 - 1.0)) for q in RIMS["gaussian"]),
        *(u**2 * np.exp(-0.5 * q * (u**2 - 1.0)) for q in RIMS["rounded"]),
    ]
    return [
        [rim[:, None] for rim in rims],
        [blanket[:, None] for blanket in blankets],
        [np.column_stack([blanket, rim]) for blanket in blankets for rim in rims],
    ]


PRIOR = (0.5, 0.25, 0.25)
"""Weight of a rim, a blanket, and both, before the ground has been looked at."""


def _joint(basis: np.ndarray, cells: _Ground, inner: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Parameters of the datum and their covariance, with blanket and rim beyond ``inner`` [m] averaged over (None:
    bare ground).

    No list of covers is complete: half of what a rim alone and a blanket alone would make of the datum is part of the
    covariance, however well either fits.
    """
    if inner is None:
        bare = _robust(basis, np.empty((1, len(basis), 0)), cells)
        return bare.datum[0], bare.covariance[0]
    kinds = [_robust(basis, np.array(kind), cells) for kind in _covers(cells.s / inner)]
    points, covariance, squares, widens = (np.concatenate(parts) for parts in zip(*kinds))
    best, many = int(np.argmin(squares)), [len(kind.squares) for kind in kinds]
    variance = squares[best] / len(cells.h) * max(widens[best], RINGS_SHARE)
    prior = np.concatenate([np.full(number, part / number) for part, number in zip(PRIOR, many)])
    weight = prior * np.exp(-0.5 * (squares - squares.min()) / variance)
    weight /= weight.sum()
    mean = weight @ points
    deviation = points - mean
    within = np.einsum("p,pij->ij", weight, covariance)
    rim, blanket = slice(0, many[0]), slice(many[0], many[0] + many[1])
    half = 0.5 * (_mean(points[rim], squares[rim], variance) - _mean(points[blanket], squares[blanket], variance))
    return mean, within + (deviation * weight[:, None]).T @ deviation + np.outer(half, half)


def _mean(points: np.ndarray, squares: np.ndarray, variance: float) -> np.ndarray:
    """Mean of the fits of one kind, each by how well it fits."""
    return np.asarray(np.average(points, axis=0, weights=np.exp(-0.5 * (squares - squares.min()) / variance)))


def _crest(ground: Relief, radius: float) -> float:
    """Distance of the highest ring about a hollow of apparent ``radius`` [m]; the radius where there is none."""
    s, mean = ground.columns.distance, ring_mean(ground.cell)
    near = (s > 0.8 * radius) & (s < 2.0 * radius) & np.isfinite(mean)
    return float(s[near][np.argmax(mean[near])]) if near.any() else radius


def _outside(ground: Relief, radius: float) -> tuple[np.ndarray, float]:
    """Mask of the rings outside of the crest that have ground, and the inner edge of what is fitted there [m]."""
    inner = INNER * _crest(ground, radius)
    return np.isfinite(ring_mean(ground.cell)) & (ground.columns.distance > inner), inner


def constrains_datum(ground: Relief, radius: float) -> bool:
    """Whether the ground outside a hollow of this ``radius`` [m] reaches far enough to tell its blanket from its
    datum."""
    wide = _edge(ground) >= NARROWEST * _crest(ground, radius)
    return wide and int(_outside(ground, radius)[0].sum()) >= FEWEST_RINGS


def refit(
    ground: Relief, datum: Datum, radius: float, centre=None, fixed_radius: float | None = None, rough: bool = False
) -> Datum:
    """The datum fitted to the ground outside a crater of apparent ``radius`` [m], blanket and all; its axis keeps
    passing through the crater.

    A sphere's ``centre`` and radius are kept where given. A ``rough`` fit, for a datum that is still far off, takes
    the far ground as bare; so does one of ground that ends too close to the crater (``constrains_datum``), and where
    there is none outside the rim the datum stays. ``errors`` of the result are the ways in which it may be off.
    """
    outside, inner = _outside(ground, radius)
    bare = rough or not constrains_datum(ground, radius)
    if bare:
        outside = outermost(ground, radius)
    if outside.sum() < 2:
        return datum
    cells = _cells(ground, outside)
    centre_free, radius_free = centre is None, fixed_radius is None
    if datum.is_sphere and not (centre_free or radius_free):
        return datum
    coefficients, covariance = _joint(
        _datum_basis(datum, cells, centre_free, radius_free), cells, None if bare else inner
    )
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


def level_of_method(ground: Relief, radius: float, before_known: bool = False) -> tuple[float, float]:
    """How far the colour field stands above the column method outside the crater, and the error of a level [m]: half
    of that, and ``REARRANGED`` spacings. Both go as the spacing: they are those of the spacing at the crater's edge.
    (Offset 0 where the column method was not used.)

    The column method counts volume and is right on average; the colour field stands low on very irregular clouds (by
    0.03 spacings for a shaken lattice, 0.2 for independent random points). Which shows only when the datum is given
    and not fitted by the same method.

    Where heights are over the ground before the impact (``before_known``), of each method over its own, the offset is
    what stirring the ground did to the colour field: the standard error of its mean over the rings then stands in
    place of ``REARRANGED``. Rings are two to a spacing, so that neighbours are not independent.
    """
    columns = ground.columns
    spacing = float(np.interp(radius, columns.distance, columns.spacing))
    if "column" not in ground.methods:
        return 0.0, REARRANGED * spacing
    ring = columns.distance > 1.3 * radius
    difference = ((ground.methods["colour"] - ground.methods["column"]) / columns.spacing[:, None])[ring]
    good = np.isfinite(difference) & (np.abs(difference) < 2.0)
    if not good.any():
        return 0.0, 2.0 * REARRANGED * spacing
    area = ground.datum.area_between(columns.edges[:-1], columns.edges[1:])[ring]
    weight = area * good.sum(axis=1)
    mean = np.where(good, difference, 0.0).sum(axis=1) / np.maximum(good.sum(axis=1), 1)
    offset = float(np.average(mean, weights=weight))
    rings = int(np.count_nonzero(weight))
    error = REARRANGED
    if before_known and rings >= FEWEST_RINGS:
        error = math.sqrt(2.0 * float(np.sum((weight * (mean - offset)) ** 2))) / float(weight.sum())
    return offset * spacing, float(np.hypot(0.5 * offset, error)) * spacing
