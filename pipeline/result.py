"""The result of a run as a table: what was measured, and the published numbers beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matter import archive
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
    measures = archive.read_json(path)
    kinds = [kind for kind in ("transient", "final") if measures.get(kind)]
    lines = [f"{'':<20}" + "".join(f"{kind:>30}" for kind in kinds)]
    for key, words in ROWS:
        cells = [shown(measures[kind].get(key)) for kind in kinds]
        if any(cells):
            lines.append(f"{words:<20}" + "".join(f"{cell or '--':>30}" for cell in cells))
    return "\n".join([*lines, _chain(measures), *(_published(entry) for entry in measures.get("reference", []))])


def _chain(measures: dict[str, Any]) -> str:
    """What the errors hold of the scatter of the whole chain."""
    from crater import chain

    parts = [entry.get("sigma_parts") or {} for kind in ("transient", "final") for entry in (measures.get(kind) or {}).values() if isinstance(entry, dict)]
    return chain.KNOWN if any(chain.PART in one for one in parts) else chain.UNKNOWN


def _published(entry: dict[str, Any]) -> str:
    """A published number, ours beside it, and whether it is met; that it is not met is a finding, not a failure."""
    scale, unit = _scale(entry["unit"], abs(entry["value"]))
    error = f" +{entry['plus'] * scale:.3g} -{entry['minus'] * scale:.3g}" if "plus" in entry and "minus" in entry else ""
    verdict = "not measured" if entry.get("met") is None else "met" if entry["met"] else "not met"
    ours = shown(entry.get("ours"))
    words = f"published {entry['name']}: {entry['value'] * scale:.4g}{error} {unit} ({entry.get('source', 'no source')})"
    return f"{words}; here {ours or '--'}: {verdict}"


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
