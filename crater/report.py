"""The page on a crater: one self-contained HTML file, and the same numbers as text."""

from __future__ import annotations

import base64
import html
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from crater import report_evidence, scaling
from crater.measure import Measures, Quantity
from matter import archive, readable

if TYPE_CHECKING:
    from crater.findings import Findings

WORDS = {
    "diameter_rim_m": "rim diameter",
    "diameter_apparent_m": "apparent diameter (at the datum)",
    "depth_m": "depth below the datum",
    "depth_rim_to_floor_m": "depth, crest to floor",
    "rim_height_m": "rim height above the datum",
    "volume_m3": "volume below the datum",
    "depth_over_diameter": "depth / apparent diameter",
    "wall_slope_deg": "steepest wall",
    "ellipticity": "ellipticity (1 - b/a)",
    "floor_diameter_m": "floor diameter",
    "central_peak_m": "central peak over the floor",
    "central_pit_m": "central pit below the ridge around it",
    "terraces": "terraces on the wall",
    "rim_asymmetry": "rim height, first harmonic over its mean",
    "blanket_exponent": "ejecta blanket: exponent of its fall",
    "blanket_height_at_rim_m": "ejecta blanket and uplift at the rim",
}
STYLE = """
body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2em auto;padding:0 1.2em;color:#1c2530}
h1{font-size:1.6em;margin:.2em 0}h2{font-size:1.15em;margin:1.8em 0 .4em;border-bottom:1px solid #ccd4dc}
table{border-collapse:collapse;margin:.6em 0;font-variant-numeric:tabular-nums;max-width:100%}
th,td{padding:.22em .7em;text-align:right;border-bottom:1px solid #e3e8ee;vertical-align:top}th:first-child,td:first-child{text-align:left}
td{white-space:nowrap}td.note,th.note{text-align:left;white-space:normal;overflow-wrap:anywhere;color:#55606c;font-size:.85em;min-width:16em}
td.word,th.word{text-align:left}table.ledger{font-size:.85em}img{max-width:100%;height:auto}img[alt=heightmap],img[alt=ejecta]{max-width:620px}
.pass,.met{color:#1b7f3b}.fail,.unmet{color:#b3261e}.waived{color:#9a6700}.not_measured,.not_applicable{color:#55606c}
figure{margin:1em 0}figcaption,p.note{color:#55606c;font-size:.9em}ul.refs{columns:2;font-size:.85em;padding-left:1.2em}
@media print{@page{size:A4;margin:14mm}body{margin:0;padding:0;max-width:none;font-size:9.5pt}h2{break-after:avoid}figure,tr,li{break-inside:avoid}
table{font-size:8pt}td,th{padding:.15em .4em}img{max-height:230mm}}
"""


def shown(quantity: Quantity | None) -> str:
    """A quantity as text: ``612 +- 14 km``; the reason in brackets where there is no value."""
    if quantity is None:
        return "-"
    if quantity.value is None:
        return f"({quantity.reason})" if quantity.reason else "-"
    scale, unit = _scale(quantity.value, quantity.unit)
    error = f" ± {_digits(quantity.sigma * scale)}" if quantity.sigma is not None else ""
    return f"{_digits(quantity.value * scale, 4)}{error} {unit}".strip()


def _digits(value: float, count: int = 2) -> str:
    return f"{value:.{count}g}" if abs(value) < 10**count else f"{value:.0f}"


def _scale(value: float, unit: str) -> tuple[float, str]:
    if unit == "m" and abs(value) >= 1e3:
        return 1e-3, "km"
    if unit == "m^3" and abs(value) >= 1e14:
        return 1e-15, "10⁶ km³"
    if unit == "m^3" and abs(value) >= 1e8:
        return 1e-9, "km³"
    if unit == "m^3":
        return 1.0, "m³"
    if unit == "s" and abs(value) >= 120.0:
        return 1.0 / 60.0, "min"
    return 1.0, "" if unit == "1" else ("°" if unit == "deg" else unit)


def _plain(text: str) -> str:
    for sign, words in (("±", "+-"), ("10⁶", "1e6"), ("³", "3"), ("°", "deg")):
        text = text.replace(sign, words)
    return text


def as_text(measures: Measures) -> str:
    """The measures as lines of text."""
    datum = measures.datum
    lines = [f"datum: {datum.kind}" + (f" of radius {datum.radius / 1e3:.6g} km" if datum.is_sphere else "") + f" ({datum.source})"]
    for name, word in WORDS.items():
        if name in measures.quantities:
            lines.append(f"  {word:<34} {_plain(shown(measures[name]))}")
    return "\n".join(lines)


