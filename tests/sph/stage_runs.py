"""Runs of the shock stage, whole or stopped at chosen simulated times (progress counts predicted steps, which are not
times), and the layered body hit by ice that several of them are about."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from matter import progress
from matter.case.body import Impact, Layer, Projectile, Target
from matter.errors import Stopped
from matter.files import checkpoint, snapshot
from sph import stage
from sph.simulation import Simulation

CALLISTO = Target(
    layers=(
        Layer(name="core", material="basalt", thickness=1842e3),
        Layer(name="ocean", material="water", thickness=150e3),
        Layer(name="shell", material="ice", thickness=150e3),
    )
)
IMPACT = Impact(
    speed=18234.0,
    angle_from_vertical=math.radians(40),
    projectile=Projectile(material="ice", radius=53.9e3),
    expected_transient_diameter=980e3,
)


def finished_run(settings: stage.Settings, root: Path) -> Path:
    """The folder of the stage below ``root``, run to its end."""
    out = root / "2_sph"
    out.mkdir(parents=True)
    stage.run(settings, root, out)
    return out


def resumed_run(monkeypatch: pytest.MonkeyPatch, settings: stage.Settings, root: Path, at: float, whole: Path) -> str:
    """Run the stage below ``root`` with a stop at the time ``at`` [s]; the phase of the stop. What it leaves has to be
    that of the ``whole`` run to the last bit."""
    out = root / "2_sph"
    out.mkdir(parents=True)
    phase, _ = stopped(monkeypatch, lambda: stage.run(settings, root, out), at)
    assert checkpoint.newest(out) is not None
    stage.run(settings, root, out)
    for path in [*snapshot.series(whole), whole / "last.vtkhdf"]:
        a, b = snapshot.read(path), snapshot.read(out / path.name)
        assert set(a) == set(b)
        for field in a:
            assert np.array_equal(a[field], b[field]), (path.name, field)
    assert (out / "history.csv").read_bytes() == (whole / "history.csv").read_bytes()
    return phase


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
