"""The report of a handoff: the ledger as a table, and what it looks like, drawn from the files of the run alone."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import numpy as np

from handoff import direct
from handoff import ledger as ledgers
from matter import archive, snapshot
from matter.errors import InputError

_PICTURES = (
    ("cut.png", "The impact plane (y = 0): source before, grains after, and the surface that carved them"),
    ("velocity.png", "Velocity on the impact plane before and after, and their difference"),
    ("residuals.png", "What was lost where: raw momentum by octant and shell, direction errors, M(&gt;v)"),
    ("forces.png", "Forces in the contacts of the bed as it starts, on the impact plane, and how they are spread"),
    ("time.png", "Choice of the time: cavity, residual pressure, drive and energy against time"),
)
_COLOUR = {"pass": "#2a7d3f", "fail": "#c0262d", "waived": "#b26b00", "not_measured": "#777", "not_applicable": "#777"}


def print_ledger(run: Path, pictures: bool = True) -> int:
    """Print the ledger of a run folder and write its report; returns the exit code: 1 when an unwaived limit fails, else 0.

    Raises ``InputError`` when the run has no handoff.
    """
    out = Path(run) / "4_handoff"
    book = ledgers.read(out / "ledger.json")
    print(text(book))
    if (record := archive.read_json(out / "handoff.json")).get("methods"):
        print("\n" + direct.as_text(record["methods"]))
    write(Path(run), out, pictures)
    print(f"\nreport: {out / 'report.html'}")
    if book.failures:
        print(f"beyond the limit: {', '.join(book.failures)}")
    return 1 if book.failures else 0


def text(book: ledgers.Ledger) -> str:
    """The ledger as a table for a terminal."""
    lines = [f"{'row':<42}{'value':>13}{'limit':>10}  verdict         note"]
    for row in book.rows:
        lines.append(f"{row['name']:<42}{_shown(row['value']):>13}{_shown(row['limit']):>10}  {row['verdict']:<15} {row['note']}".rstrip())
    return "\n".join(lines)


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    return value if isinstance(value, str) and len(value) < 13 else ("..." if isinstance(value, str) else f"{value:.4g}")


def write(run: Path, out: Path, pictures: bool = True) -> None:
    """Write ``report.html`` (and the pictures) beside the other files of the handoff in ``out``; ``run`` holds the earlier stages."""
    book = ledgers.read(out / "ledger.json")
    record = archive.read_json(out / "handoff.json")
    if pictures:
        from handoff import pictures as drawn

        drawn.draw(gather(run, out, record), out)
    further = archive.read_json(out / "sensitivity.json") if (out / "sensitivity.json").is_file() else None
    archive.write_text(out / "report.html", page(book, record, [entry for entry in _PICTURES if (out / entry[0]).is_file()], further))


def gather(run: Path, out: Path, record: dict) -> dict[str, Any]:
    """Everything the pictures need, from the files: source, bed, start, surface, residual arrays, record. Raises ``InputError``."""
    import trimesh

    from handoff import handoff_time

    paths = handoff_time.files(run / "2_sph")
    times = [float(snapshot.attributes(path).get("time", 0.0)) for path in paths]
    source = snapshot.read(paths[int(np.argmin(np.abs(np.array(times) - record["time_s"])))])
    for name in ("residuals.h5", "surface.ply"):
        if not (out / name).is_file():
            raise InputError(f"no {name} in {out}: run the handoff again")
    return {
        "source": source,
        "bed": snapshot.read(run / "3_bed" / f"bed{snapshot.SUFFIX}"),
        "start": snapshot.read(out / f"start{snapshot.SUFFIX}"),
        "surface": trimesh.load(out / "surface.ply", process=False),
        "residuals": archive.read(out / "residuals.h5")[0],
        "record": record,
    }


def page(book: ledgers.Ledger, record: dict, pictures: list[tuple[str, str]], further: dict | None = None) -> str:
    """The report as HTML; ``further`` is what the sensitivity runs came to."""
    rows = "\n".join(
        f"<tr><td>{html.escape(row['name'])}</td><td class=n>{html.escape(str(row['value']) if isinstance(row['value'], str) else _shown(row['value']))}"
        f"</td><td class=n>{_shown(row['limit'])}</td><td>{html.escape(row['unit'])}</td>"
        f"<td style='color:{_COLOUR[row['verdict']]}'><b>{row['verdict']}</b></td><td>{html.escape(row['note'])}</td></tr>"
        for row in book.rows
    )
    images = "\n".join(f"<figure><img src='{file}'><figcaption>{caption}</figcaption></figure>" for file, caption in pictures)
    cavity, grains = record["cavity"], record["grains"]
    choice = record["choice"]["reason"]
    verdict = f"beyond the limit: {', '.join(book.failures)}" if book.failures else "every unwaived limit holds"
    return f"""<!doctype html><html lang=en><meta charset=utf-8><title>Handoff</title>
