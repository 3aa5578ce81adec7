"""The report of a handoff: the ledger as a table, and what it looks like, drawn from the files of the run alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from handoff import ledger as ledgers
from handoff.ledger_rows.headline import headline
from handoff.transfer import direct
from matter.errors import InputError
from matter.files import archive, snapshot
from matter.wording import drawing, page, readable
from matter.wording.crater_measures import BY_NAME, RATIOS, UNITS

SERIES = Path("6_crater") / "time_series.csv"
_PICTURES = (
    ("cut.png", "The impact plane (y = 0): the source before, the grains after, and the surface that carved them."),
    ("velocity.png", "Velocity on the impact plane before and after the handoff, and the difference."),
    (
        "residuals.png",
        "What was lost where: momentum by octant and shell (before the correction), errors of direction, mass faster "
        "than v.",
    ),
    ("forces.png", "Contact forces of the grains as they start, on the impact plane, and their distribution."),
    ("time.png", "Choice of the time: cavity, residual pressure, acceleration and energy against time."),
)


def print_ledger(run: Path) -> int:
    """Print the ledger of a run folder; returns the exit code: 1 when an unwaived limit fails, else 0.

    Raises ``InputError`` when the run has no handoff.
    """
    out = Path(run) / "4_handoff"
    book = ledgers.read(out / "ledger.json")
    sentences = [
        readable.terminal(sentence.replace("RUN", str(run))) for sentence in headline(book, Path(run) / SERIES)
    ]
    print("\n".join(sentences) + "\n")
    print(text(book).replace("inspect_handoff RUN", f"inspect_handoff {run}"))
    if (record := archive.read_json(out / "handoff.json")).get("methods"):
        print("\n" + direct.as_text(record["methods"]))
    if book.failures:
        print(f"beyond the limit: {', '.join(book.failures)}")
    return 1 if book.failures else 0


def text(book: ledgers.Ledger) -> str:
    """The ledger as two tables for a terminal: what has a limit, and what was handed over."""
    lines = [f"{'criterion':<42}{'value':>13}{'limit':>10}  verdict         note"]
    for row in book.criteria:
        lines.append(
            f"{row['name']:<42}{_shown(row['value']):>13}{_shown(row['limit']):>10}  {row['verdict']:<15} "
            f"{row['note']}".rstrip()
        )
    if book.quantities:
        lines += ["", f"{'quantity':<42}{'value':>13}  {'unit':<9} note"]
    for row in book.quantities:
        words = row["note"] if not isinstance(row["value"], str) else f"{row['value']}; {row['note']}"
        lines.append(
            f"{row['name']:<42}{_shown(row['value']) if not isinstance(row['value'], str) else '':>13}  "
            f"{row['unit']:<9} {words}".rstrip()
        )
    return "\n".join(lines)


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    return (
        value if isinstance(value, str) and len(value) < 13 else ("..." if isinstance(value, str) else f"{value:.4g}")
    )


def write(run: Path, out: Path, pictures: bool = True) -> None:
    """Write ``report.html`` (and the pictures) beside the other files of the handoff in ``out``; ``run`` holds the
    earlier stages."""
    book = ledgers.read(out / "ledger.json")
    record = archive.read_json(out / "handoff.json")
    if pictures and drawing.possible("the handoff"):
        from handoff.pages import pictures as drawn

        drawn.draw_pictures(gather(run, out, record), out)
    further = archive.read_json(out / "sensitivity.json") if (out / "sensitivity.json").is_file() else None
    archive.write_text(out / "report.html", whole_page(run, book, record, out, further))


def gather(run: Path, out: Path, record: dict) -> dict[str, Any]:
    """Everything the pictures need, from the files and along the axes of the bed: source, bed and its region, start,
    surface, residual arrays, record. Raises ``InputError``."""
    import trimesh

    from handoff.domains import domain, turning, whole_body
    from handoff.source import flattening, handoff_time

    taken = out / flattening.FILE
    if not taken.is_file():
        paths = handoff_time.files(run / "2_sph")
        times = [float(snapshot.attributes(path).get("time", 0.0)) for path in paths]
        taken = paths[int(np.argmin(np.abs(np.array(times) - record["time_s"])))]
    source = snapshot.read(taken)
    for name in ("residuals.h5", "surface.ply"):
        if not (out / name).is_file():
            raise InputError(f"no {name} in {out}: run the handoff again")
    bed = snapshot.read(run / "3_bed" / f"bed{snapshot.SUFFIX}")
    solid = bed.attributes.get("frame") == "solid"
    surface = out / whole_body.SURFACE_FILE
    region = whole_body.of_file(bed.attributes, surface) if solid else domain.read(bed.attributes)
    return {
        "source": turning.to_bed(source, region),
        "bed": bed,
        "region": region,
        "start": turning.to_bed(snapshot.read(out / f"start{snapshot.SUFFIX}"), region),
        "surface": trimesh.load(out / "surface.ply", process=False),
        "residuals": archive.read(out / "residuals.h5")[0],
        "record": record,
    }


def whole_page(run: Path, book: ledgers.Ledger, record: dict, folder: Path, further: dict | None = None) -> str:
    """The report of a ``run`` as HTML, headed by the worst row, with the pictures of ``folder``; ``further`` is what
    the sensitivity runs came to."""
    first, *others = headline(book, run / SERIES)
    return page.render(
        "handoff/pages/templates/handoff_report.html.j2",
        headline=first, further=others, title=page.heading(run, "Handoff: from shock physics to grains"),
        pictures=[(folder / name, caption) for name, caption in _PICTURES], without_pictures=drawing.note(),
        record=record, ledger=page.ledger(book.rows), methods=_methods(record),
        grain_steps=readable.number(direct.GRAIN_STEPS_PER_S), sensitivity=_sensitivity(further) if further else {},
    )  # fmt: skip


def _sensitivity(comparison: dict) -> dict[str, Any]:
    """The sensitivity runs: head and rows of their table, and how far the bed of the controls drifted."""
    names = {
        **{name: BY_NAME[name].noun for name in RATIOS if UNITS[name] == "m"},
        "dem_depth_most_m": "largest depth",
    }
    changes = [word for name in names.values() for word in (name, "change")]
    head = ["variant", "handed over at", "speed limit", "alpha [spacings]", *changes, "rms of profiles"]
    rows = []
    for variant, row in comparison["rows"].items():
        cells = [text for key in names for text in (_amount(row[key], "m"), _change(row[f"{key}_change"]))]
        first = [_amount(row["time_s"], "s"), _amount(row["speed_limit_m_s"], "m/s"), _amount(row["alpha_spacings"])]
        rows.append([variant.replace("_", " "), *first, *cells, _amount(row["profile_rms_m"], "m")])
    controls = [
        f"{name}: {readable.number(row['grains'])} grains from {readable.clock(row['from_s'])} to "
        f"{readable.clock(row['to_s'])}, largest drift {row['drift_most_over_r']:.3g} radii; "
        f"{readable.number(row['deep_grains'])} of them deep, largest drift {_amount(row['deep_drift_most_over_r'])} "
        f"radii; energy above that at the start by {_amount(row['energy_rise_J'], 'J')}"
        for name, row in comparison["controls"].items()
    ]
    return {"head": head, "rows": rows, "controls": controls}


def _amount(value: Any, unit: str = "1") -> str:
    return "–" if value is None else value if isinstance(value, str) else readable.amount(float(value), unit, 3)


def _change(value: float | None) -> str:
    return "–" if value is None else f"{100.0 * value:+.1f} %".replace("-", "−")


def _methods(record: dict) -> list[list[str]]:
    """Mapped against direct as rows; none where it was not measured."""
    table = record.get("methods") or {}
    return [
        [label, _amount(table["mapped"][key]), _amount(table["direct"][key])]
        for key, label in direct.LABELS.items()
        if table
    ]
