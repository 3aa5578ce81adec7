"""A page for each notebook, with what it printed and drew: from the executed copies that
``BOLIDE_NOTEBOOKS=docs/_notebooks pytest -m notebook tests/pipeline/test_notebooks.py`` leaves in ``docs/_notebooks``,
as long as these are of the cells that the repository has. A notebook without such a copy is shown as it ships, and
its page says so."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
EXECUTED = ROOT / "docs" / "_notebooks"
_NOT_RUN = "*These pages were made without running it: its outputs are left out.*"
_LONGEST = 60


def names() -> list[str]:
    """The notebooks that ship."""
    return sorted(file.stem for file in (ROOT / "notebooks").glob("*.ipynb"))


def pages(site: Path, executed: Path = EXECUTED) -> dict[str, str]:
    """Name and text of the page of each notebook; pictures are written beside the pages."""
    return {f"notebooks/{name}": page(name, site / "notebooks", executed) for name in names()}


def page(name: str, out: Path, executed: Path = EXECUTED) -> str:
    """One notebook as Markdown; its pictures go to ``out``."""
    shipped = cells(ROOT / "notebooks" / f"{name}.ipynb")
    copy = executed / f"{name}.ipynb"
    ran = cells(copy) if copy.is_file() else []
    whole = [source(cell) for cell in ran] == [source(cell) for cell in shipped]
    parts = []
    for number, cell in enumerate(ran if whole else shipped):
        if cell["cell_type"] == "markdown":
            parts.append(source(cell))
            continue
        parts.append(f"```python\n{source(cell)}\n```")
        parts += [shown(output, out / f"{name}_{number}_{k}.png") for k, output in enumerate(cell.get("outputs", []))]
    about = f"The notebook: {{download}}`{name}.ipynb <../../../notebooks/{name}.ipynb>`."
    parts.insert(1, about if whole else f"{about} {_NOT_RUN}")
    return "\n\n".join(part for part in parts if part) + "\n"


def cells(file: Path) -> list[dict[str, Any]]:
    """The cells of a notebook."""
    found: list[dict[str, Any]] = json.loads(file.read_text())["cells"]
    return found


def source(cell: dict[str, Any]) -> str:
    """The text of a cell."""
    return "".join(cell["source"]).strip()


def shown(output: dict[str, Any], picture: Path) -> str:
    """An output as Markdown: a picture, else its text."""
    data = output.get("data", {})
    if "image/png" in data:
        picture.parent.mkdir(parents=True, exist_ok=True)
        picture.write_bytes(base64.b64decode("".join(data["image/png"])))
        return f"![what this cell draws]({picture.name})"
    text = "".join(output.get("text", data.get("text/plain", ""))).strip("\n")
    lines = re.sub(r"\x1b\[[0-9;]*m", "", text).splitlines()
    if not lines:
        return ""
    if len(lines) > _LONGEST:
        lines = [*lines[:_LONGEST], f"... ({len(lines) - _LONGEST} lines more)"]
    return "```text\n" + "\n".join(lines) + "\n```"
