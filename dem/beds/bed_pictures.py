"""Pictures of grains: a thin slab through the x-z plane, the profiles of a bed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dem.beds.slopes import Slopes
from dem.beds.solid_body import SolidBody
from dem.grains.assembly import LEFT, Assembly
from matter.geometry.ground_region import Cone, Upright
from matter.particles import Particles
from matter.wording import readable

_COLOURS = ("#d9c8a0", "#5b8fc7")
_HEADROOM = "#efe7d5"


def _circles(axes: Any, grains: Particles, scale: float) -> None:
    """Draw the circles that the grains cut out of the plane y = 0, coloured by species; lengths times ``scale``."""
    from matplotlib.collections import EllipseCollection

    y = np.abs(grains.position[:, 1])
    here = np.flatnonzero((y < grains.radius) & (grains.state != LEFT))
    width = 2.0 * np.sqrt(grains.radius[here] ** 2 - y[here] ** 2) * scale
    face = [_HEADROOM if h else _COLOURS[int(k)] for k, h in zip(grains.species[here], grains.headroom[here])]
    circles = EllipseCollection(
        width, width, np.zeros(len(here)), units="xy", facecolors=face, edgecolors="#444444", linewidths=0.2,
        offsets=grains.position[here][:, [0, 2]] * scale, offset_transform=axes.transData,
    )  # fmt: skip
    axes.add_collection(circles)


def slab(axes: Any, grains: Particles, domain: Cone) -> None:
    """The cut through a bed on a sphere, with its core, datum and sides, in a unit that suits its size."""
    reach = 1.05 * domain.top * np.sin(domain.half_angle)
    scale, unit = readable.length_unit(reach)
    _circles(axes, grains, scale)
    angle = np.linspace(-domain.half_angle, domain.half_angle, 200)
    for radius, style in ((domain.floor, "k-"), (domain.datum, "r--")):
        axes.plot(radius * np.sin(angle) * scale, radius * np.cos(angle) * scale, style, lw=0.8)
    for side in (-1, 1):
        line = np.array([domain.floor, domain.top]) * scale
        axes.plot(side * line * np.sin(domain.half_angle), line * np.cos(domain.half_angle), "k-", lw=0.8)
    floor = domain.floor * np.cos(domain.half_angle)
    axes.set_xlim(-reach * scale, reach * scale)
    axes.set_ylim(0.97 * floor * scale, (domain.top + 0.35 * (domain.top - domain.floor)) * scale)
    axes.set_aspect("equal")
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"z [{unit}]")


def bed(assembly: Assembly, domain: Cone, report: dict[str, Any], path: Path) -> None:
    """A cut through the bed above its profiles of packing fraction, density and stress."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 9), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 3)
    slab(figure.add_subplot(grid[0, :]), assembly.particles({}, tables=False), domain)
    profile = report["profile"]
    depth = domain.datum - np.array(profile["radius_m"])
    scale, unit = readable.length_unit(float(np.abs(depth).max(initial=0.0)))
    stress, pascals = readable.pressure_unit(
        float(np.nanmax(np.array(profile["radial_stress_Pa"], dtype=float), initial=0.0))
    )
    panels = (
        ("packing fraction", [("packing_fraction", "grains", "-")], 1.0),
        ("bulk density [kg/m$^3$]", [("density_kg_m3", "grains", "-"), ("density_target_kg_m3", "body", "--")], 1.0),
        (f"stress [{pascals}]", [("radial_stress_Pa", "radial", "-"), ("tangential_stress_Pa", "tangential", "-"),
                          ("pressure_target_Pa", "body's pressure", "--")], stress),
    )  # fmt: skip
    for k, (label, lines, factor) in enumerate(panels):
        axes = figure.add_subplot(grid[1, k])
        for key, name, style in lines:
            axes.plot(np.array(profile[key]) * factor, depth * scale, style, label=name)
        axes.invert_yaxis()
        axes.set_xlabel(label)
        axes.set_ylabel(f"depth below the datum [{unit}]")
        axes.legend(frameon=False)
    figure.savefig(path, dpi=110)


