"""A stage for tests of the runner: a chaotic map that checkpoints, so that a resumed run equals an uninterrupted one
or does not."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Literal

import numpy as np

from matter.case.body import Impact, Model, Target
from matter.case.quantity import PositiveLength
from matter.files import checkpoint, snapshot
from matter.particles import Particles
from matter.progress import Progress, stop_here


class Settings(Model):
    target: Target
    impact: Impact
    spacing: PositiveLength = 5.0e4
    steps: int = 60
    sleep_s: float = 0.0
    eos: Literal["tillotson", "murnaghan"] = "tillotson"


def predict(settings: Settings) -> dict:
    return {"wall_s": settings.steps * settings.sleep_s, "memory_bytes": 2e9, "disk_bytes": 3e6}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    with open(out / "starts.txt", "a") as starts:
        state = checkpoint.newest(out)
        x, first = (
            (state[0]["x"], state[1]["step"]) if state else (np.linspace(0.1, 0.9, 7) * settings.impact.speed % 1.0, 0)
        )
        starts.write(f"{first}\n")
    progress = Progress("sph", settings.steps, start=first, interval_s=0.0)
    for step in range(int(first), settings.steps):
        x = 3.99 * x * (1 - x)
        if first == 0:  # what is gone on with has nothing to wait for
            time.sleep(settings.sleep_s)
        progress.update(step + 1, f"step {step + 1}")
        if (step + 1) % 5 == 0:
            checkpoint.save(out, step + 1, {"x": x}, {})
            stop_here("sph")
    fields = {name: np.ones(7) for name in ("mass", "density", "specific_energy", "pressure", "smoothing_length")}
    fields |= {"position": np.outer(x, [1.0, 2.0, 3.0]), "velocity": np.zeros((7, 3)), "material": np.zeros(7)}
    snapshot.write(Particles(fields, {"time": 1.0, "stage": "sph", "frame": "sphere"}), out / "last.vtkhdf")
    (out / "target.json").write_text(json.dumps({"radius_m": settings.target.radius}))
    (out / "x.txt").write_text(" ".join(value.hex() for value in x))
    checkpoint.clear(out)
