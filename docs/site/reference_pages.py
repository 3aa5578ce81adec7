"""Pages that are not written by hand: the reference from the code itself (keys, laws, measures, rows of the ledger,
commands, the Python interface), and documents of the repository with their links turned to this site. Called by
``conf.py``."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

import api_pages
import gallery_page
import hera_page
import law_pages
import notebook_pages
import speed_page

from studies import validation_table

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = {
    "docs/validation.md": "validation",
    "docs/results/README.md": "results/index",
    "forecasts/README.md": "forecast",
    "CONTRIBUTING.md": "contribute",
    "ARCHITECTURE.md": "architecture",
    "CHANGELOG.md": "changelog",
}
"""Documents of the repository, and their pages; results and cases are found. The page of all claims is made first."""


def write(site: Path) -> None:
    """Write every generated page into ``site``."""
    pages = {
        "keys": keys(),
        "materials": materials(),
        "measures": measures(),
        "ledger": ledger(),
        "commands": commands(),
        "api": api_pages.page(prose),
        "speed": speed_page.page(speed_page.versions()),
    }
    pages |= laws(site)
    pages = {f"reference/{name}": text for name, text in pages.items()} | documents(site)
    pages["gallery"] = gallery_page.page()
    pages["hera"] = hera_page.page(site)
    pages |= notebook_pages.pages(site)
    for name, text in pages.items():
        path = site / f"{name}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_text() != text:
            path.write_text(text)


def documents(site: Path) -> dict[str, str]:
    """Pages from documents: those of ``DOCUMENTS``, a page for each kept result and each shipped case."""
    validation_table.write()
    page_of = {ROOT / name: page for name, page in DOCUMENTS.items()}
    for folder, kind in ((ROOT / "docs" / "results", "results"), (ROOT / "cases", "cases")):
        page_of |= {file: f"{kind}/{file.parent.name}" for file in sorted(folder.glob("*/README.md"))}
    pages = {page: linked(file, page, page_of, site) for file, page in page_of.items()}
    for kind in ("results", "cases"):
        listed = "\n".join(
            Path(page).name for page in pages if page.startswith(f"{kind}/") and not page.endswith("/index")
        )
        tree = f"\n\n::::{{toctree}}\n:maxdepth: 1\n\n{listed}\n::::\n"
        pages[f"{kind}/index"] = (
            pages.get(
                f"{kind}/index",
                "# Cases that ship with bolide\n\n`run_case --list cases` names them with their presets.",
            )
            + tree
        )
    return pages


def linked(file: Path, page: str, page_of: dict[Path, str], site: Path) -> str:
    """A document whose links lead to pages of this site; a link to any other file becomes its name, pictures are taken
    from where they stand."""

    def turned(match: re.Match[str]) -> str:
        mark, words, target = match.groups()
        path, _, anchor = target.partition("#")
        if not path or re.match(r"[a-z]+:", target):
            return match[0]
        found = (file.parent / path).resolve()
        if mark:
            return f"![{words}]({os.path.relpath(found, (site / page).parent)})"
        at = page_of.get(found / "README.md" if found.is_dir() else found)
        if found.suffix == ".md" and found.is_relative_to(site):
            at = found.relative_to(site).with_suffix("").as_posix()
        return f"[{words}](/{at}.md{'#' + anchor if anchor else ''})" if at else words

    return re.sub(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)", turned, file.read_text())


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table; bars inside cells are escaped."""
    lines = [list(head)]
    lines += [
        ["---"] * len(lines[0]),
        *([cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows),
    ]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def keys() -> str:
    """Every key of a case file, and the shipped cases that set it."""
    from pipeline.case import keys as all_keys

    used = uses()
    parts = [
        "# Keys of a case file",
        "Written from the settings themselves, as `run_case --describe` prints them. Quantities are texts with a unit "
        '(`"12 km/s"`); '
        "the unit named is that of the base. *Used by*: shipped cases that set the key, in the case itself or in a "
        "preset.",
    ]
    for one in all_keys.tables():
        rows = [
            (
                f"`{key.path[-1]}`",
                html(key.allowed),
                html(key.default),
                html(key.meaning),
                cases_that_set(used.get(key.name, [])),
            )
            for key in all_keys.keys(one)
        ]
        head = f"[[{one.name}]]" if one.listed else f"[{one.name}]"
        parts += [f"## `{head}`", html(one.meaning)]
        if rows:
            parts.append(table(("key", "allowed", "default", "meaning", "used by"), rows))
    return "\n\n".join(part for part in parts if part) + "\n"


def cases_that_set(names: list[str]) -> str:
    """The cases in words; where nearly all set a key, that is said instead."""
    return "most cases" if len(names) > 6 else ", ".join(name.replace("_", r"\_") for name in names) or " "


def uses() -> dict[str, list[str]]:
    """Names of the shipped cases by the keys that they set."""
    found: dict[str, list[str]] = {}
    for file in sorted((ROOT / "cases").glob("*/case.toml")):
        content = tomllib.loads(file.read_text())
        presets = content.pop("preset", {})
        for name in sorted({name for part in (content, *presets.values()) for name in _names(part, ())}):
            found.setdefault(name, []).append(file.parent.name)
    return found


def _names(part: object, path: tuple[str, ...]) -> Iterable[str]:
    if isinstance(part, list):
        for item in part:
            yield from _names(item, path)
        return
    if not isinstance(part, dict):
        yield ".".join(path)
        return
    for name, inner in part.items():
        # a material's own name stands for NAME
        step = "NAME" if path[-1:] == ("materials",) else name
        yield from _names(inner, (*path, step))


def laws(site: Path) -> dict[str, str]:
    """The pages of the laws, each with its picture, drawn now."""
    pages = law_pages.pages(prose, html)
    captions = law_pages.draw_laws(site / "reference" / "laws")
    for name in law_pages.names():
        at = f"laws/{law_pages.page_path(name)}"
        pages[at] = pages[at].replace("@caption@", html(captions[name]))
    return pages


def materials() -> str:
    """Every material with its laws and the sections that it holds."""
    from matter.case import material

    rows = []
    for name in material.names():
        chosen = material.choices(name)
        own = ", ".join(f"{key} = {value}" for key, value in chosen.items() if key not in ("title", "note"))
        rows.append(
            (
                f"`{name}`",
                html(chosen.get("title", "")),
                html(own) or "the defaults",
                ", ".join(sorted(material.load(name))),
            )
        )
    return (
        "# Materials\n\nFiles in `matter/materials/`; each number stands there with its source. "
        "`[sph.materials.<name>]` in a case changes single values.\n\n"
        + table(("name", "what", "laws", "sections"), rows)
        + "\n"
    )


def measures() -> str:
    """The measures of a crater, with what is compared and what counts as a match."""
    from matter.wording.crater_measures import TABLE

    rows = [
        (
            f"`{one.name}`",
            html(one.words),
            one.unit,
            "yes" if one.compared else "no",
            f"{one.match:.0%}" if one.match else " ",
        )
        for one in TABLE
    ]
    text = (
        "# Measures of a crater\n\nEvery measure stands in `6_crater/measures.json` with value, standard deviation "
        "(`sigma`, and its parts) "
        "and unit, for the transient crater at "
        "each of its moments and for the final one. *Match*: the relative difference up to which two independent "
        "craters count as the same."
    )
    return f"{text}\n\n{table(('name', 'what', 'unit', 'compared', 'match'), rows)}\n"


def ledger() -> str:
    """The rows of the handoff's ledger, their limits and meanings."""
    from handoff.ledger import LIMITS, VERDICTS, WAIVABLE

    rows = [
        (
            f"`{name}`",
            f"{'at least' if row.least else 'at most'} {row.limit:g} {row.unit if row.unit != '1' else ''}".strip(),
            html(row.meaning),
        )
        for name, row in LIMITS.items()
    ]
    text = (
        "# Rows of the handoff's ledger\n\n`4_handoff/ledger.json`, `inspect_handoff RUN`. Verdicts: "
        + ", ".join(f"`{word}`" for word in VERDICTS)
        + ". "
        "Only " + ", ".join(f"`{name}`" for name in WAIVABLE) + " may be waived, with a reason (`[handoff.waive]`)."
    )
    return f"{text}\n\n{table(('row', 'limit', 'meaning'), rows)}\n"


def commands() -> str:
    """What each command says with ``--help``."""
    names = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]
    parts = ["# Commands", "Each command has `--version` and `--install-completion`."]
    for name in names:
        code = f"import sys; sys.argv[0] = {name!r}; from pipeline.cli import {name}; {name}()"
        env = {**os.environ, "COLUMNS": "110", "TERM": "dumb"}
        said = subprocess.run(
            [sys.executable, "-c", code, "--help"], cwd=ROOT, capture_output=True, text=True, check=True, env=env
        ).stdout
        parts += [f"## `{name}`", "```text\n" + re.sub(r"\x1b\[[0-9;]*m", "", said).strip("\n") + "\n```"]
    return "\n\n".join(parts) + "\n"


