"""The crater as a block that the reader turns, inside the page: height map cut open along the impact plane, coloured
by depth of origin.

The numbers go into the page as a few arrays of bytes (some 60 kB), drawn by ``block_view.js`` in the reader's browser
(``crater.drawing.turning_view``).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from crater.drawing import sections, turning_view
from crater.ground.datum import Datum
from crater.measures.measure import Measures
from crater.results.findings import Findings
from matter.files import snapshot
from matter.particles import Particles
from matter.wording import drawing, readable

GRID = 97
"""Points along an edge of the height map."""
ALONG, DOWN = 256, 96
"""Cells of the cross-section."""
AROUND = 8
"""Nearest particles that tell a pore from a cavity."""
NO_HEIGHT, UNKNOWN, EMPTY = 65535, 254, 255
"""Bytes for: no ground measured here; matter of unknown origin; no matter."""


def of_findings(findings: Findings, title: str) -> str:
    """The block of the last crater, called ``title``, as HTML; empty where there is none, where its snapshot is gone,
    or where matplotlib, whose colours it takes, is not installed."""
    last = findings.final
    if last is None or not last.path.is_file() or not drawing.has():
        return ""
    particles = snapshot.read(last.path)
    return html(
        data(
            last.measures,
            particles,
            sections.positions_before(particles, findings.inputs / "3_bed" / f"bed{snapshot.SUFFIX}"),
        ),
        title,
    )


def data(measures: Measures, particles: Particles, positions: np.ndarray | None) -> dict[str, Any]:
    """What the viewer draws. ``positions`` (n, 3) [m]: where each particle lay before the impact, NaN where that is
    unknown; None: known for none.

    Heights are measured above the datum, on a square of ``half`` [m] to each side of the crater's centre along the
    datum; ``radius`` [m] is the datum's, 0 for a plane. The section is the plane through the centre and the downrange
    direction, each cell with the origin of its nearest particle.
    """
    ground = measures.ground
    apparent = measures["diameter_apparent_m"].value
    half = min(float(ground.columns.edges[-1]), 1.5 * apparent) if apparent else float(ground.columns.edges[-1])
    x = np.linspace(-half, half, GRID)
    height = _heights(measures, *np.meshgrid(x, x))
    origin = (
        np.full(len(particles), np.nan)
        if positions is None
        else -ground.datum.polar(np.nan_to_num(positions, nan=1e30))[2]
    )
    if positions is not None:
        origin[~np.isfinite(positions).all(axis=1)] = np.nan
    size = sections.size_of(particles, half)
    deepest = _deepest(ground.datum, particles, half)
    section, low, high = _section(ground.datum, particles, size, origin, deepest, measures, half)
    top = _origin_at(ground.datum, particles, origin, deepest, *np.meshgrid(x, x), height)
    known = height[np.isfinite(height)]
    lowest, highest = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    step = max(highest - lowest, 1e-9) / (NO_HEIGHT - 1)
    counts = np.where(np.isfinite(height), np.round((np.nan_to_num(height) - lowest) / step), NO_HEIGHT).astype("<u2")
    return {
        "grid": GRID, "half": half, "radius": ground.datum.radius if ground.datum.is_sphere else 0.0,
        "circle": 0.5 * apparent if apparent else 0.0,
        "height": {"low": lowest, "step": step, "counts": turning_view.text(counts)}, "top": turning_view.text(top),
        "section": {"along": ALONG, "down": DOWN, "low": low, "high": high, "cells": turning_view.text(section)},
        "deepest": deepest, "limit": float(np.quantile(np.abs(known), 0.995)) if len(known) else 1.0,
        "colours": {"origin": turning_view.colours("viridis_r"), "height": turning_view.colours("RdBu_r")},
    }  # fmt: skip


def html(content: Mapping[str, Any], title: str = "The crater") -> str:
    """The viewer with its data: hidden until its own script finds WebGL."""
    scale, unit = readable.length_unit(content["half"])
    apparent = (
        f"; black circle: apparent diameter {readable.length(2.0 * content['circle'])}" if content["circle"] else ""
    )
    words = (
        f"{title}, in three dimensions, {readable.length(2.0 * content['half'])} across{apparent}. "
        "The face is the plane of the impact, downrange to the right; each point of it has the depth of origin of the "
        "nearest particle "
        "(grey: unknown, as for ejecta). Drag to turn, scroll or pinch to zoom, double-click to reset."
    )
    facts = {**content, "scale": scale, "unit": unit}
    return turning_view.render("crater/pages/templates/block_view.html.j2", words, facts, Path(__file__))


def _heights(measures: Measures, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights [m] at positions on the datum, linear between the columns; NaN outside them."""
    from scipy.interpolate import LinearNDInterpolator

    ground = measures.ground
    distance, azimuth = ground.columns.distance[ground.columns.ring], ground.columns.azimuth
    good = np.isfinite(ground.rays)
    if np.count_nonzero(good) < 4:
        return np.full(x.shape, np.nan)
    columns = np.column_stack([distance[good] * np.cos(azimuth[good]), distance[good] * np.sin(azimuth[good])])
    return LinearNDInterpolator(columns, ground.rays[good])(x, y)


