"""Cross-sections through a crater: the particles within half a spacing of a plane, coloured by what they carry."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crater.ground.datum import Datum
from matter.files import snapshot
from matter.particles import Particles
from matter.wording import readable

MATERIAL_COLOURS = {
    "ice": "#9fd3ea",
    "water": "#2f6fb2",
    "basalt": "#8a7563",
    "iron": "#4d4d4d",
    "sand": "#d9c38c",
    "copper": "#b87333",
}
OTHER_COLOURS = ("#1f4e79", "#c0392b", "#2e7d32", "#8e44ad", "#b9770e", "#37474f")
PROJECTILE_COLOUR = "#d62828"
UNKNOWN_COLOUR = "#bdbdbd"
HALF_THICKNESS = 0.6
"""Half of the slab's thickness in spacings of the particle: one layer."""


@dataclass(frozen=True)
class View:
    """What is shown: x within ``half`` [m] of the axis, heights over the datum's summit from ``low`` to ``high`` [m];
    ``scale`` to the axis' unit."""

    datum: Datum
    half: float
    low: float
    high: float
    scale: float
    unit: str


def view(datum: Datum, half: float, below: float = 0.5, above: float = 0.35) -> View:
    """A view of half width ``half`` [m], from ``below`` half widths under the summit of the datum to ``above`` over
    it."""
    scale, unit = readable.length_unit(half)
    return View(datum, half, -below * half, above * half, scale, unit)


@dataclass(frozen=True)
class Colouring:
    """A field to colour by: ``of(particles, datum)`` gives values (n,), shown between ``low`` and ``high``; ``label``
    with its unit."""

    name: str
    label: str
    values: Callable[[Particles, Datum], np.ndarray]
    low: float
    high: float
    logarithmic: bool = False
    colours: str = "viridis"
    missing: str = PROJECTILE_COLOUR
    """Colour of particles whose value is no number."""

    def norm(self):
        """The matplotlib norm."""
        from matplotlib.colors import LogNorm, Normalize

        return (
            LogNorm(self.low, self.high, clip=True) if self.logarithmic else Normalize(self.low, self.high, clip=True)
        )


def damage() -> Colouring:
    """Scalar damage, 0 (intact) to 1."""
    return Colouring("damage", "damage [1]", lambda particles, datum: particles.damage, 0.0, 1.0, colours="YlOrBr")


def pressure() -> Colouring:
    """Pressure on a logarithmic scale; tension shows as the lowest colour."""
    return Colouring(
        "pressure",
        "pressure [GPa]",
        lambda particles, datum: np.maximum(particles.pressure, 1.0) * 1e-9,
        1e-3,
        10.0,
        True,
        "magma",
    )


def depth_of_origin(deepest: float, origin: Callable[[Particles], np.ndarray] | None = None) -> Colouring:
    """Depth below the datum at which matter lay before the impact, 0 to ``deepest`` [m]; ``origin`` gives those
    positions (n, 3) [m]."""
    positions = origin or (lambda particles: particles.initial_position)
    scale, unit = readable.length_unit(deepest)

    def depth(particles: Particles, datum: Datum) -> np.ndarray:
        values = -datum.polar(positions(particles))[2] * scale
        if "layer" in particles:
            values = np.where(particles.layer < 0, np.nan, values)
        return values

    missing = PROJECTILE_COLOUR if origin is None else UNKNOWN_COLOUR
    return Colouring(
        "depth of origin",
        f"depth of origin [{unit}]",
        depth,
        0.0,
        deepest * scale,
        colours="viridis_r",
        missing=missing,
    )


def bed_positions(grains: Particles, before: Particles) -> np.ndarray:
    """Places [m] of the same grains in the settled bed, by their ``identity``; NaN for grains that came as ejecta."""
    order = np.argsort(before.identity)
    known = before.identity[order]
    at = np.clip(np.searchsorted(known, grains.identity), 0, len(known) - 1)
    positions = before.position[order[at]].copy()
    positions[known[at] != grains.identity] = np.nan
    return positions


def positions_before(particles: Particles, bed: Path) -> np.ndarray | None:
    """Places [m] of particles before the impact, NaN for those of the projectile and for ejecta; None where files do
    not say.

    SPH particles carry them; those of grains are in the snapshot ``bed``.
    """
    if "initial_position" in particles:
        positions = particles.initial_position.copy()
        if "layer" in particles:
            positions[particles.layer < 0] = np.nan
        return positions
    if "identity" not in particles or not bed.is_file():
        return None
    before = snapshot.read(bed, only=("identity", "position"))
    return bed_positions(particles, before) if "identity" in before else None


def speed(fastest: float) -> Colouring:
    """Speed from a thousandth of ``fastest`` to ``fastest`` [m/s], logarithmic."""

    def values(particles: Particles, datum: Datum) -> np.ndarray:
        return np.maximum(np.linalg.norm(particles.velocity, axis=1), 1e-12)

    return Colouring("speed", "speed [m/s]", values, 1e-3 * fastest, fastest, True, "cividis")


