"""The thesis' Figures 22 to 25 with our runs beside the published points: depth over diameter, impact angle,
projectile size, equal energy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from crater.drawing import figure as figures
from studies.winter_2017.evidence import KM, Run, Value
from studies.winter_2017.published import DEPTH, DIAMETER, MASSES, MPD, RADII, SPEEDS
from studies.winter_2017.table_9 import masses

PUBLISHED, OURS, LITERAL = figures.INK[5], figures.INK[0], figures.INK[1]
ANGLES = (("angle15", 15.0), ("base", 40.0), ("angle65", 65.0))


def draw_figures(runs: Mapping[str, Run], out: Path) -> None:
    """One picture of four panels, written to ``out``; runs that are missing leave their points out."""
    figure = figures.figure(11.0, 8.2)
    panels = figure.subplots(2, 2)
    _depth_over_diameter(panels[0, 0], runs)
    _angles(panels[0, 1], runs)
    _projectile(panels[1, 0], runs)
    _energy(panels[1, 1], runs)
    for panel in panels.flat:
        panel.grid(alpha=0.25, linewidth=0.6)
        panel.legend(fontsize=8, frameon=False)
    figures.save(figure, out)


def _of(runs: Mapping[str, Run], names: list[str], quantity: str, at: str = "depth") -> list[Value]:
    return [runs[name].transient(quantity, at) if name in runs else Value(math.nan, math.nan) for name in names]


def _points(panel, x: list[Value], y: list[Value], colour: str, label: str, marker: str = "o") -> None:
    panel.errorbar(
        [v.value * KM for v in x], [v.value * KM for v in y], xerr=[v.sigma * KM for v in x],
        yerr=[v.sigma * KM for v in y],
        fmt=marker, color=colour, capsize=3, linestyle="none", label=label,
    )  # fmt: skip


def _depth_over_diameter(panel, runs: Mapping[str, Run]) -> None:
    minus, plus = [DIAMETER[c][2] * KM for c in DIAMETER], [DIAMETER[c][1] * KM for c in DIAMETER]
    panel.errorbar(
        [DIAMETER[c][0] * KM for c in DIAMETER], [DEPTH[c] * KM for c in DEPTH], xerr=[minus, plus],
        yerr=[MPD[c] * KM for c in MPD],
        fmt="s", color=PUBLISHED, capsize=3, label="Winter 2017, Fig. 22",
    )  # fmt: skip
    for start, colour in (("base", OURS), ("literal", LITERAL)):
        names = [f"{case}_{start}" for case in DIAMETER]
        told = "relaxed start" if start == "base" else "literal start"
        _points(
            panel,
            _of(runs, names, "diameter_apparent_m"),
            _of(runs, names, "depth_m"),
            colour,
            f"ours, {told}, first maximum of depth",
        )
        for name in names:
            if name in runs:
                series = runs[name].series
                panel.plot(
                    series["diameter_apparent_m"] * KM, series["depth_m"] * KM, color=colour, linewidth=0.8, alpha=0.45
                )
    panel.set(
        xlabel="apparent diameter D [km]",
        ylabel="depth H [km]",
        xlim=(0, 1200),
        ylim=(0, 380),
        title="Fig. 22: depth over diameter (lines: in time)",
    )


def _angles(panel, runs: Mapping[str, Run]) -> None:
    for case, colour in (("350", figures.INK[2]), ("980", OURS)):
        names = [f"{case}_{name}" for name, _ in ANGLES]
        for quantity, marker, letter in (("depth_m", "v", "H"), ("diameter_apparent_m", "o", "D")):
            values = _of(runs, names, quantity)
            panel.errorbar(
                [angle for _, angle in ANGLES], [v.value * KM for v in values], yerr=[v.sigma * KM for v in values],
                fmt=f"{marker}-", color=colour, capsize=3, linewidth=1.0, label=f"{letter}, {case} km",
            )  # fmt: skip
    panel.set(
        xlabel="impact angle from the vertical [deg]",
        ylabel="D, H [km]",
        ylim=(0, None),
        title="Fig. 23: impact angle (published: no numbers)",
    )


def _projectile(panel, runs: Mapping[str, Run]) -> None:
    d = [2.0 * RADII[case][1] for case in DIAMETER]
    minus, plus = [DIAMETER[c][2] * KM for c in DIAMETER], [DIAMETER[c][1] * KM for c in DIAMETER]
    panel.errorbar(
        d,
        [DIAMETER[c][0] * KM for c in DIAMETER],
        yerr=[minus, plus],
        fmt="s",
        color=PUBLISHED,
        capsize=3,
        label="D, Winter 2017, Fig. 24",
    )
    panel.errorbar(
        d,
        [DEPTH[c] * KM for c in DEPTH],
        yerr=[MPD[c] * KM for c in MPD],
        fmt="v",
        color=PUBLISHED,
        capsize=3,
        label="H, Winter 2017, Fig. 24",
    )
    names = [f"{case}_base" for case in DIAMETER]
    for quantity, at, marker, label in (
        ("diameter_apparent_m", "depth", "o", "D, ours"),
        ("diameter_rim_m", "volume", "^", "rim to rim at maximum volume, ours"),
        ("depth_m", "depth", "v", "H, ours"),
    ):
        values = _of(runs, names, quantity, at)
        panel.errorbar(
            d,
            [v.value * KM for v in values],
            yerr=[v.sigma * KM for v in values],
            fmt=marker,
            color=OURS,
            capsize=3,
            label=label,
        )
    panel.set(
        xlabel="projectile diameter d [km]",
        ylabel="D, H [km]",
        ylim=(0, None),
        title="Fig. 24: size of the projectile (350: model 1)",
    )


def _energy(panel, runs: Mapping[str, Run]) -> None:
    for number, speed in enumerate(SPEEDS):
        colour = figures.INK[number]
        label = f"Table 9, {speed / 1e3:.5g} km/s"
        panel.plot(
            [DIAMETER[c][0] * KM for c in DIAMETER],
            [MASSES[c][number] for c in DIAMETER],
            "s",
            color=colour,
            markersize=5,
            label=label,
        )
        right = [masses(RADII[c][1] * 1e3)[number][1] / 1e16 for c in DIAMETER]
        panel.plot([DIAMETER[c][0] * KM for c in DIAMETER], right, color=colour, linewidth=0.8, alpha=0.6)
        for case in ("350", "980"):
            name = f"{case}_{('v1', 'base', 'v3', 'v4')[number]}"
            if name in runs and math.isfinite((D := runs[name].transient("diameter_apparent_m")).value):
                m = masses(RADII[case][1] * 1e3)[number][1] / 1e16
                panel.errorbar([D.value * KM], [m], xerr=[D.sigma * KM], fmt="o", color=colour, capsize=3)
    panel.plot([], [], "o", color="k", label="ours, first maximum of depth")
    panel.set(
        xlabel="apparent diameter D [km]",
        ylabel="mass [$10^{16}$ kg]",
        yscale="log",
        title="Fig. 25: masses of equal energy (lines: arithmetic)",
    )
