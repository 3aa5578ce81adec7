"""A stage for tests of the runner: fails on request."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fake_bed import Contact, write_grains

from matter.case.body import Model
from matter.case.identity_fields import NotIdentity
from matter.errors import UnphysicalState


class Settings(Model):
    contact: Contact = Contact()
    failure: str = ""
    ranks: Annotated[int, NotIdentity()] = 1


def predict(settings: Settings) -> dict:
    return {"wall_s": 1.0, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    if settings.failure == "unphysical":
        raise UnphysicalState("grain 7 at (0, 0, 1) m overlaps by 0.9 r at t = 3 s")
    if settings.failure == "bug":
        raise ZeroDivisionError("a bug")
    write_grains(out / "last.vtkhdf")
    (out / "last.txt").write_text((inputs / "4_handoff" / "start.txt").read_text())