def write(found: Findings, out: Path) -> None:
    """Write ``report.html``: everything inlined, readable on screen and on paper."""
    parts = [
        f"<h1>Crater: {html.escape(_title(found))}</h1>",
        _summary(found),
        _picture(out / "profile.png", "Profiles: mean of each ring; shaded: 16th to 84th percentile of single columns over azimuth."),
        "<h2>Measures</h2>",
        _measures_table(found),
        "<h2>Published numbers</h2>",
        _published_table(found),
        _scaling_table(found),
        "<h2>In time</h2>",
        _picture(
            out / "time_series.png",
            "Errors: azimuth, resolution, method and datum in quadrature. Once the collapse has begun the diameter is that of a wide trough.",
        ),
        "<h2>Cross-sections through the impact plane</h2>",
        _picture(out / "cross_section.png", "Particles within half a spacing of the plane y = 0, by material."),
        _picture(
            out / "sections_in_time.png",
            "The shock stage in time: by material, damage, pressure (tension in the lowest colour) and the depth that matter came from.",
        ),
        _picture(out / "sections_grains.png", "The grains in time: by material, depth of origin (grey: came as ejecta) and speed."),
        "<h2>Height map</h2>",
        _picture(out / "heightmap.png", "Final surface, seen from above. Dashed: apparent diameter."),
        _ejecta(found, out),
        *report_evidence.all_parts(found.inputs),
    ]
    page = f"<!doctype html><html lang=en><head><meta charset=utf-8><title>{html.escape(_title(found))}</title><style>{STYLE}</style></head><body>"
    archive.write_text(out / "report.html", page + "\n".join(part for part in parts if part) + "</body></html>\n")


def _ejecta(found: Findings, out: Path) -> str:
    if not (out / "ejecta.png").is_file():
        return ""
    when = f"{readable.clock(found.ejecta['time_s'])}"
    words = f"Target mass above the datum, not part of the ground and rising, faster than v, at {when}; the laws are for vertical impacts into half-spaces."
    where = "Speed and angle at the level of the ground against the place of launch (medians); dotted: the apparent radius."
    return "<h2>Ejecta</h2>" + _picture(out / "ejecta.png", words) + (_picture(out / "launch.png", where) if found.launch else "")


def _title(found: Findings) -> str:
    impact = found.settings.impact
    return (
        f"{impact.projectile.material} projectile of radius {readable.length(impact.projectile.radius)}, {impact.speed / 1e3:.5g} km/s, "
        f"{np.degrees(impact.angle_from_vertical):.3g}° from vertical"
    )


def _summary(found: Findings) -> str:
    lines = []
    for key in ("depth", "volume"):
        moment = found.transient.get(key)
        if moment is not None and moment.measures is not None:
            m = moment.measures
            lines.append(
                f"First maximum of {key} at {readable.clock(moment.time)}: apparent diameter {shown(m['diameter_apparent_m'])}, depth {shown(m['depth_m'])}."
            )
    if found.growing:
        lines.append(f"Still growing in the last snapshot: {', '.join(found.growing)}.")
    if found.final is not None:
        lines.append(
            f"Final crater ({html.escape(found.final_from)}): depth {shown(found.final['depth_m'])}, "
            f"apparent diameter {shown(found.final['diameter_apparent_m'])}."
        )
    if found.leaving:
        lost = found.leaving
        lines.append(
            f"Leaves the body (all-SPH, at the end): {lost['target_mass_kg']:.3g} kg of the target and {lost['projectile_mass_kg']:.3g} kg of the projectile; "
            f"momentum that stays, over the projectile's: {lost['beta']:.3f}."
        )
    if found.late_difference:
        d = found.late_difference
        lines.append(
            f"The two late stages differ by {readable.length(d['rms_m'])} RMS ({d['rms_over_depth']:.3f} of the transient depth); "
            "method and rheology both differ."
        )
    lines += [f"{html.escape(key)}: {html.escape(reason)}." for key, reason in found.reasons.items()]
    return "<p>" + "<br>".join(lines) + "</p>"


def _picture(path: Path, caption: str) -> str:
    if not path.is_file():
        return ""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<figure><img alt="{html.escape(path.stem)}" src="data:image/png;base64,{data}"><figcaption>{html.escape(caption)}</figcaption></figure>'


