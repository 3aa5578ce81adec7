"""Draws every law by its own code: ``python docs/site/law_pictures.py FOLDER``, one SVG a law, and on stdout its
caption behind its name.

``DRAWN`` names the picture of a law, or of a whole folder whose laws have one form (a new law of it is drawn without a
word here). A picture is a function of the law's module and two axes that returns the caption. Run with
``NUMBA_DISABLE_JIT=1``: the laws are then plain Python, and nothing is compiled.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

import law_pages  # noqa: E402
import pictures_edges  # noqa: E402
import pictures_grains  # noqa: E402
import pictures_pores  # noqa: E402
import pictures_shock  # noqa: E402

DRAWN: dict[str, Callable[[ModuleType, Any], str]] = {
    **pictures_shock.DRAWN,
    **pictures_pores.DRAWN,
    **pictures_edges.DRAWN,
    **pictures_grains.DRAWN,
}
STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "svg.hashsalt": "bolide",  # the same law gives the same file
}


def picture_of(name: str) -> Callable[[ModuleType, Any], str]:
    """The picture of a law, its own or that of its folder or of the beginning of its name. Raises ``KeyError`` naming
    a law that has none."""
    if name in DRAWN:
        return DRAWN[name]
    folder, _, stem = name.rpartition("/")
    for key in (f"{folder}/{stem.partition('_')[0]}_", f"{folder}/"):
        if key in DRAWN:
            return DRAWN[key]
    raise KeyError(f"{name}.py has no picture: add one to DRAWN of docs/site/pictures_*.py")


def draw_law(name: str, path: Path) -> str:
    """Draw one law into ``path`` and return its caption."""
    from matplotlib import pyplot

    with pyplot.rc_context(STYLE):
        figure, axes = pyplot.subplots(1, 2, figsize=(8.0, 3.2), layout="constrained")
        caption = picture_of(name)(importlib.import_module(name.replace("/", ".")), axes)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, facecolor="white", metadata={"Date": None})
        pyplot.close(figure)
    return " ".join(caption.split())


def main(out: Path) -> int:
    """The command; returns its exit code."""
    try:
        for name in law_pages.names():
            print(name, draw_law(name, out / f"{law_pages.page_path(name)}.svg"), sep="\t")
    except KeyError as lacking:
        print(lacking.args[0], file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
