"""A settled crater read off its grains without the project's own measuring: upper envelope of the spheres after, less
that of the bed before, ring by ring. numpy and h5py only.

    python studies/crater_by_hand.py RUN

On flat ground. Rings are sampled by columns half a median radius apart; a column's height is the top of the highest
sphere over it, z + sqrt(r^2 - d^2), so that the pores at the surface count alike before and after.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import h5py
import numpy as np
from scipy.spatial import cKDTree

RINGS = 24


def spheres(file: Path) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and radii (n,) [m] of the grains that lie in the ground."""
    with h5py.File(file) as snapshot:
        held = snapshot["particles"]
        fields = {name: held[name][:] for name in ("position", "radius", "headroom", "state") if name in held}
    keep = np.ones(len(fields["radius"]), dtype=bool)
    if file.stem == "bed":
        keep &= fields["headroom"] == 0
    if "state" in fields:
        keep &= fields["state"] == 0
    return fields["position"][keep], fields["radius"][keep]


def envelope(position: np.ndarray, radius: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Height [m] of the ground under each of ``columns`` (m, 2); NaN where no sphere lies under it."""
    near = cKDTree(position[:, :2]).query_ball_point(columns, float(radius.max()))
    heights = np.full(len(columns), np.nan)
    for k, (x, y) in enumerate(columns):
        who = np.array(near[k], dtype=int)
        square_distance = (position[who, 0] - x) ** 2 + (position[who, 1] - y) ** 2
        under = square_distance < radius[who] ** 2
        if under.any():
            heights[k] = np.max(position[who[under], 2] + np.sqrt(radius[who[under]] ** 2 - square_distance[under]))
    return heights


def main() -> int:
    """Print the rings and what they say; the exit code."""
    run = Path(sys.argv[1])
    before, after = spheres(run / "3_bed" / "bed.vtkhdf"), spheres(run / "5_dem" / "last.vtkhdf")
    edge = 0.95 * float(np.hypot(*before[0][:, :2].T).max())
    step = 0.5 * float(np.median(before[1]))
    grid = np.arange(-edge, edge, step)
    columns = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    away = np.hypot(*columns.T)
    change = envelope(*after, columns) - envelope(*before, columns)
    rings = np.linspace(0.0, edge, RINGS + 1)
    middle = 0.5 * (rings[1:] + rings[:-1])
    mean = np.array([np.nanmean(change[(away >= a) & (away < b)]) for a, b in itertools.pairwise(rings)])
    for s, h in zip(middle, mean):
        print(f"{s:8.2f} m {h:8.2f} m")
    first = int(np.flatnonzero(mean > 0.0)[0])
    radius = float(np.interp(0.0, mean[first - 1 : first + 1], middle[first - 1 : first + 1]))
    inside = away < radius
    print(f"apparent diameter {2.0 * radius:.1f} m, deepest ring {-mean.min():.1f} m, volume "
          f"{-np.nansum(change[inside]) * step**2:,.0f} m3, highest ring {mean.max():.2f} m")  # fmt: skip
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
