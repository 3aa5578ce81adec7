"""The section on the body as a whole on a crater's page, and the same as lines of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from crater.bodies import body_plot, body_view
from crater.bodies.body_comparison import Pair
from crater.bodies.body_findings import BodyStage
from matter.wording import page, readable
from matter.wording.body_measures import BY_NAME, PAIRS, SINGLES, TABLE

STAGES = {"sph": "shock stage", "dem": "grains"}
WORDS = {
    "crater": "a crater",
    "not resolved": "a hollow that is not resolved",
    "reshaped": "a body of another shape",
    "no hollow": "no hollow, and no other shape",
}


HEADED = {"axis_ratio_a_over_c": "a / c", "height_change_rms_m": "RMS change of height", "beta_normal": "beta"}
"""Measures in the headline of a body, with short names."""


def headline(body: BodyStage) -> str:
    """The main numbers of a body that shows no crater: those that are known."""
    cells = {words: _cells(name, body)[:2] for name, words in HEADED.items()}
    return ", ".join(f"{words} {' → '.join(cell)}" for words, cell in cells.items() if not cell[-1].startswith("("))


def section(stages: Sequence[BodyStage], out: Path) -> str:
    """What became of the body; empty on other ground."""
    if not stages:
        return ""
    last = stages[-1]
    after, when, compared = STAGES[last.stage], readable.clock(last.time), last.compared
    beta = (readable.number(float(value), 3) for value in compared.moved.vector @ compared.shape.placed.turn)
    return page.render(
        "crater/bodies/templates/body_report.html.j2", "section",
        after=after, when=when, kind=WORDS[last.kind], reason=last.reason,
        labels=[(STAGES[stage.stage], readable.clock(stage.time)) for stage in stages],
        pairs=[[BY_NAME[name].words, *_cells(name, last)] for name in PAIRS],
        singles=[[BY_NAME[name].words, *(_cells(name, stage)[0] for stage in stages)] for name in SINGLES],
        noise=readable.number(compared.chart.noise, 2), beta=", ".join(beta),
        view=body_view.of_stage(last, f"The body after {after} ({when})"),
        heights=out / body_plot.HEIGHTS, outlines=out / body_plot.OUTLINES, resurfaced=out / body_plot.RESURFACED,
    )  # fmt: skip


def _cells(name: str, stage: BodyStage) -> list[str]:
    """A measure as text: its value, or those before, after and their difference; the reason where there is none."""
    entry = stage.measures[name]
    return [
        f"({part.reason})" if part.value is None else readable.measured(part.value, part.sigma, part.unit)
        for part in (entry if isinstance(entry, Pair) else [entry])
    ]


def body_lines(body: Mapping[str, Any]) -> list[str]:
    """The same of ``measures.json`` for the terminal."""
    entry = body.get(body.get("final", ""))
    if not entry:
        return []
    found = [f"the body: {WORDS.get(entry['class'], entry['class'])} ({entry['class_reason']})"]
    for row in TABLE:
        cell = entry["measures"].get(row.name, {})
        shown = [cell.get("before"), cell.get("after")] if row.pair else [cell]
        if row.terminal and shown[-1] and shown[-1].get("value") is not None:
            values = [
                readable.measured(part["value"], part["sigma"], row.unit)
                for part in shown
                if part and part.get("value") is not None
            ]
            found.append(f"  {row.words}: {' -> '.join(values)}")
    return [readable.terminal(line) for line in found]
