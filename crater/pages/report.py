"""The page on a crater: one self-contained HTML file, and the same numbers as text."""

from __future__ import annotations

import html
from pathlib import Path

import numpy as np

from crater.bodies import body_report as of_body
from crater.ejecta import ballistic
from crater.ground import cloud
from crater.measures import chain
from crater.measures.measure import Measures, Quantity
from crater.pages import block_view, report_evidence, report_matter
from crater.results import column_labels, handover
from crater.results.findings import Findings, columns, final_entry
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
    last = _last(findings)
    when = readable.clock(findings.final.time) if findings.final is not None else ""
    parts = [
        _summary(findings),
        drawing.note(),
        page.picture(
            out / "profile.png",
            "Profiles: the mean of each ring; shaded: the 16th to 84th percentile of single columns over azimuth.",
        ),
        "<h2>Measures</h2>",
        _measures_table(findings),
        _handover_table(findings),
        of_body.section(findings.body, out),
        "<h2>Published numbers</h2>",
        _published_table(findings),
        _scaling_table(findings),
        "<h2>In time</h2>",
        page.picture(
            out / "time_series.png",
            "Errors: azimuth, resolution, method and datum in quadrature. Once the collapse has begun the diameter is "
            "that of a wide trough.",
        ),
        "<h2>Cross-sections through the impact plane</h2>" if findings.setting.shape is None else "",
        page.picture(out / "cross_section.png", "Particles within half a spacing of the plane y = 0, by material."),
        page.picture(
            out / "sections_in_time.png",
            "The shock stage in time: material, damage, pressure (tension in the lowest colour) and the depth that "
            "the matter came from.",
        ),
        page.picture(
            out / "sections_grains.png",
            "The grains in time: material, depth of origin (grey: arrived as ejecta) and speed.",
        ),
        f"<h2>{'The final crater' if _at_rest(findings) else 'The last snapshot'}</h2>",
        block_view.of_findings(findings, f"{last} ({when})") if findings.setting.shape is None else "",
        page.picture(
            out / "heightmap.png",
            f"{last}, seen from above at {when}: heights above the datum, distances from the crater's centre along "
            f"it. "
            "The dashed circle has the apparent diameter; the line is where the surface crosses the datum.",
            narrow=True,
        ),
        _ejecta(findings, out),
        *report_matter.all_parts(findings, out),
        *report_evidence.all_parts(
            findings.inputs, findings.setting.event.mass * findings.settings.impact.speed, _lever(findings)
        ),
    ]
    archive.write_text(
        out / "report.html", page.document(page.heading(findings.inputs, f"Crater: {_title(findings)}"), parts)
    )


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


def _ejecta(findings: Findings, out: Path) -> str:
    if not (out / "ejecta.png").is_file():
        return ""
    when = f"{readable.clock(findings.ejected.faster_than['time_s'])}"
    words = (
        f"Target mass above the datum, not part of the ground and rising, faster than v, at {when}; the laws are for "
        f"vertical impacts into half-spaces."
    )
    where = (
        "Speed and angle at the level of the ground against the launch position (medians); dotted: the apparent "
        "radius."
    )
    return (
        "<h2>Ejecta</h2>"
        + page.picture(out / "ejecta.png", words, narrow=True)
        + (page.picture(out / "launch.png", where, narrow=True) if findings.ejected.launch else "")
    )


def _title(findings: Findings) -> str:
    impact = findings.settings.impact
    return (
        f"{impact.projectile.material} projectile of radius {readable.length(impact.projectile.radius)}, "
        f"{impact.speed / 1e3:.5g} km/s, "
        f"{np.degrees(impact.angle_from_vertical):.3g}° from vertical"
    )


