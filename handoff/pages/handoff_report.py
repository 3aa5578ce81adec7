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
    from handoff.source import handoff_time, laying

    taken = out / laying.FILE
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
    """The report of a ``run`` as HTML, with the pictures of ``folder``; ``further`` is what the sensitivity runs came
    to."""
    parts = [
        _first_lines(headline(book, run / SERIES), record),
        drawing.note(),
        *(page.picture(folder / name, caption) for name, caption in _PICTURES),
        "<h2>Ledger</h2>",
        "<p>Raw rows count before the one global correction; momenta are those of the bed's domain and all ejecta. "
        "Pressure, overlaps and elastic "
        "energy are the excess over the undisturbed state at the same depth.</p>",
        page.ledger(book.rows),
        _methods(record),
        _further(further),
    ]
    return page.document(page.heading(run, "Handoff: from shock physics to grains"), parts)


def _first_lines(sentences: list[str], record: dict) -> str:
    """The worst row and the sensitivity, the time and why it was taken, and what was handed over."""
    first, *others = sentences
    cavity, grains = record["cavity"], record["grains"]
    return (
        f"<p><b>{page.escape(first)}</b> <br>{'<br>'.join(page.escape(other) for other in others)}</p>"
        f"<p>Handoff at {readable.clock(record['time_s'])} after the impact: "
        f"{page.escape(record['choice']['reason'])}.</p>"
        f"<p>Cavity at that time: radius {readable.amount(cavity['radius_m'], 'm', 3)}, depth "
        f"{readable.amount(cavity['depth_m'], 'm', 3)}, volume "
        f"{readable.amount(cavity['volume_m3'], 'm^3', 3)}, rim {readable.amount(cavity['rim_height_m'], 'm', 3)} "
        f"above the datum. "
        f"{readable.number(grains['kept'])} of {readable.number(grains['bed'])} grains stay, "
        f"{readable.number(grains['ejecta'])} are added as ejecta. "
        f"Speed limit {readable.amount(record['speed_limit_m_s'], 'm/s', 3)}, alpha {record['alpha_spacings']:g} "
        f"spacings, surface "
        f"{record['offset_spacings']:.3f} spacings outside its particles, mapping "
        f"{page.escape(record['mapping'])}.</p>"
    )


def _further(comparison: dict | None) -> str:
    """The sensitivity runs as a table; empty where there are none."""
    if not comparison:
        return ""
    names = {
        **{name: BY_NAME[name].noun for name in RATIOS if UNITS[name] == "m"},
        "dem_depth_most_m": "largest depth",
    }
    head = [
        "variant",
        "handed over at",
        "speed limit",
        "alpha [spacings]",
        *(word for name in names.values() for word in (name, "change")),
        "rms of profiles",
    ]
    rows = []
    for variant, row in comparison["rows"].items():
        cells = [text for key in names for text in (_amount(row[key], "m"), _change(row[f"{key}_change"]))]
        first = [_amount(row["time_s"], "s"), _amount(row["speed_limit_m_s"], "m/s"), _amount(row["alpha_spacings"])]
        rows.append([page.escape(variant.replace("_", " ")), *first, *cells, _amount(row["profile_rms_m"], "m")])
    controls = "".join(
        f"<li>{page.escape(name)}: {readable.number(row['grains'])} grains from {readable.clock(row['from_s'])} to "
        f"{readable.clock(row['to_s'])}, largest "
        f"drift {row['drift_most_over_r']:.3g} radii; {readable.number(row['deep_grains'])} of them deep, largest "
        f"drift "
        f"{_amount(row['deep_drift_most_over_r'])} radii; energy above that at the start by "
        f"{_amount(row['energy_rise_J'], 'J')}</li>"
        for name, row in comparison["controls"].items()
    )
    return f"<h2>Sensitivity of the final crater</h2>{page.table(head, rows)}<ul>{controls}</ul>"


def _amount(value: Any, unit: str = "1") -> str:
    return (
        "–"
        if value is None
        else page.escape(value if isinstance(value, str) else readable.amount(float(value), unit, 3))
    )


def _change(value: float | None) -> str:
    return "–" if value is None else f"{100.0 * value:+.1f} %".replace("-", "−")


def _methods(record: dict) -> str:
    """Mapped against direct as a table; empty where it was not measured."""
    table = record.get("methods")
    if not table:
        return ""
    rows = [
        [page.escape(label), _amount(table["mapped"][key]), _amount(table["direct"][key])]
        for key, label in direct.LABELS.items()
    ]
    return f"""<h2>Mapped against direct</h2>
<p>The run continues with the <b>{page.escape(record["method"])}</b> grains. Direct: every SPH particle becomes one
grain. Excess is counted beyond what the undisturbed body would carry. The prediction is the number of
grains times the number of steps over {readable.number(direct.GRAIN_STEPS_PER_S)} grain steps
per second on one core.</p>
{page.table(["", "mapped", "direct"], rows)}"""
