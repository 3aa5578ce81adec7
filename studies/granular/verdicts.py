"""Claims whose limits were committed before the first run, and their verdicts: those of the first complete run, which
stay for good in ``first.json``, beside those of today."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np


class Claim(NamedTuple):
    """What is ``wanted`` of a number, and how far off it may be: ``limit`` (0 wanted: at most)."""

    words: str
    wanted: float
    limit: float


class Found(NamedTuple):
    """A number with its error from the scatter of seeds (nan: none), and whether it is within the limit."""

    value: float
    error: float
    met: bool


Claims = Mapping[str, Claim]
Verdicts = Mapping[str, Found]


def judged(claim: Claim, value: float, error: float) -> Found:
    """The verdict on a number."""
    return Found(value, error, bool(abs(value - claim.wanted) <= claim.limit))


def first_of(out: Path, claims: Claims, now: Verdicts) -> dict[str, Found]:
    """The verdicts of the first complete run: those of ``first.json``, which is written where it is missing."""
    path = out / "first.json"
    if not path.is_file():
        if len(now) < len(claims):
            return {}
        path.write_text(json.dumps({name: found._asdict() for name, found in now.items()}, indent=1))
    return {name: Found(**found) for name, found in json.loads(path.read_text()).items()}


def worded(found: Found) -> str:
    """Value and error in words."""
    return f"{found.value:.3f}" + (f" +- {found.error:.3f}" if math.isfinite(found.error) else "")


def judgement(found: Verdicts, name: str) -> str:
    """Value and verdict of a claim in words."""
    if name not in found:
        return "not run"
    return f"{worded(found[name])}: {'met' if found[name].met else '**not met**'}"


def table(claims: Claims, first: Verdicts, now: Verdicts) -> str:
    """The verdicts as Markdown."""
    lines = ["| | claim | asked | first | now |", "|---|---|---|---|---|"]
    for name, claim in claims.items():
        asked = f"at most {claim.limit:g}" if claim.wanted == 0.0 else f"{claim.wanted:.3g} +- {claim.limit:g}"
        lines.append(f"| {name} | {claim.words} | {asked} | {judgement(first, name)} | {judgement(now, name)} |")
    return "\n".join(lines)


def write(out: Path, resolution: str, first: Verdicts, now: Verdicts, old: str = "first run") -> None:
    """``verdicts.json`` for the page of all claims: those of today, of the first run where there are none yet, with
    the words ``old``; what the first run said where that was another verdict."""
    rows = []
    for name, found in {**first, **now}.items():
        row = {"id": name, "ours": worded(found), "verdict": "met" if found.met else "not met"}
        if name not in now:
            row["why"] = old
        elif name in first and first[name].met != found.met:
            row["why"] = f"first run: {worded(first[name])}"
        rows.append(row)
    (out / "verdicts.json").write_text(json.dumps({"resolution": resolution, "verdicts": rows}, indent=1))


def scatter(values: Sequence[float]) -> float:
    """Standard deviation over the mean; nan of fewer than two."""
    return math.nan if len(values) < 2 else float(np.std(values, ddof=1) / np.mean(values))


def spread(x: Any) -> float:
    """What the error of a point is to be divided by for that of an exponent: root of the sum of squares of ln x about
    its mean."""
    return float(np.sqrt(np.sum((np.log(x) - np.mean(np.log(x))) ** 2)))


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Power of x by which y grows: the slope of ln y over ln x."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def fields(kind: Any, row: Mapping[str, Any]) -> dict[str, Any]:
    """Those of a kept row that ``kind`` has."""
    return {name: row[name] for name in kind._fields}
