"""How far two series of the same crater differ: a run against the same run with one numerical setting changed."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from matter.errors import InputError


class Difference(NamedTuple):
    """Largest |b - a| / a and when [s], the same without that time, the last time compared [s], how many times."""

    relative: float
    otherwise: float
    at_s: float
    until_s: float
    compared: int


def read_series(path: Path, stage: str = "sph") -> dict[str, np.ndarray]:
    """Columns of a ``time_series.csv`` for one stage, NaN where a cell is empty; raises ``InputError`` without the
    file."""
    if not Path(path).is_file():
        raise InputError(f"no time series at {path}")
    with open(path, newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["stage"] == stage]
    names = [name for name in (rows[0] if rows else {}) if name not in ("stage", "note")]
    return {name: np.array([float(row[name]) if row[name] else np.nan for row in rows]) for name in names}


def open_until(time: np.ndarray, depth: np.ndarray) -> float:
    """Time [s] at which the depth [m] first falls below half of its largest value (the last time, where it never
    does).

    Afterwards the crater is so shallow that a relative difference says nothing.
    """
    good = np.isfinite(depth)
    if not good.any():
        raise InputError("the series has no depth")
    t, d = time[good], depth[good]
    fallen = np.flatnonzero((d < 0.5 * d.max()) & (t > t[np.argmax(d)]))
    return float(t[fallen[0]]) if len(fallen) else float(t[-1])


def difference(
    time_a: np.ndarray, a: np.ndarray, time_b: np.ndarray, b: np.ndarray, start: float, until: float
) -> Difference:
    """Compare ``b`` with the reference ``a`` at the times [s] of ``a`` after ``start``, ``b`` interpolated, before
    ``until``.

    Raises ``InputError`` when fewer than three times are common before ``until``.
    """
    good = np.isfinite(b)
    if good.sum() < 2:
        raise InputError("the second series has fewer than two values")
    other = np.interp(time_a, time_b[good], b[good], left=np.nan, right=np.nan)
    early = (time_a >= start) & (time_a < until) & np.isfinite(a) & np.isfinite(other)
    if early.sum() < 3:
        raise InputError(f"fewer than three common times between {start:g} and {until:g} s")
    relative = np.where(early, np.abs(other - a) / np.where(early, a, 1.0), 0.0)
    worst = int(np.argmax(relative))
    otherwise = float(np.delete(relative, worst).max())
    return Difference(
        float(relative[worst]), otherwise, float(time_a[worst]), float(time_a[early][-1]), int(early.sum())
    )
