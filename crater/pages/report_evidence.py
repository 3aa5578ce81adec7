"""What stands behind the numbers of a page: handoff ledger, conservation, what limited the step, provenance,
references."""

from __future__ import annotations

import re
from pathlib import Path

from crater.results import soundness
from matter.files import archive
from matter.wording import page, readable

VERDICTS = ("fail", "waived", "not_measured", "pass", "not_applicable")
"""Order of the ledger's rows on the page: what asks for attention first."""
TEMPLATE = "crater/pages/templates/report_evidence.html.j2"


def all_parts(run: Path, projectile_momentum: float, lever: tuple[float, str]) -> list[str]:
    """Every section that the files of a run folder give material for; momentum [kg m/s] and lever [m, name] are the
    scales of what was conserved."""
    return [
        rows_of("Resolution and peak pressure", soundness.resolution_rows(run)),
        ledger(run / "4_handoff" / "ledger.json"),
        rows_of("Conservation in the shock stage", soundness.conservation_rows(run, projectile_momentum, lever)),
        rows_of("The collapse: balances and overlaps", soundness.collapse_rows(run)),
        steps(run),
        provenance(run / "provenance.json"),
        references(run / "references.bib"),
    ]


def ledger(path: Path) -> str:
    """The handoff's ledger: how many rows stand how, then the rows, those that ask for attention first."""
    if not path.is_file():
        return ""
    entries = archive.read_json(path, list)
    rank = {verdict: k for k, verdict in enumerate(VERDICTS)}
    entries.sort(key=lambda row: rank.get(str(row.get("verdict")), len(VERDICTS)))
    judged = [row for row in entries if row.get("limit") is not None]
    counts = {verdict: sum(row.get("verdict") == verdict for row in judged) for verdict in VERDICTS}
    summary = ", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items() if count)
    words = f"{len(judged)} criteria: {summary}."
    return page.render(TEMPLATE, "ledger", words=words, rows=page.ledger(entries))


def rows_of(title: str, rows: list[tuple[str, str]]) -> str:
    """A section of words and values; empty where there are none."""
    return page.render(TEMPLATE, "section", title=title, rows=rows) if rows else ""


def steps(run: Path) -> str:
    """What limited the time step: steps of the shock stage by limit; the grains' step and what sets it."""
    rows = []
    shock, grains = (run / folder / "stage_report.json" for folder in ("2_sph", "5_dem"))
    if shock.is_file():
        counts = {
            str(name): int(count) for name, count in archive.read_json(shock).get("step_limits", {}).items() if count
        }
        total = sum(counts.values())
        for name in sorted(counts, key=lambda key: -counts[key]):
            rows.append([f"SPH: {name}", readable.number(counts[name]), f"{counts[name] / total:.0%}"])
    if grains.is_file():
        facts = archive.read_json(grains)
        if "time_step_s" in facts:
            step = readable.clock(float(facts["time_step_s"]))
            count = readable.number(float(facts.get("steps", 0)))
            rows.append([f"grains: a fixed fraction of the contact time ({step})", count, "100%"])
    head = ["limit", "steps", "share"]
    return page.render(TEMPLATE, "section", title="What limited the time step", head=head, rows=rows) if rows else ""


def provenance(path: Path) -> str:
    """Versions, case, machine and the hashes of the sources, as a table."""
    if not path.is_file():
        return ""
    facts = archive.read_json(path)
    program, case = facts.get("distribution", {}), facts.get("case", {})
    name = "/".join(Path(str(case.get("file", ""))).parts[-2:])
    commit, outside = program.get("commit", "unknown"), case.get("from_elsewhere") or {}
    lines = [
        ("program", f"{program.get('name', '')} {program.get('version', '')}, commit {commit}"),
        ("", "with uncommitted changes" if program.get("uncommitted_changes") else ""),
        ("case", f"{name}, preset {case.get('preset') or '-'}, SHA-256 {str(case.get('sha256', ''))[:16]}"),
        ("overrides", ", ".join(map(str, case.get("overrides") or ()))),
        ("from elsewhere", ", ".join(f"{key}: {page.local(value)}" for key, value in outside.items())),
        ("libraries", ", ".join(f"{key} {value}" for key, value in facts.get("libraries", {}).items())),
        ("sources (SHA-256)", ", ".join(f"{k} {str(v)[:10]}" for k, v in facts.get("sources_sha256", {}).items())),
    ]
    for session in facts.get("sessions", []):
        command = " ".join(page.local(word) for word in session.get("command", []))
        memory = float(session.get("memory_bytes", 0)) / 2**30
        machine = f"{session.get('threads')} threads of {session.get('cores')} cores, {memory:.0f} GiB"
        lines.append((f"session {session.get('started_at', '')}", f"{command}; {machine}"))
    rows = [line for line in lines if line[1]]
    return page.render(TEMPLATE, "section", title="Provenance", rows=rows, notes=(1,))


def references(path: Path) -> str:
    """The run's bibliography: exactly the laws and materials that it used."""
    if not path.is_file():
        return ""
    items = []
    for entry in re.split(r"^(?=@)", path.read_text(), flags=re.MULTILINE):
        author, title, year = (_field(entry, name) for name in ("author", "title", "year"))
        if author:
            names = [name.split(",")[0] for name in author.split(" and ")]
            who = names[0] + (f" & {names[1]}" if len(names) == 2 else " et al." if len(names) > 2 else "")
            journal = _field(entry, "journal") or _field(entry, "publisher") or _field(entry, "school")
            where = f"{journal} {_field(entry, 'volume')}".strip()
            items.append(f"{who} {year}: {title}. {where}".strip())
    return page.render(TEMPLATE, "references", entries=items) if items else ""


def _field(entry: str, name: str) -> str:
    """One field of a BibTeX entry, braces and accents' markup taken off."""
    match = re.search(rf"\b{name} = \{{((?:[^{{}}]|\{{(?:[^{{}}]|\{{[^{{}}]*\}})*\}})*)\}}", entry)
    if match is None:
        return ""
    text = match.group(1)
    accents = {
        r"\"a": "ä", r"\"o": "ö", r"\"u": "ü", r"\'e": "é", r"\'a": "á", r"\`e": "è", r"\c c": "ç", r"\~n": "ñ",
        r"\v s": "š", r"\v c": "č",
    }  # fmt: skip
    for mark, letter in accents.items():
        text = text.replace("{" + mark + "}", letter).replace(mark, letter)
    return re.sub(r"[{}]", "", text).replace("--", "–").replace("~", " ")
