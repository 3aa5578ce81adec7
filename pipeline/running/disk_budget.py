"""``run_case CASE --budget "5 GB"``: snapshots so far apart that a run fits into a stated part of the disk.

What is left out is what only pictures and movies need: histories keep their own intervals, and ``KEPT`` snapshots
of each stage stay, out of which the handoff chooses its time. The intervals become values of the run like any others.
"""

from __future__ import annotations

from collections.abc import Callable

from matter.errors import InputError
from pipeline.case.read import Case
from pipeline.running import prediction, room
from pipeline.running.request import Request, settings_of

FACTORS = (1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0)
KEPT = 20
"""Snapshots of a stage that stay at least, where it has so many."""
_STAGES = ("sph", "dem")


def fitted(read: Callable[[tuple[str, ...]], Case], ask: Callable[[Case], Request], budget: float) -> tuple[Case, str]:
    """The case with the shortest intervals between snapshots at which the run needs no more than ``budget`` [bytes] of
    disk, and a line that says so (empty where nothing had to change).

    ``read``: the case with further values (``--set``); ``ask``: a request for it. Raises ``InputError`` where no
    interval is long enough.
    """
    case = read(())
    if case.run is not None:
        raise InputError(f"--budget: {case.run} is a run, whose snapshots are settled; run its case with --budget")
    first = settings_of(ask(case))
    need = least = float("inf")
    for factor in FACTORS:
        more = _longer(first, factor) if factor > 1.0 else ()
        tried = read(more) if more else case
        request = ask(tried)
        need = room.needs(prediction.predictions(request, settings_of(request)).values())[1]
        if need <= budget:
            words = f"snapshots up to {factor:g} times further apart: {', '.join(more[::2])}; " if more else ""
            return tried, f"{words}{room.size(need)} of disk are needed of {room.size(budget)}" if more else ""
        least = min(least, need)
    raise InputError(
        f"--budget {room.size(budget)}: {case.file} needs {room.size(least)} of disk even with snapshots up to "
        f"{FACTORS[-1]:g} times further apart; fewer particles or grains (--size, a preset) need less"
    )


def _longer(settings: dict, factor: float) -> tuple[str, ...]:
    """Values that put snapshots further apart by up to ``factor`` and keep the histories as they are."""
    values: list[str] = []
    for stage in _STAGES:
        if (given := settings.get(stage)) is None or not hasattr(given, "snapshot_interval"):
            continue
        most = given.end_time / (KEPT * given.snapshot_interval)
        if (longer := min(factor, most)) > 1.0:
            values.append(f"{stage}.snapshot_interval={longer * given.snapshot_interval:.6g} s")
            values.append(f"{stage}.history_interval={given.history_interval:.17g} s")
    return tuple(values)
