"""From heights on columns to one profile: sectors in azimuth, the mean of rings, the band between the 16th and 84th
percentile."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from crater.ground import surface_smoothing
from crater.ground.datum import Datum
from crater.ground.surface import Columns, Heights, Undisturbed, column_points
from matter.errors import InputError
from matter.files import archive

RINGS_SHARE = 3.1
"""Neighbouring rings share particles, so that the variance of a mean over rings is this many times that of independent
ones: 1 + 2 (0.70 + 0.29 + 0.06), the correlations with the next three rings, measured on 79 clouds of three
packings."""
COLUMN_NAMES = ("radius_m", "height_m", "height_p16_m", "height_p84_m", "count")


@dataclass(frozen=True)
class Relief:
    """Heights relative to the datum (and to a reference surface on the same columns, where there is one).

    ``methods`` maps the method's name to its heights (rings, sectors) [m]; ``rays`` are the colour-field heights
    (columns,) [m]; ``scatter`` is that of the undisturbed ground [local spacings], where it is known.
    """

    datum: Datum
    columns: Columns
    methods: dict[str, np.ndarray]
    rays: np.ndarray
    scatter: float | None = None

    @property
    def cell(self) -> np.ndarray:
        """The heights that are measured: the colour field, the quietest of the methods."""
        return self.methods["colour"]


def relief(now: Heights, before: Undisturbed | None = None) -> Relief:
    """Heights ``now``, less the excess over the datum at the same positions ``before`` the impact (per method)."""
    columns, datum = now.columns, now.datum
    methods: dict[str, np.ndarray] = {}
    rays = {"colour": now.colour, "highest": now.highest}
    if now.alpha_shape is not None and (before is None or "alpha" in before.excess):
        rays["alpha"] = now.alpha_shape
    azimuth = (np.arange(columns.sectors) + 0.5) * 2.0 * np.pi / columns.sectors
    if before is not None:
        near = before.nearest(column_points(datum, columns.distance[columns.ring], columns.azimuth))
        rays = {name: values - before.at(name, near, values) for name, values in rays.items()}
    for name, values in rays.items():
        methods[name] = now.cells_of(values)
    if now.cell is not None:
        cell = now.cell
        if before is not None:
            s, a = np.broadcast_arrays(columns.distance[:, None], azimuth[None, :])
            cell = cell - before.at(
                "column", before.nearest(column_points(datum, s.ravel(), a.ravel())), cell.ravel()
            ).reshape(cell.shape)
        methods["column"] = cell
    return Relief(datum, columns, methods, rays["colour"], None if before is None else before.scatter)


@dataclass(frozen=True)
class Profile:
    """Radial profile: ``radius`` [m] along the datum, ``height`` [m], the band ``p16`` to ``p84`` [m] over azimuth,
    ``count`` of columns."""

    radius: np.ndarray
    height: np.ndarray
    p16: np.ndarray
    p84: np.ndarray
    count: np.ndarray
    header: dict[str, str] = field(default_factory=dict)


def ring_mean(cells: np.ndarray) -> np.ndarray:
    """Mean over azimuth of each ring; NaN where less than a third of its sectors have ground."""
    number = np.isfinite(cells).sum(axis=1)
    total = np.nansum(cells, axis=1)
    return np.where(number * 3 >= cells.shape[1], total / np.maximum(number, 1), np.nan)


def closed(cells: np.ndarray) -> np.ndarray:
    """Cells with gaps closed: from the ring, then along the profile."""
    mean = ring_mean(cells)
    known = np.isfinite(mean)
    if not known.any():
        raise InputError("no ground under any ring: the cloud ends inside the crater or the datum lies elsewhere")
    filled = np.interp(np.arange(len(mean)), np.flatnonzero(known), mean[known])
    return np.where(np.isfinite(cells), cells, filled[:, None])


def profile_of(ground: Relief, header: dict[str, str] | None = None) -> Profile:
    """Profile of a relief: mean of each ring of the colour field with its rounding undone, band of the single
    columns."""
    columns = ground.columns
    mean = ring_mean(ground.cell)
    known = np.isfinite(mean)
    height = mean.copy()
    if known.sum() > 2:
        height[known] = surface_smoothing.sharpened(columns.distance[known], columns.spacing[known], mean[known])
    p16, p84 = np.full(len(height), np.nan), np.full(len(height), np.nan)
    count = np.zeros(len(height), dtype=int)
    start = columns.start
    for i in range(len(height)):
        values = ground.rays[start[i] : start[i + 1]]
        values = values[np.isfinite(values)]
        count[i] = len(values)
        if len(values):
            p16[i], p84[i] = np.percentile(values, [16.0, 84.0])
    datum = ground.datum
    facts = {"datum": datum.kind, "datum_source": datum.source}
    if datum.is_sphere:
        facts["datum_radius_m"] = f"{datum.radius:.6g}"
    facts["frame"] = "arc distance along the datum, height along the local normal"
    return Profile(columns.distance.copy(), height, p16, p84, count, {**facts, **(header or {})})


def write_csv(profile: Profile, path: Path) -> None:
    """Write ``# key = value`` lines and the columns radius_m, height_m, height_p16_m, height_p84_m, count."""
    lines = [f"# {key} = {value}" for key, value in profile.header.items()] + [",".join(COLUMN_NAMES)]
    for row in zip(profile.radius, profile.height, profile.p16, profile.p84, profile.count):
        lines.append(",".join(f"{value:.6g}" if np.isfinite(value) else "nan" for value in row))
    archive.write_text(path, "\n".join(lines) + "\n")


