"""Where ejecta leave the ground, how fast and how steeply: read from snapshots of the shock stage on flat ground,
beside the law of Housen & Holsapple 2011.

A particle of the target is launched when it first stands higher than ``above`` and rises. From there it is led back to
the datum along its parabola. Distances are those from the vertical through the impact point: for an oblique impact no
longer the crater's axis.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from crater.scaling import crater_size
from matter.errors import InputError
from matter.particles import Particles
from matter.wording import readable

SOURCES = ("HousenHolsapple2011",)

ABOVE = 1.5
"""Spacings above the datum at which a particle counts as flying."""


class Launched(NamedTuple):
    """Distance from the axis [m], azimuth [rad], speed [m/s] and angle above the horizontal [rad] at the datum, mass
    [kg]; one row a particle."""

    distance: np.ndarray
    azimuth: np.ndarray
    speed: np.ndarray
    angle: np.ndarray
    mass: np.ndarray


def launched(frames: Iterable[Particles], gravity: float, above: float) -> Launched:
    """Ejecta of ``frames`` in the order of time (the same particles in each), with the height ``above`` [m] at which
    they count as flying.

    Raises ``InputError`` for a body that is not flat, and where nothing flies.
    """
    seen: np.ndarray | None = None
    parts: list[tuple[np.ndarray, ...]] = []
    for frame in frames:
        frame.need("position", "velocity", "mass", "layer")
        if frame.attributes.get("frame") != "plane":
            raise InputError("launch speeds can be measured on flat ground only")
        seen = np.zeros(len(frame), dtype=bool) if seen is None else seen
        z, up = frame.position[:, 2], frame.velocity[:, 2]
        new = ~seen & (frame.layer >= 0) & (z > above) & (up > 0.0)
        seen |= new
        position, flat = frame.position[new, :2], frame.velocity[new, :2]
        rise = np.sqrt(up[new] ** 2 + 2.0 * gravity * z[new])
        since = (rise - up[new]) / gravity if gravity > 0.0 else z[new] / up[new]
        origin = position - flat * since[:, None]
        across = np.hypot(flat[:, 0], flat[:, 1])
        parts.append(
            (
                np.hypot(origin[:, 0], origin[:, 1]),
                np.arctan2(origin[:, 1], origin[:, 0]),
                np.hypot(across, rise),
                np.arctan2(rise, across),
                frame.mass[new],
            )
        )
    if not parts or not sum(len(part[0]) for part in parts):
        raise InputError(f"nothing of the target flies higher than {readable.length(above)}")
    return Launched(*(np.concatenate(column) for column in zip(*parts)))


class Fit(NamedTuple):
    """mu and C1 of v(x) with their errors, and the table they were fitted to: median x / a, v / U, angle [rad] and
    number of each ring."""

    mu: float
    mu_sigma: float
    c1: float
    c1_sigma: float
    table: np.ndarray


def fit(
    ejecta: Launched,
    event: crater_size.ImpactEvent,
    radius: float,
    inner: float = 1.2,
    outer: float = 0.9,
    rings: int = 12,
    sectors: int = 24,
) -> Fit:
    """mu and C1 of ``scaling.launch_speed`` (its p and n2 of dry sand) through the medians of rings between ``inner``
    a and ``outer`` ``radius``.

    ``radius`` [m] : apparent radius of the crater. Rings of fewer than eight particles are left out. The errors are
    those of leaving out one of ``sectors`` in azimuth after the other (jackknife). Raises ``InputError`` where fewer
    than three rings are left.
    """
    edges = np.geomspace(inner * event.radius, outer * radius, rings + 1)
    ring = np.digitize(ejecta.distance, edges) - 1
    sector = np.floor((ejecta.azimuth / (2.0 * np.pi) % 1.0) * sectors).astype(int)

    def line(kept: np.ndarray) -> tuple[float, float, np.ndarray]:
        rows = []
        for k in range(rings):
            here = kept & (ring == k)
            if here.sum() >= 8:
                rows.append(
                    [np.median(part[here]) for part in (ejecta.distance, ejecta.speed, ejecta.angle)]
                    + [float(here.sum())]
                )
        table = np.array(rows)
        if len(table) < 3:
            raise InputError(
                f"a fit of launch speeds needs ejecta in at least 3 of the {rings} rings between {inner:g} a and "
                f"{outer:g} R; found {len(table)}"
            )
        x, v = table[:, 0], table[:, 1]
        bent = np.maximum(1.0 - x / (crater_size.SAND_EDGE * radius), 1e-9) ** crater_size.SAND_BEND
        scaled_distance = x / event.radius * (event.target_density / event.projectile_density) ** crater_size.NU
        slope, offset = np.polyfit(np.log(scaled_distance), np.log(v / (event.speed * np.cos(event.angle)) / bent), 1)
        return float(-1.0 / slope), float(np.exp(offset)), table

    mu, c1, table = line(np.ones(len(ring), dtype=bool))
    less = np.array([line(sector != k)[:2] for k in range(sectors)])
    scale = (sectors - 1) / sectors
    errors = np.sqrt(scale * ((less - less.mean(axis=0)) ** 2).sum(axis=0))
    table[:, 0] /= event.radius
    table[:, 1] /= event.speed * np.cos(event.angle)
    return Fit(mu, float(errors[0]), c1, float(errors[1]), table)
