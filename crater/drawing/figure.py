"""What every picture has in common: a matplotlib figure without a window, colours, grid, how it is written. matplotlib
is loaded only when one is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matter.files import archive

INK = BLUE, RED, GREEN, VIOLET, OCHRE, GREY = "#1f4e79", "#c0392b", "#2e7d32", "#8e44ad", "#b9770e", "#37474f"
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


def legend_outside(
    fig, handles: Sequence[Any], labels: Sequence[str] | None = None, fontsize: float = 8.0, side: str = "upper"
) -> None:
    """One legend above (``side`` upper) or below all panels, in as many columns as the width of the figure holds:
    beyond it words are cut."""
    labels = [handle.get_label() for handle in handles] if labels is None else labels
    for columns in range(max(len(handles), 1), 0, -1):
        position = f"outside {side} center"
        legend = fig.legend(handles, labels, loc=position, ncols=columns, frameon=False, fontsize=fontsize)
        if columns == 1 or legend.get_window_extent(fig.canvas.get_renderer()).width <= fig.bbox.width:
            return
        legend.remove()


def grid(axis) -> None:
    """A faint grid, and no frame above or to the right."""
    axis.grid(alpha=0.25, linewidth=0.6)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
