"""Pictures of a handoff, drawn without a display."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from handoff.domains import domain as domains
from handoff.domains.whole_body import WholeBody
from handoff.source import grain_size
from matter.solids import solid as solids
from matter.wording import readable

_MATERIAL_COLOURS = {"ice": "#9ecae1", "water": "#3182bd", "basalt": "#8c6d31", "iron": "#636363", "sand": "#d9c38c"}
_OTHER, _PROJECTILE, _EJECTA = "#bbbbbb", "#e6550d", "#de2d26"


def draw_pictures(data: dict[str, Any], out: Path) -> None:
    """Draw every picture of the report into the folder ``out``; ``data`` as from ``report.gather``."""
    for name, picture in (("cut.png", _cut), ("velocity.png", _velocity), ("residuals.png", _residuals)):
        _save(picture(data), out / name)
    if "stiffness" in data["start"]:
        _save(_forces(data), out / "forces.png")
    if "series" in data["record"]["choice"]:
        _save(_time(data), out / "time.png")


def _save(figure, path: Path) -> None:
    figure.savefig(path, dpi=110)


def _figure(rows: int, columns: int, size: tuple[float, float]):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def _frame_of(data) -> tuple[Any, float, str, tuple[float, float], tuple[float, float]]:
    """Domain, length unit and its name, and the limits of a cut (x, z) in that unit."""
    region: domains.Domain = data["region"]
    unit, name = (1e3, "km") if region.arc > 2e3 else (1.0, "m")
    if isinstance(region, domains.Cone):
        width = region.top * np.sin(min(region.half_angle, np.pi / 2))
        low, high = region.floor * np.cos(region.half_angle), region.top
    elif isinstance(region, WholeBody):
        least, most = (limit(region.shape.solid.vertices, axis=0) for limit in (np.min, np.max))
        width, low, high = float(max(-least[0], most[0])), float(least[2]), float(most[2])
    else:
        width, low, high = region.radius, region.floor, region.top
    margin = 0.06 * width
    across = (-width - margin) / unit, (width + margin) / unit
    return region, unit, name, across, ((low - margin) / unit, (high + 4 * margin) / unit)


def _discs(axes, position, radius, colours, unit, **options) -> None:
    from matplotlib.collections import EllipseCollection

    size, where = 2.0 * radius / unit, dict(units="xy", offsets=position / unit, offset_transform=axes.transData)
    axes.add_collection(EllipseCollection(size, size, 0.0 * size, facecolors=colours, **where, **options))


def _section(mesh, unit: float):
    """Segments (s, 2, 2) of the surface in the plane y = 0."""
    import trimesh

    segments = trimesh.intersections.mesh_plane(mesh, [0.0, 1.0, 0.0], [0.0, 0.0, 0.0])
    return np.asarray(segments)[:, :, [0, 2]] / unit


def _outline(axes, data, region, unit) -> None:
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(_section(data["surface"], unit), colors="black", linewidths=0.9, zorder=5))
    if isinstance(region, domains.Cone):
        angle = np.linspace(-region.half_angle, region.half_angle, 200)
        for radius, style in ((region.datum, ":"), (region.top, "--"), (region.floor, "-")):
            axes.plot(
                radius * np.sin(angle) / unit, radius * np.cos(angle) / unit, style, color="#999", lw=0.7, zorder=4
            )
    elif isinstance(region, WholeBody):
        undisturbed = _section(solids.surface_of(region.shape.solid), unit)
        axes.add_collection(LineCollection(undisturbed, colors="#999", linewidths=0.9, linestyles=":", zorder=4))
    else:
        for level, style in ((region.datum, ":"), (region.top, "--"), (region.floor, "-")):
            side = region.radius / unit
            axes.plot([-side, side], [level / unit] * 2, style, color="#999", lw=0.7, zorder=4)


def _colour_of(name: str) -> str:
    return _MATERIAL_COLOURS.get(name.split("_")[0], _OTHER)


def _colours(names: list[str], material: np.ndarray) -> np.ndarray:
    from matplotlib.colors import to_rgba

    table = np.array([to_rgba(_colour_of(name)) for name in names] or [to_rgba(_OTHER)])
    return table[np.clip(material, 0, len(table) - 1)]


def _marks(names: list[str], projectile: bool) -> list[Any]:
    """Legend entries: materials, projectile, ejecta and the lines of ``_outline``."""
    from matplotlib.lines import Line2D

    def disc(label: str, face: str, edge: str) -> Line2D:
        return Line2D(
            [], [], marker="o", linestyle="", markersize=8, label=label, markerfacecolor=face, markeredgecolor=edge
        )

    marks = [disc(name.replace("_", " "), _colour_of(name), "#666") for name in dict.fromkeys(names)]
    marks += [disc("projectile", _PROJECTILE, "#666")] if projectile else []
    marks.append(disc("ejecta", "white", _EJECTA))
    marks.append(Line2D([], [], color="black", linewidth=0.9, label="carving surface"))
    marks.append(Line2D([], [], color="#999", linewidth=0.9, linestyle=":", label="datum"))
    return marks


def _cut(data):
    from matplotlib.colors import to_rgba

    region, unit, name, xlim, zlim = _frame_of(data)
    source, start = data["source"], data["start"]
    aspect = (zlim[1] - zlim[0]) / (xlim[1] - xlim[0])
    figure, axes = _figure(2, 1, (12.0, 24.0 * aspect + 1.0))
    reason = data["residuals"]["source/reason"]
    spacing = np.cbrt(source.mass / source.density)
    slab = np.abs(source.position[:, 1]) < 0.6 * spacing
    colours = _colours(source.attributes.get("materials", []), source.material)
    if "layer" in source:
        colours[source.layer < 0] = to_rgba(_PROJECTILE)
    edge = np.where(reason[:, None] == 0, to_rgba("#666"), to_rgba(_EJECTA))
    above = axes[0, 0]
    _discs(
        above,
        source.position[slab][:, [0, 2]],
        0.5 * np.minimum(spacing, np.median(spacing) * 2)[slab],
        colours[slab],
        unit,
        edgecolors=edge[slab],
        linewidths=0.5,
    )
    above.set_title(f"Before: particles of the shock stage at {readable.clock(data['record']['time_s'])}")
    below = axes[1, 0]
    grain = np.abs(start.position[:, 1]) < start.radius
    cut = np.sqrt(np.maximum(start.radius**2 - start.position[:, 1] ** 2, 0.0))
    edge = np.where(
        np.arange(len(start))[:, None] < int(data["record"]["grains"]["kept"]), to_rgba("#666"), to_rgba(_EJECTA)
    )
    colours = _colours(start.attributes.get("materials", []), start.material)
    _discs(
        below,
        start.position[grain][:, [0, 2]],
        cut[grain],
        colours[grain],
        unit,
        edgecolors=edge[grain],
        linewidths=0.4,
    )
    below.set_title("After: grains of the bed and of the ejecta, cut by the plane y = 0")
    for panel in axes.flat:
        _outline(panel, data, region, unit)
        panel.set(xlim=xlim, ylim=zlim, aspect="equal", xlabel=f"x [{name}]", ylabel=f"z [{name}]")
    names = [*source.attributes.get("materials", []), *start.attributes.get("materials", [])]
    figure.legend(
        handles=_marks(names, "layer" in source and bool((source.layer < 0).any())),
        loc="outside upper center",
        ncols=8,
        frameon=False,
    )
    return figure


def _velocity(data):
    region, unit, name, xlim, zlim = _frame_of(data)
    cells = {key.removeprefix("cells/"): value for key, value in data["residuals"].items() if key.startswith("cells/")}
    source, start = data["source"], data["start"]
    aspect = (zlim[1] - zlim[0]) / (xlim[1] - xlim[0])
    figure, axes = _figure(3, 1, (12.0, 36.0 * aspect + 1.0))
    spacing = np.cbrt(source.mass / source.density)
    inside = (region.depth_inside(source.position) > -spacing) & (data["residuals"]["source/reason"] == 0)
    slab = inside & (np.abs(source.position[:, 1]) < spacing)
    stays = int(data["record"]["grains"]["kept"])
    grain = np.flatnonzero(np.abs(start.position[:stays, 1]) < start.radius[:stays])
    close = np.abs(cells["centre"][:, 1]) < 1.5 * float(start.radius[:stays].mean()) * 3.0
    # against the ground, which turns with a whole body
    flow, moved = (region.flow(cloud.position, cloud.velocity) for cloud in (source, start))
    speed = np.linalg.norm(flow[slab], axis=1)
    top = float(np.percentile(speed, 99)) if len(speed) else 1.0
    parts = (
        ("Before: particles that are not ejecta", source.position[slab], flow[slab]),
        ("After: grains", start.position[grain], moved[grain]),
        (
            "Difference, cell by cell (arrows five times as long)",
            cells["centre"][close],
            (cells["after"] - cells["before"])[close],
        ),
    )
    for panel, (title, position, velocity) in zip(axes[:, 0], parts):
        last = title.startswith("Difference")
        size = np.linalg.norm(velocity, axis=1)
        arrows = panel.quiver(
            position[:, 0] / unit, position[:, 2] / unit, velocity[:, 0], velocity[:, 2], size, cmap="viridis",
            scale=top * (6.0 if last else 30.0), width=0.0012, clim=(0, 0.2 * top if last else top), zorder=3,
        )  # fmt: skip
        figure.colorbar(arrows, ax=panel, label="speed [m/s]", shrink=0.8)
        _outline(panel, data, region, unit)
        panel.set(xlim=xlim, ylim=zlim, aspect="equal", title=title, xlabel=f"x [{name}]", ylabel=f"z [{name}]")
    return figure


def _residuals(data):
    residuals, record, source, start = data["residuals"], data["record"], data["source"], data["start"]
    figure, axes = _figure(2, 2, (12.0, 8.0))
    local = record["local_momentum"]
    axes[0, 0].barh([row["region"] for row in local], [row["relative"] for row in local], color="#3182bd")
    axes[0, 0].axvline(0.05, color="#c0262d", lw=1)
    axes[0, 0].set(
        xlabel="|Δp| / Σ m|v|, before the correction", title="Momentum by octant (about the centre of mass) and shell"
    )
    axes[0, 0].tick_params(axis="y", labelsize=7)
    before, after = residuals["cells/before"], residuals["cells/after"]
    speed = np.linalg.norm(before, axis=1)
    flowing = speed > 0.05 * speed.max(initial=0.0)
    cosine = np.sum(before * after, axis=1) / np.maximum(speed * np.linalg.norm(after, axis=1), 1e-300)
    angle = np.degrees(np.arccos(np.clip(cosine[flowing], -1, 1)))
    axes[0, 1].hist(np.clip(angle, 0, 30), bins=60, weights=residuals["cells/mass"][flowing], color="#3182bd")
    axes[0, 1].set(
        xlabel="angle between the fields [deg] (30 and more in the last bar)",
        ylabel="mass [kg]",
        title="Errors of direction",
    )
    compact = residuals["source/reason"] == 0
    region = data["region"]
    here = ~compact | (region.depth_inside(source.position) > 0.0)
    for panel in (axes[1, 0],):
        for label, mass, velocity, style in (
            ("before (domain and ejecta)", source.mass[here], source.velocity[here], "k-"),
            ("after: grains", start.mass, start.velocity, "r--"),
        ):
            size = np.sort(np.linalg.norm(velocity, axis=1))[::-1]
            order = np.argsort(-np.linalg.norm(velocity, axis=1))
            panel.loglog(np.maximum(size, 1e-3), np.cumsum(mass[order]), style, label=label)
        panel.axvline(record["speed_limit_m_s"], color="#999", lw=0.8)
        panel.set(
            xlabel="speed v [m/s]",
            ylabel="mass faster than v [kg]",
            title="Mass by speed; vertical line: the speed limit",
        )
        panel.set_xlim(left=max(1e-3, 1e-3 * record["speed_limit_m_s"]))
        panel.legend()
    distance, unit = residuals["columns/distance"], 1e3 if residuals["columns/distance"].max() > 2e3 else 1.0
    difference = residuals["columns/height_bed"] - residuals["columns/height_source"]
    radius = grain_size.at_impact(data["bed"])
    axes[1, 1].plot(distance / unit, difference / radius, ".", ms=2)
    axes[1, 1].set(
        xlabel=f"distance from the axis [{'km' if unit > 1 else 'm'}]",
        ylabel="height, bed minus source [grain radii]",
        title="Carved surface",
    )
    axes[1, 1].set_ylim(-4, 4)
    return figure


def _forces(data):
    from matplotlib.collections import LineCollection

    from handoff.transfer import force_network

    region, unit, name, xlim, zlim = _frame_of(data)
    start = data["start"]
    network = force_network.measure(start)
    aspect = (zlim[1] - zlim[0]) / (xlim[1] - xlim[0])
    figure, axes = _figure(2, 1, (12.0, 12.0 * aspect + 4.5))
    figure.get_layout_engine().set(hspace=0.05)
    cut, spread = axes[0, 0], axes[1, 0]
    slab = np.abs(start.position[network.one, 1] + start.position[network.other, 1]) < 2.0 * float(start.radius.mean())
    ends = (
        np.stack([start.position[network.one[slab]], start.position[network.other[slab]]], axis=1)[:, :, [0, 2]] / unit
    )
    fraction = network.force[slab] / max(network.mean, 1e-300)
    order = np.argsort(fraction)
    lines = LineCollection(
        ends[order],
        array=fraction[order],
        cmap="inferno_r",
        linewidths=np.clip(0.7 * fraction[order], 0.15, 4.0),
        clim=(0.0, 5.0),
    )
    cut.add_collection(lines)
    figure.colorbar(lines, ax=cut, label="force / mean", shrink=0.8)
    _outline(cut, data, region, unit)
    mean = readable.amount(network.mean, "N", 3)
    title = (
        f"Contact forces at the start: mean {mean}, 99 % below {network.spread:.2g} means, "
        f"{network.contacts_per_grain:.2f} contacts per grain"
    )
    cut.set(xlim=xlim, ylim=zlim, aspect="equal", title=title, xlabel=f"x [{name}]", ylabel=f"z [{name}]")
    if len(network.force):
        every = network.force / network.mean
        spread.hist(
            every,
            bins=np.linspace(0.0, max(10.0, float(np.percentile(every, 99.9))), 80),
            density=True,
            histtype="step",
            color="#3182bd",
        )
        spread.plot(ticks := np.linspace(0.0, 10.0, 50), np.exp(-ticks), ":", color="#999", label="exp(-f / mean)")
        spread.legend()
    spread.set(yscale="log", xlabel="force / mean", ylabel="fraction of contacts", title="Distribution of the forces")
    return figure


def _time(data):
    choice = data["record"]["choice"]
    series = {name: np.array(values, dtype=float) for name, values in choice["series"].items() if name != "file"}
    unit, name = (1e3, "km") if np.nanmax(series["radius"]) > 2e3 else (1.0, "m")
    figure, axes = _figure(2, 2, (12.0, 7.0))
    tick, clock = readable.time_unit(float(np.nanmax(series["time"])))
    t = series["time"] * tick
    for key in ("radius", "depth", "rim_height"):
        axes[0, 0].plot(t, series[key] / unit, ".-", label=key.replace("_", " "))
    axes[0, 0].set(ylabel=f"length [{name}]", title="Cavity")
    axes[0, 1].semilogy(t, series["excess_pressure"], ".-", label="exceeded in 1 % of the domain")
    axes[0, 1].semilogy(t, series["excess_pressure_most"], ".-", label="largest")
    axes[0, 1].axhline(1e-3, color="#c0262d", lw=1, label="limit")
    axes[0, 1].set(title="Excess pressure / bulk modulus")
    axes[1, 0].plot(t, np.maximum(series["drive"], 1e-3), ".-", label="drive")
    axes[1, 0].axhline(1.0, color="#c0262d", lw=1, label="limit")
    axes[1, 0].set(
        ylabel="acceleration [g]",
        title="Mean acceleration beyond hydrostatic balance, weighted by m|v|",
        ylim=(0.0, None),
    )
    for key in ("kinetic", "elastic"):
        axes[1, 1].semilogy(t, series[key], ".-", label=f"{key} energy")
    axes[1, 1].set(ylabel="energy [J]", title="Energy in the domain")
    for panel in axes.flat:
        panel.axvline(choice["time_s"] * tick, color="black", lw=0.8, label="handoff")
        panel.set(xlabel=f"time after contact [{clock}]")
        panel.legend(fontsize=8)
    return figure