def read_csv(path: Path) -> Profile:
    """Read a profile, one's own too: ``radius_m`` and ``height_m`` (or ``radius_km``, ``height_km``) are needed,
    comment lines may carry ``# key = value``.

    The band is ``height_p16_m`` and ``height_p84_m``, or ``height_sigma_m`` about the height; ``count`` is optional.
    Empty heights are gaps.

    Raises ``InputError`` naming the file, and the line where a number cannot be read.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"no profile at {path}")
    header, rows = _parts(path)
    if len(rows) < 3:
        raise InputError(
            f"{path} holds no profile: a header line with radius_m, height_m and at least two rows are needed"
        )
    names = [name.strip() for name in next(csv.reader([rows[0][1]]))]
    values: dict[str, list[float]] = {name: [] for name in names}
    for number, text in rows[1:]:
        cells = next(csv.reader([text]))
        if len(cells) != len(names):
            raise InputError(f"{path}, line {number}: {len(cells)} values for {len(names)} columns")
        for name, cell in zip(names, cells):
            try:
                values[name].append(float(cell) if cell.strip() else float("nan"))
            except ValueError:
                raise InputError(f"{path}, line {number}: {cell!r} in column {name} is not a number") from None
    columns = {name: np.array(cells) for name, cells in values.items()}
    for name in [name for name in columns if name.endswith("_km")]:
        columns[f"{name[:-3]}_m"] = 1e3 * columns[name]
    if "radius_m" not in columns or "height_m" not in columns:
        raise InputError(
            f"{path}: the first line names {', '.join(names)}; a profile needs the columns radius_m and height_m"
        )
    radius, height = columns["radius_m"], columns["height_m"]
    if not np.isfinite(radius).all() or (np.diff(radius) <= 0.0).any():
        raise InputError(f"{path}: radius_m must increase from row to row")
    if np.isfinite(height).sum() < 2:
        raise InputError(f"{path}: fewer than two heights are numbers")
    sigma = columns.get("height_sigma_m", np.full(len(radius), np.nan))
    p16, p84 = columns.get("height_p16_m", height - sigma), columns.get("height_p84_m", height + sigma)
    count = columns.get("count", np.zeros(len(radius)))
    return Profile(radius, height, p16, p84, np.nan_to_num(count).astype(int), header)


def _parts(path: Path) -> tuple[dict[str, str], list[tuple[int, str]]]:
    """Header facts, and the other lines with their numbers."""
    header: dict[str, str] = {}
    rows: list[tuple[int, str]] = []
    for number, line in enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1):
        if line.lstrip().startswith("#"):
            key, equals, value = line.lstrip("# ").partition("=")
            if equals:
                header[key.strip()] = value.strip()
        elif line.strip():
            rows.append((number, line))
    return header, rows