def _position(datum: Datum, x: np.ndarray, y: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Places (n, 3) in the frame of the snapshot at ``x``, ``y`` along the datum and ``height`` above it."""
    if not datum.is_sphere:
        return datum.outside(np.column_stack([x, y, height]))
    distance = np.hypot(x, y)
    scale = np.sinc(distance / datum.radius / np.pi)  # sin(psi) / psi
    r = 1.0 + height / datum.radius
    return datum.outside(
        np.column_stack([x * scale * r, y * scale * r, (datum.radius + height) * np.cos(distance / datum.radius)])
    )


def _deepest(datum: Datum, particles: Particles, half: float) -> float:
    """Depth of the block [m]: half of what it is wide to a side, or what the particles near the axis reach."""
    distance, _, height = datum.polar(particles.position)
    near = distance < half
    return min(0.55 * half, float(-height[near].min())) if near.any() else 0.55 * half


def _section(datum, particles, size, origin, deepest, measures, half) -> tuple[np.ndarray, float, float]:
    """Bytes of the cells of the section, row by row from below, and the heights [m] at which it begins and ends."""
    from scipy.spatial import cKDTree

    along = (np.arange(ALONG) + 0.5) / ALONG * 2.0 * half - half
    surface = _heights(measures, along, np.zeros(ALONG))
    low, high = -deepest, max(float(np.nanmax(surface, initial=0.0)), 0.0)
    level = low + (np.arange(DOWN) + 0.5) / DOWN * (high - low)
    u, h = (array.ravel() for array in np.meshgrid(along, level))
    slab = np.abs(datum.local(particles.position)[:, 1]) < 2.0 * size
    if not slab.any():
        return np.full(ALONG * DOWN, EMPTY, dtype=np.uint8), low, high
    # a gap no wider than the coarsest particle beside it is a pore, not a cavity
    among = min(AROUND, int(np.count_nonzero(slab)))
    away, near = cKDTree(particles.position[slab]).query(
        _position(datum, u, np.zeros_like(u), h), k=[*range(1, among + 1)]
    )
    cells = _byte(origin[slab][near[:, 0]], deepest)
    with np.errstate(invalid="ignore"):
        cells[~(h <= np.tile(surface, DOWN)) | (away[:, 0] > size[slab][near].max(axis=1))] = EMPTY
    return cells, low, high


def _origin_at(datum, particles, origin, deepest, x, y, height) -> np.ndarray:
    """Bytes of the origin of what lies at the surface."""
    from scipy.spatial import cKDTree

    _, nearest = cKDTree(particles.position).query(
        _position(datum, x.ravel(), y.ravel(), np.nan_to_num(height).ravel())
    )
    return _byte(origin[nearest], deepest)


def _byte(depth: np.ndarray, deepest: float) -> np.ndarray:
    scale = np.clip(np.nan_to_num(depth) / deepest, 0.0, 1.0)
    return np.where(np.isfinite(depth), np.round(scale * (turning_view.COLOURS - 1)), UNKNOWN).astype(np.uint8)
