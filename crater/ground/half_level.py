"""The colour field on columns, and where it crosses one half: the compiled loops under ``crater.ground.surface``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from crater.ground.cloud import Cloud
from crater.ground.datum import Datum
from matter.compilation.jit import inner_kernel, kernel


class Rings(NamedTuple):
    """Columns on rings over a plane, or over a sphere of ``radius`` [m] about the origin: ``distance`` of each ring
    (n,) [m], its ``first`` column, how many ``columns``, and the ``position`` of every one (m, 3): on the plane [m],
    or its direction from the centre of the sphere."""

    sphere: bool
    radius: float
    distance: np.ndarray
    first: np.ndarray
    columns: np.ndarray
    position: np.ndarray


class Levels(NamedTuple):
    """Heights at which the field is summed: ``lowest`` and ``step`` [m], and the number of the level at which each
    column begins."""

    lowest: float
    step: float
    first: np.ndarray


@inner_kernel(fastmath=True)
def _columns_within(half, azimuth, count):
    """First and last of the ``count`` columns of a ring that lie within the angle ``half`` of an ``azimuth`` [rad];
    either may need to wrap."""
    step = 2.0 * np.pi / count
    k0 = int(np.floor((azimuth - half) / step - 0.5))
    k1 = int(np.ceil((azimuth + half) / step - 0.5))
    if k1 - k0 >= count:
        k0, k1 = 0, count - 1
    return k0, k1


@inner_kernel(fastmath=True)
def _half_angle(reach, rho):
    """Angle about the axis under which a particle at ``rho`` [m] from it and of this ``reach`` [m] is seen."""
    return np.pi if reach >= rho else np.arcsin(reach / rho) * 1.001


@inner_kernel(fastmath=True)
def _beside_and_above(point, r, rings, column):
    """Square of the distance of a point (``r`` from the centre) from a column [m^2], and its height along that column
    [m]."""
    position = rings.position
    if rings.sphere:
        along = position[column, 0] * point[0] + position[column, 1] * point[1] + position[column, 2] * point[2]
        return r * r - along * along, along - rings.radius
    return (point[0] - position[column, 0]) ** 2 + (point[1] - position[column, 1]) ** 2, point[2]


@kernel(fastmath=True)
def _tops(x, spacing, rings, highest):
    """The highest particle of each column of area spacing^2, plus half a spacing."""
    sphere, radius = rings.sphere, rings.radius
    for j in range(len(x)):
        rho = np.sqrt(x[j, 0] ** 2 + x[j, 1] ** 2)
        r = np.sqrt(rho * rho + x[j, 2] ** 2)
        azimuth = np.arctan2(x[j, 1], x[j, 0])
        s = radius * np.arctan2(rho, x[j, 2]) if sphere else rho
        h = 0.565 * spacing[j]
        stretch = max(r / radius, 0.1) if sphere else 1.0
        half = _half_angle(h, rho)
        for i in range(np.searchsorted(rings.distance, s - h / stretch), len(rings.distance)):
            if rings.distance[i] > s + h / stretch:
                break
            k0, k1 = _columns_within(half, azimuth, rings.columns[i])
            for k in range(k0, k1 + 1):
                column = rings.first[i] + k % rings.columns[i]
                lateral2, t = _beside_and_above(x[j], r, rings, column)
                if lateral2 < 0.3183 * spacing[j] ** 2 and t + 0.5 * spacing[j] > highest[column]:
                    highest[column] = t + 0.5 * spacing[j]


@kernel(fastmath=True)
def _splat(x, volume, spacing, rings, levels, ring_low, colour):
    """Add every particle's kernel to the columns within its support, from the first level of each column upwards
    (``ring_low``: the lowest of a ring)."""
    sphere, radius = rings.sphere, rings.radius
    t_lo, dt, low = levels.lowest, levels.step, levels.first
    for j in range(len(x)):
        rho = np.sqrt(x[j, 0] ** 2 + x[j, 1] ** 2)
        r = np.sqrt(rho * rho + x[j, 2] ** 2)
        s = radius * np.arctan2(rho, x[j, 2]) if sphere else rho
        h = 2.0 * spacing[j]
        stretch = max(r / radius, 0.1) if sphere else 1.0
        weight = volume[j] * 8.0 / (np.pi * h**3)
        half, azimuth = -1.0, 0.0
        # along a column's own vertical a particle stands no higher than its distance from the centre
        last_level = int(np.floor(((r - radius if sphere else x[j, 2]) + h - t_lo) / dt))
        for i in range(np.searchsorted(rings.distance, s - h / stretch), len(rings.distance)):
            if rings.distance[i] > s + h / stretch:
                break
            if ring_low[i] > last_level:
                continue
            if half < 0.0:
                half = _half_angle(h, rho)
                azimuth = np.arctan2(x[j, 1], x[j, 0])
            k0, k1 = _columns_within(half, azimuth, rings.columns[i])
            for k in range(k0, k1 + 1):
                column = rings.first[i] + k % rings.columns[i]
                if low[column] > last_level:
                    continue
                lateral2, t = _beside_and_above(x[j], r, rings, column)
                if lateral2 >= h * h:
                    continue
                reach = np.sqrt(h * h - lateral2)
                lowest = max(low[column], int(np.ceil((t - reach - t_lo) / dt)))
                highest = min(colour.shape[1] - 1, int(np.floor((t + reach - t_lo) / dt)))
                for n in range(lowest, highest + 1):
                    q = np.sqrt(lateral2 + (t_lo + n * dt - t) ** 2) / h
                    if q < 0.5:
                        colour[column, n] += weight * (1.0 - 6.0 * q * q * (1.0 - q))
                    elif q < 1.0:
                        colour[column, n] += weight * 2.0 * (1.0 - q) ** 3


@kernel
def _crossing(colour, levels, thickness, out):
    """From above: the first crossing of 1/2 with ``thickness`` of matter above 1/2 under it; columns are known from
    their first level upwards.

    Gaps thinner than that (voids between disordered particles) do not count as an end of the matter; thin sheets over
    a wider gap are skipped.
    """
    t_lo, dt, low = levels.lowest, levels.step, levels.first
    number = colour.shape[1]
    for column in range(len(colour)):
        out[column] = np.nan
        top, solid, gap = -1, 0, 0
        for n in range(number - 1, low[column] - 1, -1):
            if colour[column, n] >= 0.5:
                if top < 0:
                    top = n
                solid += 1
                gap = 0
            elif top >= 0:
                gap += 1
                if gap * dt >= thickness[column]:
                    top, solid = -1, 0
            if top > 0 and (solid * dt >= thickness[column] or n == 0):
                if top + 1 < number:
                    upper, lower = colour[column, top + 1], colour[column, top]
                    out[column] = t_lo + dt * (top + (lower - 0.5) / (lower - upper))
                break


BELOW_TOP = 4.0
"""Spacings below the highest particle of a column down to which the colour field is first summed: nearly every
column's ground lies there."""


