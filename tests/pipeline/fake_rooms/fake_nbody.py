"""A stage for tests of the runner: writes an impact.toml."""

from __future__ import annotations

from pathlib import Path

from matter.body import Impact, Model


class Settings(Model):
    impact: Impact | None = None
    count: int = 100


def predict(settings: Settings) -> dict:
    return {"wall_s": 0.1, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    text = f'speed = "{10000.0 + settings.count} m/s"\nangle_from_vertical = "0.5 rad"\n[projectile]\nmaterial = "ice"\nradius = "50 km"\n'
    (out / "impact.toml").write_text(text)
