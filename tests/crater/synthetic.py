"""Synthetic craters with known answers. Shares no code with crater/: own geometry, own sampling, own numbers."""

from __future__ import annotations

import numpy as np


class Shape:
    """Axisymmetric height above the datum at distance s; known rim radius, apparent radius, depth, rim height, volume."""

    def __init__(self, height, rim, reach, body_radius=None):
        self.h, self.rim, self.reach, self.R = height, rim, reach, body_radius
        s = np.linspace(0.0, reach, 400001)
        z = height(s)
        crest = np.argmax(z)
        self.rim_height = float(z[crest])
        self.rim_found = float(s[crest])
        self.depth = float(-z.min())
        below = s[(z < 0) & (s < self.rim_found)]
        self.apparent = float(below.max())
        inside = s <= self.apparent
        if body_radius is None:
            self.volume = float(np.trapezoid(-z[inside] * 2 * np.pi * s[inside], s[inside]))
        else:
            shell = (body_radius**3 - (body_radius + z[inside]) ** 3) / 3
            self.volume = float(np.trapezoid(shell * 2 * np.pi * np.sin(s[inside] / body_radius) / body_radius, s[inside]))


def bowl(radius, depth_ratio=0.2, rim_ratio=0.04, decay=3.0, power=2.0):
    """Bowl s^power to a sharp crest at ``radius``, ejecta falling as s^-decay outside. Ratios to the rim diameter."""
    depth, rim = 2 * radius * depth_ratio, 2 * radius * rim_ratio

    def height(s):
        s = np.asarray(s, float)
        inner = -depth + (depth + rim) * (s / radius) ** power
        outer = rim * (np.maximum(s, radius) / radius) ** -decay
        return np.where(s < radius, inner, outer)

    return height


def exponential(radius, depth_ratio=0.2, rim_ratio=0.05, length=0.35):
    """A cosine bowl to a sharp crest, an exponential apron outside: no power law."""
    depth, rim = 2 * radius * depth_ratio, 2 * radius * rim_ratio

    def height(s):
        s = np.asarray(s, float)
        inner = -depth + (depth + rim) * (1 - np.cos(np.pi * s / (2 * radius)))
        outer = rim * np.exp(-(np.maximum(s, radius) - radius) / (length * radius))
        return np.where(s < radius, inner, outer)

    return height


def rounded(radius, depth_ratio=0.15, rim_ratio=0.05, width=0.25):
    """Gaussian hollow plus a Gaussian ring: a crest without a corner."""
    depth, rim = 2 * radius * depth_ratio, 2 * radius * rim_ratio

    def height(s):
        s = np.asarray(s, float)
        hollow = -depth * np.exp(-((s / (0.6 * radius)) ** 4))
        return hollow + rim * np.exp(-(((s - radius) / (width * radius)) ** 2))

    return height


def complex_crater(radius, depth_ratio=0.06, rim_ratio=0.03, floor=0.6, peak=0.4):
    """Flat floor, steep wall, central peak of ``peak`` depths, power-law apron."""
    depth, rim = 2 * radius * depth_ratio, 2 * radius * rim_ratio

    def height(s):
        s = np.asarray(s, float)
        u = np.clip((s - floor * radius) / ((1 - floor) * radius), 0, 1)
        inner = -depth + (depth + rim) * u**1.5 + peak * depth * np.exp(-((s / (0.15 * radius)) ** 2))
        return np.where(s < radius, inner, rim * (np.maximum(s, radius) / radius) ** -3.0)

    return height


def _hexagonal(spacing, lo, hi):
    """HCP points in a box with one point per spacing^3."""
    a = spacing * 2 ** (1 / 6)
    n = np.ceil((hi - lo) / (a * np.array([1, np.sqrt(3) / 2, np.sqrt(2 / 3)]))).astype(int) + 3
    i, j, k = np.meshgrid(*(np.arange(m) for m in n), indexing="ij")
    x = i + 0.5 * (j % 2) + 0.5 * (k % 2)
    y = np.sqrt(3) / 2 * (j + (k % 2) / 3)
    z = np.sqrt(2 / 3) * k
    p = a * np.stack([x.ravel(), y.ravel(), z.ravel()], 1) + lo - a
    return p[((p >= lo) & (p < hi)).all(1)]


