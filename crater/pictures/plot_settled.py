"""Picture of the settled crater by what its matter went through: cross-sections by shock stage, largest pressure and
first depth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from crater.drawing import sections
from crater.drawing.figure import figure, save
from crater.ground.datum import Datum
from crater.results.findings import Findings
from matter.files import snapshot
from matter.particles import Particles
from matter.wording import readable

STAGES = ("less", "begins to melt", "molten", "vapour")
_HALF = 0.5


def stage_of(grains: Particles) -> np.ndarray:
    """The last of ``STAGES`` (its number) that at least half of each grain's mass was shocked to."""
    fields = ("melting_fraction", "melt_fraction", "vapour_fraction")
    return np.max([np.where(grains[name] >= _HALF, k + 1, 0) for k, name in enumerate(fields)], axis=0).astype(float)


def colourings(grains: Particles, half: float) -> list[sections.Colouring]:
    """What there is to colour by: shock stage (where a grain reached one), pressure, first depth down to ``half``."""
    rows: list[sections.Colouring] = []
    if "melt_fraction" in grains and stage_of(grains).any():
        rows.append(
            sections.Colouring(
                "shock stage", "shock stage", lambda p, datum: stage_of(p), 0.0, len(STAGES) - 1.0, colours="YlOrRd"
            )
        )
    if "peak_pressure_mean" in grains:
        highest = max(float(np.quantile(grains.peak_pressure_mean, 0.999)) * 1e-9, 1e-6)

        def pressure(particles: Particles, datum: Datum) -> np.ndarray:
            return np.maximum(particles.peak_pressure_mean * 1e-9, 1e-3 * highest)

        rows.append(
            sections.Colouring("peak", "largest pressure [GPa]", pressure, 1e-3 * highest, highest, True, "magma")
        )
    return [*rows, depth(half)]


def depth(deepest: float) -> sections.Colouring:
    """First depth of the matter that grains stand for, 0 to ``deepest`` [m]; projectile alone in its own colour."""
    scale, unit = readable.length_unit(deepest)
    return sections.Colouring(
        "depth of origin", f"depth of origin [{unit}]", lambda p, datum: p.first_depth * scale, 0.0, deepest * scale,
        colours="viridis_r",
    )  # fmt: skip


def draw_origin_sections(findings: Findings, path: Path) -> None:
    """Slabs through the final crater in grains, one below the other; nothing where the grains do not say where their
    matter came from."""
    last = findings.settled_grains
    if last is None:
        return
    grains = snapshot.read(last.path)
    if "first_depth" not in grains:
        return
    half = 1.6 * 0.5 * float(last.measures["diameter_apparent_m"].value or np.nan)
    if not half > 0.0:
        return
    rows = colourings(grains, 0.5 * half)
    fig = figure(8.0, 0.6 + 2.6 * len(rows))
    axes = fig.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    seen = sections.view(last.measures.datum, half, 0.45, 0.2)
    for axis, colouring in zip(axes, rows):
        drawn = sections.draw_section(axis, grains, seen, colouring, edge="none")
        bar = fig.colorbar(drawn, ax=axis, label=colouring.label, shrink=0.9, pad=0.01)
        if colouring.name == "shock stage":
            bar.set_ticks(range(len(STAGES)), labels=STAGES)
        axis.set_ylabel(f"z [{seen.unit}]")
    axes[-1].set_xlabel(f"x, downrange [{seen.unit}]")
    fig.suptitle(f"the settled crater, {readable.clock(last.time)}", fontsize=10)
    save(fig, path)
