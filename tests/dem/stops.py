"""Stops at chosen steps: a request at a wall-clock time would fall somewhere else on every machine, or nowhere."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
import pytest

from matter import cadence, progress
from matter.errors import Stopped
from matter.particles import Particles


def interrupted(monkeypatch: pytest.MonkeyPatch, steps: Collection[int], run: Callable[[], None]) -> None:
    """Call ``run`` again and again until it ends, the loop being asked to stop after each of ``steps``,
    counted over all calls."""
    counted, stops = 0, 0

    def asked() -> bool:
        nonlocal counted
        counted += 1
        if counted in steps:
            progress.request_stop()
        return progress.stop_requested()

    with monkeypatch.context() as patch:
        patch.setattr(cadence, "stop_requested", asked)
        try:
            while True:
                try:
                    run()
                    break
                except Stopped:
                    stops += 1
                    progress.clear_stop()
        finally:
            progress.clear_stop()
    assert stops == len(steps), f"stopped {stops} times of {len(steps)} within {counted} steps"


def same_grains(one: Particles, two: Particles) -> None:
    """Assert that two snapshots hold the same bits."""
    for name in one:
        assert np.array_equal(one[name], two[name]), name
    for name in one.tables:
        assert np.array_equal(one.tables[name], two.tables[name]), name
