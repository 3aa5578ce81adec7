"""Compare craters, like with like: run folders, profiles in CSV files and observations, in one table and one
picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from crater.comparison import craters as held
from crater.comparison.craters import Crater, load, reference_of
from crater.comparison.difference import MATCH, profile_difference, resampled, verdict
from matter.errors import InputError
from matter.files import archive
from matter.wording import drawing, readable
from matter.wording.crater_measures import BY_NAME, COMPARED, RATIOS, UNITS

__all__ = ["Crater", "compare", "differences", "load", "profile_difference"]

HEIGHTS = (
    "rms_inside_m",
    "inside_m",
    "rms_over_depth",
    "largest_m",
    "largest_at_m",
    "rms_m",
    "offset_m",
    "rms_aligned_m",
    "rms_shape",
)


def compare(
    paths: list[str], observed: str | list[str] | None = None, out: Path | None = None, stage: str | None = None
) -> int:
    """The command ``compare_profiles``: prints a table, writes ``comparison.csv``, ``comparison_profiles.csv`` and
    ``comparison.png`` into ``out``; returns 0.

    Craters are matched by stage (``crater.comparison.craters.chosen``); ``stage`` chooses for every run. Profiles are
    compared on their own datums; where an offset is taken out, the row says so and states it.
    """
    extra = [observed] if isinstance(observed, str) else list(observed or [])
    items = [held.holdings(item) for item in [*map(str, paths), *extra]]
    if len(items) < 2:
        raise InputError(
            "compare_profiles needs at least two craters: run folders, profile.csv files or observed names"
        )
    craters, said = held.chosen(items, stage)
    folder, picture = _destination(out)
    archive.check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    archive.write_text(folder / "comparison.csv", _table(craters))
    written = ["comparison.csv"]
    drawn = [crater for crater in craters if crater.profile is not None]
    if drawn:
        archive.write_text(folder / "comparison_profiles.csv", _profiles(drawn))
        written.append("comparison_profiles.csv")
    print(_printed(craters, said))
    if drawing.possible("the comparison", print):
        from crater.pictures import plot, plot_sections

        plot.draw_comparison(craters, folder / picture)
        written.insert(0, picture)
        placed = [crater for crater in craters if crater.snapshot is not None and crater.datum is not None]
        if placed:
            plot_sections.draw_side_by_side(placed, folder / "cross_sections.png")
            written.append("cross_sections.png")
    print(
        f"written to {folder}: {', '.join(written)} (each profile uses its own datum; nothing is shifted or scaled "
        f"unless a row says so)"
    )
    return 0


def _profiles(craters: Sequence[Crater]) -> str:
    """All profiles on common radii, a column each: what the picture shows, for a spreadsheet."""
    r, heights = resampled([crater.profile for crater in craters if crater.profile is not None])
    lines = [",".join(["radius_m", *(_quoted(f"height_m of {crater.label}") for crater in craters)])]
    for radius, row in zip(r, heights):
        lines.append(",".join([f"{radius:.6g}", *(f"{h:.6g}" if math.isfinite(h) else "" for h in row)]))
    return "\n".join(lines) + "\n"


def _destination(out: Path | None) -> tuple[Path, str]:
    if out is None:
        return Path("comparison"), "comparison.png"
    out = Path(out)
    return (out.parent, out.name) if out.suffix.lower() in (".png", ".pdf", ".svg") else (out, "comparison.png")


def differences(craters: Sequence[Crater]) -> list[dict[str, Any] | None]:
    """Difference of every crater's profile from the first one of its stage that has a profile (None where there is no
    other)."""
    drawn = [crater for crater in craters if crater.profile is not None]
    result: list[dict[str, Any] | None] = []
    for crater in craters:
        first = reference_of(crater, drawn) if crater.profile is not None else None
        result.append(_difference(first, crater) if first is not None else None)
    return result


def _difference(first: Crater, crater: Crater) -> dict[str, Any] | None:
    if first.profile is None or crater.profile is None:
        return None
    rims = [c.values["diameter_rim_m"][0] / 2.0 for c in (first, crater) if "diameter_rim_m" in c.values]
    try:
        return profile_difference(first.profile, crater.profile, rim=max(rims) if len(rims) == 2 else None)
    except InputError:
        return None


def verdicts(craters: Sequence[Crater]) -> list[dict[str, Any]]:
    """Ratios to the first crater of the same stage and verdicts of every crater (empty for that first one)."""
    heights = differences(craters)
    judged = []
    for crater, height in zip(craters, heights):
        first = reference_of(crater, craters)
        judged.append({} if first is None else verdict(first.values, crater.values, height))
    return judged


def _table(craters: Sequence[Crater]) -> str:
    head = (
        ["name"]
        + [c for n in COMPARED for c in (n, f"{n}_minus", f"{n}_plus")]
        + ["depth_over_diameter", "rim_depth_over_rim_diameter"]
    )
    head += [c for n in RATIOS for c in (f"{n}_ratio", f"{n}_ratio_sigma", f"{n}_within_errors", f"{n}_match")] + [
        *HEIGHTS,
        "stage",
        "moment",
        "source",
    ]
    lines = [",".join(head)]
    for crater, difference, judged in zip(craters, differences(craters), verdicts(craters)):
        row = [_quoted(crater.name)]
        for name in COMPARED:
            row += [_number(x, 6) for x in crater.values[name]] if name in crater.values else ["", "", ""]
        row += [_number(over[0], 4) if over else "" for over in (_apparent_ratio(crater), _rim_ratio(crater))]
        for name in RATIOS:
            j = judged.get(name)
            row += (
                [
                    f"{j['ratio']:.4g}",
                    _number(j["error"], 2),
                    "yes" if j["within_errors"] else "no",
                    "yes" if j["match"] else "no",
                ]
                if j
                else [""] * 4
            )
        row += [f"{difference[key]:.6g}" if difference and difference[key] is not None else "" for key in HEIGHTS]
        lines.append(
            ",".join(
                [*row, crater.stage, _quoted(f"{crater.title}, {crater.when}".strip(", ")), _quoted(crater.source)]
            )
        )
    return "\n".join(lines) + "\n"


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}g}" if math.isfinite(value) else ""


def _quoted(text: str) -> str:
    return '"' + text.replace('"', "'").replace("\n", " ") + '"'


def _apparent_ratio(crater: Crater) -> tuple[float, float] | None:
    """d/D: depth below the datum over apparent diameter, with its error."""
    return _over(crater, "depth_m", "diameter_apparent_m")


def _rim_ratio(crater: Crater) -> tuple[float, float] | None:
    """Crest to floor over rim diameter, with its error."""
    return _over(crater, "depth_rim_to_floor_m", "diameter_rim_m")


def _over(crater: Crater, depth: str, diameter: str) -> tuple[float, float] | None:
    if depth not in crater.values or diameter not in crater.values or not crater.values[diameter][0] > 0.0:
        return None
    d, size = crater.values[depth], crater.values[diameter]
    relative_errors = [max(x[1:]) / abs(x[0]) if x[0] else 0.0 for x in (d, size)]
    return d[0] / size[0], d[0] / size[0] * math.hypot(*relative_errors)


def _printed(craters: Sequence[Crater], said: str) -> str:
    """The table: a column for each crater, as wide as its widest cell."""
    words = {name: BY_NAME[name].symbol for name in COMPARED}
    rows = [
        ("", [c.name for c in craters]),
        ("stage", [c.title or "-" for c in craters]),
        ("", [c.when for c in craters]),
    ]
    rows += [(word, [_shown(c.values.get(key), key) for c in craters]) for key, word in words.items()]
    rows.append(("d/D apparent", [_ratio_text(_apparent_ratio(c)) for c in craters]))
    rims = [_ratio_text(_rim_ratio(c)) for c in craters]
    rows += [("d/D rim to rim", rims)] if any(cell != "-" for cell in rims) else []
    judged = verdicts(craters)
    rows += [(f"{words[key]} / 1st", [_ratio_shown(j.get(key)) for j in judged]) for key in RATIOS]
    pairs = differences(craters)
    rows += [("RMS to first", [_rms_shown(d) for d in pairs]), ("  largest", [_largest_shown(d) for d in pairs])]
    aligned = [
        f"{readable.length(d['rms_aligned_m'])} ({readable.length(d['offset_m'])} out)"
        if d and d["offset_m"] is not None
        else "-"
        for d in pairs
    ]
    shapes = [f"{d['rms_shape']:.3f}" if d and d["rms_shape"] is not None else "-" for d in pairs]
    rows += [("  outside level", aligned), ("  RMS of shape", shapes)]
    kept = [
        row
        for row in rows
        if not row[0] or row[0] in ("stage", *words.values(), "d/D apparent") or any(cell != "-" for cell in row[1])
    ]
    widths = [max(len(cells[k]) for _, cells in kept) + 2 for k in range(len(craters))]
    lines = [f"{word:<16}" + "".join(f"{cell:>{width}}" for cell, width in zip(cells, widths)) for word, cells in kept]
    limits = ", ".join(f"{key.split('_m')[0].replace('_', ' ')} {limit:.0%}" for key, limit in MATCH.items())
    lines += [f"  {said}"] if said else []
    lines.append(
        "  d/D apparent: depth below the datum over apparent diameter; d/D rim to rim: crest to floor over rim "
        "diameter"
    )
    lines.append(
        "  / 1st: over the first column of the same stage; RMS: inside 1.5 rim radii of the larger of the two"
    )
    lines.append(
        f"  ratios: = within the joint error, ~ within the match limits ({limits}), ! neither; shape: z / depth over "
        f"r / R"
    )
    lines += [f"  {crater.label}: {note}" for crater in craters for note in crater.notes]
    return "\n".join(lines)


def _rms_shown(difference: dict[str, Any] | None) -> str:
    if not difference or difference["rms_over_depth"] is None:
        return "-"
    return (
        f"{readable.length(difference['rms_inside_m'])} = {difference['rms_over_depth']:.3f} depth, r < "
        f"{readable.length(difference['inside_m'])}"
    )


def _largest_shown(difference: dict[str, Any] | None) -> str:
    return (
        f"{readable.length(difference['largest_m'])} at r = {readable.length(difference['largest_at_m'])}"
        if difference
        else "-"
    )


def _ratio_text(over: tuple[float, float] | None) -> str:
    if over is None:
        return "-"
    return f"{over[0]:.3f} +- {over[1]:.2g}" if math.isfinite(over[1]) else f"{over[0]:.3f}"


def _ratio_shown(judged: dict[str, Any] | None) -> str:
    if not judged:
        return "-"
    error = f" +- {judged['error']:.2g}" if math.isfinite(judged["error"]) else ""
    return f"{judged['ratio']:.3f}{error} {'=' if judged['within_errors'] else '~' if judged['match'] else '!'}"


def _shown(entry: tuple[float, float, float] | None, key: str) -> str:
    """A value with the errors that are known; none where none is stated."""
    if entry is None:
        return "-"
    value, minus, plus = entry
    scale, unit = (1e-9, " km3") if key == "volume_m3" else (1e-3, " km")
    if (key == "volume_m3" and abs(value) < 1e7) or (key != "volume_m3" and abs(value) < 1e3):
        scale, unit = 1.0, f" {unit[2:]}"
    if UNITS[key] == "1":
        scale, unit = 1.0, ""
    if not math.isfinite(minus + plus):
        return f"{value * scale:.4g}{unit}"
    if abs(minus - plus) < 1e-9 * max(abs(plus), 1e-300):
        return f"{value * scale:.4g} +- {plus * scale:.2g}{unit}"
    return f"{value * scale:.4g} +{plus * scale:.3g}/-{minus * scale:.3g}{unit}"
