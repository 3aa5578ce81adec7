"""What every picture has in common: a matplotlib figure without a window, colours, grid, how it is written. matplotlib
is loaded only when one is drawn."""

from __future__ import annotations

from pathlib import Path

from matter.files import archive

INK = ("#1f4e79", "#c0392b", "#2e7d32", "#8e44ad", "#b9770e", "#37474f")
"""Colours of lines, in the order in which they are taken."""


def figure(width: float, height: float):
    """A matplotlib figure on the Agg canvas (no window, no global state)."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(fig)
    return fig


def save(fig, path: Path) -> None:
    """Write a figure; the file is whole or absent."""
    path = Path(path)
    kind = path.suffix[1:] or "png"
    with archive.replacing(path) as temporary:
        fig.savefig(temporary, format=kind, dpi=150)


def grid(axis) -> None:
    """A faint grid, and no frame above or to the right."""
    axis.grid(alpha=0.25, linewidth=0.6)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
