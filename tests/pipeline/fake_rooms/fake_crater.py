"""A stage for tests of the runner: writes measures in the agreed form."""

from __future__ import annotations

import json
from pathlib import Path

from crater.settings import ChainError
from matter.case.body import Model


class Settings(Model):
    bins: int = 40
    chain: ChainError | None = None


def predict(settings: Settings) -> dict:
    return {"wall_s": 1.0, "memory_bytes": 1e6, "disk_bytes": 1e3}


def run(settings: Settings, inputs: Path, out: Path) -> None:
    width = {"value": 8.1e5, "sigma": 5.2e4, "unit": "m"}
    depth = {"value": 2.9e5, "sigma": 2.6e4, "unit": "m"}
    measures = {
        "transient": {"diameter_apparent_m": width, "depth_m": depth},
        "final": {"depth_m": {**depth, "value": 1.2e4}},
    }
    published = {
        "name": "transient depth_m",
        "value": 3e5,
        "plus": 5.1e4,
        "minus": 4.1e4,
        "unit": "m",
        "source": "Winter 2017",
    }
    measures["reference"] = [{**published, "ours": depth, "met": True}]
    (out / "measures.json").write_text(json.dumps(measures))
