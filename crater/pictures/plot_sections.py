"""Pictures of cross-sections: by material, in time by damage, pressure and depth of origin, and several runs side by
side with their measures drawn in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crater.comparison.craters import Crater
from crater.drawing import sections
from crater.drawing.figure import figure, legend_outside, save
from crater.ground import datum as datums
from crater.ground.datum import Datum
from crater.pictures import plot_settled
from crater.results.findings import Findings
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from matter.wording import readable

MEASURE_COLOUR = "#e0a100"
GRAINS = ("4_handoff/start", "5_dem/last")


def _shots_of_shock(findings: Findings) -> list[tuple[str, Path]]:
    """The transient (largest volume), or, of a crater that still grew, what was handed over; and the end of the shock
    stage."""
    chosen: list[tuple[str, Path]] = []
    moment, words = findings.transient.get("volume"), "transient (maximum volume)"
    if findings.at_end_of_shock(moment):
        moment, words = findings.handed_over[0], "handoff"
    if moment is not None and moment.stage == "sph" and not findings.at_end_of_shock(moment):
        chosen.append((f"SPH, {words}, {readable.clock(moment.time)}", moment.path))
    if findings.shock is not None:
        chosen.append((f"SPH, end, {readable.clock(findings.shock.end_time)}", findings.shock.end_path))
    return chosen


def _datum_of(findings: Findings, particles: Particles) -> Datum:
    """The undisturbed surface about the stage's z axis (not about the crater's centre: the picture shows where the
    impact was aimed)."""
    if particles.attributes.get("frame") == "plane":
        return datums.plane()
    domain = particles.attributes.get("domain")
    radius = (
        float(domain["datum_radius_m"])
        if isinstance(domain, dict) and "datum_radius_m" in domain
        else findings.settings.target.radius
    )
    return datums.sphere(float(particles.attributes.get("target_radius_m", radius)))


def _clock(particles: Particles) -> str:
    """Time of a snapshot as text."""
    return readable.clock(float(particles.attributes.get("time", np.nan)))


def draw_cross_sections(findings: Findings, path: Path) -> None:
    """Slabs through the impact plane: shock stage at the transient and at the end, grains at the start and at the end,
    by material."""
    panels = [(title, snapshot.read(file)) for title, file in _shots_of_shock(findings)]
    for folder, word in zip(GRAINS, ("grains, handoff", "grains, end")):
        file = findings.inputs / f"{folder}{snapshot.SUFFIX}"
        if file.is_file():
            grains = snapshot.read(file)
            panels.append((f"{word}, {_clock(grains)}", grains))
    if not panels:
        return
    half = 1.1 * findings.settings.impact.expected_transient_diameter
    across = 1 if len(panels) < 3 else 2
    down = -(-len(panels) // across)
    fig = figure(9.0 if across == 1 else 11.0, 0.7 + (8.6 if across == 1 else 5.2) * 0.425 * down)
    grid = fig.subplots(down, across, sharex=True, sharey=True, squeeze=False)
    # grains stand beside, not below, the shock stage
    axes = grid.T.ravel()[: len(panels)]
    for axis in grid.T.ravel()[len(panels) :]:
        axis.set_visible(False)
    for axis, (title, particles) in zip(axes, panels):
        seen = sections.view(_datum_of(findings, particles), half)
        sections.draw_section(axis, particles, seen)
        axis.set_title(title, fontsize=9, loc="left")
    _label(grid, seen)
    marks = sections.material_marks([particles for _, particles in panels])
    legend_outside(fig, marks, fontsize=8)
    save(fig, path)


def _label(grid: np.ndarray, seen: sections.View) -> None:
    for axis in grid[:, 0]:
        axis.set_ylabel(f"height above the\nimpact point [{seen.unit}]", fontsize=9)
    for axis in grid[-1]:
        axis.set_xlabel(f"x, downrange [{seen.unit}]", fontsize=9)


def draw_in_time(findings: Findings, path: Path) -> None:
    """The shock stage at four times (columns) by damage, pressure, material and depth of origin (rows); rows that the
    snapshots lack are left out."""
    shots = snapshot.series(findings.inputs / "2_sph")
    if len(shots) < 2:
        return
    times = [float(snapshot.attributes(shot).get("time", np.nan)) for shot in shots]
    first = findings.transient.get("depth") or findings.transient.get("volume")
    grown = first.time if first is not None and first.stage == "sph" else times[len(times) // 3]
    wanted = [times[1], grown, min(2.0 * grown, times[-1]), times[-1]]
    chosen = sorted({int(np.argmin(np.abs(np.array(times) - t))) for t in wanted})
    panels = [(readable.clock(times[k]), snapshot.read(shots[k])) for k in chosen]
    half = 0.9 * findings.settings.impact.expected_transient_diameter
    rows: list[sections.Colouring | None] = [None]
    have = set(panels[0][1])
    rows += [sections.damage()] * ("damage" in have) + [sections.pressure()] * ("pressure" in have)
    rows += [sections.depth_of_origin(0.6 * half)] * ("initial_position" in have)
    _grid_of(findings, panels, rows, half, path)


def draw_grains_in_time(findings: Findings, path: Path) -> None:
    """The grains at handoff, halfway and at the end (columns) by material, depth of origin and speed (rows)."""
    files = [findings.inputs / f"{name}{snapshot.SUFFIX}" for name in GRAINS]
    if not files[-1].is_file():
        return
    middle = snapshot.series(findings.inputs / "5_dem")
    files = [files[0]] * files[0].is_file() + ([middle[len(middle) // 2]] if len(middle) > 2 else []) + [files[1]]
    panels = [(f"grains, {_clock(p)}", p) for p in map(snapshot.read, files)]
    half = 0.9 * findings.settings.impact.expected_transient_diameter
    rows: list[sections.Colouring | None] = [None]
    bed = findings.inputs / "3_bed" / f"bed{snapshot.SUFFIX}"
    if all("first_depth" in p for _, p in panels):  # of the matter; else where the grain itself lay
        rows.append(plot_settled.depth(0.6 * half))
    elif bed.is_file() and "identity" in panels[0][1]:
        start = snapshot.read(bed, only=("identity", "position"))
        if "identity" in start:
            rows.append(sections.depth_of_origin(0.6 * half, lambda grains: sections.bed_positions(grains, start)))
    if "velocity" in panels[0][1]:
        fastest = max(float(np.quantile(np.linalg.norm(p.velocity, axis=1), 0.99)) for _, p in panels)
        rows.append(sections.speed(max(fastest, 1e-9)))
    _grid_of(findings, panels, rows, half, path)


def _grid_of(
    findings: Findings,
    panels: Sequence[tuple[str, Particles]],
    rows: Sequence[sections.Colouring | None],
    half: float,
    path: Path,
) -> None:
    width = 2.6 * len(panels) + 1.2  # narrow: words stay readable when the picture shrinks to a page
    fig = figure(width, 0.8 + 1.45 * len(rows))
    grid = fig.subplots(len(rows), len(panels), sharex=True, sharey=True, squeeze=False)
    for row, colouring in enumerate(rows):
        drawn = None
        for column, (title, particles) in enumerate(panels):
            axis = grid[row, column]
            seen = sections.view(_datum_of(findings, particles), half, 0.55, 0.3)
            drawn = sections.draw_section(axis, particles, seen, colouring, edge="none")
            axis.tick_params(labelsize=8)
            if row == 0:
                axis.set_title(title, fontsize=10)
        if colouring is not None:
            fig.colorbar(drawn, ax=list(grid[row]), label=colouring.label, shrink=0.9, pad=0.01)
    for axis in grid[:, 0]:
        axis.set_ylabel(f"z [{seen.unit}]", fontsize=9)
    for axis in grid[-1]:
        axis.set_xlabel(f"x, downrange [{seen.unit}]", fontsize=9)
    marks = sections.material_marks([particles for _, particles in panels])
    legend_outside(fig, marks, fontsize=9)
    save(fig, path)


def draw_side_by_side(craters: Sequence[Crater], path: Path) -> None:
    """Cross-sections of the craters of runs beside each other on one scale: original surface and axis dashed, rim
    diameter, diameter and depth drawn in.

    Raises ``InputError`` naming a crater that has no snapshot or no datum.
    """
    panels = [_section_of(crater) for crater in craters]
    reach = max(panel["reach"] for panel in panels)
    across = min(3, len(panels))
    down = -(-len(panels) // across)
    fig = figure(5.4 * across, 0.5 + 2.75 * down)
    grid = fig.subplots(down, across, squeeze=False, sharex=True, sharey=True)
    for axis in grid.ravel()[len(panels) :]:
        axis.set_visible(False)
    for axis, panel in zip(grid.ravel(), panels):
        seen = sections.view(panel["datum"], reach, 0.5, 0.35)
        sections.draw_section(axis, panel["particles"], seen)
        axis.axvline(0.0, color="black", linewidth=0.8, linestyle="--")
        _draw_measures(axis, seen, panel["values"])
        axis.set_title(panel["title"], fontsize=9, loc="left")
        axis.text(
            0.02,
            0.04,
            panel["facts"],
            transform=axis.transAxes,
            fontsize=8,
            bbox=dict(facecolor="white", edgecolor="none", alpha=0.8, pad=2),
        )
    _label(grid, seen)
    marks = sections.material_marks([panel["particles"] for panel in panels])
    legend_outside(fig, marks, fontsize=8)
    save(fig, path)


def _section_of(crater: Crater) -> dict[str, Any]:
    if crater.snapshot is None or crater.datum is None:
        raise InputError(f"{crater.label} has no snapshot or no datum to draw a section of")
    particles = snapshot.read(crater.snapshot)
    values = {name: value for name, (value, _, _) in crater.values.items()}
    known = [values[name] for name in ("diameter_rim_m", "diameter_apparent_m") if name in values]
    distance = crater.datum.polar(particles.position)[0]
    reach = min(0.95 * max(known), float(distance.max())) if known else 0.5 * float(np.quantile(distance, 0.9))
    size = np.median(sections.size_of(particles, reach))
    packing = particles.attributes.get("packing_fraction")
    words = [
        f"N = {len(particles):,}",
        f"{'r' if 'radius' in particles else 'spacing'} = "
        f"{readable.length(0.5 * size if 'radius' in particles else size)}",
    ]
    words += [f"packing {float(packing):.2f}"] if packing is not None else []
    kind = "grains" if "radius" in particles else "SPH"
    when = _clock(particles)
    title = f"{crater.name}\n{crater.title} ({kind}, {when})"
    return {
        "datum": crater.datum,
        "particles": particles,
        "values": values,
        "reach": reach,
        "title": title,
        "facts": ", ".join(words),
    }


def _draw_measures(axis, seen: sections.View, values: dict[str, float]) -> None:
    """Rim diameter over the crests, apparent diameter on the datum, depth along the axis, each with its value."""
    arrow = dict(arrowstyle="<->", color=MEASURE_COLOUR, linewidth=1.6, shrinkA=0, shrinkB=0)
    box = dict(facecolor="white", edgecolor="none", alpha=0.75, pad=1.0)
    top = 0.78 * seen.high
    rim, crest = values.get("diameter_rim_m"), values.get("rim_height_m", 0.0)
    apparent, depth = values.get("diameter_apparent_m"), values.get("depth_m")
    if rim is not None:
        (left, right), (foot, _) = sections.on_section(
            seen, np.array([-0.5 * rim, 0.5 * rim]), np.array([crest, crest])
        )
        for x in (left, right):
            axis.plot([x, x], [foot, top * seen.scale], color=MEASURE_COLOUR, linewidth=0.8, linestyle=":")
        axis.annotate("", xy=(left, top * seen.scale), xytext=(right, top * seen.scale), arrowprops=arrow)
        axis.text(0.0, top * seen.scale, f"rim {readable.length(rim)}", ha="center", va="center", fontsize=8, bbox=box)
    level = 0.0
    if apparent is not None:
        (left, right), (z, _) = sections.on_section(seen, np.array([-0.5 * apparent, 0.5 * apparent]), np.zeros(2))
        axis.annotate("", xy=(left, z), xytext=(right, z), arrowprops=arrow)
        axis.text(0.55 * left, z, f"D {readable.length(apparent)}", ha="center", va="bottom", fontsize=8, bbox=box)
        level = z
    if depth is not None:
        axis.annotate("", xy=(0.0, 0.0), xytext=(0.0, -depth * seen.scale), arrowprops=arrow)
        axis.text(
            0.02 * seen.half * seen.scale,
            min(-0.5 * depth * seen.scale, level),
            f"d {readable.length(depth)}",
            ha="left",
            va="top",
            fontsize=8,
            bbox=box,
        )
