"""A scene inside a page that the reader turns: its numbers as a few arrays of bytes, drawn by ``turning_view.js`` and
a script of its own in the reader's browser.

No server, no network, no library. Without WebGL nothing of it shows, and the page's pictures stand alone.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter.files import archive
from matter.wording import page

COLOURS = 254
"""Colours of a map; bytes from here on stand for what has none."""


def render(template: str, words: str, facts: Mapping[str, Any], module: Path) -> str:
    """The scene of a ``template`` with its data: hidden until its own script, which lies beside ``module``, finds
    WebGL.

    ``words`` stand below the picture; ``facts``: what the script reads, with ``colours`` and the ``unit`` of its
    legend.
    """
    script = Path(__file__).with_suffix(".js").read_text() + module.with_suffix(".js").read_text()
    data = archive.json_text(facts, separators=(",", ":"))
    return page.render(template, "view", words=words, data=data, script=script)


def text(array: np.ndarray) -> str:
    """The bytes of an array as text."""
    return base64.b64encode(array.tobytes()).decode()


def colours(name: str) -> str:
    """Three bytes for each of the colours of a matplotlib map."""
    from matplotlib import colormaps

    return text((colormaps[name](np.linspace(0.0, 1.0, COLOURS))[:, :3] * 255).round().astype(np.uint8))
