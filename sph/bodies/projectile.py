"""The projectile as particles: a uniform ball, or several parts that fly together.

A part holds a ``share`` of the projectile's mass. Without ``size`` it is a ball of its material at its own density,
with one a box of cells, each with a pellet of solid matter in its middle: a box that weighs less than its material
would has gaps between them, as a spacecraft has. A pellet's support is that of a cell, the scale of the ground that it
meets; its own size, centimetres of a thin panel, would set the step of all particles. Positions are along the flight,
horizontally across it, and up from both; the parts' centre of mass is on the line that leads to the site, so that
mass and momentum are those of the ball.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from matter.case.body import Impact, Part, Projectile, Target
from matter.errors import InputError
from matter.points import packing
from sph.bodies import symmetry as symmetries
from sph.bodies.target import Body
from sph.materials.rows import Materials

MANY = 1e6
"""Particles of a ball beyond which a prediction goes by its volume."""
MOST_IN_ONE = 3.5
"""Volume of a ball, in cubes of a spacing, up to which it is one particle."""


class Pellets(NamedTuple):
    """Particles of a projectile about its centre of mass: ``position`` (n, 3) [m] (along the flight, across it, up),
    ``volume`` (n,) [m^3] of solid matter, ``width`` (n,) [m] that its support goes by, ``fraction`` (n,) of the mass,
    index of the ``material`` (n,)."""

    position: np.ndarray
    volume: np.ndarray
    width: np.ndarray
    fraction: np.ndarray
    material: np.ndarray


def in_ball(radius: float, spacing: float, symmetry: str = "none") -> np.ndarray:
    """Positions (n, 3) [m] of a ball's particles about its centre, some ``spacing`` [m] apart; of the part that a
    ``symmetry`` leaves. One particle where there would be three or fewer: two or three lie as lopsided as it is
    coarse."""
    wanted, parts = 4.0 / 3.0 * np.pi * radius**3 / spacing**3, symmetries.copies(symmetry)
    mirrors = list(symmetries.MIRRORS[symmetry])
    if wanted <= MOST_IN_ONE * parts:  # the centre of mass of the part
        positions = np.zeros((1, 3))
        positions[0, mirrors] = 0.375 * radius
        return positions
    positions = packing.hexagonal(spacing, radius)
    positions = positions - positions.mean(axis=0)
    return symmetries.folded(positions, symmetry, 0.35 * spacing) if mirrors else positions


def in_box(size: tuple[float, float, float], spacing: float) -> np.ndarray:
    """Middles (n, 3) [m] of the cells, some ``spacing`` [m] wide, of a box of this ``size`` [m] about its centre."""
    axes = []
    for length in size:
        number = max(1, round(length / spacing))
        axes.append((np.arange(number) + 0.5) * (length / number) - 0.5 * length)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def pellets(ball: Projectile, spacing: float, materials: Materials) -> Pellets:
    """The parts as particles some ``spacing`` [m] apart. Raises ``InputError`` for a box that is too small for what it
    holds."""
    mass = float(materials.bulk_density[materials.index(ball.material)]) * ball.volume
    pieces = []
    for number, part in enumerate(ball.parts, 1):
        index = materials.index(ball.material_of(part))
        volume = part.share * mass / float(materials.bulk_density[index])
        positions = _positions(part, number, volume, spacing) + np.array(part.offset)
        n = len(positions)
        width = (volume / n) ** (1.0 / 3.0) if part.size is None else spacing
        pieces.append((positions, *(np.full(n, value) for value in (volume / n, width, part.share / n, index))))
    position, volumes, widths, fraction, material = (np.concatenate(columns) for columns in zip(*pieces))
    return Pellets(
        position - fraction @ position / fraction.sum(), volumes, widths, fraction / fraction.sum(), material
    )


def _positions(part: Part, number: int, volume: float, spacing: float) -> np.ndarray:
    """Places (n, 3) [m] of one part's particles about its centre."""
    _fits(part, number, volume)
    if part.size is None:
        return in_ball((3.0 * volume / (4.0 * math.pi)) ** (1.0 / 3.0), spacing)
    return in_box(part.size, spacing)


