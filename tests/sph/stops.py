"""Stops of the shock stage at chosen simulated times: progress counts predicted steps, which are not times."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from matter import progress
from matter.errors import Stopped
from sph.simulation import Simulation


def stopped(monkeypatch: pytest.MonkeyPatch, run: Callable[[], None], at: float) -> tuple[str, float]:
    """Call ``run``, which is asked to stop after the first step beyond ``at`` [s, the relaxation counted] and has to;
    the phase that it was in, and the time since that began [s]."""
    pause, seen = Simulation._pause, ("", 0.0)

    def asked(self: Simulation, report: progress.Progress, done: float) -> None:
        nonlocal seen
        seen = (self.phase, self.integrator.time)
        if done > at:
            progress.request_stop()
        pause(self, report, done)

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "_pause", asked)
        try:
            with pytest.raises(Stopped):
                run()
        finally:
            progress.clear_stop()
    return seen
