"""The first words on a handoff: the worst row that counts, how far the final crater depends on the time of the
handoff, and what has not been measured."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

from handoff.ledger import SENSITIVITY, Ledger
from matter.wording import ledger_words, readable
from matter.wording.crater_measures import BY_NAME, MAXIMA, UNITS

_DEPTH = "final_d_change_on_t_handoff_x2"
COMMAND = "inspect_handoff RUN --sensitivity"


def headline(book: Ledger, series: Path | None = None) -> list[str]:
    """Plain sentences, the most telling first; ``series`` is the crater stage's ``time_series.csv``, which measures
    both stages in one way."""
    measured = _both_measured(series) if series is not None and series.is_file() else ""
    return [sentence for sentence in (_worst(book), measured, _sensitivity(book), _rest(book)) if sentence]


def _both_measured(series: Path) -> str:
    """The crater at the handoff as the crater stage finds it in the shock stage's particles and in the grains; empty
    where it has not both."""
    with open(series, newline="") as file:
        rows = list(csv.DictReader(file))
    grains = next((row for row in rows if row["stage"] == "dem"), None)
    if grains is None:
        return ""
    same = [
        row
        for row in rows
        if row["stage"] == "sph"
        and abs(float(row["time_s"]) - float(grains["time_s"])) < 1e-6 * max(1.0, float(grains["time_s"]))
    ]
    parts = [_pair(same[0], grains, name, BY_NAME[name].noun, UNITS[name]) for name in MAXIMA.values()] if same else []
    return (
        f"Measured in one way at the handoff, shock stage and grains: {'; '.join(part for part in parts if part)}."
        if any(parts)
        else ""
    )


def _pair(one: dict[str, str], other: dict[str, str], name: str, word: str, unit: str) -> str:
    """Both values with their errors, the change, and that over the errors in quadrature."""
    try:
        a, b, sa, sb = (float(row[key]) for key in (name, f"{name}_sigma") for row in (one, other))
    except (KeyError, ValueError):
        return ""
    sigma = math.hypot(sa, sb)
    if not a or not sigma > 0.0:
        return ""
    shown = f"{word} {readable.measured(a, sa, unit)} and {readable.measured(b, sb, unit)}"
    return f"{shown} ({100.0 * (b / a - 1.0):+.1f} %, {abs(b - a) / sigma:.1f} sigma)"


def _worst(book: Ledger) -> str:
    """The row that is furthest beyond its limit, or nearest to it."""
    row = book.worst()
    if row is None:
        return "No row of the ledger has been measured."
    said = f"{ledger_words.words(row['name'])}: {_amount(row)} (limit {readable.amount(row['limit'], row['unit'], 3)})"
    if not book.failures:
        return f"Tightest criterion: {said}."
    others = [ledger_words.words(name) for name in book.failures if name != row["name"]]
    return f"Beyond the limit: {said}" + (f"; and {'; '.join(others)}." if others else ".")


def _amount(row: dict[str, Any]) -> str:
    value = row["value"]
    return readable.amount(float(value), row["unit"], 3) if isinstance(value, (int, float)) else str(value)


def _sensitivity(book: Ledger) -> str:
    """By how much the final crater moves when it is handed over earlier or later, or that nobody has looked."""
    rows = {row["name"]: row for row in book.rows}
    diameter, depth = rows.get(SENSITIVITY), rows.get(_DEPTH)
    if diameter is None or diameter["verdict"] == "not_measured":
        return f"How the final diameter depends on the time of the handoff has not been measured: run {COMMAND}."
    if not isinstance(diameter["value"], (int, float)):
        return f"How the final diameter depends on the time of the handoff could not be measured: {diameter['note']}."
    if diameter["unit"] == "m":
        return (
            f"The final profile moves by {readable.amount(diameter['value'], 'm', 3)} (RMS) when the handoff is half "
            f"or twice as late."
        )
    also = (
        f", the final depth by up to {_percent(depth['value'])}"
        if depth and isinstance(depth["value"], (int, float)) and depth["unit"] == "1"
        else ""
    )
    return (
        f"The final diameter moves by up to {_percent(diameter['value'])}{also} when the handoff is half or twice as "
        f"late ({diameter['note']})."
    )


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.2g} %"


def _rest(book: Ledger) -> str:
    """How the criteria stand, with what is waived and what would need more runs."""
    counts = {
        verdict: sum(row["verdict"] == verdict for row in book.criteria)
        for verdict in ("pass", "fail", "waived", "not_measured", "not_applicable")
    }
    words = ", ".join(
        f"{count} {name}"
        for name, count in zip(("hold", "fail", "waived", "not measured", "not applicable"), counts.values())
        if count
    )
    return f"{len(book.criteria)} criteria: {words}."
