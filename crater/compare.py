"""Compare craters: run folders, profiles in CSV files and observations, in one table and one picture."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from crater import observations, radial_profile
from crater.radial_profile import Profile
from matter import archive
from matter.errors import InputError

SHOWN = ("diameter_rim_m", "diameter_apparent_m", "depth_m", "depth_rim_to_floor_m", "rim_height_m", "volume_m3")


@dataclass
class Crater:
    """One crater of a comparison: ``values`` maps a measure to (value, minus, plus) [SI]; ``profile`` may be missing."""

    name: str
    values: dict[str, tuple[float, float, float]]
    profile: Profile | None
    source: str = ""
    notes: list[str] = field(default_factory=list)


def profile_difference(a: Profile, b: Profile, depth: float | None = None) -> dict[str, Any]:
    """RMS, mean and largest height difference (b minus a) of two profiles on the coarser one's rings [m], area-weighted, where both exist.

    ``depth`` [m] is the scale that ``rms_over_depth`` is stated in (default: the deeper of the two).
    """
    coarse, fine = (a, b) if len(a.radius) <= len(b.radius) else (b, a)
    sign = 1.0 if coarse is b else -1.0
    known = np.isfinite(fine.height)
    inside = np.isfinite(coarse.height) & (coarse.radius >= fine.radius[known][0]) & (coarse.radius <= fine.radius[known][-1])
    if inside.sum() < 3:
        raise InputError("the profiles overlap in fewer than three radii: nothing to compare")
    r = coarse.radius[inside]
    difference = sign * (coarse.height[inside] - np.interp(r, fine.radius[known], fine.height[known]))
    weight = r * np.gradient(r)
    rms = float(np.sqrt(np.average(difference**2, weights=weight)))
    scale = depth or max(-float(np.nanmin(a.height)), -float(np.nanmin(b.height)))
    return {
        "rms_m": rms,
        "mean_m": float(np.average(difference, weights=weight)),
        "largest_m": float(difference[np.argmax(np.abs(difference))]),
        "from_m": float(r[0]),
        "to_m": float(r[-1]),
        "depth_scale_m": float(scale),
        "rms_over_depth": rms / scale if scale > 0.0 else None,
    }


def load(item: str) -> Crater:
    """A crater by run folder, ``6_crater`` folder, profile CSV or the name of an observation.

    Raises ``InputError`` saying what was looked for.
    """
    path = Path(item)
    if path.is_dir():
        folder = path / "6_crater" if (path / "6_crater").is_dir() else path
        if not (folder / "measures.json").is_file():
            raise InputError(f"{item} holds no measured crater (no 6_crater/measures.json): run the stage 'crater' first")
        return _of_run(path, folder)
    if path.is_file():
        measured = path.name == "profile.csv" and (path.parent / "measures.json").is_file()
        return _of_run(path.parent.parent if path.parent.name == "6_crater" else path.parent, path.parent) if measured else _of_profile(path)
    if item in observations.names():
        known = observations.load(item)
        return Crater(known.title, known.values, known.profile, known.source)
    raise InputError(f"{item!r} is neither a run folder, nor a profile, nor an observation (known: {', '.join(observations.names())})")


def _of_run(run: Path, folder: Path) -> Crater:
    content = json.loads((folder / "measures.json").read_text())
    final = content.get("final", {})
    values, notes = _values(final), []
    if "diameter_apparent_m" not in values:
        reason = final.get("diameter_apparent_m", {}).get("reason", final.get("reason", "")) if isinstance(final, dict) else ""
        notes.append(f"no final diameter: {reason}")
    profile = radial_profile.read_csv(folder / "profile.csv") if (folder / "profile.csv").is_file() else None
    return Crater(run.resolve().name, values, profile, str(folder), notes)


def _values(entry: dict[str, Any]) -> dict[str, tuple[float, float, float]]:
    values = {}
    for name in SHOWN:
        cell = entry.get(name)
        if isinstance(cell, dict) and isinstance(cell.get("value"), (int, float)):
            sigma = float(cell.get("sigma") or 0.0)
            values[name] = (float(cell["value"]), sigma, sigma)
    return values


def _of_profile(path: Path) -> Crater:
    from crater.measure import measure_profile

    profile = radial_profile.read_csv(path)
    values = {}
    for name, cell in measure_profile(profile).items():
        if cell.value is not None:
            values[name] = (cell.value, cell.sigma or 0.0, cell.sigma or 0.0)
    return Crater(path.stem if path.stem != "profile" else f"{path.parent.name}/{path.stem}", values, profile, str(path))


def compare(paths: list[str], observed: str | list[str] | None = None, out: Path | None = None) -> int:
    """The command ``compare_profiles``: prints a table, writes ``comparison.csv`` and ``comparison.png`` into ``out``; returns 0.

    Nothing is shifted or scaled: profiles are compared on their own datums; the printed lines say so.
    """
    extra = [observed] if isinstance(observed, str) else list(observed or [])
    items = [*map(str, paths), *extra]
    if len(items) < 2:
        raise InputError("compare_profiles needs at least two craters: run folders, profile.csv files or observed names")
    craters = [load(item) for item in items]
    folder, picture = _destination(out)
    folder.mkdir(parents=True, exist_ok=True)
    table = _table(craters)
    archive.write_text(folder / "comparison.csv", table)
    print(_printed(craters))
    from crater import plot

    plot.draw_comparison(craters, folder / picture)
    print(f"written: {folder / picture}, {folder / 'comparison.csv'} (heights on each one's own datum, nothing shifted or scaled)")
    return 0


def _destination(out: Path | None) -> tuple[Path, str]:
    if out is None:
        return Path("comparison"), "comparison.png"
    out = Path(out)
    return (out.parent, out.name) if out.suffix.lower() in (".png", ".pdf", ".svg") else (out, "comparison.png")


def differences(craters: list[Crater]) -> list[dict[str, Any] | None]:
    """Difference of every crater's profile from the first one that has a profile."""
    first = next((crater for crater in craters if crater.profile is not None), None)
    result: list[dict[str, Any] | None] = []
    for crater in craters:
        if first is None or first.profile is None or crater.profile is None or crater is first:
            result.append(None)
            continue
        try:
            result.append(profile_difference(first.profile, crater.profile))
        except InputError:
            result.append(None)
    return result


