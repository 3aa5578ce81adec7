"""The crater in time: D(t), depth(t), V(t) from a folder of snapshots, and the moments at which the transient crater
is largest."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crater.ground import cloud as clouds
from crater.ground import locate
from crater.ground.surface import Undisturbed
from crater.measures.measure import Measures, measure_scene
from crater.results.measurement_config import MeasurementConfig
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.wording.crater_measures import COLUMNS, MAXIMA


@dataclass(frozen=True)
class Moment:
    """One snapshot measured; ``measures`` is None where it could not be, and ``reason`` says why."""

    stage: str
    time: float
    path: Path
    measures: Measures | None
    reason: str = ""

    def value(self, name: str) -> float:
        """A measure, NaN where it is missing."""
        value = None if self.measures is None else self.measures[name].value
        return float("nan") if value is None else float(value)

    def sigma(self, name: str) -> float:
        """The error of a measure, NaN where it is missing."""
        sigma = None if self.measures is None else self.measures[name].sigma
        return float("nan") if sigma is None else float(sigma)


def follow(
    paths: Iterable[Path],
    stage: str,
    chosen: MeasurementConfig,
    before: Undisturbed | None,
    heard: Callable[[Path], None] | None = None,
) -> list[Moment]:
    """Measure every snapshot of a stage with one configuration and against the same undisturbed target, by two
    methods."""
    moments = []
    for path in paths:
        particles = snapshot.read(path, (*clouds.FIELDS, "identity"))
        time = float(particles.attributes.get("time", np.nan))
        try:
            scene = locate.prepare(chosen.seen(particles), chosen.datum, before, chosen.search, path.name)
            measures = measure_scene(scene, seed=chosen.seed, sectors=chosen.sectors, turns=4, methods="two")
            moments.append(Moment(stage, time, path, chosen.told(measures)))
        except InputError as reason:
            moments.append(Moment(stage, time, path, None, str(reason)))
        if heard is not None:
            heard(path)
    return moments


def write_csv(moments: Sequence[Moment], path: Path) -> None:
    """One row per snapshot: stage, time and every measure with its sigma."""
    head = ["stage", "time_s"] + [column for name in COLUMNS for column in (name, f"{name}_sigma")] + ["note"]
    lines = [",".join(head)]
    for moment in moments:
        row = [moment.stage, f"{moment.time:.9g}"]
        for name in COLUMNS:
            row += [f"{x:.6g}" if np.isfinite(x) else "" for x in (moment.value(name), moment.sigma(name))]
        row += [moment.reason.replace(",", ";").replace("\n", " ")]
        lines.append(",".join(row))
    archive.write_text(path, "\n".join(lines) + "\n")


def smoothed(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Savitzky-Golay smoothing of a series (window of 5, quadratic); short or gappy series are returned as they
    are."""
    from scipy.signal import savgol_filter  # half a second of every command, and few smooth

    good = np.isfinite(values)
    if good.sum() < 5:
        return values
    result = values.copy()
    filled = np.interp(time, time[good], values[good])
    result[good] = savgol_filter(filled, 5, 2)[good]
    return result


def first_maximum(time: np.ndarray, values: np.ndarray, lasting: float = 0.2) -> int | None:
    """Index of the first maximum of a series that is not exceeded by more than ``lasting`` (relative) before it has
    fallen by that much.

    None where the series has no value.
    """
    good = np.flatnonzero(np.isfinite(values))
    if len(good) == 0:
        return None
    smooth = smoothed(time, values)
    best = good[0]
    for i in good:
        if smooth[i] > smooth[best]:
            best = i
        elif smooth[i] < (1.0 - lasting) * smooth[best] and smooth[best] > 0.25 * np.nanmax(smooth):
            break
    return int(best)


def transient(moments: Sequence[Moment]) -> tuple[dict[str, Moment], list[str]]:
    """The moments of the first maximum of ``volume``, ``depth`` and ``diameter`` (apparent), and the keys that still
    grow at the end."""
    time = np.array([moment.time for moment in moments])
    maxima, growing = {}, []
    for key, name in MAXIMA.items():
        values = np.array([moment.value(name) for moment in moments])
        index = first_maximum(time, values)
        if index is not None:
            maxima[key] = moments[index]
            if index == int(np.flatnonzero(np.isfinite(values))[-1]):
                growing.append(key)
    return maxima, growing


def again(moment: Moment, chosen: MeasurementConfig, before: Undisturbed | None) -> Moment:
    """The same moment measured as a single snapshot is: by all four methods, until neither centre nor datum moves."""
    particles = snapshot.read(moment.path)
    try:
        return Moment(moment.stage, moment.time, moment.path, chosen.measured(particles, before, moment.path.name))
    except InputError as reason:
        return Moment(moment.stage, moment.time, moment.path, None, str(reason))
