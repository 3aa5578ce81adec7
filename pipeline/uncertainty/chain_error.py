"""The chain error of a measure, from further runs of the same case (``pipeline.sweeps.error_study`` makes them).

Per measure, with y the values of the draws (the case as it is, the reference, is the first) in groups of one shock
stage each:

    scatter^2 = MS_within + max(0, (MS_between - MS_within) / n0)
        one-way analysis of variance: the scatter of one run whose particles and grains are both redrawn; n0 the mean
        size of a group, corrected for unequal ones
    draws^2   = max(0, scatter^2 - azimuth^2)
        what a run's own error does not hold yet: where its particles lie about the crater, and so how its sectors
        differ (``azimuth``, root mean square over the draws), is redrawn with them
    handoff^2 = max(0, (half the range over the times x0.5, 1, x2)^2 - 0.913 MS_within)
    alpha^2   = the same over alpha x0.67, 1, x1.5
    size      = the distance to a vanishing spacing, by a ladder of two coarser runs (``ladder``); or that by one run
                with twice the spacing at the contact alone, |y(2 h) - y(h)| for an error of first order, less 2
                scatter^2 in the square: the larger of both, since the ladder changes that spacing too, by little
    chain^2   = draws^2 + handoff^2 + alpha^2 + size^2

What is subtracted from the others is what the scatter of draws alone would show on average (half the range of three
normal numbers has a mean square of 0.913 sigma^2), so that no error counts twice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from crater.measures.chain import PARTS
from pipeline.settings import expected
from pipeline.uncertainty import ladder
from pipeline.uncertainty.ladder import Ladder

HALF_RANGE_OF_THREE = 0.5 + 3.0 * math.sqrt(3.0) / (4.0 * math.pi)
"""Mean square of half the range of three standard normal numbers: 1/2 + 3 sqrt(3) / (4 pi)."""
DRAWS_PER_SHOCK = 2
REFERENCE = "reference"
EARLIER_LATER = ("handoff_x0.5", "handoff_x2")
ALPHAS = ("alpha_x0.67", "alpha_x1.5")
RUNGS = ("coarser", "coarsest")
CONTACT = "contact_x2"
"""Names of the members, beside the draws'."""


@dataclass(frozen=True)
class Row:
    """One measure of one crater: values of the draws with their shock stages, mean and mean measuring error, the parts
    of the chain error (None: not measured), and what is behind ``size``: the ladder of resolutions and what the
    spacing at the ``contact`` changes."""

    crater: str
    measure: str
    values: tuple[float, ...]
    mean: float
    measuring: float
    draws: float | None
    handoff: float | None
    alpha: float | None
    ladder: Ladder | None
    contact: float | None = None

    @property
    def size(self) -> float | None:
        """How far the run is from a vanishing spacing."""
        ladder = None if self.ladder is None else self.ladder.size
        return max((error for error in (ladder, self.contact) if error is not None), default=None)

    @property
    def parts(self) -> dict[str, float]:
        """The parts of the chain error that were measured."""
        return {part: error for part in PARTS if (error := getattr(self, part)) is not None}

    @property
    def chain(self) -> float:
        """The chain error."""
        return math.hypot(*self.parts.values(), 0.0)


def variance(values: Sequence[float], groups: Sequence[int]) -> tuple[float, float]:
    """Mean square within groups, and the variance of one value whose group is drawn too: one-way analysis of variance
    with random effects.

    One group: both are the plain variance. Groups of one value each: the variance of the values, and nothing is known
    within (0).
    """
    y, group = np.asarray(values, dtype=float), np.asarray(groups)
    names, size = np.unique(group, return_counts=True)
    means = np.array([y[group == name].mean() for name in names])
    n, g = len(y), len(names)
    within = float(sum(np.sum((y[group == name] - mean) ** 2) for name, mean in zip(names, means, strict=True)))
    ms_within = within / (n - g) if n > g else 0.0
    if g == 1:
        return ms_within, ms_within
    ms_between = float(np.sum(size * (means - y.mean()) ** 2)) / (g - 1)
    n0 = (n - float(np.sum(size**2)) / n) / (g - 1)
    return ms_within, ms_within + max(0.0, (ms_between - ms_within) / n0)


def row(crater: str, name: str, measured: Mapping[str, Any], draws: Mapping[str, int]) -> Row | None:
    """The chain error of one measure of one crater; ``measured``: member -> crater -> measure -> entry, ``draws``: the
    members that are draws, the reference among them, each with the number of its shock stage. None where the reference
    has not measured it."""

    def value(member: str) -> float | None:
        return measured.get(member, {}).get(crater, {}).get(name, {}).get("value")

    origin = value(REFERENCE)
    if origin is None:
        return None
    mine = {member: found for member in draws if (found := value(member)) is not None}
    within, total = variance(list(mine.values()), [draws[member] for member in mine]) if len(mine) > 1 else (0.0, 0.0)

    def spread(members: Sequence[str]) -> float | None:
        others = [found for member in members if (found := value(member)) is not None]
        half = 0.5 * (max(*others, origin) - min(*others, origin)) if others else None
        return None if half is None else math.sqrt(max(0.0, half**2 - HALF_RANGE_OF_THREE * within))

    rungs = [origin]
    for member in RUNGS:
        if (found := value(member)) is None:
            break
        rungs.append(found)
    coarse = value(CONTACT)
    contact = None if coarse is None else math.sqrt(max(0.0, (coarse - origin) ** 2 - 2.0 * total))
    entries = [measured[member][crater][name] for member in mine]
    return Row(
        crater, name, tuple(mine.values()), float(np.mean(list(mine.values()))),
        _measuring(entries),
        draws=_beyond_reading(total, entries) if len(mine) > 1 else None,
        handoff=spread(EARLIER_LATER), alpha=spread(ALPHAS), ladder=ladder.climb(rungs, math.sqrt(total)),
        contact=contact,
    )  # fmt: skip


def _beyond_reading(total: float, entries: list[dict[str, Any]]) -> float:
    """The part ``draws``: the scatter of one run, a variance, beyond what the run's sectors show of it themselves."""
    azimuth = float(np.mean([((entry.get("sigma_parts") or {}).get("azimuth") or 0.0) ** 2 for entry in entries]))
    return math.sqrt(max(0.0, total - azimuth))


def _measuring(entries: list[dict[str, Any]]) -> float:
    """Root mean square of the measuring errors of the draws, without a chain error that they may carry; of a run that
    is not resolved by their parts, since it states no error."""
    squares = []
    for entry in entries:
        parts = entry.get("sigma_parts") or {}
        whole = math.hypot(*parts.values()) if entry.get("sigma") is None else entry["sigma"]
        squares.append(whole**2 - (parts.get("chain") or 0.0) ** 2)
    return math.sqrt(max(0.0, float(np.mean(squares))))


COLUMNS = ("mean", "measuring", *PARTS, "chain")


def cells(row: Row) -> tuple[list[str], str]:
    """A row as texts by ``COLUMNS``, and the unit that they are in."""
    factor, unit = expected.scale(row.measure, row.mean)
    values = [getattr(row, column) for column in COLUMNS]
    return ["--" if value is None else f"{value * factor:.4g}" for value in values], unit


def text(rows: Sequence[Row]) -> str:
    """The rows as a table, each with its unit."""
    lines = [f"{'':<30}{'':<22}{''.join(f'{column:>12}' for column in COLUMNS)}"]
    for row in rows:
        shown, unit = cells(row)
        lines.append(f"{row.crater:<30}{row.measure:<22}{''.join(f'{cell:>12}' for cell in shown)}  {unit}")
    return "\n".join(lines)