def sizes(ball: Projectile, spacing: float, materials: Materials) -> list[tuple[float, float]]:
    """Number of particles of each part, and the width [m] that their support goes by, without a position of any: a box
    of many cells costs no more than one of few. Of a ball of more than a million the number is that of its volume.
    Raises as ``pellets``."""
    mass, found = float(materials.bulk_density[materials.index(ball.material)]) * ball.volume, []
    for number, part in enumerate(ball.parts, 1):
        volume = part.share * mass / float(materials.bulk_density[materials.index(ball.material_of(part))])
        _fits(part, number, volume)
        if part.size is not None:
            found.append((math.prod(float(max(1, round(length / spacing))) for length in part.size), spacing))
            continue
        wanted = volume / spacing**3
        n = wanted if wanted > MANY else float(len(_positions(part, number, volume, spacing)))
        found.append((n, (volume / n) ** (1.0 / 3.0)))
    return found


def _fits(part: Part, number: int, volume: float) -> None:
    if part.size is not None and volume > math.prod(part.size):
        raise InputError(
            f"[impact.projectile] parts, number {number}: {volume:.3g} m^3 of solid matter do not fit into a box of "
            f"{math.prod(part.size):.3g} m^3; enlarge its size or lower its fraction"
        )


def count(ball: Projectile, spacing: float, materials: Materials, symmetry: str = "none") -> float:
    """Number of particles, all images of a ``symmetry`` counted; of a ball of more than a million that of its
    volume."""
    if ball.parts:
        return sum(n for n, _ in sizes(ball, spacing, materials))
    if (wanted := ball.volume / spacing**3) > MANY:
        return wanted
    return symmetries.copies(symmetry) * len(in_ball(ball.radius, spacing, symmetry))


def build(
    target: Target,
    impact: Impact,
    spacing: float,
    surface: float,
    gap: float,
    materials: Materials,
    support: float = 2.0,
    symmetry: str = "none",
) -> Body:
    """The projectile about ``spacing`` [m] between particles on its way to (0, 0, ``surface``), ``gap`` [m] above it.

    A ball touches the ground there. Of parts the centre of mass flies towards it, and the lowest is ``gap`` above the
    plane through it.
    """
    velocity = np.array(target.aim(impact))
    along = velocity / np.linalg.norm(velocity)
    normal = target.placed.normal if target.solid else np.array([0.0, 0.0, 1.0])
    site = np.array([0.0, 0.0, surface])
    if impact.projectile.parts:
        return _of_parts(impact.projectile, spacing, site, normal, along, gap, materials, support)
    body = impact.projectile
    index = materials.index(body.material)
    rho0 = materials.bulk_density[index]
    positions, parts = in_ball(body.radius, spacing, symmetry), symmetries.copies(symmetry)
    centre = site + body.radius * normal + along * (gap / float(along @ normal))
    n = len(positions)
    return Body(
        positions + centre,
        np.full(n, rho0 * body.volume / parts / n),
        np.full(n, rho0),
        np.full(n, support * (body.volume / parts / n) ** (1.0 / 3.0)),
        np.full(n, -1, dtype=np.int32),
        np.full(n, index, dtype=np.int32),
        np.full(n, materials.rows.alpha0[index]),
    )


def axes_of_flight(along: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Rows (3, 3): along the flight, across it in the plane of the ground (along y where it falls straight down), and
    what stands square on both."""
    across = np.cross(normal, along)
    if np.linalg.norm(across) < 1e-9:
        across = np.array([0.0, 1.0, 0.0]) - normal[1] * normal
    across /= np.linalg.norm(across)
    return np.stack([along, across, np.cross(along, across)])


def _of_parts(
    ball: Projectile,
    spacing: float,
    site: np.ndarray,
    normal: np.ndarray,
    along: np.ndarray,
    gap: float,
    materials: Materials,
    support: float,
) -> Body:
    found = pellets(ball, spacing, materials)
    mass = float(materials.bulk_density[materials.index(ball.material)]) * ball.volume
    positions = found.position @ axes_of_flight(along, normal)
    size = found.volume ** (1.0 / 3.0)
    lowest = float(np.min(positions @ normal - 0.5 * size))
    index = found.material.astype(np.int32)
    return Body(
        site + along * ((gap - lowest) / float(along @ normal)) + positions,
        mass * found.fraction,
        materials.bulk_density[index],
        support * found.width,
        np.full(len(size), -1, dtype=np.int32),
        index,
        materials.rows.alpha0[index],
    )
