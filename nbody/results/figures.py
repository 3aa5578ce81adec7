"""Pictures of a census: figures 14-18 of the thesis with error bars, and the tables from which they are drawn."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from matter.files import archive
from nbody.masses.system import Body
from nbody.population import encounters
from nbody.results import census_tables
from nbody.results.census_tables import Table

BIN = 100.0  # m/s: the width that reproduces the heights printed in Winter 2017, section 2.3.2
ANGLE_BIN = 5.0  # deg
FORMAT = dict(capsize=0, linewidth=1.0, elinewidth=0.8)


def histogram(values: np.ndarray, weights: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted counts in bins and their errors sqrt(sum w^2)."""
    counts, _ = np.histogram(values, edges, weights=weights)
    squares, _ = np.histogram(values, edges, weights=weights**2)
    return counts, np.sqrt(squares)


def _axes(rows: int, columns: int, width: float = 9.0, height: float = 3.2):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height * rows), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def _steps(axis, edges: np.ndarray, counts: np.ndarray, errors: np.ndarray, label: str, colour: str) -> None:
    middle = 0.5 * (edges[1:] + edges[:-1])
    axis.stairs(counts, edges, color=colour, label=label)
    shown = counts > 0
    axis.errorbar(middle[shown], counts[shown], errors[shown], fmt="none", ecolor=colour, alpha=0.5, **FORMAT)


def _save(out: Path, name: str, figure, header: Sequence[str], rows) -> None:
    figure.savefig(out / f"{name}.png", dpi=130)
    archive.write_text(out / f"{name}.csv", census_tables.rows_as_csv(header, rows))


def speed_edges(table: Table) -> np.ndarray:
    """Bins of 0.1 km/s (wider for few events) over all speeds [m/s]."""
    fastest = table["speed"].max() if len(table["speed"]) else 1e3
    width = BIN * max(1, round(5000 / max(len(table["speed"]) / 8, 1)) if len(table["speed"]) < 16000 else 1)
    return np.arange(0.0, fastest + 2.0 * min(width, 1000.0), min(width, 1000.0))


def events_over_speed(table: Table, moons: Sequence[Body], out: Path) -> None:
    """Figure 14: all kinds of events over the relative speed."""
    edges, rows = speed_edges(table), []
    figure, axes = _axes(len(moons), 1)
    colours = {1: "tab:blue", 2: "tab:red", 3: "tab:green", 4: "tab:orange"}
    for index, moon in enumerate(moons):
        for kind, label in encounters.KINDS.items():
            mask = (table["moon"] == index) & (table["event"] == kind) & (table["direct"] == 0)
            counts, errors = histogram(table["speed"][mask], table["weight"][mask], edges)
            _steps(axes[index, 0], edges / 1e3, counts, errors, label, colours[kind])
            rows += [
                [moon.name, label, float(e / 1e3), float(c), float(s)] for e, c, s in zip(edges, counts, errors) if c
            ]
        axes[index, 0].set(
            title=moon.title, xlabel="relative speed [km/s]", ylabel=f"weight per {edges[1] / 1e3:.1f} km/s"
        )
        axes[index, 0].legend(fontsize=8)
    _save(out, "figure_14_events_over_speed", figure, ["moon", "event", "speed_low_km_s", "weight", "error"], rows)