def _table(craters: list[Crater]) -> str:
    head = ["name"] + [c for n in SHOWN for c in (n, f"{n}_minus", f"{n}_plus")] + ["depth_over_diameter", "rms_m", "rms_over_depth", "source"]
    lines = [",".join(head)]
    for crater, difference in zip(craters, differences(craters)):
        row = [_quoted(crater.name)]
        for name in SHOWN:
            row += [f"{x:.6g}" for x in crater.values[name]] if name in crater.values else ["", "", ""]
        ratio = _ratio(crater)
        row += [f"{ratio:.4g}" if ratio else ""]
        row += [f"{difference['rms_m']:.6g}", f"{difference['rms_over_depth']:.4g}"] if difference else ["", ""]
        lines.append(",".join(row + [_quoted(crater.source)]))
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return '"' + text.replace('"', "'").replace("\n", " ") + '"'


def _ratio(crater: Crater) -> float | None:
    diameter = crater.values.get("diameter_rim_m") or crater.values.get("diameter_apparent_m")
    depth = crater.values.get("depth_m")
    return depth[0] / diameter[0] if depth and diameter and diameter[0] > 0 else None


def _printed(craters: list[Crater]) -> str:
    names = {
        "diameter_rim_m": "D rim",
        "diameter_apparent_m": "D apparent",
        "depth_m": "depth",
        "depth_rim_to_floor_m": "rim to floor",
        "rim_height_m": "rim height",
        "volume_m3": "volume",
    }
    width = max(24, *(len(c.name) + 2 for c in craters))
    lines = [f"{'':<14}" + "".join(f"{crater.name:>{width}}" for crater in craters)]
    for key, word in names.items():
        lines.append(f"{word:<14}" + "".join(f"{_shown(crater.values.get(key), key):>{width}}" for crater in craters))
    ratios = [_ratio(crater) for crater in craters]
    lines.append(f"{'d/D':<14}" + "".join(f"{(f'{ratio:.3f}' if ratio else '-'):>{width}}" for ratio in ratios))
    cells = [f"{d['rms_m'] / 1e3:.3g} km = {d['rms_over_depth']:.3f} depth" if d else "-" for d in differences(craters)]
    lines.append(f"{'RMS to first':<14}" + "".join(f"{cell:>{width}}" for cell in cells))
    lines += [f"  {crater.name}: {note}" for crater in craters for note in crater.notes]
    return "\n".join(lines)


def _shown(entry: tuple[float, float, float] | None, key: str) -> str:
    if entry is None:
        return "-"
    value, minus, plus = entry
    scale, unit = (1e-9, "km3") if key == "volume_m3" else (1e-3, "km")
    if (key == "volume_m3" and abs(value) < 1e7) or (key != "volume_m3" and abs(value) < 1e3):
        scale, unit = 1.0, unit[1:]
    if abs(minus - plus) < 1e-9 * max(abs(plus), 1e-300):
        return f"{value * scale:.4g} +- {plus * scale:.2g} {unit}"
    return f"{value * scale:.4g} +{plus * scale:.3g}/-{minus * scale:.3g} {unit}"
