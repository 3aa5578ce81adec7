"""The datum: the plane or sphere that heights are measured from, fitted robustly to the ground far from the crater.

Canonical coordinates: the crater's axis is +z. On a plane the height is z and the distance the radius in the plane; on
a sphere of radius R (centre at the origin of these coordinates) the height is |x| - R and the distance the arc R psi.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from matter.errors import InputError
from matter.geometry import frame


@dataclass(frozen=True)
class Datum:
    """A plane (``radius`` infinite, ``centre`` a point on it) or a sphere about ``centre``; rows of ``axes`` are x',
    y', z' (the axis).

    ``sigma`` [m] is the uncertainty of its level on the axis, ``source`` how it was found. ``errors`` are the
    independent ways (c, k) [m] in which its height may be off: by c + k cos(s / radius) at a distance s, one standard
    deviation each.
    """

    kind: str
    radius: float
    centre: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    sigma: float = 0.0
    source: str = "given"
    errors: tuple[tuple[float, float], ...] = ()

    @property
    def is_sphere(self) -> bool:
        return self.kind == "sphere"

    def local(self, position: np.ndarray) -> np.ndarray:
        """Canonical coordinates [m], shape (n, 3)."""
        p, c = np.asarray(position, dtype=float), self.centre
        x, y, z = p[:, 0] - c[0], p[:, 1] - c[1], p[:, 2] - c[2]
        # written out: a product with a 3 x 3 matrix costs BLAS ten times as much
        return np.column_stack([x * a[0] + y * a[1] + z * a[2] for a in self.axes])

    def outside(self, local: np.ndarray) -> np.ndarray:
        """Back from canonical coordinates."""
        return local @ np.asarray(self.axes) + np.asarray(self.centre)

    def polar(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Distance from the crater's axis along the datum [m], azimuth [rad] in [0, 2 pi), height [m]."""
        x = self.local(position)
        rho = np.hypot(x[:, 0], x[:, 1])
        azimuth = np.mod(np.arctan2(x[:, 1], x[:, 0]), 2.0 * np.pi)
        if self.is_sphere:
            return self.radius * np.arctan2(rho, x[:, 2]), azimuth, np.linalg.norm(x, axis=1) - self.radius
        return rho, azimuth, x[:, 2]

    def vertical(self, position: np.ndarray, vector: np.ndarray) -> np.ndarray:
        """Component of ``vector`` along the local vertical, shape (n,)."""
        v = np.asarray(vector) @ np.asarray(self.axes).T
        if not self.is_sphere:
            return v[:, 2]
        x = self.local(position)
        return np.einsum("ij,ij->i", v, x) / np.maximum(np.linalg.norm(x, axis=1), 1e-300)

    def moved(self, east: float, north: float) -> Datum:
        """The same surface with the crater's axis shifted by ``east`` along x' and ``north`` along y' [m along the
        datum]."""
        axes = np.asarray(self.axes)
        if not self.is_sphere:
            return replace(self, centre=tuple(np.asarray(self.centre) + east * axes[0] + north * axes[1]))
        distance = np.hypot(east, north)
        if distance == 0.0:
            return self
        psi = distance / self.radius
        towards = (east * axes[0] + north * axes[1]) / distance
        return replace(self, axes=_axes(np.cos(psi) * axes[2] + np.sin(psi) * towards, axes[0]))

    def raised(self, by: float, sigma: float | None = None, source: str | None = None) -> Datum:
        """The datum shifted up by ``by`` [m]."""
        changes: dict = {"sigma": self.sigma if sigma is None else sigma, "source": source or self.source}
        if self.is_sphere:
            return replace(self, radius=self.radius + by, **changes)
        return replace(self, centre=tuple(np.asarray(self.centre) + by * np.asarray(self.axes)[2]), **changes)

    def area_between(self, inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
        """Area of the annulus between two distances on the datum [m^2]."""
        if self.is_sphere:
            return 2.0 * np.pi * self.radius**2 * (np.cos(inner / self.radius) - np.cos(outer / self.radius))
        return np.pi * (np.asarray(outer) ** 2 - np.asarray(inner) ** 2)


def _triple(vector) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in vector)
    return x, y, z


