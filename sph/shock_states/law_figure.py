"""What the pictures of laws share (``python -m sph.eos tillotson basalt`` and its like): the command's form, and one
file as the result."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from matter.errors import InputError
from matter.wording import drawing


def command(
    folder: str,
    about: str,
    laws: Sequence[str],
    draw: Callable[[str, str, Any], str],
    arguments: Sequence[str] | None = None,
) -> int:
    """Run ``python -m sph.<folder> LAW MATERIAL [--out FILE]``: ``draw(law, material, axes)`` fills two axes side by
    side and returns a table to print.

    Returns the exit code: 0, or 2 with one message for a material or law that does not fit.
    """
    parser = argparse.ArgumentParser(prog=f"python -m sph.{folder}", description=about)
    parser.add_argument("law", choices=laws)
    parser.add_argument("material")
    parser.add_argument("--out", type=Path, default=None, help="the picture (default: LAW_MATERIAL.png)")
    options = parser.parse_args(arguments)
    try:
        drawing.require("the picture of a law")
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    try:
        print(draw(options.law, options.material, axes))
        path = options.out or Path(f"{options.law}_{options.material}.png")
        if not path.parent.is_dir():
            raise InputError(f"no folder {path.parent}")
        figure.suptitle(f"{options.material}: {options.law}")
        figure.savefig(path, dpi=150)
        print(path)
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    finally:
        pyplot.close(figure)
    return 0
