"""What stands behind the numbers of a page: handoff ledger, conservation, what limited the step, provenance, references."""

from __future__ import annotations

import csv
import html
import re
from pathlib import Path

import numpy as np

from matter import archive, page, readable

VERDICTS = ("fail", "waived", "not_measured", "pass", "not_applicable")
"""Order of the ledger's rows on the page: what asks for attention first."""


def all_parts(run: Path) -> list[str]:
    """Every section that the files of a run folder give material for."""
    return [
        ledger(run / "4_handoff" / "ledger.json"),
        conservation(run / "2_sph" / "history.csv"),
        steps(run),
        provenance(run / "provenance.json"),
        references(run / "references.bib"),
    ]


def ledger(path: Path) -> str:
    """The handoff's ledger: how many rows stand how, then the rows, those that ask for attention first."""
    if not path.is_file():
        return ""
    entries = archive.read_json(path, list)
    place = {verdict: k for k, verdict in enumerate(VERDICTS)}
    entries.sort(key=lambda row: place.get(str(row.get("verdict")), len(VERDICTS)))
    counts = {verdict: sum(row.get("verdict") == verdict for row in entries) for verdict in VERDICTS}
    summary = ", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items() if count)
    return f"<h2>Handoff ledger</h2><p>{len(entries)} rows: {summary}.</p>{page.ledger(entries)}"


def _columns(path: Path) -> dict[str, list[str]]:
    with path.open() as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]} if len(rows) >= 2 else {}


def conservation(path: Path) -> str:
    """Drift of energy, mass, momentum and angular momentum in the shock stage."""
    columns = _columns(path) if path.is_file() else {}
    if not columns:
        return ""

    def column(name: str) -> np.ndarray:
        return np.array([float(value) for value in columns[name]])

    kinetic = column("kinetic_J")[0]
    drift = (column("total_J") - column("total_J")[0]) / kinetic
    momentum = np.stack([column(f"momentum_{axis}") for axis in "xyz"], axis=1)
    spin = np.stack([column(f"angular_momentum_{axis}") for axis in "xyz"], axis=1)
    lines = [
        ("total energy, largest departure over the initial kinetic energy", f"{np.abs(drift).max():.3%}"),
        ("total energy, at the end", f"{drift[-1]:+.3%}"),
        ("mass, relative change", f"{column('mass_kg')[-1] / column('mass_kg')[0] - 1.0:.2e}"),
        ("linear momentum, change over the initial", f"{_change(momentum):.3%}"),
        ("angular momentum, change over the initial", f"{_change(spin):.3%}"),
    ]
    return f"<h2>Conservation in the shock stage</h2>{page.table([], [[page.escape(word), page.escape(value)] for word, value in lines])}"


def _change(vectors: np.ndarray) -> float:
    """Size of last minus first over size of the first."""
    return float(np.linalg.norm(vectors[-1] - vectors[0])) / max(float(np.linalg.norm(vectors[0])), 1e-300)


def steps(run: Path) -> str:
    """What limited the time step: steps of the shock stage by limit; the grains' step and what sets it."""
    rows = []
    shock, grains = (run / folder / "stage_report.json" for folder in ("2_sph", "5_dem"))
    if shock.is_file():
        counts = {str(name): int(count) for name, count in archive.read_json(shock).get("step_limits", {}).items() if count}
        total = sum(counts.values())
        for name in sorted(counts, key=lambda key: -counts[key]):
            rows.append([f"SPH: {page.escape(name)}", readable.number(counts[name]), f"{counts[name] / total:.0%}"])
    if grains.is_file():
        facts = archive.read_json(grains)
        if "time_step_s" in facts:
            step = readable.clock(float(facts["time_step_s"]))
            rows.append([f"grains: a fixed fraction of the contact time ({step})", readable.number(float(facts.get("steps", 0))), "100%"])
    if not rows:
        return ""
    return f"<h2>What limited the time step</h2>{page.table(['limit', 'steps', 'share'], rows)}"


def provenance(path: Path) -> str:
    """Versions, case, machine and the hashes of the sources, as a table."""
    if not path.is_file():
        return ""
    facts = archive.read_json(path)
    program, case = facts.get("distribution", {}), facts.get("case", {})
    lines = [("program", f"{program.get('name', '')} {program.get('version', '')}, commit {program.get('commit', 'unknown')}")]
    if program.get("uncommitted_changes"):
        lines.append(("", "with uncommitted changes"))
    name = "/".join(Path(str(case.get("file", ""))).parts[-2:])
    lines.append(("case", f"{name}, preset {case.get('preset') or '-'}, SHA-256 {str(case.get('sha256', ''))[:16]}"))
    if case.get("overrides"):
        lines.append(("overrides", ", ".join(map(str, case["overrides"]))))
    if case.get("from_elsewhere"):
        lines.append(("from elsewhere", ", ".join(f"{key}: {page.local(value)}" for key, value in case["from_elsewhere"].items())))
    lines.append(("libraries", ", ".join(f"{key} {value}" for key, value in facts.get("libraries", {}).items())))
    lines.append(("sources (SHA-256)", ", ".join(f"{key} {str(value)[:10]}" for key, value in facts.get("sources_sha256", {}).items())))
    for session in facts.get("sessions", []):
        command = " ".join(page.local(word) for word in session.get("command", []))
        memory = float(session.get("memory_bytes", 0)) / 2**30
        lines.append(
            (f"session {session.get('started_at', '')}", f"{command}; {session.get('threads')} threads of {session.get('cores')} cores, {memory:.0f} GiB")
        )
    return f"<h2>Provenance</h2>{page.table([], [[page.escape(word), page.breakable(value)] for word, value in lines], notes=(1,))}"


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
            where = " ".join(
                part for part in (_field(entry, "journal") or _field(entry, "publisher") or _field(entry, "school"), _field(entry, "volume")) if part
            )
            items.append(f"<li>{html.escape(f'{who} {year}: {title}. {where}'.strip())}</li>")
    return f"<h2>References</h2><p class=note>BibTeX: references.bib of the run folder.</p><ul class=refs>{''.join(items)}</ul>" if items else ""


def _field(entry: str, name: str) -> str:
    """One field of a BibTeX entry, braces and accents' markup taken off."""
    found = re.search(rf"\b{name} = \{{((?:[^{{}}]|\{{(?:[^{{}}]|\{{[^{{}}]*\}})*\}})*)\}}", entry)
    if found is None:
        return ""
    text = found.group(1)
    accents = {r"\"a": "ä", r"\"o": "ö", r"\"u": "ü", r"\'e": "é", r"\'a": "á", r"\`e": "è", r"\c c": "ç", r"\~n": "ñ", r"\v s": "š", r"\v c": "č"}
    for mark, letter in accents.items():
        text = text.replace("{" + mark + "}", letter).replace(mark, letter)
    return re.sub(r"[{}]", "", text).replace("--", "–").replace("~", " ")