def _axes(z: np.ndarray, x_hint: np.ndarray) -> tuple[tuple[float, float, float], ...]:
    z = z / np.linalg.norm(z)
    x = np.asarray(x_hint) - np.dot(x_hint, z) * z
    if np.linalg.norm(x) < 1e-9:
        x = np.array([0.0, 1.0, 0.0]) - z[1] * z
    x = x / np.linalg.norm(x)
    return _triple(x), _triple(np.cross(z, x)), _triple(z)


def sphere(radius: float, centre=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), source: str = "given") -> Datum:
    """A spherical datum whose crater lies in the direction ``axis`` from its ``centre``."""
    if not radius > 0.0:
        raise InputError(f"the radius of the datum sphere must be positive, got {radius}")
    return Datum(
        "sphere", float(radius), _triple(centre), _axes(np.asarray(axis, float), np.array([1.0, 0, 0])), 0.0, source
    )


def plane(level: float = 0.0, origin=(0.0, 0.0), normal=(0.0, 0.0, 1.0), source: str = "given") -> Datum:
    """A plane through (x, y, level) with the given ``normal`` (up)."""
    axes = _axes(np.asarray(normal, float), np.array([1.0, 0, 0]))
    return Datum("plane", float("inf"), (float(origin[0]), float(origin[1]), float(level)), axes, 0.0, source)


def of_frame(given: Datum | frame.Sphere | frame.Plane) -> Datum:
    """The datum of one of the frames of ``matter.geometry.frame``."""
    if isinstance(given, Datum):
        return given
    if isinstance(given, frame.Sphere):
        return sphere(given.radius, given.centre)
    if isinstance(given, frame.Plane):
        return plane(given.level, given.origin)
    raise InputError(f"a datum is a Sphere, a Plane (matter.geometry.frame) or a Datum, not {type(given).__name__}")


def fit_sphere(
    points: np.ndarray, scale: float, radius: float | None = None, centre: tuple[float, float, float] | None = None
) -> Datum:
    """Sphere through ``points`` (n, 3) by least squares with soft_l1 loss beyond ``scale`` [m]; a ``radius`` or
    ``centre`` that is given is kept.

    Raises ``InputError`` when the points do not determine a sphere (too flat a patch): give radius or centre.
    """
    if len(points) < 8:
        raise InputError(
            f"too few points to fit a datum: {len(points)} in the far field; give its level or its radius "
            f"(measure_crater --datum-radius)"
        )
    c0, r0 = _first_sphere(points, scale)
    c0 = np.asarray(centre, float) if centre is not None else c0
    r0 = radius or (float(np.median(np.linalg.norm(points - c0, axis=1))) if centre is not None else r0)
    free_c, free_r = centre is None, radius is None

    def unpack(p):
        c = c0 + p[:3] if free_c else c0
        return c, (r0 + p[-1] if free_r else r0)

    def residual(p):
        c, r = unpack(p)
        return (np.linalg.norm(points - c, axis=1) - r) / scale

    count = 3 * free_c + free_r
    if count == 0:
        return sphere(r0, c0, source="given")
    fit = least_squares(residual, np.zeros(count), x_scale=scale, loss="soft_l1", max_nfev=200)
    c, r = unpack(fit.x)
    if not r > 0.0 or r > 1e3 * np.ptp(points):
        raise InputError(
            "the far field is too flat to fit a sphere to it: give the datum's radius or centre, or take a plane"
        )
    return sphere(r, c, source="fitted to the far field")


def _first_sphere(points: np.ndarray, scale: float) -> tuple[np.ndarray, float]:
    """Centre and radius by linear least squares: |x|^2 = 2 c.x + (R^2 - |c|^2) is linear in c and R^2 - |c|^2."""
    middle = points.mean(axis=0)
    q = points - middle
    solution, *_ = np.linalg.lstsq(np.column_stack([2.0 * q, np.ones(len(q))]), (q**2).sum(axis=1), rcond=None)
    centre, rest = solution[:-1], solution[-1]
    return middle + centre, float(np.sqrt(max(rest + centre @ centre, scale**2)))
