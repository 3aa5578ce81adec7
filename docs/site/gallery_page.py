"""The gallery: every kept result that has a picture, with what its own page says of command, size and time; the cases
that ship; the notebooks. Nothing is stated here that those documents do not state."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+\.png)\)")
NOT_STATED = "not stated"
_ABOUT = (
    "Pictures that were kept, each with the command that makes it. Sizes and times are those that the result's own "
    "page states; many were taken beside other work."
)


def page() -> str:
    """The gallery as Markdown."""
    parts = ["# Gallery", _ABOUT, "## Results", *(entry(file) for file in results())]
    parts += ["## Cases that ship", *cases(), "## Notebooks", *notebooks()]
    return "\n\n".join(parts) + "\n"


def results() -> list[Path]:
    """The pages of kept results that show a picture."""
    return [
        file for file in sorted((ROOT / "docs" / "results").glob("*/README.md")) if _PICTURE.search(file.read_text())
    ]


def entry(file: Path) -> str:
    """One result: title, picture, command, size, time."""
    text, name = file.read_text(), file.parent.name
    words, picture = _PICTURE.search(text).groups()  # type: ignore[union-attr]
    title = text.partition("\n")[0].lstrip("# ")
    size, time = stated(name, text)
    about = [f"{{doc}}`its page <results/{name}>`", f"size: {size}", f"time: {time}"]
    shown = f"![{words}](../results/{name}/{picture})"
    return f"### {title}\n\n{shown}\n\n```\n{command(text)}\n```\n\n{'; '.join(about)}"


def command(text: str) -> str:
    """The command that a page begins with: its first block of code."""
    fenced = re.search(r"^```\w*\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    indented = re.search(r"(?:^    \S.*\n?)+", text, re.MULTILINE)
    found = min((match for match in (fenced, indented) if match), key=lambda match: match.start(), default=None)
    if found is None:
        raise ValueError(f"no command in the result that begins {text[:60]!r}")
    lines = (found[1] if found is fenced else re.sub(r"^    ", "", found[0], flags=re.MULTILINE)).strip().splitlines()
    return "\n".join(lines[:6])


def stated(name: str, text: str) -> tuple[str, str]:
    """Size and time of a result, from ``docs/gallery.toml``. Raises ``ValueError`` where it has none, or a number in
    them is not on the result's own page."""
    facts = tomllib.loads((ROOT / "docs" / "gallery.toml").read_text()).get(name)
    if facts is None:
        raise ValueError(f"docs/gallery.toml has nothing on docs/results/{name}")
    for number in re.findall(r"\d[\d,.]*\d|\d", facts["size"] + " " + facts["time"]):
        if not re.search(rf"(?<![\d,.]){re.escape(number)}(?![\d]|[,.]\d)", text):
            raise ValueError(f"docs/gallery.toml, {name}: {number} is not in docs/results/{name}/README.md")
    return facts["size"], facts["time"] or NOT_STATED


def cases() -> list[str]:
    """A table of the shipped cases: title, presets, results."""
    rows = ["| case | what it is | presets | results |", "|---|---|---|---|"]
    for file in sorted((ROOT / "cases").glob("*/case.toml")):
        content, name = tomllib.loads(file.read_text()), file.parent.name
        kept = [
            f"{{doc}}`results/{result.parent.name}`"
            for result in sorted((ROOT / "docs" / "results").glob("*/README.md"))
            if re.search(rf"cases/{name}\b", result.read_text())
        ]
        link = f"{{doc}}`{name} <cases/{name}>`" if (file.parent / "README.md").is_file() else f"`{name}`"
        presets = ", ".join(f"`{preset}`" for preset in content.get("preset", {})) or "none"
        rows.append(f"| {link} | {content['case']['title']} | {presets} | {' '.join(kept) or 'none kept'} |")
    return ["\n".join(rows)]


def notebooks() -> list[str]:
    """The notebooks, by the first words of each."""
    found = []
    for file in sorted((ROOT / "notebooks").glob("*.ipynb")):
        cell = next(c for c in json.loads(file.read_text())["cells"] if c["cell_type"] == "markdown")
        title, _, more = "".join(cell["source"]).partition("\n")
        first = " ".join(more.split())
        found.append(f"* {{doc}}`{title.lstrip('# ')} <notebooks/{file.stem}>`, `notebooks/{file.name}`: {first}")
    return ["\n".join(found), "Each is run to its end with every change, at its smallest size."]
