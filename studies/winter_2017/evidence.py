"""The form in which a published claim is scored against a matrix of runs.

Evidence of one run: what the crater stage wrote (``measures.json``, ``time_series.csv``, ``profile_transient.csv``)
and what ``follow_run`` found. A claim whose runs are missing is ``not run``; nothing is inferred.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crater.ground.radial_profile import Profile, read_csv
from matter.errors import InputError
from studies.winter_2017 import follow_run
from studies.winter_2017.series_difference import read_series

KM = 1e-3


class Value(NamedTuple):
    """A value with its standard error; NaN where it cannot be stated."""

    value: float
    sigma: float

    def text(self, scale: float = KM, unit: str = "km", digits: int = 0) -> str:
        """``477 +- 6 km``."""
        return (
            f"{self.value * scale:.{digits}f} +- {self.sigma * scale:.{digits}f} {unit}"
            if math.isfinite(self.value)
            else "none"
        )


@dataclass(frozen=True)
class Run:
    """What one run left: SI throughout.

    ``interior``: columns of ``follow_run.follow``; ``annulus``: the undamaged ring (inner, outer distance) or None,
    ``damage``: (distance, mean damage) behind it; ``end_s``: the last time; ``shell_m``: thickness of the outermost
    layer as it starts.
    """

    name: str
    measures: Mapping[str, Any]
    series: Mapping[str, np.ndarray]
    interior: Mapping[str, np.ndarray]
    shell_m: float
    end_s: float
    profile: Profile | None = None
    damage: tuple[np.ndarray, np.ndarray] | None = None
    annulus: tuple[float, float] | None = None
    facts: Mapping[str, Any] = field(default_factory=dict)

    def transient(self, name: str, at: str = "depth") -> Value:
        """A measure at the first maximum of ``at`` (depth, volume, diameter)."""
        return _value(self.measures.get("transient", {}).get(f"at_maximum_{at}", {}).get(name))

    @property
    def final_depth(self) -> Value:
        """Depth of the shock stage's last state; zero, within the deepest ring, where no hollow is left."""
        late = self.measures.get("late_sph", {})
        depth = _value(late.get("depth_m"))
        return (
            depth if math.isfinite(depth.value) or not late else Value(0.0, float(late.get("deepest_ring_m") or 0.0))
        )

    def inside(self, name: str, time: float) -> float:
        """A quantity of ``follow_run`` at the snapshot nearest to ``time`` [s]."""
        return float(self.interior[name][int(np.argmin(np.abs(self.interior["time_s"] - time)))])


def read_run(name: str, run: Path, measured: Path) -> Run:
    """One run from its run folder and the folder that ``follow_run.write`` and the crater stage filled.

    Raises ``InputError`` when a file is missing.
    """
    facts = follow_run.target_facts(run)
    measures, compared, inside = (
        _json(measured / file) for file in ("measures.json", "compare.json", follow_run.FILE)
    )
    profile = measured / "profile_transient.csv"
    damage = inside["damage"]
    return Run(
        name,
        measures,
        read_series(measured / "time_series.csv"),
        {column: np.array([row[column] for row in inside["rows"]], dtype=float) for column in inside["rows"][0]},
        facts["shell_m"],
        float(inside["rows"][-1]["time_s"]),
        read_csv(profile) if profile.is_file() else None,
        (np.array(damage["distance_m"]), np.array(damage["mean"])) if damage else None,
        tuple(damage["annulus_m"]) if damage and damage["annulus_m"] else None,
        {"scaling_m": compared["scaling"]["range_m"], "run": Path(run).name},
    )


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file():
        raise InputError(f"{path} is missing: measure the run first")
    return json.loads(path.read_text())


def _value(entry: Mapping[str, Any] | None) -> Value:
    if not entry or entry.get("value") is None:
        return Value(math.nan, math.nan)
    return Value(float(entry["value"]), float(entry.get("sigma") or 0.0))


@dataclass(frozen=True)
class Finding:
    """What the runs say about a claim; ``met`` None where they cannot decide."""

    ours: str
    error: str
    met: bool | None
    why: str = ""


@dataclass(frozen=True)
class Claim:
    """One published claim: the runs that it ``needs``, and how they are judged."""

    id: str
    claim: str
    published: str
    tolerance: str
    needs: tuple[str, ...]
    judge: Callable[[Mapping[str, Run]], Finding]


@dataclass(frozen=True)
class Score:
    """One row of the table; verdict is met, not met, undecided or not run."""

    id: str
    claim: str
    published: str
    ours: str
    error: str
    tolerance: str
    verdict: str
    why: str
    runs: tuple[str, ...]


def score(claims: Iterable[Claim], runs: Mapping[str, Run]) -> list[Score]:
    """The claims in order."""
    return [_scored(claim, runs) for claim in claims]


def _scored(claim: Claim, runs: Mapping[str, Run]) -> Score:
    row = (claim.id, claim.claim, claim.published)
    missing = [name for name in claim.needs if name not in runs]
    if missing:
        return Score(*row, "", "", claim.tolerance, "not run", f"missing: {', '.join(missing)}", claim.needs)
    try:
        finding = claim.judge(runs)
    except InputError as reason:
        finding = Finding("", "", None, str(reason))
    verdict = "undecided" if finding.met is None else ("met" if finding.met else "not met")
    return Score(*row, finding.ours, finding.error, claim.tolerance, verdict, finding.why, claim.needs)


def as_markdown(scores: list[Score], title: str, command: str, notes: str = "") -> str:
    """The scores as a table."""
    tally = ", ".join(
        f"{n} {verdict}"
        for verdict in ("met", "not met", "undecided", "not run")
        if (n := sum(s.verdict == verdict for s in scores))
    )
    lines = [f"# {title}", "", f"Made by `{command}`.{' ' + notes if notes else ''}", "", f"{tally}.", ""]
    lines += [
        "| id | claim | published | ours | error | reproduced if | verdict | why (runs) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for s in scores:
        why = f"{s.why} ({', '.join(s.runs)})".strip() if s.runs and s.verdict != "not run" else s.why
        cells = (s.id, s.claim, s.published, s.ours, s.error, s.tolerance, s.verdict, why)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def as_json(scores: list[Score], command: str) -> str:
    """The scores as JSON."""
    return json.dumps({"command": command, "claims": [asdict(s) for s in scores]}, indent=1)


def within(ours: Value, published: float, plus: float, minus: float) -> bool | None:
    """Whether they agree within both errors in quadrature; None where ours cannot be stated."""
    if not math.isfinite(ours.value):
        return None
    difference = ours.value - published
    return abs(difference) <= math.hypot(plus if difference > 0 else minus, ours.sigma)


def ratio_of(a: Value, b: Value) -> Value:
    """a / b with both relative errors in quadrature."""
    value = a.value / b.value
    return Value(value, abs(value) * math.hypot(a.sigma / a.value, b.sigma / b.value))