def html(text: str) -> str:
    """Text from a docstring inside a table: code in single backquotes, ``**Words.**`` that begin a paragraph, nothing
    else that Markdown would take for markup of its own."""
    text = " ".join(str(text).split())
    parts = re.split(r"(``[^`]+``|`[^`]+`|\*\*\w[\w ]*\.\*\*)", text)
    return "".join(
        part.replace("``", "`") if part.startswith("`") else part if part.startswith("**") else _plain(part)
        for part in parts
    )


def _plain(text: str) -> str:
    return re.sub(r"([*_<>\[\]$#])", r"\\\1", text)


def prose(doc: str) -> str:
    """A docstring as Markdown: indented blocks (equations, tables) as they stand, paragraphs with their code marks."""
    out: list[str] = []
    for block in re.split(r"\n\s*\n", doc.strip("\n")):
        lines = block.split("\n")
        fixed = any(line.startswith("    ") for line in lines) or any(
            re.match(r"=+( =+)*$|\s*[-=]{4,}", line) for line in lines
        )
        if fixed:
            first = 0
            while first < len(lines) and not lines[first].startswith("    ") and not re.match(r"=+", lines[first]):
                first += 1
            if first:
                out.append(html(" ".join(lines[:first])))
            out.append("```text\n" + "\n".join(lines[first:]) + "\n```")
        else:
            out.append(html(" ".join(lines)))
    return "\n\n".join(out)