def flat_slab(axes: Any, grains: Particles, container: Upright) -> None:
    """The cut through a bed in its container, with walls and datum, in a unit that suits its size."""
    scale, unit = readable.length_unit(container.radius)
    _circles(axes, grains, scale)
    r, floor, top = container.radius * scale, container.floor * scale, container.top * scale
    if container.shape == "bowl":
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 200)
        axes.plot(r * np.sin(angle), -r * np.cos(angle), "k-", lw=0.8)
        axes.plot([-r, -r], [0.0, top], "k-", [r, r], [0.0, top], "k-", lw=0.8)
    else:
        axes.plot([-r, -r, r, r], [top, floor, floor, top], "k-", lw=0.8)
    axes.plot([-r, r], [0.0, 0.0], "r--", lw=0.8)
    axes.set_xlim(-1.05 * r, 1.05 * r)
    axes.set_ylim(1.05 * floor, top - 0.1 * floor)
    axes.set_aspect("equal")
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"z [{unit}]")


def flat_bed(assembly: Assembly, container: Upright, report: dict[str, Any], path: Path) -> None:
    """A cut through a bed in its container."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    flat_slab(axes, assembly.particles({}, tables=False), container)
    axes.set_title(
        f"{report['grains']} grains, fraction {report['packing_fraction']:.3f} (bulk), "
        f"{report['coordination_number']:.2f} contacts, "
        f"walls carry {report['weight_carried']:.4f} of the weight", fontsize=10,
    )  # fmt: skip
    figure.savefig(path, dpi=110)


def whole_body(assembly: Assembly, body: SolidBody, slopes: Slopes, report: dict[str, Any], path: Path) -> None:
    """Cuts through a whole body in its own frame, along its axis and its equator, above a map of its slopes."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 9), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.1, 1.0))
    for k, (across, up) in enumerate(((0, 2), (0, 1))):
        _cut_of_body(figure.add_subplot(grid[0, k]), assembly, body, across, up)
    axes = figure.add_subplot(grid[1, :])
    latitude, longitude = body.latitude_longitude(slopes.position)
    shown = axes.hexbin(longitude, latitude, C=slopes.slope, gridsize=(32, 9), cmap="cividis", linewidths=0.2)
    figure.colorbar(shown, ax=axes, label="slope [deg]")
    axes.set_xlim(-180.0, 180.0)
    axes.set_ylim(-90.0, 90.0)
    axes.set_xlabel("longitude [deg]")
    axes.set_ylabel("latitude [deg]")
    axes.set_title(report["slopes_in_words"], fontsize=9)
    figure.savefig(path, dpi=110)


def _cut_of_body(axes: Any, assembly: Assembly, body: SolidBody, across: int, up: int) -> None:
    """A cut in the body's own frame through the axes ``across`` and ``up``, with the outline of the surface."""
    scale, unit = readable.length_unit(body.solid.extent)
    own = assembly.particles({}, tables=False)
    x = own.position @ body.placed.turn
    own["position"] = x[:, [across, 3 - across - up, up]]
    _circles(axes, own, scale)
    reach = 1.1 * body.solid.extent
    line = np.linspace(-reach, reach, 160)
    one, two = np.meshgrid(line, line)
    plane = np.zeros((one.size, 3))
    plane[:, across], plane[:, up] = one.ravel(), two.ravel()
    depth = body.distance.at(plane @ body.placed.turn.T)[0].reshape(one.shape)
    axes.contour(one * scale, two * scale, depth, levels=[0.0], colors="r", linewidths=0.8, linestyles="--")
    axes.set_xlim(-reach * scale, reach * scale)
    axes.set_ylim(-reach * scale, reach * scale)
    axes.set_aspect("equal")
    axes.set_xlabel(f"{'xyz'[across]} [{unit}]")
    axes.set_ylabel(f"{'xyz'[up]} [{unit}]")
