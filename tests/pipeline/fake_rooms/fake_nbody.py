"""A stage for tests of the runner: writes an impact.toml."""

from __future__ import annotations

from pathlib import Path

from matter.case.body import Impact, Model


class Settings(Model):
    impact: Impact | None = None
    count: int = 100
    pinned: bool = True


def predict(settings: Settings) -> dict:
    return {"wall_s": 0.1, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    pinned = settings.pinned and settings.impact is not None
    speed, angle = (
        (settings.impact.speed, settings.impact.angle_from_vertical) if pinned else (10000.0 + settings.count, 0.5)
    )
    (out / "impact.toml").write_text(f'speed = "{speed} m/s"\nangle_from_vertical = "{angle} rad"\n')
