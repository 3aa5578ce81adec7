"""The result of a run as a table: what was measured, and the published numbers beside it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pipeline import stages

ROWS = (
    ("diameter_rim_m", "rim diameter"),
    ("diameter_apparent_m", "apparent diameter"),
    ("depth_m", "depth below datum"),
    ("depth_rim_to_floor_m", "depth rim to floor"),
    ("rim_height_m", "rim height"),
    ("volume_m3", "volume"),
    ("time_s", "time"),
)


def table(run: Path) -> str:
    """The measures of a finished run; an empty text when the crater was not measured."""
    path = stages.folder(run, "crater") / "measures.json"
    if not path.is_file():
        return ""
    measures = json.loads(path.read_text())
    kinds = [kind for kind in ("transient", "final") if measures.get(kind)]
    lines = [f"{'':<22}" + "".join(f"{kind:>24}" for kind in kinds)]
    for key, words in ROWS:
        cells = [shown(measures[kind].get(key)) for kind in kinds]
        if any(cells):
            lines.append(f"{words:<22}" + "".join(f"{cell or '--':>24}" for cell in cells))
    return "\n".join(lines + _published(measures.get("reference")))


def shown(entry: Any) -> str:
    """``{"value", "sigma", "unit"}`` as ``980 +- 52 km``; empty when there is no value."""
    if not isinstance(entry, dict) or not isinstance(entry.get("value"), (int, float)):
        return ""
    unit, sigma = entry.get("unit", ""), entry.get("sigma")
    scale, word = _scale(unit, abs(entry["value"]))
    error = f" +- {sigma * scale:.3g}" if isinstance(sigma, (int, float)) else ""
    return f"{entry['value'] * scale:.4g}{error} {word}"


def _scale(unit: str, value: float) -> tuple[float, str]:
    if unit == "m" and value >= 1e3:
        return 1e-3, "km"
    if unit in ("m^3", "m3") and value >= 1e9:
        return 1e-9, "km^3"
    if unit == "s" and value >= 120:
        return 1 / 60, "min"
    return 1.0, unit


def _published(reference: Any) -> list[str]:
    """A line per published number."""
    return [line for line in _lines(reference, "") if line]


def _lines(entry: Any, name: str) -> list[str]:
    if isinstance(entry, list):
        return [line for part in entry for line in _lines(part, name)]
    if not isinstance(entry, dict):
        return []
    if "value" in entry:
        name = str(entry.get("name", name))
        met = entry.get("met", entry.get("verdict"))
        word = {True: "met", False: "not met", None: ""}.get(met, str(met)) if isinstance(met, bool | None) else str(met)
        return [f"published: {name} {shown(entry)}  {entry.get('source', '')}  {word}".rstrip()]
    return [line for key, part in entry.items() for line in _lines(part, f"{name} {key}".strip())]
