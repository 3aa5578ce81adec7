"""Compare craters: run folders, profiles in CSV files and observations, in one table and one picture."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from crater import observations, radial_profile
from crater.difference import MATCH, RATIOS, profile_difference, resampled, verdict
from crater.radial_profile import Profile
from matter import archive, readable
from matter.errors import InputError

__all__ = ["Crater", "compare", "differences", "load", "profile_difference"]

SHOWN = ("diameter_rim_m", "diameter_apparent_m", "depth_m", "depth_rim_to_floor_m", "rim_height_m", "volume_m3")


@dataclass
class Crater:
    """One crater of a comparison: ``values`` maps a measure to (value, minus, plus) [SI]; ``profile`` may be missing."""

    name: str
    values: dict[str, tuple[float, float, float]]
    profile: Profile | None
    source: str = ""
    notes: list[str] = field(default_factory=list)
    zones: tuple[observations.Zone, ...] = ()


def load(item: str) -> Crater:
    """A crater by run folder, ``6_crater`` folder, profile CSV, observation file (TOML) or the name of an observation that ships with the project.

    Raises ``InputError`` saying what was looked for.
    """
    path = Path(item)
    if path.is_dir():
        folder = path / "6_crater" if (path / "6_crater").is_dir() else path
        if not (folder / "measures.json").is_file():
            raise InputError(f"{item} holds no measured crater (no 6_crater/measures.json): run the stage 'crater' first")
        return _of_run(path, folder)
    if path.is_file() and path.suffix == ".toml":
        return _of_observation(observations.read(path))
    if path.is_file():
        measured = path.name == "profile.csv" and (path.parent / "measures.json").is_file()
        return _of_run(path.parent.parent if path.parent.name == "6_crater" else path.parent, path.parent) if measured else _of_profile(path)
    if item in observations.names():
        return _of_observation(observations.load(item))
    raise InputError(f"{item!r} is neither a run folder, nor a profile, nor an observation (known: {', '.join(observations.names())})")


def _of_observation(known: observations.Observation) -> Crater:
    notes = [known.note] if known.note else []
    return Crater(known.title, known.values, known.profile, known.source, notes, known.zones)


def _of_run(run: Path, folder: Path) -> Crater:
    content = archive.read_json(folder / "measures.json")
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
    from crater.profile_measures import measure_profile

    profile = radial_profile.read_csv(path)
    values = {}
    for name, cell in measure_profile(profile).items():
        if cell.value is not None:
            values[name] = (cell.value, cell.sigma or 0.0, cell.sigma or 0.0)
    return Crater(path.stem if path.stem != "profile" else f"{path.parent.name}/{path.stem}", values, profile, str(path))


def compare(paths: list[str], observed: str | list[str] | None = None, out: Path | None = None) -> int:
    """The command ``compare_profiles``: prints a table, writes ``comparison.csv``, ``comparison_profiles.csv`` and ``comparison.png`` into ``out``; returns 0.

    Profiles are compared on their own datums; where an offset is taken out, the row says so and states it.
    """
    extra = [observed] if isinstance(observed, str) else list(observed or [])
    items = [*map(str, paths), *extra]
    if len(items) < 2:
        raise InputError("compare_profiles needs at least two craters: run folders, profile.csv files or observed names")
    folder, picture = _destination(out)
    archive.check_folder(folder)
    craters = [load(item) for item in items]
    folder.mkdir(parents=True, exist_ok=True)
    archive.write_text(folder / "comparison.csv", _table(craters))
    written = [picture, "comparison.csv"]
    drawn = [crater for crater in craters if crater.profile is not None]
    if drawn:
        archive.write_text(folder / "comparison_profiles.csv", _profiles(drawn))
        written.append("comparison_profiles.csv")
    print(_printed(craters))
    from crater import plot

    plot.draw_comparison(craters, folder / picture)
    runs = [Path(item) for item in items if Path(item).is_dir()]
    if runs:
        from crater import plot_sections

        try:
            plot_sections.draw_side_by_side(runs, folder / "cross_sections.png")
            written.append("cross_sections.png")
        except InputError as reason:
            print(f"no cross-sections: {reason}")
    print(f"written to {folder}: {', '.join(written)} (heights on each one's own datum; nothing is shifted or scaled unless the row says so)")
    return 0


def _profiles(craters: list[Crater]) -> str:
    """All profiles on common radii, a column each: what the picture shows, for a spreadsheet."""
    r, heights = resampled([crater.profile for crater in craters if crater.profile is not None])
    lines = [",".join(["radius_m", *(_quoted(f"height_m of {crater.name}") for crater in craters)])]
    for radius, row in zip(r, heights):
        lines.append(",".join([f"{radius:.6g}", *(f"{h:.6g}" if math.isfinite(h) else "" for h in row)]))
    return "\n".join(lines) + "\n"


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


def verdicts(craters: list[Crater]) -> list[dict[str, Any]]:
    """Ratios to the first crater and verdicts of every crater (empty for the first)."""
    heights = differences(craters)
    return [{} if crater is craters[0] else verdict(craters[0].values, crater.values, d) for crater, d in zip(craters, heights)]


def _table(craters: list[Crater]) -> str:
    heights = ("rms_m", "rms_over_depth", "offset_m", "rms_aligned_m", "rms_shape")
    head = ["name"] + [c for n in SHOWN for c in (n, f"{n}_minus", f"{n}_plus")] + ["depth_over_diameter"]
    head += [c for n in RATIOS for c in (f"{n}_ratio", f"{n}_ratio_sigma", f"{n}_within_errors", f"{n}_match")] + [*heights, "source"]
    lines = [",".join(head)]
    for crater, difference, judged in zip(craters, differences(craters), verdicts(craters)):
        row = [_quoted(crater.name)]
        for name in SHOWN:
            row += [f"{x:.6g}" for x in crater.values[name]] if name in crater.values else ["", "", ""]
        ratio = _ratio(crater)
        row += [f"{ratio:.4g}" if ratio else ""]
        for name in RATIOS:
            j = judged.get(name)
            row += [f"{j['ratio']:.4g}", f"{j['error']:.2g}", "yes" if j["within_errors"] else "no", "yes" if j["match"] else "no"] if j else [""] * 4
        row += [f"{difference[key]:.6g}" if difference and difference[key] is not None else "" for key in heights]
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
    found, judged = differences(craters), verdicts(craters)
    for key, word in (("diameter_rim_m", "D rim"), ("diameter_apparent_m", "D apparent"), ("depth_m", "depth"), ("volume_m3", "volume")):
        cells = [_ratio_shown(j.get(key)) for j in judged]
        if any(cell != "-" for cell in cells):
            lines.append(f"{f'{word} / 1st':<14}" + "".join(f"{cell:>{width}}" for cell in cells))
    cells = [f"{readable.length(d['rms_m'])} = {d['rms_over_depth']:.3f} depth" if d and d["rms_over_depth"] is not None else "-" for d in found]
    lines.append(f"{'RMS to first':<14}" + "".join(f"{cell:>{width}}" for cell in cells))
    cells = [f"{readable.length(d['rms_aligned_m'])} ({readable.length(d['offset_m'])} out)" if d and d["offset_m"] is not None else "-" for d in found]
    if any(cell != "-" for cell in cells):
        lines.append(f"{'  outside level':<14}" + "".join(f"{cell:>{width}}" for cell in cells))
    cells = [f"{d['rms_shape']:.3f}" if d and d["rms_shape"] is not None else "-" for d in found]
    if any(cell != "-" for cell in cells):
        lines.append(f"{'  RMS of shape':<14}" + "".join(f"{cell:>{width}}" for cell in cells))
    limits = ", ".join(f"{key.split('_m')[0].replace('_', ' ')} {limit:.0%}" for key, limit in MATCH.items())
    lines.append(f"  ratios: = within the joint error, ~ within the match limits ({limits}), ! neither; shape: z / depth over r / R")
    lines += [f"  {crater.name}: {note}" for crater in craters for note in crater.notes]
    return "\n".join(lines)


def _ratio_shown(judged: dict[str, Any] | None) -> str:
    if not judged:
        return "-"
    return f"{judged['ratio']:.3f} +- {judged['error']:.2g} {'=' if judged['within_errors'] else '~' if judged['match'] else '!'}"


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
