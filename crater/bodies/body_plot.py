"""Pictures of a body before and after an impact: the change of height in latitude and longitude, outlines in three
cuts. matplotlib is loaded only when one is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from crater.bodies.body_findings import BodyStage, latitude_longitude
from crater.drawing.figure import INK, figure, grid, save
from matter.wording import readable

HEIGHTS, RESURFACED, OUTLINES = "body_heights.png", "body_made_anew.png", "body_outlines.png"
_ABOUT = 40.0
"""Half the width of the map about the site [deg]."""
_MIXED = 4


def draw_all(stage: BodyStage, folder: Path) -> None:
    """Every picture of a body."""
    chart = stage.compared.chart
    limit = max(float(np.quantile(np.abs(chart.change), 0.998)), 1e-9)
    scale, unit = readable.length_unit(limit)
    style = dict(cmap="RdBu_r", vmin=-limit * scale, vmax=limit * scale)
    _draw(stage, chart.change * scale, f"change of height along the normal [{unit}]", style, folder / HEIGHTS)
    deepest = max(float(chart.deep.max()), float(chart.spacing.min()))
    scale, unit = readable.length_unit(deepest)
    style = dict(cmap="YlOrBr", vmin=0.0, vmax=deepest * scale)
    _draw(stage, chart.deep * scale, f"depth to which the surface is resurfaced [{unit}]", style, folder / RESURFACED)
    draw_outlines(stage, folder / OUTLINES)


def on_directions(stage: BodyStage, values: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Values (n,) of the map in some directions (m, 3) from the centre in the body's own frame, mixed of the nearest
    points."""
    own = stage.compared.chart.points.position @ stage.compared.shape.placed.turn
    tree = cKDTree(own / np.linalg.norm(own, axis=1)[:, None])
    away, near = tree.query(direction, k=_MIXED)
    weight = 1.0 / np.maximum(away, 1e-9) ** 2
    return np.asarray((values[near] * weight).sum(axis=1) / weight.sum(axis=1))


def _draw(stage: BodyStage, values: np.ndarray, label: str, style: dict[str, Any], path: Path) -> None:
    """A map of the whole body in latitude and longitude, and one of the surroundings of the site."""
    from matplotlib.ticker import MultipleLocator

    placed = stage.compared.shape.placed
    site = np.array([[0.0, 0.0, placed.height]]) @ placed.turn
    lat0, lon0 = (float(angle[0]) for angle in latitude_longitude(site))
    fig = figure(11.0, 3.9)
    whole, near = fig.subplots(1, 2, width_ratios=[1.9, 1.0])
    spans = ((lon0 - 180.0, lon0 + 180.0, -90.0, 90.0), _about(lat0, lon0))
    for axis, (west, east, south, north) in zip((whole, near), spans):
        lon, lat = np.meshgrid(np.linspace(west, east, 361), np.linspace(south, north, 181))
        cos = np.cos(np.radians(lat))
        towards = np.stack([cos * np.cos(np.radians(lon)), cos * np.sin(np.radians(lon)), np.sin(np.radians(lat))], -1)
        shown = on_directions(stage, values, towards.reshape(-1, 3)).reshape(lon.shape)
        drawn = axis.pcolormesh(lon, lat, shown, shading="nearest", rasterized=True, **style)
        axis.plot(lon0, lat0, "k+", markersize=9)
        axis.set(xlim=(west, east), ylim=(south, north), xlabel="longitude, east [deg]")
        axis.xaxis.set_major_locator(MultipleLocator(45.0 if axis is whole else 15.0))
        axis.yaxis.set_major_locator(MultipleLocator(30.0 if axis is whole else 15.0))
        axis.xaxis.set_major_formatter(lambda angle, _: f"{angle % 360.0:g}")
        axis.set_aspect(1.0 if axis is whole else 1.0 / max(np.cos(np.radians(lat0)), 0.2))
    whole.set_ylabel("latitude [deg]")
    whole.set_title(f"{readable.clock(stage.time)}; the cross is the site", fontsize=9, loc="left")
    near.set_title("about the site", fontsize=9, loc="left")
    fig.colorbar(drawn, ax=[whole, near], label=label, shrink=0.85)
    save(fig, path)


def _about(lat: float, lon: float) -> tuple[float, float, float, float]:
    wide = min(_ABOUT / max(np.cos(np.radians(lat)), 0.2), 180.0)
    return lon - wide, lon + wide, max(lat - _ABOUT, -90.0), min(lat + _ABOUT, 90.0)


def cuts(stage: BodyStage) -> list[tuple[str, str, str, np.ndarray, np.ndarray]]:
    """Name, names of the axes, and directions (3,) of the axes, in the frame of the run, of three planes through the
    centre."""
    placed = stage.compared.shape.placed
    up, spin = np.array([0.0, 0.0, 1.0]), placed.spin_axis
    east = np.cross(spin, up)
    if np.linalg.norm(east) < 1e-6:  # the site is a pole
        east = placed.turn[:, 0]
    east = east / np.linalg.norm(east)
    x, y = placed.turn[:, 0], placed.turn[:, 1]
    return [
        ("meridian of the site", "across the site's direction", "towards the site", np.cross(east, up), up),
        ("east and west of the site", "east", "towards the site", east, up),
        ("equator", "x", "y", x, y),
    ]


def outline(position: np.ndarray, triangles: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Segments (n, 2, 2) [m] in which a plane through the centre, along ``first`` and ``second``, cuts a surface."""
    import trimesh

    mesh = trimesh.Trimesh(position, triangles, process=False)
    lines = trimesh.intersections.mesh_plane(mesh, np.cross(first, second), np.zeros(3))
    lines = np.asarray(lines).reshape(-1, 2, 3)
    return np.stack([lines @ first, lines @ second], axis=-1)


def draw_outlines(stage: BodyStage, path: Path) -> None:
    """The ground before and after in three cuts."""
    from matplotlib.collections import LineCollection

    chart, shape = stage.compared.chart, stage.compared.shape
    scale, unit = readable.length_unit(shape.solid.extent)
    fig = figure(12.0, 4.1)
    for axis, (title, across, along, first, second) in zip(fig.subplots(1, 3), cuts(stage)):
        for after, colour, name in ((False, "0.55", "before"), (True, INK[1], "after")):
            segments = outline(chart.ground(after), chart.points.triangles, first, second)
            axis.add_collection(LineCollection(list(segments * scale), colors=colour, linewidths=1.3, label=name))
        half = 1.15 * shape.solid.extent * scale
        axis.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
        axis.set_title(title, fontsize=10, loc="left")
        axis.set(xlabel=f"{across} [{unit}]", ylabel=f"{along} [{unit}]")
        grid(axis)
    axis.legend(frameon=False, fontsize=9, loc="center")
    save(fig, path)