def _rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def fill(rng, spacing, lo, hi, kind):
    """Points of a box: ``lattice`` (HCP, turned and shifted), ``jitter`` (HCP with a quarter spacing of noise), ``random`` (Poisson)."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    if kind == "random":
        return rng.uniform(lo, hi, size=(round(float(np.prod((hi - lo) / spacing))), 3))
    p = _turned_lattice(spacing, lo, hi, rng)
    if kind == "jitter":
        p = p + rng.normal(scale=0.25 * spacing, size=p.shape)
    return p[((p >= lo) & (p < hi)).all(1)]


def _turned_lattice(spacing, lo, hi, rng):
    """HCP points, turned and shifted at random, of a box and a margin of two spacings: only the stretch of each lattice row that lies inside is made."""
    a = spacing * 2 ** (1 / 6)
    turn, shift = _rotation(rng), rng.uniform(-1, 1, 3) * spacing
    lo, hi = lo - 2 * spacing, hi + 2 * spacing
    middle, reach = 0.5 * (lo + hi) + shift, 0.5 * np.linalg.norm(hi - lo)
    n, m = int(reach / (a * np.sqrt(3) / 2)) + 2, int(reach / (a * np.sqrt(2 / 3))) + 2
    j, k = (g.ravel() for g in np.meshgrid(np.arange(-n, n + 1), np.arange(-m, m + 1), indexing="ij"))
    start = a * np.stack([0.5 * (j % 2) + 0.5 * (k % 2), np.sqrt(3) / 2 * (j + (k % 2) / 3), np.sqrt(2 / 3) * k], 1) @ turn.T + middle
    step = a * turn[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (lo - start) / step, (hi - start) / step
    enter, leave = np.nanmax(np.minimum(first, second), axis=1), np.nanmin(np.maximum(first, second), axis=1)
    begin, count = np.ceil(enter), np.maximum(0, np.floor(leave) - np.ceil(enter) + 1).astype(int)
    row = np.repeat(np.arange(len(j)), count)
    along = begin[row] + np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return start[row] + along[:, None] * step


def cloud_on_plane(shape, spacing, rng, kind="jitter", thickness=None, centre=(0.0, 0.0), tilt=0.0, stretch=1.0, ejecta=0.0, noise=0.0):
    """Positions (n, 3) under ``shape`` on a plane; ``stretch`` > 1 makes the crater an ellipse of equal area."""
    reach = shape.reach
    floor = -(thickness if thickness else shape.depth + 4 * spacing)
    top = shape.rim_height + 2 * spacing
    p = fill(rng, spacing, (-reach, -reach, floor), (reach, reach, top), kind)
    s = np.hypot((p[:, 0] - centre[0]) / np.sqrt(stretch), (p[:, 1] - centre[1]) * np.sqrt(stretch))
    p = p[p[:, 2] < shape.h(s)]
    count = len(p)
    if ejecta:
        m = round(ejecta * count)
        fly = rng.uniform((-reach, -reach, 0), (reach, reach, 3 * shape.depth), size=(m, 3))
        s = np.hypot(fly[:, 0] - centre[0], fly[:, 1] - centre[1])
        p = np.vstack([p, fly[fly[:, 2] > shape.h(s) + spacing]])
    if noise:
        p = p + rng.normal(scale=noise * spacing, size=p.shape)
    if tilt:
        c, w = np.cos(tilt), np.sin(tilt)
        p = p @ np.array([[c, 0, w], [0, 1, 0], [-w, 0, c]]).T
    return p


def turned(position, angles):
    """Positions turned about y and then x by two angles [rad]: the pole wanders off +z."""
    (c, w), (e, f) = ((np.cos(a), np.sin(a)) for a in angles)
    return position @ np.array([[c, 0, w], [0, 1, 0], [-w, 0, c]]).T @ np.array([[1, 0, 0], [0, e, -f], [0, f, e]]).T


def cloud_on_sphere(shape, spacing, rng, kind="jitter", ejecta=0.0, depth_of_cloud=None, stretch=1.0):
    """Positions under ``shape`` on a body of radius shape.R whose pole is +z: the cap within the shape's reach.

    ``stretch`` > 1 makes the crater an ellipse of (to a part in a thousand) equal area.
    """
    R = shape.R
    psi = min(shape.reach / R, np.pi)
    below = depth_of_cloud or (shape.depth + 4 * spacing)
    wide = (R + shape.rim_height) * (np.sin(psi) if psi < np.pi / 2 else 1.0) + spacing
    low = (R - below) * np.cos(psi) if psi < np.pi / 2 else (R + shape.rim_height) * np.cos(psi)
    p = fill(rng, spacing, (-wide, -wide, low), (wide, wide, R + shape.rim_height + spacing), kind)
    r = np.linalg.norm(p, axis=1)
    s = R * np.arctan2(np.hypot(p[:, 0], p[:, 1]), p[:, 2])
    cosine2 = (p[:, 0] ** 2) / np.maximum(p[:, 0] ** 2 + p[:, 1] ** 2, 1e-300)
    inner = s * np.sqrt(cosine2 / stretch + (1 - cosine2) * stretch)
    keep = (r > R - below) & (s < shape.reach) & (r - R < shape.h(inner))
    p = p[keep]
    if ejecta:
        m = round(ejecta * len(p))
        u = rng.normal(size=(20 * m, 3))
        u /= np.linalg.norm(u, axis=1)[:, None]
        far = R * np.arctan2(np.hypot(u[:, 0], u[:, 1]), u[:, 2])
        u, far = u[far < shape.reach], far[far < shape.reach]
        q = shape.h(far) + spacing + rng.uniform(0, 3 * shape.depth, size=len(u))
        p = np.vstack([p, (u * (R + q)[:, None])[:m]])
    return p


def as_fields(position, spacing, density=1000.0):
    """Fields of a snapshot: equal particles that fill space at ``spacing``."""
    n = len(position)
    spacing = np.broadcast_to(spacing, n)
    return {"position": position, "mass": density * spacing**3, "density": np.full(n, density)}


def graded_cloud_on_sphere(shape, spacing, rng, growth=1.0, reach=None, below=None):
    """A regular cloud whose spacing grows away from the pole: a lattice about the pole, stretched as q -> q (1 + growth q^2 / reach^2).

    Returns positions and local spacing = (volume per particle)^(1/3) = spacing (f' f^2 / q^2)^(1/3), exact for the stretch.
    """
    R = shape.R
    reach = reach or 1.3 * shape.reach / (1 + growth)
    below = below or (shape.depth + 4 * spacing)
    q_most = reach
    box = _hexagonal(spacing, -q_most * np.ones(3), q_most * np.ones(3)) @ _rotation(rng).T
    q = np.linalg.norm(box, axis=1)
    box, q = box[q < q_most], q[q < q_most]
    stretch = 1 + growth * (q / reach) ** 2
    slope = 1 + 3 * growth * (q / reach) ** 2
    p = box * stretch[:, None] + np.array([0.0, 0.0, R])
    size = spacing * np.cbrt(slope * stretch**2)
    r = np.linalg.norm(p, axis=1)
    s = R * np.arctan2(np.hypot(p[:, 0], p[:, 1]), p[:, 2])
    keep = (s < shape.reach) & (r - R < shape.h(s)) & (r > R - below - 3 * size)
    return p[keep], size[keep]
