"""The page on a crater: one self-contained HTML file, and the same numbers as text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from crater.bodies import body_report as of_body
from crater.ejecta import ballistic
from crater.ground import cloud
from crater.measures import chain
from crater.measures.measure import Measures, Quantity
from crater.pages import block_view, report_evidence, report_matter
from crater.results import column_labels, handover
from crater.results.findings import Findings, columns, final_entry, missing_errors
from crater.scaling import crater_size as scaling
from matter.files import archive
from matter.wording import drawing, page, readable
from matter.wording.crater_measures import BY_NAME, TABLE


def shown(quantity: Quantity | None) -> str:
    """A quantity as text: ``612 ± 14 km``; the reason in brackets where there is no value."""
    if quantity is None:
        return "-"
    if quantity.value is None:
        return f"({quantity.reason})" if quantity.reason else "-"
    return readable.measured(quantity.value, quantity.sigma, quantity.unit)


def as_text(measures: Measures) -> str:
    """The measures as lines of text."""
    datum = measures.datum
    lines = [
        f"datum: {datum.kind}"
        + (f" of radius {datum.radius / 1e3:.6g} km" if datum.is_sphere else "")
        + f" ({datum.source})"
    ]
    lines += [
        f"  {row.words:<44} {readable.terminal(shown(measures[row.name]))}"
        for row in TABLE
        if row.name in measures.quantities
    ]
    return "\n".join(lines)


def write(findings: Findings, out: Path) -> None:
    """Write ``report.html``: everything inlined, readable on screen and on paper."""
    last, ejected = _last(findings), findings.ejected.faster_than
    when = readable.clock(findings.final.time) if findings.final is not None else ""
    near_plane = findings.setting.shape is None
    momentum = findings.setting.event.mass * findings.settings.impact.speed
    text = page.render(
        "crater/pages/templates/report.html.j2", headline=headline(findings), out=out,
        title=page.heading(findings.inputs, f"Crater: {_title(findings)}"), without_pictures=drawing.note(),
        summary=_summary(findings), soundness=findings.soundness, measured=_measured(findings), ground=cloud.GROUND,
        chain_error=_chain_words(findings), handed_over=_handed_over(findings),
        body=of_body.section(findings.body, out), published=_published(findings), scaling=_scaling(findings),
        near_plane=near_plane, at_rest=_at_rest(findings), last=last, when=when,
        block=block_view.of_findings(findings, f"{last} ({when})") if near_plane else "",
        ejected_at=readable.clock(ejected["time_s"]) if ejected else "",
        matter=report_matter.all_parts(findings, out),
        evidence=report_evidence.all_parts(findings.inputs, momentum, _lever(findings)),
    )  # fmt: skip
    archive.write_text(out / "report.html", text)


def headline(findings: Findings) -> str:
    """The last crater in one line: diameter at the datum, depth, whether it is at rest, how many cautions; of a body
    also what the impact left of it."""
    said = "no crater was measured"
    if held := columns(findings):
        label, m = held[-1]
        state = "settled" if label.title == "final" else label.title
        said = f"{_in_words('D', m['diameter_apparent_m'], ' =')}, {_in_words('depth', m['depth_m'])}, {state}"
    if findings.body:
        body = findings.body[-1]
        hollow = body.kind in ("crater", "not resolved")
        said = f"{of_body.WORDS[body.kind]}: {said if hollow else of_body.headline(body)}"
    count = len(findings.soundness.get("cautions", ()))
    verdict = "NOT RESOLVED: " if "not_resolved" in findings.soundness else ""
    return f"{_capital(verdict + said)}; {count or 'no'} caution{'' if count == 1 else 's'}"


def _last(findings: Findings) -> str:
    """What the last crater is called: *final* only where it has come to rest."""
    if findings.final is None:
        return "The last snapshot"
    label = column_labels.final(final_entry(findings.final))
    return "The final crater" if label.title == "final" else f"The crater in the {label.title}"


def _at_rest(findings: Findings) -> bool:
    return findings.final is not None and findings.final.rest.settled


def _lever(findings: Findings) -> tuple[float, str]:
    """What momentum is multiplied with to give a scale of angular momentum [m], and its name: one that is never zero,
    at any angle."""
    if not findings.settings.target.flat:
        return findings.settings.target.radius, "the target's radius"
    moment = findings.transient.get("volume")
    radius = 0.5 * moment.value("diameter_apparent_m") if moment is not None else float("nan")
    if np.isfinite(radius):
        return radius, "the transient crater's apparent radius"
    return findings.settings.impact.projectile.radius, "its radius"


def _title(findings: Findings) -> str:
    impact = findings.settings.impact
    return (
        f"{impact.projectile.material} projectile of radius {readable.length(impact.projectile.radius)}, "
        f"{impact.speed / 1e3:.5g} km/s, "
        f"{np.degrees(impact.angle_from_vertical):.3g}° from vertical"
    )


def _summary(findings: Findings) -> list[str]:
    without = missing_errors(findings)
    lines = [
        f"{_capital(label.title)} ({label.when}): {_in_words('apparent diameter D', m['diameter_apparent_m'], ' =')}, "
        f"{_in_words('depth', m['depth_m'])}{f' (errors {without})' if without and m['depth_m'].sigma else ''}."
        for label, m in columns(findings)
    ]
    if findings.final is not None and not findings.final.rest.settled:
        lines.append(f"The last snapshot is no final crater: {findings.final.rest.reason}.")
    if findings.ballistic is not None:
        lines.append(_ballistic_words(findings))
    if findings.compared.late_difference:
        lines.append(_late_sentence(findings))
    if lost := findings.ejected.leaving:
        lines.append(
            f"Mass that escapes, at the end of the shock stage: {readable.amount(lost['target_mass_kg'], 'kg', 3)} of "
            f"the target and {readable.amount(lost['projectile_mass_kg'], 'kg', 3)} of the projectile. Momentum "
            f"enhancement β = {lost['beta']:.3f}: the momentum that the body keeps over that of the projectile, along "
            f"its flight."
        )
    return lines + [f"{key}: {reason}." for key, reason in findings.reasons.items()]


def _in_words(name: str, quantity: Quantity, equals: str = "") -> str:
    return f"no {name} {shown(quantity)}" if quantity.value is None else f"{name}{equals} {shown(quantity)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _late_sentence(findings: Findings) -> str:
    """The two late stages beside each other, in depth and in profile."""
    d, late, last = findings.compared.late_difference or {}, findings.late_sph, findings.settled_grains
    if late is None or last is None:
        return ""
    shock, grains = late.measures, last.measures
    ratio = d["depth_m"]["sph_over_dem"]
    over = f", a ratio of {ratio:.2f}" if ratio is not None else ""
    return (
        f"The two late stages, which differ in method and in rheology: depth {shown(shock['depth_m'])} "
        f"in SPH "
        f"({readable.clock(late.time)}) against {shown(grains['depth_m'])} in grains "
        f"({readable.clock(last.time)}){over}. "
        f"Inside {readable.length(d['inside_m'])} (1.5 rim radii of the larger crater) their profiles differ by "
        f"{readable.length(d['rms_inside_m'])} RMS, "
        f"{d['rms_over_depth']:.2f} of the deeper one's depth; most at {readable.length(d['largest_at_m'])} from the "
        f"axis, where the grains' ground lies "
        f"{readable.length(abs(d['largest_m']))} {'lower' if d['largest_m'] < 0.0 else 'higher'}."
    )


def _named(findings: Findings) -> str:
    return "the final crater" if _at_rest(findings) else "the last snapshot, which is no final crater"


def _ballistic_words(findings: Findings) -> str:
    ballistic_crater = findings.ballistic
    assert ballistic_crater is not None
    m = ballistic_crater.measures
    last = findings.final
    final = last.measures["diameter_apparent_m"].value if last is not None else None
    return (
        f"Ballistic crater (every particle of the snapshot of {readable.clock(ballistic_crater.time)} in free flight, "
        "mass balanced in rings; neither collapse nor compaction): "
        f"apparent diameter {shown(m.get('diameter_apparent_m'))}, depth {shown(m.get('depth_m'))}, volume "
        f"{shown(m.get('volume_m3'))}. "
        + ballistic.words(ballistic_crater, final, f"{_named(findings)} ({last.origin if last is not None else ''})")
    )


def _measured(findings: Findings) -> dict[str, Any]:
    """Head and rows of the table of measures, with the reasons for those that are missing; empty where nothing was
    measured."""
    held = columns(findings)
    reasons: list[str] = []
    rows = [[row.words, *(_measure_cell(measures, row.name, reasons) for _, measures in held)] for row in TABLE]
    head = ["", *((label.title, label.when) for label, _ in held)]
    return {"head": head, "rows": rows, "reasons": reasons} if held else {}


def _handed_over(findings: Findings) -> dict[str, Any]:
    """The crater right before and right after the handover; empty where it is not known."""
    before, after = findings.handed_over
    changes = handover.changes(before, after)
    rows = [[BY_NAME[name].words, *map(shown, row)] for name, row in changes.items()]
    return {"time": readable.clock(after.time), "rows": rows} if rows and after is not None else {}


def _chain_words(findings: Findings) -> str:
    """What the errors hold of the scatter of the whole chain, with its size for the first measures of the final (else
    the transient) crater."""
    if findings.settings.chain is None:
        return chain.UNKNOWN
    volume = findings.transient.get("volume")
    measures, of = volume.measures if volume else None, "transient"
    if findings.final is not None:
        measures, of = findings.final.measures, "final" if findings.final.rest.settled else "last"
    sizes = [
        f"{BY_NAME[name].noun} {readable.length(measures[name].parts[chain.PART])}"
        for name in ("diameter_apparent_m", "depth_m")
        if measures is not None and chain.PART in measures[name].parts
    ]
    return chain.KNOWN + (f"; of the {of} crater: {', '.join(sizes)}" if sizes else "")


def _measure_cell(measures: Measures | None, name: str, reasons: list[str]) -> str:
    """A measure, or the number of the reason why there is none; new reasons are added to ``reasons``."""
    entry = measures.quantities.get(name) if measures else None
    if entry is None or entry.value is not None:
        return shown(entry)
    if entry.reason not in reasons:
        reasons.append(entry.reason)
    return f"none ({reasons.index(entry.reason) + 1})"


def _published(findings: Findings) -> list[list[str | page.Cell]]:
    """Published numbers, ours beside them, whether they are met, and their source."""
    rows: list[list[str | page.Cell]] = []
    for row in findings.compared.reference:
        ours = Quantity(row["ours"]["value"], row["ours"]["sigma"], row["unit"], row["ours"].get("reason", ""))
        word, style = {True: ("yes", "met"), False: ("no", "unmet"), None: ("not measured", "not_measured")}[
            row["met"]
        ]
        name = f"{row['name'].replace('_m3', '').replace('_m', '').replace('_', ' ')}, {row['at']}"
        published = readable.between(row["value"], row["plus"], row["minus"], row["unit"])
        met = page.Cell(word, style=style)
        rows.append([name, published, shown(ours), met, f"{row['source']} {row['note']}"])
    return rows


def _scaling(findings: Findings) -> dict[str, Any]:
    """Every law beside what was measured, the ratio of measured to predicted, and the spread of the laws."""
    found = findings.compared.scaling
    if not found:
        return {}
    ours = findings.transient.get("volume")
    diameter = ours.value("diameter_apparent_m") if ours is not None else float("nan")
    growing = "volume" in findings.growing or (findings.at_end_of_shock(ours) and "diameter" in findings.growing)
    final, laws = found["final_rim_diameter_m"], found["diameter_m"]
    rows = []
    for name, value in laws.items():
        ratio = f"{diameter / value:.2f}" if np.isfinite(diameter) and not growing else ""
        last = readable.amount(final[name], "m", 3) if name in final else ""
        rows.append([scaling.NAMES[name], readable.amount(value, "m", 3), ratio, last])
    least, most = min(laws.values()), max(laws.values())
    sizes = [*found["range_m"], least, most]
    named = [scaling.NAMES[name] for name in found["range_of"]]
    here = (
        f" This run: {shown(ours.measures['diameter_apparent_m'])}{', still growing' if growing else ''}."
        if ours is not None and ours.measures is not None
        else ""
    )
    ends = dict(zip(("low", "high", "least", "most"), (readable.amount(size, "m", 3) for size in sizes)))
    return {
        "rows": rows, "named": f"{', '.join(named[:-1])} and {named[-1]}", **ends, "here": here,
        "factor": f"{most / least:.1f}", "growth": readable.clock(found["formation_time_s"]),
    }  # fmt: skip
