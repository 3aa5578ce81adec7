"""The height map as a picture: every column seen from above, with the datum's level and the apparent diameter."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from crater.drawing.figure import figure, save
from crater.measures.measure import Measures
from matter.wording import readable


def draw_heightmap(measures: Measures, path: Path) -> None:
    """Height of every column, looking down on the crater: the colours are finest near the datum, where a crater
    ends."""
    from matplotlib.colors import AsinhNorm
    from matplotlib.ticker import FixedLocator

    ground = measures.ground
    columns = ground.columns
    ring = columns.ring
    reach = float(columns.edges[-1])
    apparent = measures["diameter_apparent_m"].value
    if apparent:
        reach = min(reach, 1.5 * apparent)
    scale, unit = readable.length_unit(reach)
    s, a = columns.distance[ring], columns.azimuth
    good = np.isfinite(ground.rays) & (s < reach)
    x, y, h = s[good] * np.cos(a[good]) * scale, s[good] * np.sin(a[good]) * scale, ground.rays[good] * scale
    limit = max(float(np.quantile(np.abs(h), 0.995)), 1e-9) if len(h) else 1.0
    fig = figure(6.6, 5.4)
    axis = fig.add_subplot(aspect="equal")
    drawn = axis.tripcolor(x, y, h, shading="gouraud", cmap="RdBu_r", norm=AsinhNorm(0.1 * limit, -limit, limit))
    fig.colorbar(
        drawn,
        ax=axis,
        shrink=0.8,
        label=f"height above the datum [{unit}]",
        ticks=FixedLocator(_even_ticks(limit)),
        format="%g",
    )
    if apparent:
        angle = np.linspace(0.0, 2.0 * np.pi, 200)
        ring_at = 0.5 * apparent * scale
        axis.plot(
            ring_at * np.cos(angle),
            ring_at * np.sin(angle),
            "k--",
            linewidth=1.0,
            label=f"apparent diameter, {readable.length(apparent)}",
        )
        cx, cy, level = _smoothed(measures, 1.3 * 0.5 * apparent)
        axis.contour(cx * scale, cy * scale, level, levels=[0.0], colors="#1b7f3b", linewidths=1.0)
        axis.plot([], [], color="#1b7f3b", linewidth=1.0, label="level of the datum, smoothed over a spacing")
        axis.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.1), ncols=2, frameon=False)
    axis.set(xlabel=f"x, downrange [{unit}]", ylabel=f"y [{unit}]")
    save(fig, path)


def _even_ticks(limit: float) -> list[float]:
    """Ticks of a colour scale that is finest about zero: 0 and a few round heights to both sides."""
    top = 10.0 ** np.floor(np.log10(limit))
    sizes = [
        size
        for size in (0.05 * top, 0.1 * top, 0.2 * top, 0.5 * top, top, 2.0 * top, 5.0 * top)
        if 0.04 * limit < size <= limit
    ]
    return [-size for size in reversed(sizes)] + [0.0] + sizes


def _smoothed(measures: Measures, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Heights [m] on a square grid within ``reach`` [m], averaged over one spacing; NaN further out."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.ndimage import gaussian_filter

    ground, columns = measures.ground, measures.ground.columns
    good, s = np.isfinite(ground.rays), columns.distance[columns.ring]
    axis = np.linspace(-1.2 * reach, 1.2 * reach, 161)
    x, y = np.meshgrid(axis, axis)
    level = LinearNDInterpolator(
        np.column_stack([s * np.cos(columns.azimuth), s * np.sin(columns.azimuth)])[good], ground.rays[good]
    )(x, y)
    level = gaussian_filter(
        np.nan_to_num(level), 0.5 * float(np.median(columns.spacing[columns.distance < reach])) / (axis[1] - axis[0])
    )
    return x, y, np.where(np.hypot(x, y) < reach, level, np.nan)
