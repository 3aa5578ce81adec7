"""The section on the body as a whole on a crater's page, and the same as lines of text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from crater.bodies import body_plot, body_view
from crater.bodies.body_findings import BodyStage
from crater.bodies.seen import Pair
from crater.measures.uncertainty import Quantity
from matter.wording import page, readable
from matter.wording.body_measures import BY_NAME, PAIRS, SINGLES, TABLE

STAGES = {"sph": "shock stage", "dem": "grains"}
WORDS = {
    "crater": "a crater",
    "not resolved": "a hollow that is not resolved",
    "reshaped": "a body of another shape",
    "no hollow": "no hollow, and no other shape",
}


def section(stages: Sequence[BodyStage], out: Path) -> str:
    """What became of the body; empty on other ground."""
    if not stages:
        return ""
    last = stages[-1]
    labels = [f"{STAGES[stage.stage]}<br>({page.escape(readable.clock(stage.time))})" for stage in stages]
    pairs = [[BY_NAME[name].words, *_three(last.measures[name])] for name in PAIRS]
    singles = [
        [BY_NAME[name].words, *(page.escape(_shown(stage.measures[name])) for stage in stages)] for name in SINGLES
    ]
    noise = readable.number(last.seen.chart.noise, 2)
    turn = last.seen.shape.placed.turn
    beta = ", ".join(readable.number(float(value), 3) for value in last.seen.moved.vector @ turn)
    when = readable.clock(last.time)
    return "".join(
        [
            f"<h2>The body</h2><p>After {page.escape(STAGES[last.stage])}, {page.escape(when)}: "
            f"<b>{page.escape(WORDS[last.kind])}</b> ({page.escape(last.reason)}).</p>",
            page.table(["", "before", "after", "change"], pairs),
            page.table(["", *labels], singles),
            "<p class=note>The body is the largest group of particles that touch. Axes are those of the even "
            "ellipsoid of its inertia; before and after are of the same particles, so that a change is known better "
            f"than either. The ground of the particles departs from the shape that they fill by {noise} spacings. The "
            f"momentum that stays over the projectile's, in the body's own frame (x, y, z): ({beta}).</p>",
            body_view.of_stage(last, f"The body after {STAGES[last.stage]} ({when})"),
            page.picture(
                out / body_plot.HEIGHTS,
                f"Height along the local normal at {when} less that before the impact, in the body's own frame.",
            ),
            page.picture(
                out / body_plot.OUTLINES, "The ground before and after in three planes through the centre of mass."
            ),
            page.picture(
                out / body_plot.RESURFACED,
                "Depth to which the surface is resurfaced: down to the highest particle that neither went nor moved "
                "by more than a spacing.",
            ),
        ]
    )


def _three(entry: Quantity | Pair) -> list[str]:
    assert isinstance(entry, Pair)
    return [page.escape(_shown(cell)) for cell in entry]


def _shown(entry: Quantity | Pair) -> str:
    assert isinstance(entry, Quantity)
    if entry.value is None:
        return f"({entry.reason})"
    return readable.measured(entry.value, entry.sigma, entry.unit)


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
