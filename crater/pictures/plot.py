"""Pictures of craters: profiles, time series, height map, cross-sections. matplotlib is loaded only when a picture is
drawn."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crater.bodies import body_plot as plot_body
from crater.comparison.craters import Crater
from crater.comparison.observations import Zone
from crater.drawing.figure import BLUE, GREEN, INK, OCHRE, RED, VIOLET, figure, grid, legend_outside, save
from crater.ground.radial_profile import Profile
from crater.measures.measure import Measures
from crater.pictures import plot_ejecta, plot_excavation, plot_heights, plot_sections
from crater.pictures import plot_settled as plot_settled
from crater.results.findings import LATE_SHOCK, Findings
from crater.scaling import crater_size as scaling
from matter.wording import readable
from matter.wording.crater_measures import MAXIMA, TABLE


def _profile_line(axis, profile: Profile, scale: float, colour: str, label: str) -> None:
    known = np.isfinite(profile.height)
    axis.plot(profile.radius[known] * scale, profile.height[known] * scale, color=colour, linewidth=1.8, label=label)
    band = np.isfinite(profile.p16) & np.isfinite(profile.p84)
    if band.any():
        axis.fill_between(
            profile.radius[band] * scale,
            profile.p16[band] * scale,
            profile.p84[band] * scale,
            color=colour,
            alpha=0.15,
            linewidth=0,
        )


def draw_all(findings: Findings, out: Path) -> None:
    """Every picture of a run that there is material for: profile, time series, height map, cross-sections."""
    if findings.final is not None:
        draw_profiles(findings, out / "profile.png")
    if any(moment.measures for moment in findings.moments):
        draw_series(findings, out / "time_series.png")
    if findings.ejected.faster_than:
        plot_ejecta.draw_ejecta(findings, out / "ejecta.png")
    if findings.ejected.launch:
        plot_ejecta.draw_launches(findings, out / "launch.png")
    if findings.ejected.excavation:
        origin = findings.ejected.excavation
        plot_excavation.draw_depth_classes(
            origin["blanket"], origin["depth_m"] / origin["depth_over_transient_diameter"], out / "excavation.png"
        )
    if settled := findings.settled_matter:
        if any(sum(entry["mass_kg"]) > 0.0 for entry in settled["by_distance"]):
            plot_excavation.draw_depth_classes(
                settled["by_distance"], 2.0 * settled["radius_m"], out / "blanket.png", "distance"
            )
        if findings.setting.shape is None:
            plot_settled.draw_origin_sections(findings, out / "section_origin.png")
    if findings.final is not None:
        plot_heights.draw_heightmap(findings.final.measures, out / "heightmap.png")
    if findings.body:
        plot_body.draw_all(findings.body[-1], out)
    if findings.setting.shape is not None:  # its ground is no plane through which a section could be laid
        return
    plot_sections.draw_cross_sections(findings, out / "cross_section.png")
    plot_sections.draw_in_time(findings, out / "sections_in_time.png")
    plot_sections.draw_grains_in_time(findings, out / "sections_grains.png")


def draw_one(measures: Measures, name: str, folder: Path) -> None:
    """Profile and height map of a single snapshot."""
    scale, unit = readable.length_unit(float(measures.profile.radius[-1]))
    fig = figure(8.0, 4.2)
    axis = fig.add_subplot()
    _profile_line(axis, measures.profile, scale, BLUE, name)
    _mark(axis, measures, scale, BLUE)
    axis.axhline(0.0, color="black", linewidth=0.8, linestyle="--")
    axis.set(
        xlabel=f"distance from the crater's axis along the datum [{unit}]", ylabel=f"height above the datum [{unit}]"
    )
    axis.legend(frameon=False)
    grid(axis)
    save(fig, folder / "profile.png")
    plot_heights.draw_heightmap(measures, folder / "heightmap.png")


def _mark(axis, measures: Measures, scale: float, colour: str) -> None:
    """Apparent radius on the datum and the crest, with their errors."""
    apparent, depth = measures["diameter_apparent_m"], measures["depth_m"]
    if apparent.value is not None:
        axis.errorbar(
            [0.5 * apparent.value * scale],
            [0.0],
            xerr=[0.5 * (apparent.sigma or 0.0) * scale],
            fmt="o",
            color=colour,
            markersize=4,
            capsize=3,
        )
    if depth.value is not None:
        axis.errorbar(
            [0.0],
            [-depth.value * scale],
            yerr=[(depth.sigma or 0.0) * scale],
            fmt="o",
            color=colour,
            markersize=4,
            capsize=3,
        )
    rim, height = measures["diameter_rim_m"], measures["rim_height_m"]
    if rim.value is not None and height.value is not None:
        axis.errorbar(
            [0.5 * rim.value * scale],
            [height.value * scale],
            xerr=[0.5 * (rim.sigma or 0.0) * scale],
            yerr=[(height.sigma or 0.0) * scale],
            fmt="^",
            color=colour,
            markersize=5,
            capsize=3,
        )


def draw_profiles(findings: Findings, path: Path) -> None:
    """Transient, all-SPH late stage and granular late stage on one axis, with the published transient crater."""
    fig = figure(9.0, 5.0)
    axis = fig.add_subplot()
    lines: list[tuple[Measures, str, str]] = []
    moment = findings.transient.get("volume")
    grown = not findings.at_end_of_shock(moment)
    if grown and moment is not None and moment.measures is not None:
        lines.append((moment.measures, RED, f"transient, maximum volume (SPH, {readable.clock(moment.time)})"))
    late, grains = findings.late_sph, findings.settled_grains
    if late is not None:
        state = ", still growing" if findings.growing else ""
        lines.append((late.measures, BLUE, f"{LATE_SHOCK}{state} ({readable.clock(late.time)})"))
    if grains is not None:
        state = "settled grains" if grains.rest.settled else f"grains, {grains.rest.state}"
        lines.append((grains.measures, GREEN, f"{state}, DEM ({readable.clock(grains.time)})"))
    reach = max(float(measures.profile.radius[np.isfinite(measures.profile.height)][-1]) for measures, _, _ in lines)
    reach = min(reach, _interesting(findings, reach))
    scale, unit = readable.length_unit(reach)
    for measures, colour, label in lines:
        _profile_line(axis, measures.profile, scale, colour, label)
    if findings.ballistic is not None:
        ballistic_profile, when = findings.ballistic.profile, readable.clock(findings.ballistic.time)
        label = f"ballistic: free flight of the snapshot of {when}, no grains"
        axis.plot(
            ballistic_profile.radius * scale,
            ballistic_profile.height * scale,
            color="0.35",
            linewidth=1.2,
            linestyle=":",
            label=label,
        )
    if lines and moment is not None and moment.measures is not None:
        _mark(axis, moment.measures, scale, RED if grown else BLUE)
    _published_box(axis, findings, scale)
    axis.axhline(0.0, color="black", linewidth=0.8, linestyle="--")
    axis.set_xlim(-0.015 * reach * scale, reach * scale)
    axis.set(
        xlabel=f"distance from the crater's axis along the datum [{unit}]", ylabel=f"height above the datum [{unit}]"
    )
    axis.legend(frameon=False, fontsize=8, loc="lower right")
    if late is not None and grains is not None:
        axis.set_title(
            "The two late stages differ in method and in rheology: continuum with yield strength / grains with "
            "friction",
            fontsize=9,
        )
    grid(axis)
    save(fig, path)


def _interesting(findings: Findings, reach: float) -> float:
    sizes = [moment.value("diameter_apparent_m") for key, moment in findings.transient.items() if key != "diameter"]
    known = [size for size in sizes if np.isfinite(size)]
    return (
        min(reach, max(2.0 * max(known), 1.2 * findings.settings.impact.expected_transient_diameter))
        if known
        else reach
    )


def _published_box(axis, findings: Findings, scale: float) -> None:
    """Published transient diameter and depth as error bars on the axes that they belong to."""
    for row in findings.compared.reference:
        if not row["name"].startswith("transient"):
            continue
        low, high = row["minus"] * scale, row["plus"] * scale
        if "diameter" in row["name"]:
            r = 0.5 * row["value"] * scale
            axis.errorbar(
                [r],
                [0.0],
                xerr=[[0.5 * low], [0.5 * high]],
                fmt="s",
                color="black",
                markersize=4,
                capsize=3,
                label="published transient",
            )
        elif row["name"].endswith("depth_m"):
            axis.errorbar(
                [0.0], [-row["value"] * scale], yerr=[[low], [high]], fmt="s", color="black", markersize=4, capsize=3
            )


def _series(axis, findings: Findings, name: str, minute: float, scale: float) -> None:
    """A measure in time with its errors, of the shock stage and of the grains."""
    for stage, colour, word in (("sph", BLUE, "SPH"), ("dem", GREEN, "grains (DEM)")):
        chosen = [m for m in findings.moments if m.stage == stage]
        y = np.array([m.value(name) * scale for m in chosen])  # NaN breaks the line where a measure does not exist
        if np.isfinite(y).any():
            t, e = [m.time * minute for m in chosen], np.array([m.sigma(name) * scale for m in chosen])
            style = dict(color=colour, markersize=3, linewidth=1.2, elinewidth=0.7, capsize=2)
            axis.errorbar(t, y, yerr=e, fmt="o-", label=word, **style)


UNSURE = 0.25
"""Error over value from which a measure does not stretch the axis: a ringing body's far field may cross the datum
anywhere."""


def _top(axis, findings: Findings, name: str, scale: float) -> float:
    """Where the axis of a measure ends: above all that is known to better than ``UNSURE``, and above the bands."""
    sure = [m for m in findings.moments if m.sigma(name) <= UNSURE * abs(m.value(name))]
    tops = [(m.value(name) + m.sigma(name)) * scale for m in sure] + [
        float(patch.get_extents().transformed(axis.transData.inverted()).y1) for patch in axis.patches
    ]
    return 1.08 * max([0.0, *tops])


def draw_series(findings: Findings, path: Path) -> None:
    """D(t), depth(t) and V(t) with errors; the published transient values as bands, the scaling laws as a bracket."""
    fig = figure(9.0, 8.0)
    axes = fig.subplots(3, 1, sharex=True)
    widest = max(
        (abs(m.value("diameter_apparent_m")) for m in findings.moments if np.isfinite(m.value("diameter_apparent_m"))),
        default=2e3,
    )
    length, unit = readable.length_unit(widest)
    minute, clock = readable.time_unit(max((m.time for m in findings.moments), default=120.0))
    cubes = (1e-6 * length**3, "$10^6$ ") if unit == "km" and widest >= 1e5 else (length**3, "")
    rows = (
        ("diameter", f"apparent diameter [{unit}]", length),
        ("depth", f"depth below datum [{unit}]", length),
        ("volume", f"volume below datum [{cubes[1]}{unit}$^3$]", cubes[0]),
    )
    for axis, (moment, label, scale) in zip(axes, rows):
        _series(axis, findings, MAXIMA[moment], minute, scale)
        axis.set_ylabel(label)
        grid(axis)
    for row in findings.compared.reference:
        if row["name"] == "transient depth_m" or row["name"].startswith("transient diameter"):
            axis = axes[1] if "depth" in row["name"] else axes[0]
            low, high = (row["value"] - row["minus"]) * length, (row["value"] + row["plus"]) * length
            axis.axhspan(low, high, color="black", alpha=0.08, label="published transient")
            axis.axhline(row["value"] * length, color="black", linewidth=0.8, linestyle=":")
    if findings.compared.scaling:
        low, high = (x * length for x in findings.compared.scaling["range_m"])
        laws = ", ".join(scaling.NAMES[name] for name in findings.compared.scaling["range_of"])
        words = textwrap.fill(f"pi-scaling ({laws})", 60)
        axes[0].axhspan(low, high, color=OCHRE, alpha=0.15, label=words)
    for key, colour in (("volume", RED), ("depth", VIOLET)):
        if key in findings.transient and key not in findings.growing:
            for axis in axes:
                axis.axvline(
                    findings.transient[key].time * minute,
                    color=colour,
                    linewidth=0.8,
                    linestyle="--",
                    label=f"first maximum of {key}",
                )
    for axis, (moment, _, scale) in zip(axes, rows):
        axis.relim()
        axis.autoscale_view()
        axis.set_ylim(0.0, _top(axis, findings, MAXIMA[moment], scale) or None)
    handles, labels = axes[0].get_legend_handles_labels()
    legend_outside(fig, handles, labels, fontsize=8)
    axes[-1].set_xlabel(f"time after contact [{clock}]")
    save(fig, path)


def draw_comparison(craters: Sequence[Crater], path: Path) -> None:
    """All profiles on one axis, and diameter and depth with their errors beside."""
    fig = figure(10.0, 4.6 + 0.3 * len(craters))
    axis, sizes = fig.subplots(2, 1, height_ratios=[3.4, 0.5 + 0.3 * len(craters)])
    longest = max(
        [float(np.nanmax(c.profile.radius)) for c in craters if c.profile is not None]
        + [c.values[n][0] for c in craters for n in ("diameter_apparent_m",) if n in c.values]
        + [1.0]
    )
    diameters = [c.values["diameter_apparent_m"][0] for c in craters if "diameter_apparent_m" in c.values]
    reach = min(longest, 1.6 * max(diameters)) if diameters else longest
    scale, unit = readable.length_unit(reach)
    span = max(
        [zone.outer for crater in craters for zone in crater.zones] + [1.1 * size for size in diameters] + [1e-300]
    )
    for k, crater in enumerate(craters):
        colour = INK[k % len(INK)]
        if crater.profile is not None:
            _profile_line(axis, crater.profile, scale, colour, crater.label)
        for measure in TABLE:
            if measure.marker and measure.name in crater.values:
                value, minus, plus = (float(x) * scale for x in np.nan_to_num(crater.values[measure.name]))
                sizes.errorbar(
                    [value], [-k], xerr=[[minus], [plus]], fmt=measure.marker, color=colour, markersize=5, capsize=3
                )
        _zones(sizes, crater.zones, -k, scale, span, colour)
    axis.axhline(0.0, color="black", linewidth=0.8, linestyle="--")
    axis.set_xlim(0.0, reach * scale)
    axis.set(
        xlabel=f"distance from the crater's axis along the datum [{unit}]", ylabel=f"height above the datum [{unit}]"
    )
    if any(crater.profile is not None for crater in craters):
        axis.legend(frameon=False, fontsize=8)
    else:
        axis.text(0.5, 0.5, "none of these craters has a profile", ha="center", transform=axis.transAxes)
    sizes.set_yticks([-k for k in range(len(craters))], [textwrap.fill(c.label, 46) for c in craters], fontsize=8)
    sizes.set_ylim(-len(craters) + 0.5, 0.5)
    sizes.set_xlabel(
        f"circle: apparent diameter; triangles: rim diameter (up), depth (down); bars: zones by diameter [{unit}]",
        fontsize=8,
    )
    sizes.set_xlim(left=0.0)
    grid(axis)
    grid(sizes)
    save(fig, path)


def _zones(axis, zones: Sequence[Zone], level: float, scale: float, span: float, colour: str) -> None:
    """Mapped zones as bars with their names in them; where one is too narrow on an axis ``span`` [m] long, all names
    stand behind the last."""
    names = [zone.name.split(",")[0].split(" (")[0].replace(" ", "\n", 1) for zone in zones]
    lengths = [max(map(len, name.split("\n"))) for name in names]
    for n, zone in enumerate(zones):
        axis.barh(
            [level],
            [(zone.outer - zone.inner) * scale],
            left=[zone.inner * scale],
            height=0.7,
            color=colour,
            alpha=0.2 + 0.2 * (n % 3),
        )
    options: dict[str, Any] = dict(va="center", fontsize=6, clip_on=True, in_layout=False)
    if all(zone.outer - zone.inner > 0.006 * length * span for length, zone in zip(lengths, zones)):
        for name, zone in zip(names, zones):
            axis.text(0.5 * (zone.inner + zone.outer) * scale, level, name, ha="center", **options)
    elif zones:
        ends = [f"{zone.name.split(' (')[0]}: up to {readable.length(zone.outer)}" for zone in zones]
        axis.text(zones[-1].outer * scale + 0.01 * span * scale, level, "; ".join(ends), ha="left", **options)
