"""A stage for tests of the runner: unsound on request, as a ledger with a broken limit would be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from fake_bed import write_grains
from pydantic import Field

from handoff.ledger import Ledger
from matter.case.body import Model
from matter.case.identity_fields import NotIdentity
from matter.case.quantity import PositiveSpeed, PositiveTime
from matter.errors import InputError, Unsound


class Settings(Model):
    time: PositiveTime = 60.0
    speed_limit: PositiveSpeed = 500.0
    alpha: float = 1.5
    control: str = "none"
    broken: bool = False
    pictures: Annotated[bool, NotIdentity()] = True
    waive: dict[str, str] = Field(default_factory=dict)


def predict(settings: Settings) -> dict:
    return {"wall_s": 1.0, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    if settings.time > 100.0:
        raise InputError("no snapshot near that time")
    (out / "start.txt").write_text((inputs / "3_bed" / "bed.txt").read_text())
    write_grains(out / "start.vtkhdf")
    book = Ledger()
    book.measure("mass_total_rel", 0.1 if settings.broken else 0.0)
    book.write(out / "ledger.json")
    record = {"time_s": settings.time, "speed_limit_m_s": settings.speed_limit, "alpha_spacings": settings.alpha}
    (out / "handoff.json").write_text(json.dumps(record))
    if settings.broken:
        raise Unsound("handoff: mass_total_rel is 0.1, limit 1e-12")