<style>body{{font:15px/1.45 system-ui,sans-serif;max-width:1150px;margin:2em auto;padding:0 1em}}table{{border-collapse:collapse;font-size:13px}}
td,th{{border-bottom:1px solid #ddd;padding:3px 8px;text-align:left;vertical-align:top}}.n{{text-align:right;font-variant-numeric:tabular-nums}}
img{{max-width:100%}}figure{{margin:1.5em 0}}figcaption{{color:#555}}</style>
<h1>From shock physics to grains</h1>
<p><b>{html.escape(verdict)}.</b> Handed over {record["time_s"]:.6g} s after the impact: {html.escape(choice)}.</p>
<p>Cavity at that time: radius {cavity["radius_m"]:.4g} m, depth {cavity["depth_m"]:.4g} m, volume {cavity["volume_m3"]:.4g} m&sup3;, rim
{cavity["rim_height_m"]:.4g} m above the datum. {grains["kept"]} of {grains["bed"]} grains stay, {grains["ejecta"]} ejecta are added.
Speed limit {record["speed_limit_m_s"]:.4g} m/s, alpha {record["alpha_spacings"]:g} spacings, surface {record["offset_spacings"]:.3f} spacings outside its
particles, mapping {record["mapping"]}.</p>
{images}
<h2>Ledger</h2>
<p>Raw rows count before the one global correction; momenta are those of the bed's domain and all ejecta. Pressure, overlaps and elastic energy
are the excess over the undisturbed state at the same depth.</p>
<table><tr><th>row<th>value<th>limit<th>unit<th>verdict<th>note</tr>
{rows}
</table>
{_methods(record)}{_further(further)}</html>
"""


def _further(found: dict | None) -> str:
    """The sensitivity runs as a table; empty where there are none."""
    if not found:
        return ""
    names = {"diameter_rim_m": "D rim [m]", "diameter_apparent_m": "D apparent [m]", "depth_m": "depth [m]", "dem_depth_most_m": "deepest [m]"}
    head = "".join(f"<th>{name}<th>change" for name in names.values())
    rows = []
    for variant, row in found["rows"].items():
        cells = "".join(f"<td class=n>{_shown(row[key])}</td><td class=n>{_change(row[f'{key}_change'])}</td>" for key in names)
        rows.append(
            f"<tr><td>{html.escape(variant)}</td><td class=n>{_shown(row['time_s'])}</td><td class=n>{_shown(row['speed_limit_m_s'])}</td>"
            f"<td class=n>{_shown(row['alpha_spacings'])}</td>{cells}<td class=n>{_shown(row['profile_rms_m'])}</td></tr>"
        )
    controls = "".join(
        f"<li>{html.escape(name)}: {row['grains']} grains from {row['from_s']:.4g} to {row['to_s']:.4g} s, largest way {row['drift_most_over_r']:.3g} r; "
        f"{row['deep_grains']} of them deep, largest way {_shown(row['deep_drift_most_over_r'])} r; energy above its start by {row['energy_rise_J']:.3g} J</li>"
        for name, row in found["controls"].items()
    )
    return f"""<h2>Sensitivity of the final crater</h2>
<table><tr><th>variant<th>time [s]<th>speed limit [m/s]<th>alpha{head}<th>RMS of profiles [m]</tr>
{"".join(rows)}
</table><ul>{controls}</ul>
"""


def _change(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:+.1f} %"


def _methods(record: dict) -> str:
    """Mapped against direct as a table; empty where it was not measured."""
    table = record.get("methods")
    if not table:
        return ""
    rows = "\n".join(
        f"<tr><td>{html.escape(label)}</td><td class=n>{_shown(table['mapped'][key])}</td><td class=n>{_shown(table['direct'][key])}</td></tr>"
        for key, label in direct.LABELS.items()
    )
    return f"""<h2>Mapped against direct</h2>
<p>The run goes on with the <b>{record["method"]}</b> grains. Direct: every SPH particle one grain. Excess counts beyond what the undisturbed
body would carry. The prediction is grains over step over {direct.GRAIN_STEPS_PER_S:.1e} grain steps per second of one core.</p>
<table><tr><th><th>mapped<th>direct</tr>
{rows}
</table>
"""