def _summary(findings: Findings) -> str:
    lines = [
        f"{_capital(label.title)} ({page.escape(label.when)}): "
        f"{_in_words('apparent diameter', m['diameter_apparent_m'])}, {_in_words('depth', m['depth_m'])}."
        for label, m in columns(findings, ("depth", "volume"))
    ]
    if findings.final is not None and not findings.final.rest.settled:
        lines.append(f"The last snapshot is no final crater: {page.escape(findings.final.rest.reason)}.")
    if findings.ballistic is not None:
        lines.append(_ballistic_words(findings))
    if findings.compared.late_difference:
        lines.append(_late_sentence(findings))
    if lost := findings.ejected.leaving:
        lines.append(
            f"Mass that escapes, at the end of the shock stage: {readable.amount(lost['target_mass_kg'], 'kg', 3)} of "
            f"the target and "
            f"{readable.amount(lost['projectile_mass_kg'], 'kg', 3)} of the projectile. Momentum enhancement &beta; = "
            f"{lost['beta']:.3f}: the momentum that "
            "the body keeps over that of the projectile, along its flight."
        )
    lines += [f"{page.escape(key)}: {page.escape(reason)}." for key, reason in findings.reasons.items()]
    cautions = [
        f"<b class=waived>Caution:</b> {page.escape(words)}." for words in findings.soundness.get("cautions", ())
    ]
    verdict = findings.soundness.get("not_resolved")
    return (
        (f"<p><b class=fail>NOT RESOLVED</b>: {page.escape(verdict)}.</p>" if verdict else "")
        + "<p>"
        + "<br>".join(lines)
        + "</p>"
        + ("<p class=note>" + "<br>".join(cautions) + "</p>" if cautions else "")
    )


def _in_words(name: str, quantity: Quantity) -> str:
    return (
        f"{name} {page.escape(shown(quantity))}"
        if quantity.value is not None
        else f"no {name} {page.escape(shown(quantity))}"
    )


def _capital(text: str) -> str:
    return page.escape(text[:1].upper() + text[1:])


