"""A stage for tests of the runner: reads only target.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import Field

from matter.case.body import Model
from matter.case.quantity import PositiveLength
from matter.files import snapshot
from matter.particles import Particles


class Law(Model):
    rolling: float = 1.0
    width: PositiveLength = 1.0


class Contact(Model):
    friction: float = Field(0.5, ge=0, le=2)
    ocean: Law = Law(rolling=0.0, width=2.0)


class Settings(Model):
    contact: Contact = Contact()
    radius: PositiveLength = 1000.0


def write_grains(path: Path) -> None:
    """Three grains as a snapshot."""
    fields = {"position": np.eye(3), "velocity": np.zeros((3, 3)), "mass": np.ones(3), "radius": np.ones(3)}
    snapshot.write(Particles(fields, {"time": 1.0, "frame": "sphere"}), path)


def predict(settings: Settings) -> dict:
    return {"wall_s": 1.0, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    write_grains(out / "bed.vtkhdf")
    (out / "bed.txt").write_text(f"{(inputs / '2_sph' / 'target.json').read_text()} {settings.contact.friction}")
