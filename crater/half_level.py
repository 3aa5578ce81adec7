"""The colour field on columns, and where it crosses one half: the compiled loops under ``crater.surface``."""

from __future__ import annotations

import numpy as np

from crater.cloud import Cloud
from crater.datum import Datum
from matter.jit import kernel


@kernel(fastmath=True)
def _tops(x, spacing, sphere, radius, ring_s, start, count, place, highest):
    """The highest particle of each column of area spacing^2, plus half a spacing."""
    for j in range(len(x)):
        rho = np.sqrt(x[j, 0] ** 2 + x[j, 1] ** 2)
        r = np.sqrt(rho * rho + x[j, 2] ** 2)
        azimuth = np.arctan2(x[j, 1], x[j, 0])
        s = radius * np.arctan2(rho, x[j, 2]) if sphere else rho
        h = 0.565 * spacing[j]
        stretch = max(r / radius, 0.1) if sphere else 1.0
        half = np.pi if h >= rho else np.arcsin(h / rho) * 1.001
        for i in range(np.searchsorted(ring_s, s - h / stretch), len(ring_s)):
            if ring_s[i] > s + h / stretch:
                break
            step = 2.0 * np.pi / count[i]
            k0 = int(np.floor((azimuth - half) / step - 0.5))
            k1 = int(np.ceil((azimuth + half) / step - 0.5))
            if k1 - k0 >= count[i]:
                k0, k1 = 0, count[i] - 1
            for k in range(k0, k1 + 1):
                column = start[i] + k % count[i]
                if sphere:
                    along = place[column, 0] * x[j, 0] + place[column, 1] * x[j, 1] + place[column, 2] * x[j, 2]
                    lateral2 = r * r - along * along
                    t = along - radius
                else:
                    lateral2 = (x[j, 0] - place[column, 0]) ** 2 + (x[j, 1] - place[column, 1]) ** 2
                    t = x[j, 2]
                if lateral2 < 0.3183 * spacing[j] ** 2 and t + 0.5 * spacing[j] > highest[column]:
                    highest[column] = t + 0.5 * spacing[j]


@kernel(fastmath=True)
def _splat(x, volume, spacing, sphere, radius, ring_s, start, count, place, t_lo, dt, low, ring_low, colour):
    """Add every particle's kernel to the columns within its support, from level ``low`` of each column upwards (``ring_low``: the lowest of a ring)."""
    rings, levels = len(ring_s), colour.shape[1]
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
        for i in range(np.searchsorted(ring_s, s - h / stretch), rings):
            if ring_s[i] > s + h / stretch:
                break
            if ring_low[i] > last_level:
                continue
            if half < 0.0:
                half = np.pi if h >= rho else np.arcsin(h / rho) * 1.001
                azimuth = np.arctan2(x[j, 1], x[j, 0])
            step = 2.0 * np.pi / count[i]
            k0 = int(np.floor((azimuth - half) / step - 0.5))
            k1 = int(np.ceil((azimuth + half) / step - 0.5))
            if k1 - k0 >= count[i]:
                k0, k1 = 0, count[i] - 1
            for k in range(k0, k1 + 1):
                column = start[i] + k % count[i]
                if low[column] > last_level:
                    continue
                if sphere:
                    along = place[column, 0] * x[j, 0] + place[column, 1] * x[j, 1] + place[column, 2] * x[j, 2]
                    lateral2 = r * r - along * along
                    t = along - radius
                else:
                    lateral2 = (x[j, 0] - place[column, 0]) ** 2 + (x[j, 1] - place[column, 1]) ** 2
                    t = x[j, 2]
                if lateral2 >= h * h:
                    continue
                reach = np.sqrt(h * h - lateral2)
                first = max(low[column], int(np.ceil((t - reach - t_lo) / dt)))
                last = min(levels - 1, int(np.floor((t + reach - t_lo) / dt)))
                for n in range(first, last + 1):
                    q = np.sqrt(lateral2 + (t_lo + n * dt - t) ** 2) / h
                    if q < 0.5:
                        colour[column, n] += weight * (1.0 - 6.0 * q * q * (1.0 - q))
                    elif q < 1.0:
                        colour[column, n] += weight * 2.0 * (1.0 - q) ** 3


@kernel
def _crossing(colour, t_lo, dt, thickness, low, out):
    """From above: the first crossing of 1/2 with ``thickness`` of matter above 1/2 under it; columns are known from level ``low`` upwards.

    Gaps thinner than that (voids between disordered particles) do not count as an end of the matter; thin sheets over a wider gap are skipped.
    """
    levels = colour.shape[1]
    for column in range(len(colour)):
        out[column] = np.nan
        top, solid, gap = -1, 0, 0
        for n in range(levels - 1, low[column] - 1, -1):
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
                if top + 1 < levels:
                    upper, lower = colour[column, top + 1], colour[column, top]
                    out[column] = t_lo + dt * (top + (lower - 0.5) / (lower - upper))
                break


BELOW_TOP = 4.0
"""Spacings below the highest particle of a column down to which the colour field is first summed: nearly every column's ground lies there."""


def half_level(
    near: Cloud, datum: Datum, of_ring: np.ndarray, rings: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], t_lo: float, t_hi: float
) -> tuple[np.ndarray, np.ndarray]:
    """Height [m] of every column by the colour field, and of its highest particle; NaN where there is none.

    ``of_ring`` is the local spacing of every ring [m]; ``rings`` their distance, first column, number of columns, and the place of every column;
    the ground lies between the heights ``t_lo`` and ``t_hi`` [m].

    Matter deep below the ground says nothing of its height: the field is summed from a little below the top, and to the bottom only in those columns
    where no ground was found there (thin sheets over gaps). The result is the same to the last bit as that of whole columns.
    """
    dt = 0.25 * float(of_ring.min())
    levels = int(np.ceil((t_hi - t_lo) / dt)) + 1
    total, first, count = len(rings[3]), rings[1], rings[2]
    highest, crossing = np.full(total, -np.inf), np.full(total, np.nan)
    sphere, radius, x = datum.is_sphere, datum.radius if datum.is_sphere else 1.0, datum.local(near.position)
    _tops(x, near.spacing, sphere, radius, *rings, highest)
    highest[~np.isfinite(highest)] = np.nan
    spacing = np.repeat(of_ring, count)
    depth = np.floor((np.where(np.isfinite(highest), highest, t_lo) - BELOW_TOP * spacing - t_lo) / dt)
    low = np.clip(depth, 0, levels).astype(np.int64)
    for _ in range(2):
        colour = np.zeros((total, levels), dtype=np.float32)
        _splat(x, near.volume, near.spacing, sphere, radius, *rings, t_lo, dt, low, np.minimum.reduceat(low, first), colour)
        found = np.empty(total)
        _crossing(colour, t_lo, dt, spacing, low, found)
        crossing = np.where(low < levels, found, crossing)
        again = np.isnan(found) & (low > 0) & (low < levels)
        if not again.any():
            break
        low = np.where(again, 0, levels)
    return crossing, highest