def _late_sentence(findings: Findings) -> str:
    """The two late stages beside each other, in depth and in profile."""
    d, late, last = findings.compared.late_difference or {}, findings.late_sph, findings.settled_grains
    if late is None or last is None:
        return ""
    shock, grains = late.measures, last.measures
    ratio = d["depth_m"]["sph_over_dem"]
    over = f", a ratio of {ratio:.2f}" if ratio is not None else ""
    return (
        f"The two late stages, which differ in method and in rheology: depth {page.escape(shown(shock['depth_m']))} "
        f"in SPH "
        f"({readable.clock(late.time)}) against {page.escape(shown(grains['depth_m']))} in grains "
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
    flown = findings.ballistic
    assert flown is not None
    m = flown.measures
    last = findings.final
    final = last.measures["diameter_apparent_m"].value if last is not None else None
    return (
        f"Ballistic crater (every particle of the snapshot of {readable.clock(flown.time)} in free flight, mass "
        f"balanced in rings; "
        "neither collapse nor compaction): "
        f"apparent diameter {shown(m.get('diameter_apparent_m'))}, depth {shown(m.get('depth_m'))}, volume "
        f"{shown(m.get('volume_m3'))}. "
        + html.escape(ballistic.words(flown, final, f"{_named(findings)} ({last.origin if last is not None else ''})"))
    )


def _measures_table(findings: Findings) -> str:
    held = columns(findings)
    if not held:
        return "<p>Nothing could be measured.</p>"
    reasons: list[str] = []
    rows = [[row.words, *(_measure_cell(measures, row.name, reasons) for _, measures in held)] for row in TABLE]
    notes = "".join(f"<br>({k + 1}) {page.escape(reason)}" for k, reason in enumerate(reasons))
    titles = [f"{page.escape(label.title)}<br>({page.escape(label.when)})" for label, _ in held]
    return (
        page.table(["", *titles], rows)
        + f"<p class=note>{cloud.GROUND} Errors are one standard deviation; {_chain_words(findings)}.{notes}</p>"
    )


def _handover_table(findings: Findings) -> str:
    """The crater right before and right after the handover; empty where it is not known."""
    before, after = findings.handed_over
    rows = [
        [BY_NAME[name].words, *(page.escape(shown(entry)) for entry in row)]
        for name, row in handover.changes(before, after).items()
    ]
    if not rows or after is None:
        return ""
    heads_of = ["", "before, SPH", "after, grains", "change"]
    return f"<h3>The handover, {readable.clock(after.time)}</h3>" + page.table(heads_of, rows)


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
    return f"{page.escape(chain.KNOWN)}" + (f"; of the {of} crater: {', '.join(sizes)}" if sizes else "")


def _measure_cell(measures: Measures | None, name: str, reasons: list[str]) -> str:
    """A measure, or the number of the reason why there is none; new reasons are added to ``reasons``."""
    entry = measures.quantities.get(name) if measures else None
    if entry is None or entry.value is not None:
        return shown(entry)
    if entry.reason not in reasons:
        reasons.append(entry.reason)
    return f"none ({reasons.index(entry.reason) + 1})"


def _published_table(findings: Findings) -> str:
    if not findings.compared.reference:
        return "<p>The case names no published numbers.</p>"
    rows = []
    for row in findings.compared.reference:
        ours = Quantity(row["ours"]["value"], row["ours"]["sigma"], row["unit"], row["ours"].get("reason", ""))
        word, style = {True: ("yes", "met"), False: ("no", "unmet"), None: ("not measured", "not_measured")}[
            row["met"]
        ]
        name = f"{row['name'].replace('_m3', '').replace('_m', '').replace('_', ' ')}, {row['at']}"
        published = readable.between(row["value"], row["plus"], row["minus"], row["unit"])
        note = f"{page.escape(row['source'])} {page.escape(row['note'])}"
        rows.append([page.escape(name), published, page.escape(shown(ours)), page.cell(word, style), note])
    return page.table(["quantity", "published", "here", "met", "source"], rows, notes=(4,))


def _scaling_table(findings: Findings) -> str:
    """Every law beside what was measured, the ratio of measured to predicted, and the spread of the laws."""
    if not findings.compared.scaling:
        return ""
    ours = findings.transient.get("volume")
    diameter = ours.value("diameter_apparent_m") if ours is not None else float("nan")
    growing = "volume" in findings.growing
    final, laws = findings.compared.scaling["final_rim_diameter_m"], findings.compared.scaling["diameter_m"]
    rows = []
    for name, value in laws.items():
        ratio = f"{diameter / value:.2f}" if np.isfinite(diameter) and not growing else ""
        last = readable.amount(final[name], "m", 3) if name in final else ""
        rows.append([page.escape(scaling.NAMES[name]), readable.amount(value, "m", 3), ratio, last])
    low, high = (readable.amount(size, "m", 3) for size in findings.compared.scaling["range_m"])
    least, most = min(laws.values()), max(laws.values())
    named = [scaling.NAMES[name] for name in findings.compared.scaling["range_of"]]
    here = (
        f" This run: {shown(ours.measures['diameter_apparent_m'])}{', still growing' if growing else ''}."
        if ours is not None and ours.measures is not None
        else ""
    )
    return (
        "<h2>Scaling laws</h2>"
        + page.table(["law", "transient apparent diameter", "measured / predicted", "final rim diameter"], rows)
        + f"<p>{page.escape(', '.join(named[:-1]))} and {page.escape(named[-1])} span {low} to {high}; all laws "
        f"together {readable.amount(least, 'm', 3)} to "
        f"{readable.amount(most, 'm', 3)}, a factor of {most / least:.1f}, which is the spread between target "
        f"materials.{here} "
        f"Predicted time of growth: {readable.clock(findings.compared.scaling['formation_time_s'])}. "
        "None of these laws accounts for layers, strength or the curvature of the body.</p>"
    )
