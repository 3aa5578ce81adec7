"""Pictures of an inversion: the corner with the prior in grey, members left out, observed beside predicted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from crater.drawing.figure import INK, figure, grid, save
from pipeline.inverse import posterior, verdict
from pipeline.inverse.inversion import Inversion

CORNER, LEFT_OUT = "corner.png", "left_out.png"
_BAR = 0.6
_GREY, _BINS, _DRAWS = "#b8bec4", 40, 1 << 13


def corner(found: Inversion) -> Any:
    """The figure: each parameter's density over that of its prior, and each pair: prior as grey points, the regions
    that hold 39 and 86 % of the posterior (1 and 2 sigma of a normal distribution in two dimensions)."""
    names, size = found.design.names, len(found.priors)
    before = _columns(found, posterior.prior_draws(found.priors, _DRAWS, found.seed))
    after = _columns(found, found.posterior.drawn(8 * _DRAWS, found.seed))
    ranges = [(float(column.min()), float(column.max())) for column in before.T]
    fig = figure(2.2 + 1.9 * size, 1.4 + 1.9 * size)
    panels = fig.subplots(size, size, squeeze=False)
    for row in range(size):
        for column in range(size):
            axes = panels[row][column]
            if column > row:
                axes.set_axis_off()
                continue
            axes.set_xlim(ranges[column])
            if row == column:
                _density(axes, before[:, row], after[:, row], ranges[row])
            else:
                axes.set_ylim(ranges[row])
                _pair(axes, before[:, [column, row]], after[:, [column, row]], ranges[column], ranges[row])
            _labels(found, axes, row, column, names)
            grid(axes)
    return fig


def _columns(found: Inversion, theta: np.ndarray) -> np.ndarray:
    """Parameters (n, d) as they are drawn: angles in degrees, the decadic logarithm where that is even, the numbers of
    the values of "choices" spread over the width of a bar."""
    columns = []
    for k, (prior, unit) in enumerate(zip(found.priors.values(), found.design.units)):
        values = theta[:, k] * verdict.unit_of(unit)[0]
        if prior.values:
            values = values + _BAR * (np.random.default_rng(found.seed).random(len(values)) - 0.5)
        columns.append(np.log10(values) if prior.distribution == "log_uniform" else values)
    return np.stack(columns, axis=1)


def _density(axes: Any, before: np.ndarray, after: np.ndarray, limits: tuple[float, float]) -> None:
    look = {"bins": _BINS, "range": limits, "density": True, "histtype": "stepfilled"}
    axes.hist(before, color=_GREY, label="prior", **look)
    axes.hist(after, color=INK[0], alpha=0.7, label="posterior", **look)
    axes.set_yticks([])


def _pair(axes: Any, before: np.ndarray, after: np.ndarray, x: tuple[float, float], y: tuple[float, float]) -> None:
    from scipy.ndimage import gaussian_filter

    axes.plot(*before[:600].T, ".", color=_GREY, markersize=2)
    height, across, up = np.histogram2d(after[:, 0], after[:, 1], bins=_BINS, range=(x, y))
    height = gaussian_filter(height, 1.0)
    falling = np.sort(height.ravel())[::-1]
    held = np.cumsum(falling) / falling.sum()
    levels = [float(falling[np.searchsorted(held, part)]) for part in (0.86, 0.39)]
    if levels[0] < levels[1]:
        middle = 0.5 * (across[1:] + across[:-1]), 0.5 * (up[1:] + up[:-1])
        axes.contourf(*middle, height.T, [*levels, float(height.max()) * 1.01], colors=["#9dbad6", INK[0]], alpha=0.8)


def _labels(found: Inversion, axes: Any, row: int, column: int, names: tuple[str, ...]) -> None:
    size = len(names)

    def words(k: int) -> str:
        symbol = verdict.unit_of(found.design.units[k])[1]
        short = f"{verdict.name_of(names[k])}{f' [{symbol}]' if symbol else ''}"
        return f"log₁₀ {short}" if found.priors[names[k]].distribution == "log_uniform" else short

    for k, axis in ((column, axes.xaxis), (row, axes.yaxis)):
        values = found.priors[names[k]].values
        if values and not (row == column and axis is axes.yaxis):
            axis.set_ticks(range(len(values)), [str(value) for value in values])

    axes.tick_params(labelsize=7)
    if row == size - 1:
        axes.set_xlabel(words(column), fontsize=8)
    else:
        axes.set_xticklabels([])
    if column == 0 and row:
        axes.set_ylabel(words(row), fontsize=8)
    elif row != column:
        axes.set_yticklabels([])
    if row == column == 0:
        axes.legend(fontsize=7, frameon=False)


def left_out(found: Inversion) -> Any:
    """The figure: every member against what the others predict of it, and what was observed beside the posterior's
    prediction."""
    fig = figure(4.6 * len(found.observed), 4.0)
    for number, one in enumerate(found.observed):
        axes = fig.add_subplot(1, len(found.observed), number + 1)
        members = found.emulator(one.name).left_out()
        truth, mean = np.exp(members.truth), np.exp(members.mean)
        look = {"fmt": "o", "color": INK[0], "markersize": 3, "linewidth": 0.8}
        axes.errorbar(truth, mean, mean * members.sd, label="members", **look)
        ends = [truth.min(), truth.max()]
        axes.plot(ends, ends, color=_GREY, zorder=0)
        predicted = np.quantile(found.predicted(one.name), (0.16, 0.5, 0.84))
        axes.errorbar(
            one.value, predicted[1], [[predicted[1] - predicted[0]], [predicted[2] - predicted[1]]],
            [[one.minus], [one.plus]],
            fmt="s", color=INK[1], markersize=5, capsize=2, label="observed, and the posterior's prediction",
        )  # fmt: skip
        unit = f" [{one.unit}]" if one.unit not in ("", "1") else ""
        axes.set(xlabel=f"{one.name}{unit}", ylabel="predicted by the others")
        axes.legend(fontsize=7, frameon=False)
        grid(axes)
    return fig


def write(found: Inversion, folder: Path) -> None:
    """Write the pictures of an inversion."""
    save(corner(found), folder / CORNER)
    save(left_out(found), folder / LEFT_OUT)
