"""What the errors of a case came to, on a page and in one sentence: the parts of each error, the ladder of
resolutions, the runs behind them (``pipeline.sweeps.error_study``)."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from crater.measures.chain import PARTS
from crater.results import column_labels
from matter.files import archive
from matter.wording import page, readable
from matter.wording.crater_measures import BY_NAME, UNITS
from pipeline.case import stages
from pipeline.settings import expected
from pipeline.store import provenance
from pipeline.sweeps.sweep import Sweep
from pipeline.sweeps.sweep_run import outcome_of
from pipeline.uncertainty.chain_error import REFERENCE, RUNGS, Row

SHOWN = ("diameter_apparent_m", "depth_m")
"""Measures of the sentence."""
READING = "reading of one run"
_NAMES = {"transient": "transient crater", "transient_at_maximum_depth": "transient crater where it is deepest"}


def sentence(sweep: Sweep, rows: Sequence[Row]) -> str:
    """The errors of the last crater in one sentence for a paper."""
    crater = _last(rows)
    mine = [row for row in rows if row.crater == crater and row.measure in SHOWN]
    numbers = " and ".join(f"the {BY_NAME[row.measure].noun} is {_whole(row)}" for row in mine)
    parts = "; ".join(
        f"{BY_NAME[row.measure].noun}: "
        + ", ".join(
            f"{words} {_error(row, error)}"
            for words, error in [(READING, row.measuring)]
            + [(PARTS[part], error) for part, error in row.parts.items()]
        )
        for row in mine
    )
    made = provenance.commit().get("commit", "")[:8]
    code = f"bolide {provenance.version()}{f', commit {made}' if made else ''}"
    count = len(sweep.members)
    return readable.terminal(
        f"In the {_title(sweep, crater)} of {count} runs with {code} {numbers} (one standard deviation, mean over "
        f"{len(mine[0].values) if mine else 0} draws; parts in quadrature, {parts})."
    )


def page_of(sweep: Sweep, rows: Sequence[Row], failed: Mapping[str, int], run: Path) -> str:
    """The page. ``failed``: exit codes of members that failed just now; ``run``: the run folder of the reference with
    its errors."""
    crater = _last(rows)
    named = {row.measure: row for row in rows if row.crater == crater}
    head = [f"{symbol} {_whole(named[name])}" for name, symbol in zip(SHOWN, ("D =", "depth")) if name in named]
    outcomes = {member.name: outcome_of(sweep, member, failed) for member in sweep.members}
    done = sum(state.word == "done" for state in outcomes.values())
    craters = [one for one in reversed(expected.CRATERS) if any(row.crater == one for row in rows)]
    return page.render(
        "pipeline/sweeps/templates/errors.html.j2",
        headline=", ".join([*head, f"{done} of {len(outcomes)} runs"]),
        title=f"Errors of {sweep.requests[REFERENCE].case.title}", sentence=sentence(sweep, rows),
        run=os.path.relpath(run, sweep.folder), parts=list(PARTS.values()), reading=READING,
        craters=[
            (
                _title(sweep, one),
                [_parts(row) for row in rows if row.crater == one],
                [_ladder(sweep, row) for row in rows if row.crater == one and row.ladder is not None],
            )
            for one in craters
        ],
        members=[
            [member.name, ", ".join(f"{key} = {value}" for key, value in member.values.items()) or "the case as it is",
             outcomes[member.name].word, *_of_member(sweep, member.name, crater)]
            for member in sweep.members
        ],
        failed=[[name, state.reason] for name, state in outcomes.items() if state.word == "failed"],
    )  # fmt: skip


def _last(rows: Sequence[Row]) -> str:
    """The last crater that has rows."""
    return next((one for one in reversed(expected.CRATERS) if any(row.crater == one for row in rows)), "transient")


def _title(sweep: Sweep, crater: str) -> str:
    """What a crater is called: final only where the reference has come to rest."""
    if crater in _NAMES:
        return _NAMES[crater]
    measures = archive.read_json(stages.folder(sweep.requests[REFERENCE].run_folder, "crater") / "measures.json")
    title = column_labels.final(measures["final"]).title
    return "final crater" if title == "final" else f"crater in the {title}"


def _whole(row: Row) -> str:
    """Mean over the draws with the whole error of one run: reading and chain."""
    return readable.measured(row.mean, math.hypot(row.measuring, row.chain), UNITS[row.measure])


def _error(row: Row, error: float) -> str:
    factor, unit = readable.scale(row.mean, UNITS[row.measure])
    return f"{readable.number(error * factor, 2)} {unit}".strip()


def _parts(row: Row) -> list[str]:
    parts = row.parts
    return [
        BY_NAME[row.measure].words, _whole(row), _error(row, row.measuring),
        *(_error(row, parts[part]) if part in parts else "–" for part in PARTS),
    ]  # fmt: skip


def _ladder(sweep: Sweep, row: Row) -> list[str]:
    """The measure at each rung, the order, the value at a vanishing spacing."""
    unit = UNITS[row.measure]
    rungs = [
        expected.values(sweep.requests[name].run_folder).get(row.crater, {}).get(row.measure, {}).get("value")
        if name in sweep.requests
        else None
        for name in (REFERENCE, *RUNGS)
    ]
    found = row.ladder
    assert found is not None
    return [
        BY_NAME[row.measure].words,
        *("–" if value is None else readable.amount(value, unit, 3) for value in rungs),
        "none beyond the scatter" if found.order is None else f"{found.order:.2g}",
        "–"
        if found.extrapolated is None
        else readable.measured(found.extrapolated, math.hypot(found.size, row.draws or 0.0), unit),
    ]


def _of_member(sweep: Sweep, name: str, crater: str) -> list[str]:
    measures = expected.values(sweep.requests[name].run_folder).get(crater, {})
    cells = [(measures.get(key) or {}).get("value") for key in SHOWN]
    return ["–" if value is None else readable.amount(value, "m", 4) for value in cells]