def size_of(particles: Particles, half: float) -> np.ndarray:
    """Diameter at which each particle is drawn [m]: a grain's own, else the edge of its volume (vapour capped)."""
    if "radius" in particles:
        return 2.0 * particles.radius
    if "mass" in particles and "density" in particles:
        spacing = np.minimum(np.cbrt(particles.mass / np.maximum(particles.density, 1e-3)), 0.12 * half)
        return np.where(np.isfinite(spacing), spacing, 0.02 * half)
    return np.full(len(particles), 0.02 * half)


def material_colours(particles: Particles) -> np.ndarray:
    """Colour of each particle by material; the projectile's own."""
    names = list(particles.attributes.get("materials", []))
    palette = [
        MATERIAL_COLOURS.get(name.split("_")[0], OTHER_COLOURS[k % len(OTHER_COLOURS)]) for k, name in enumerate(names)
    ] or [UNKNOWN_COLOUR]
    if "material" not in particles:
        return np.full(len(particles), UNKNOWN_COLOUR, dtype=object)
    colours = np.array(palette, dtype=object)[np.clip(particles.material, 0, len(palette) - 1)]
    if "layer" in particles:
        colours[particles.layer < 0] = PROJECTILE_COLOUR
    return colours


def draw_section(
    axis, particles: Particles, seen: View, colouring: Colouring | None = None, edge: str = "white"
) -> Any:
    """Draw the slab and the original surface into ``axis``; by material, or by ``colouring`` (whose collection is
    returned for a colour bar)."""
    from matplotlib.collections import EllipseCollection

    size = size_of(particles, seen.half)
    x = seen.datum.local(particles.position)
    z = x[:, 2] - (seen.datum.radius if seen.datum.is_sphere else 0.0)
    inside = (
        (np.abs(x[:, 1]) < HALF_THICKNESS * size) & (np.abs(x[:, 0]) < seen.half) & (z > seen.low) & (z < seen.high)
    )
    if "state" in particles:
        inside &= particles.state < 2
    order = np.flatnonzero(inside)
    offsets = np.column_stack([x[order, 0], z[order]]) * seen.scale
    shown: dict[str, Any] = dict(
        units="xy", offsets=offsets, offset_transform=axis.transData, edgecolors=edge, linewidths=0.25
    )
    diameter = size[order] * seen.scale
    collection: EllipseCollection
    if colouring is None:
        collection = EllipseCollection(
            diameter, diameter, np.zeros(len(order)), facecolors=list(material_colours(particles)[order]), **shown
        )
    else:
        collection = EllipseCollection(
            diameter, diameter, np.zeros(len(order)), cmap=_colour_map(colouring), norm=colouring.norm(), **shown
        )
        collection.set_array(np.ma.masked_invalid(colouring.values(particles, seen.datum)[order]))
    axis.add_collection(collection)
    original_surface(axis, seen)
    axis.set_aspect("equal")
    axis.set_xlim(-seen.half * seen.scale, seen.half * seen.scale)
    axis.set_ylim(seen.low * seen.scale, seen.high * seen.scale)
    return collection


def _colour_map(colouring: Colouring):
    import matplotlib

    return matplotlib.colormaps[colouring.colours].with_extremes(bad=colouring.missing)


def on_section(seen: View, distance: np.ndarray, height: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place in the picture of points at a ``distance`` along the datum (negative: uprange) and a ``height`` over it
    [m]."""
    s, h = np.asarray(distance, float), np.asarray(height, float)
    if not seen.datum.is_sphere:
        return s * seen.scale, h * seen.scale
    psi = s / seen.datum.radius
    return (seen.datum.radius + h) * np.sin(psi) * seen.scale, (
        (seen.datum.radius + h) * np.cos(psi) - seen.datum.radius
    ) * seen.scale


def original_surface(axis, seen: View) -> None:
    """The datum as a dashed line."""
    s = np.linspace(-1.2 * seen.half, 1.2 * seen.half, 241)
    axis.plot(*on_section(seen, s, np.zeros(len(s))), color="black", linewidth=0.8, linestyle="--")


def material_marks(shots: Sequence[Particles]) -> list[Any]:
    """Legend entries of all materials in some snapshots, the projectile and the original surface."""
    from matplotlib.lines import Line2D

    names: dict[str, str] = {}
    for particles in shots:
        for k, name in enumerate(particles.attributes.get("materials", [])):
            names.setdefault(name, MATERIAL_COLOURS.get(name.split("_")[0], OTHER_COLOURS[k % len(OTHER_COLOURS)]))
        if "layer" in particles and (particles.layer < 0).any():
            names.setdefault("projectile", PROJECTILE_COLOUR)
    marks: list[Any] = [
        Line2D([], [], marker="o", linestyle="", color=colour, label=name, markersize=6)
        for name, colour in names.items()
    ]
    marks.append(Line2D([], [], color="black", linestyle="--", linewidth=0.8, label="original surface"))
    return marks
