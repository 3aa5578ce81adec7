"""A stage for tests of the runner: unsound on request, as a ledger with a broken limit would be."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from matter.body import Model
from matter.errors import Unsound


class Settings(Model):
    broken: bool = False
    waive: dict[str, str] = Field(default_factory=dict)


def predict(settings: Settings) -> dict:
    return {"wall_s": 1.0, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    (out / "start.txt").write_text((inputs / "3_bed" / "bed.txt").read_text())
    if settings.broken:
        raise Unsound("handoff: mass_total_rel is 0.1, limit 1e-12")