def _measures_table(found: Findings) -> str:
    columns: list[tuple[str, Measures | None]] = []
    for key in ("depth", "volume", "diameter"):
        moment = found.transient.get(key)
        if moment is not None:
            columns.append((f"transient, maximum {key}<br>({readable.clock(moment.time)}, {moment.stage.upper()})", moment.measures))
    if found.late_sph is not None and found.late_sph is not found.final:
        columns.append((f"all-SPH late stage<br>({readable.clock(found.late_sph_time)})", found.late_sph))
    if found.final is not None:
        columns.append((f"final, {html.escape(found.final_from)}<br>({readable.clock(found.final_time)})", found.final))
    if not columns:
        return "<p>Nothing could be measured.</p>"
    rows = ["<tr><th></th>" + "".join(f"<th>{title}</th>" for title, _ in columns) + "</tr>"]
    reasons: list[str] = []
    for name, word in WORDS.items():
        cells = []
        for _, measures in columns:
            entry = measures.quantities.get(name) if measures else None
            if entry is not None and entry.value is None:
                if entry.reason not in reasons:
                    reasons.append(entry.reason)
                cells.append(f"<td>none ({reasons.index(entry.reason) + 1})</td>")
            else:
                cells.append(f"<td>{shown(entry)}</td>")
        rows.append(f"<tr><td>{word}</td>{''.join(cells)}</tr>")
    notes = "".join(f"<br>({k + 1}) {html.escape(reason)}" for k, reason in enumerate(reasons))
    return f"<table>{''.join(rows)}</table><p class=note>Errors are one standard deviation.{notes}</p>"


def _published_table(found: Findings) -> str:
    if not found.reference:
        return "<p>The case names no published numbers.</p>"
    rows = ["<tr><th>quantity</th><th>published</th><th>here</th><th>met</th><th class=note>source</th></tr>"]
    for row in found.reference:
        scale, unit = _scale(row["value"], row["unit"])
        published = f"{row['value'] * scale:.4g} +{row['plus'] * scale:.3g}/−{row['minus'] * scale:.3g} {unit}"
        ours = Quantity(row["ours"]["value"], row["ours"]["sigma"], row["unit"], row["ours"].get("reason", ""))
        word, style = {True: ("yes", "met"), False: ("no", "unmet"), None: ("not measured", "waived")}[row["met"]]
        name = f"{row['name'].replace('_m3', '').replace('_m', '').replace('_', ' ')}, {row['at']}"
        rows.append(
            f"<tr><td>{html.escape(name)}</td><td>{published}</td><td>{shown(ours)}</td><td class={style}>{word}</td>"
            f"<td class=note>{html.escape(row['source'])} {html.escape(row['note'])}</td></tr>"
        )
    return f"<table>{''.join(rows)}</table>"


def _scaling_table(found: Findings) -> str:
    """Every law beside what was measured, with the ratio of ours to it, and the spread of the laws."""
    if not found.scaling:
        return ""
    ours = found.transient.get("volume")
    diameter = ours.value("diameter_apparent_m") if ours is not None else float("nan")
    rows = ["<tr><th>law</th><th>transient apparent diameter</th><th>ours over law</th><th>final rim diameter</th></tr>"]
    final = found.scaling["final_rim_diameter_m"]
    for name, value in found.scaling["diameter_m"].items():
        scale, unit = _scale(value, "m")
        last = f"{_digits(final[name] * scale, 3)} {unit}" if name in final else ""
        share = f"{diameter / value:.2f}" if np.isfinite(diameter) else ""
        rows.append(f"<tr><td>{name.replace('_', ' ')}</td><td>{_digits(value * scale, 4)} {unit}</td><td>{share}</td><td>{last}</td></tr>")
    sizes = np.array(list(found.scaling["diameter_m"].values()))
    low, high = found.scaling["range_m"]
    scale, unit = _scale(high, "m")
    named = [scaling.NAMES[name] for name in found.scaling["range_of"]]
    growth = readable.clock(found.scaling["formation_time_s"])
    here = f" Ours: {shown(ours.measures['diameter_apparent_m'])}." if ours is not None and ours.measures is not None else ""
    return (
        f"<h2>Scaling laws</h2><table>{''.join(rows)}</table><p>{', '.join(named[:-1])} and {named[-1]} span {_digits(low * scale, 3)} to "
        f"{_digits(high * scale, 3)} {unit}, all laws {_digits(sizes.min() * scale, 3)} to {_digits(sizes.max() * scale, 3)} {unit} (a factor "
        f"{sizes.max() / sizes.min():.1f}: the spread between target materials).{here} Growth time by scaling {growth}. "
        "None of them knows layers, strength or the curvature of the body.</p>"
    )