def half_level(
    near: Cloud, datum: Datum, rings: Rings, of_ring: np.ndarray, t_lo: float, t_hi: float
) -> tuple[np.ndarray, np.ndarray]:
    """Height [m] of every column by the colour field, and of its highest particle; NaN where there is none.

    ``of_ring`` is the local spacing of every one of the ``rings`` [m]; the ground lies between the heights ``t_lo``
    and ``t_hi`` [m].

    Matter deep below the ground says nothing of its height: the field is summed from a little below the top, and to
    the bottom only in those columns where no ground was found there (thin sheets over gaps). The result is the same to
    the last bit as that of whole columns.
    """
    dt = 0.25 * float(of_ring.min())
    number, total = int(np.ceil((t_hi - t_lo) / dt)) + 1, len(rings.position)
    highest, crossing = np.full(total, -np.inf), np.full(total, np.nan)
    x = datum.local(near.position)
    _tops(x, near.spacing, rings, highest)
    highest[~np.isfinite(highest)] = np.nan
    spacing = np.repeat(of_ring, rings.columns)
    depth = np.floor((np.where(np.isfinite(highest), highest, t_lo) - BELOW_TOP * spacing - t_lo) / dt)
    low = np.clip(depth, 0, number).astype(np.int64)
    for _ in range(2):
        colour, levels = np.zeros((total, number), dtype=np.float32), Levels(t_lo, dt, low)
        _splat(x, near.volume, near.spacing, rings, levels, np.minimum.reduceat(low, rings.first), colour)
        height = np.empty(total)
        _crossing(colour, levels, spacing, height)
        crossing = np.where(low < number, height, crossing)
        again = np.isnan(height) & (low > 0) & (low < number)
        if not again.any():
            break
        low = np.where(again, 0, number)
    return crossing, highest
