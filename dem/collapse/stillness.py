"""The surface profile of the bed while it moves, and when it has stopped changing."""

from __future__ import annotations

from typing import Any

import numpy as np

from dem.beds.bed_walls import Domain
from dem.beds.whole_body_bed import PoseTracker, WholeBody
from dem.contact.columns import RADIUS
from dem.grains.assembly import ACTIVE, Assembly
from matter.files import checkpoint
from matter.geometry.ground_region import Upright

STILL_CHANGE = 0.1
"""RMS change of the profile, in mean grain radii, below which it counts as still."""
COLUMN = 2.0
"""Width of a column and of a ring, in mean grain radii."""


def surface_profile(bed: Assembly, domain: Domain | WholeBody, tracker: PoseTracker | None = None) -> np.ndarray:
    """Mean height [m] of the top of the bed above the datum in rings about the axis; nan where a ring is empty. Of a
    whole body, which turns, in the frame in which it rests (``tracker``).

    The surface is the highest touching grain of each column of an equal-area grid (Lambert's projection; on flat
    ground squares), so that grains in flight do not count.
    """
    touching = np.zeros(len(bed.X), dtype=bool)
    first, second, _ = bed.touching()
    touching[first] = touching[second] = True
    here = np.flatnonzero(touching & (bed.state == ACTIVE))
    x = bed.X[here]
    if tracker is not None:
        x = np.column_stack([tracker.turned_back(bed)[here], x[:, RADIUS]])
    size = COLUMN * bed.mean_radius
    if isinstance(domain, Upright):
        plan, level, inside = np.ones(len(x)), x[:, 2] + x[:, RADIUS], ~domain.outside(x[:, :3])
        reach = domain.radius * (np.sqrt(2.0) if domain.shape == "box" else 1.0)
    else:
        distance = np.linalg.norm(x[:, :3], axis=1)
        angle = domain.polar_angle(x[:, :3])
        flat = 2.0 * domain.datum * np.sin(0.5 * angle)
        plan = flat / np.maximum(np.hypot(x[:, 0], x[:, 1]), 1e-300)
        level, inside = distance + x[:, RADIUS] - domain.datum, angle <= domain.half_angle
        reach = 2.0 * domain.datum * np.sin(0.5 * domain.half_angle)
    half = int(np.ceil(reach / size)) + 1
    column = (
        (np.floor(x[:, 0] * plan / size).astype(int) + half) * (2 * half + 1)
        + np.floor(x[:, 1] * plan / size).astype(int)
        + half
    )
    top = np.full((2 * half + 1) ** 2, -np.inf)
    good = (column >= 0) & (column < len(top)) & inside
    np.maximum.at(top, column[good], level[good])
    cells = np.arange(len(top))
    centre = np.hypot(cells // (2 * half + 1) - half + 0.5, cells % (2 * half + 1) - half + 0.5)
    ring = centre.astype(int)
    filled = np.isfinite(top)
    count = np.bincount(ring[filled], minlength=half)[:half]
    total = np.bincount(ring[filled], top[filled], minlength=half)[:half]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


class Stillness:
    """Remembers profiles over ``interval`` [s] and says by how much, in mean radii, the present one differs from any
    of them (RMS)."""

    def __init__(self, interval: float, samples: int = 10):
        self.every = interval / samples
        self.samples = samples
        self.kept: list[np.ndarray] = []
        self.change = np.inf

    def look(self, profile: np.ndarray, radius: float) -> float:
        """Add a profile (every ``self.every`` seconds); returns, and keeps, the ``change``, inf until the interval is
        full."""
        self.kept.append(profile)
        if len(self.kept) > self.samples:
            self.kept = self.kept[-self.samples - 1 :]
            changes = [np.sqrt(np.nanmean((profile - old) ** 2)) for old in self.kept[:-1]]
            self.change = float(np.nanmax(changes) / radius)
        return self.change

    def state(self) -> dict[str, Any]:
        """What a checkpoint must hold."""
        return {"profiles": np.array(self.kept), "change": self.change}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        self.kept, self.change = list(saved["profiles"]), float(saved["change"])