def impacts_over_speed(table: Table, moons: Sequence[Body], out: Path) -> None:
    """Figure 15: impact speeds, prograde against retrograde (left), before against after the passage of Jupiter
    (right)."""
    edges, rows = speed_edges(table), []
    figure, axes = _axes(len(moons), 2, width=11.0)
    for index, moon in enumerate(moons):
        hit = census_tables.hits(table, index)
        for number, (name, mask) in enumerate(census_tables.subsets(hit).items()):
            counts, errors = histogram(hit["speed"][mask], hit["weight"][mask], edges)
            axis = axes[index, number // 2]
            _steps(axis, edges / 1e3, counts, errors, name, ("tab:blue", "tab:red")[number % 2])
            axis.set(title=moon.title, xlabel="impact speed [km/s]", ylabel=f"weight per {edges[1] / 1e3:.1f} km/s")
            axis.legend(fontsize=8)
            rows += [
                [moon.name, name, float(e / 1e3), float(c), float(s)] for e, c, s in zip(edges, counts, errors) if c
            ]
    _save(out, "figure_15_impacts_over_speed", figure, ["moon", "subset", "speed_low_km_s", "weight", "error"], rows)


def approach_ratio(table: Table, moons: Sequence[Body], target: int, out: Path) -> None:
    """Figure 16: speed at impact over speed at the closest approach, against the distance of the latter."""
    distance, value, weight = census_tables.pairs(table, target)
    figure, axes = _axes(1, 1, width=7.0, height=4.0)
    axes[0, 0].plot(distance / 1e6, value, ".", markersize=2, alpha=0.5)
    edges = np.linspace(0.0, max(distance.max(initial=1.0), 1.0), 11)
    rows = []
    for low, high in itertools.pairwise(edges):
        inside = (distance >= low) & (distance < high)
        if inside.sum() > 1:
            mean = census_tables.weighted_mean(value[inside], weight[inside])
            rows.append(
                [
                    float(low / 1e6),
                    float(high / 1e6),
                    mean.value,
                    mean.standard_error,
                    float(value[inside].max()),
                    mean.impacts,
                ]
            )
            axes[0, 0].errorbar(
                [(low + high) / 2e6], [mean.value], [mean.standard_error], fmt="o", color="tab:red", markersize=4
            )
    axes[0, 0].set(title=f"{moons[target].title} (red: means)", xlabel="distance of the closest approach [1000 km]")
    axes[0, 0].set_ylabel("v(impact) / v(closest approach)")
    header = ["distance_low_1000_km", "distance_high_1000_km", "mean_ratio", "error", "maximum", "entries"]
    _save(out, "figure_16_impact_over_approach", figure, header, rows)


def _angles(axis, hit: Table, mask: np.ndarray, label: str, colour: str) -> list:
    edges = np.arange(0.0, 90.0 + ANGLE_BIN, ANGLE_BIN)
    counts, errors = histogram(np.degrees(hit["angle"][mask]), hit["weight"][mask], edges)
    mean = census_tables.mean_angle(hit, mask)
    text = f"{label}: mean {mean.value:.2f} +- {mean.standard_error:.2f} deg"
    _steps(axis, edges, counts, errors, text, colour)
    return [[label, float(e), float(c), float(s)] for e, c, s in zip(edges, counts, errors)]


def impact_angles(table: Table, moons: Sequence[Body], target: int, out: Path) -> None:
    """Figure 17: impact angles of all impacts with Gilbert's sin 2 gamma."""
    hit = census_tables.hits(table, target)
    figure, axes = _axes(1, 1, width=7.0, height=4.0)
    rows = _angles(axes[0, 0], hit, np.ones(len(hit["angle"]), bool), moons[target].title, "tab:blue")
    gamma = np.linspace(0.0, 90.0, 181)
    law = np.sin(np.radians(2.0 * gamma)) * hit["weight"].sum() * math.radians(ANGLE_BIN)
    axes[0, 0].plot(gamma, law, "k--", linewidth=1, label="sin 2 gamma")
    axes[0, 0].set(xlabel="angle from the vertical [deg]", ylabel=f"weight per {ANGLE_BIN:.0f} deg")
    axes[0, 0].legend(fontsize=8)
    _save(out, "figure_17_impact_angles", figure, ["set", "angle_low_deg", "weight", "error"], rows)


def basin_angles(table: Table, moons: Sequence[Body], target: int, out: Path) -> None:
    """Figure 18: impact angles at the latitudes of Valhalla and Asgard."""
    hit = census_tables.hits(table, target)
    figure, axes = _axes(1, 1, width=7.0, height=4.0)
    rows = []
    for (name, window), colour in zip(census_tables.BASINS.items(), ("tab:red", "tab:blue")):
        label = f"{name} ({window[0]}-{window[1]} deg)"
        rows += _angles(axes[0, 0], hit, census_tables.in_band(hit, *window), label, colour)
    axes[0, 0].set(
        title=moons[target].title, xlabel="angle from the vertical [deg]", ylabel=f"weight per {ANGLE_BIN:.0f} deg"
    )
    axes[0, 0].legend(fontsize=8)
    _save(out, "figure_18_basin_angles", figure, ["set", "angle_low_deg", "weight", "error"], rows)


def latitude_dependence(table: Table, moons: Sequence[Body], target: int, out: Path) -> None:
    """Table 7 as a picture: mean angle and impacts per area against |latitude|, with the beam model."""
    from nbody.results import analytic

    hit, width = census_tables.hits(table, target), 7.5
    figure, axes = _axes(1, 2, width=11.0, height=4.0)
    lows = np.arange(0.0, 90.0, width)
    model, fraction = analytic.beam_angles(np.radians(np.stack([lows, lows + width], axis=1)))
    rows = []
    for low, angle, part in zip(lows, model, fraction):
        inside = census_tables.in_band(hit, low, low + width)
        area = math.sin(math.radians(low + width)) - math.sin(math.radians(low))
        mean, weight = census_tables.mean_angle(hit, inside), hit["weight"][inside]
        density = weight.sum() / hit["weight"].sum() / area if len(weight) else 0.0
        error = math.sqrt((weight**2).sum()) / hit["weight"].sum() / area if len(weight) else 0.0
        rows.append(
            [
                float(low),
                float(low + width),
                mean.value,
                mean.standard_error,
                float(np.degrees(angle)),
                density,
                error,
                part / area,
            ]
        )
    lower, upper, mean_deg, mean_error, beam_deg, per_area, per_area_error, beam_per_area = np.array(rows, float).T
    middle = 0.5 * (lower + upper)
    axes[0, 0].errorbar(middle, mean_deg, mean_error, fmt="o", markersize=4, label="census")
    axes[0, 0].plot(middle, beam_deg, "k--", linewidth=1, label="beam, 22 deg")
    axes[0, 0].axhline(45.0, color="grey", linewidth=0.6)
    axes[0, 0].set(title=moons[target].title, xlabel="|latitude| [deg]", ylabel="mean angle from the vertical [deg]")
    axes[0, 1].errorbar(middle, per_area, per_area_error, fmt="o", markersize=4, label="census")
    axes[0, 1].plot(middle, beam_per_area, "k--", linewidth=1, label="beam, 22 deg")
    axes[0, 1].set(xlabel="|latitude| [deg]", ylabel="impacts per area over the mean")
    for axis in axes[0]:
        axis.legend(fontsize=8)
    header = [
        "latitude_low_deg",
        "latitude_high_deg",
        "mean_angle_deg",
        "error",
        "beam_model_deg",
        "per_area",
        "error",
        "beam_per_area",
    ]
    _save(out, "latitude_dependence", figure, header, rows)
