"""The crater right before and right after the handover, by one definition of ground (``crater.ground.cloud.GROUND``):
in the snapshot of the shock stage that was handed over and in the grains that took over, each measured closely on the
configuration of its stage.

    change = after - before        sigma^2 = sigma_before^2 + sigma_after^2

It is what the handover itself does to the crater: a whole grain is kept or taken out, ejecta leave the ground, dilated
matter is packed. Before, the two errors have particles, after, grains: nothing in common.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crater.bodies.body_comparison import Pair
from crater.ground.surface import Undisturbed
from crater.measures.measure import Quantity
from crater.results import series
from crater.results.measurement_config import MeasurementConfig
from crater.results.series import Moment
from matter.files import archive, snapshot
from matter.wording.crater_measures import BY_NAME, COLUMNS, UNITS

NAMES = tuple(name for name in COLUMNS if BY_NAME[name].compared)
"""Measures whose change is stated."""
START = f"4_handoff/start{snapshot.SUFFIX}"
"""The grains as they took over, in a run's folder."""
_SAME_TIME = 1e-6


def shock_snapshot(inputs: Path, shots: Sequence[Path]) -> Path | None:
    """The snapshot of the shock stage that was handed over: the one at the handover's time; None where there is none
    among ``shots``."""
    record = inputs / "4_handoff" / "handoff.json"
    handed = archive.read_json(record).get("time_s") if record.is_file() else None
    if handed is None or not shots:
        return None
    off = np.abs(np.array([float(snapshot.attributes(shot).get("time", np.nan)) for shot in shots]) - float(handed))
    nearest = int(np.argmin(np.where(np.isfinite(off), off, np.inf)))
    return shots[nearest] if off[nearest] <= _SAME_TIME * abs(float(handed)) else None


def closely(path: Path | None, stage: str, chosen: MeasurementConfig, start: Undisturbed | None) -> Moment | None:
    """The crater in a snapshot, measured by all methods; None where there is no such file."""
    if path is None or not path.is_file():
        return None
    time = float(snapshot.attributes(path).get("time", np.nan))
    return series.again(Moment(stage, time, path, None), chosen, start)


def changes(before: Moment | None, after: Moment | None) -> dict[str, Pair]:
    """Each of ``NAMES`` before and after, and its change; empty where either moment is missing or was not measured."""
    if before is None or after is None or before.measures is None or after.measures is None:
        return {}
    return {name: _change(name, before.measures[name], after.measures[name]) for name in NAMES}


def _change(name: str, before: Quantity, after: Quantity) -> Pair:
    if before.value is None or after.value is None:
        return Pair(before, after, Quantity(None, None, UNITS[name], before.reason or after.reason))
    one, other = before.sigma, after.sigma
    sigma = None if one is None or other is None else math.hypot(one, other)
    return Pair(before, after, Quantity(after.value - before.value, sigma, UNITS[name]))


def facts(before: Moment | None, after: Moment | None, run: Path) -> dict[str, Any]:
    """What ``measures.json`` says of it: the time [s], both snapshots, and the ``changes``; empty where not known."""
    rows = changes(before, after)
    if before is None or after is None or not rows:
        return {}
    return {
        "time_s": after.time,
        "snapshots": {"before": _name(before.path, run), "after": _name(after.path, run)},
        **{name: row.as_dict() for name, row in rows.items()},
    }


def _name(path: Path, run: Path) -> str:
    return path.relative_to(run).as_posix()
