"""Whether a crater has come to rest: only then is it called final.

Grains are at rest by the collapse's own rule (``5_dem/stage_report.json``: the profile stopped changing). The shock
stage has no such rule: its last fifth is looked at, and what changed there by more than 2 % (heights: and by more than
a tenth of a spacing) still moves. A shock stage that ends before the crater is expected to be grown cut it short,
whatever its last fifth says: viscosity may hold the flow.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crater.results.series import Moment
from matter.case import formation_time
from matter.files import archive
from matter.wording import readable
from matter.wording.crater_measures import MAXIMA

WINDOW, CHANGE, OF_SPACING = 0.2, 0.02, 0.1
FEWEST = 3
NAMES = {name: moment for moment, name in MAXIMA.items()}


class Rest(NamedTuple):
    """Whether the crater has settled; its ``state`` in two or three words and the ``reason`` where it has not."""

    settled: bool
    state: str = ""
    reason: str = ""

    def as_dict(self) -> dict[str, Any]:
        """What ``measures.json`` holds of it."""
        return (
            {"settled": True}
            if self.settled
            else {"settled": False, "state": self.state, "settled_reason": self.reason}
        )


UNKNOWN = Rest(False, "not known to be at rest", "not measured")


def of_shock(report: Path, moments: Sequence[Moment]) -> Rest:
    """Rest of the crater at the end of the shock stage: by the series, where the stage's ``report`` does not say that
    the crater is expected to grow for longer."""
    found = of_series(moments)
    time = archive.read_json(report).get("expected_growth_s") if report.is_file() else None
    if not found.settled or not moments or not isinstance(time, (int, float)):
        return found
    end = moments[-1].time
    if end >= formation_time.ENOUGH * time:
        return found
    reason = f"end_time cut it at {readable.clock(end)}; it is expected to grow for {readable.clock(time)}"
    return Rest(False, "cut by end_time", reason)


def of_grains(report: Path, moments: Sequence[Moment]) -> Rest:
    """Rest of the granular crater by the collapse's ``report``; by the series of ``moments`` where there is none."""
    facts = archive.read_json(report) if report.is_file() else {}
    if "still" not in facts:
        return of_series(moments)
    if facts["still"]:
        return Rest(True)
    changed = facts.get("profile_change_radii")
    how = f" by {changed:.2g} grain radii" if isinstance(changed, (int, float)) else ""
    return Rest(False, "still moving", f"the collapse ended at its latest_time while the profile still changed{how}")


def of_series(moments: Sequence[Moment]) -> Rest:
    """Rest of a crater whose series ends with its last state."""
    moved = changes(moments)
    if moved is None:
        return Rest(False, "not known to be at rest", "too few snapshots to tell whether it still moves")
    if not moved:
        return Rest(True)
    growing = max(moved.get("volume_m3", 0.0), moved.get("depth_m", 0.0)) > 0.0
    words = ", ".join(f"{NAMES[name]} {change:+.0%}" for name, change in moved.items())
    reason = f"over the last fifth of the simulated time: {words}"
    return Rest(False, "still growing" if growing else "still moving", reason)


def changes(moments: Sequence[Moment]) -> dict[str, float] | None:
    """Measure -> its relative change over the last fifth of the time, of those that still move; None where fewer than
    three snapshots can tell."""
    seen = [moment for moment in moments if moment.measures is not None]
    if len(seen) < FEWEST:
        return None
    time = np.array([moment.time for moment in seen])
    late = max(int(np.searchsorted(time, (1.0 - WINDOW) * time[-1])), 0)
    late = min(late, len(seen) - FEWEST)
    moving: dict[str, float] = {}
    for name in NAMES:
        values = np.array([moment.value(name) for moment in seen[late:]])
        good = np.isfinite(values)
        if good.sum() < FEWEST:
            continue
        change, error = _change(time[late:][good], values[good])
        size = max(abs(float(values[good][-1])), 1e-300)
        least = OF_SPACING * _spacing(seen[-1]) if name != "volume_m3" else 0.0
        if abs(change) > max(CHANGE * size, least, 2.0 * error):
            moving[name] = change / size
    return moving


def _change(t: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Change of y along its straight line from the first to the last t, and that line's standard error."""
    span = float(t[-1] - t[0])
    x = (t - t.mean()) / max(span, 1e-300)
    slope = float((x @ y) / (x @ x))
    misfit = y - y.mean() - slope * x
    return slope, float(np.sqrt(misfit @ misfit / max(len(t) - 2, 1) / (x @ x)))


def _spacing(moment: Moment) -> float:
    """Spacing of the ground under the crater [m]."""
    return float(moment.measures.ground.columns.spacing[0]) if moment.measures is not None else 0.0
