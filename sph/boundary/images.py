"""Images of particles across planes: what the pair loop sees beyond a periodic end or a wall.

An image is a row behind those of the particles; the loop reads it like any neighbour's and never writes to it. It
follows its particle exactly,

    x' = s x + a + b t,   v' = s v + b,   sigma'_ij = s_i s_j sigma_ij
        (s, a, b per axis; volume, density, h and sound speed as its particle)

so that pairs across a plane are as antisymmetric as any. Planes are taken one after the other, each seeing the images
of those before: corners come out right.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from matter.compilation.gather import LANES
from matter.compilation.jit import kernel, parallel_kernel, prange
from matter.files import checkpoint
from matter.geometry import neighbours
from sph.pairs.row import (
    ENERGY,
    RHO_INVERSE,
    SLOPE,
    SOUND,
    SUPPORT,
    TENSOR,
    VISCOSITY_FRACTION,
    VOLUME,
    VX,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    X,
)


class Plane(Protocol):
    """What a plane answers; ``axis`` is the one that it is square to."""

    @property
    def axis(self) -> int: ...

    @property
    def image_speed(self) -> float:
        """Largest speed of an image of matter at rest [m/s]."""

    @property
    def period(self) -> float:
        """Distance of two images of one particle [m], infinite where it has one only."""

    def images(
        self, x: np.ndarray, reach: np.ndarray, most: float, time: float
    ) -> Iterator[tuple[np.ndarray, float, float, float]]:
        """Indices, sign s, shift a [m] at time 0 and drift b [m/s] along the axis of what lies within 0.5 (``reach`` +
        ``most``) of the plane at ``time`` [s]; ``x`` (n,) [m] along the axis."""

    def wrap(self, x: np.ndarray) -> None:
        """Bring positions along the axis (n,) back to the side of the matter, in place."""


@parallel_kernel
def _fill(row, count, owner, sign, shift, drift):
    for g in prange(len(owner)):
        source, image = row[owner[g]], row[count + g]
        for k in (SUPPORT, VOLUME, RHO_INVERSE, SOUND):
            image[k] = source[k]
        for a in range(3):
            image[X + a] = sign[g, a] * source[X + a] + shift[g, a]
            image[VX + a] = sign[g, a] * source[VX + a] + drift[g, a]
        sx, sy, sz = sign[g, 0], sign[g, 1], sign[g, 2]
        image[XX], image[XY], image[XZ] = source[XX], sx * sy * source[XY], sx * sz * source[XZ]
        image[YY], image[YZ], image[ZZ] = source[YY], sy * sz * source[YZ], source[ZZ]


@parallel_kernel
def _fill_extra(extra, count, owner, sign, tensor):
    for g in prange(len(owner)):
        source, image = extra[owner[g]], extra[count + g]
        image[VISCOSITY_FRACTION], image[ENERGY] = source[VISCOSITY_FRACTION], source[ENERGY]
        sx, sy, sz = sign[g, 0], sign[g, 1], sign[g, 2]
        image[SLOPE], image[SLOPE + 1], image[SLOPE + 2] = (
            source[SLOPE],
            sx * sy * source[SLOPE + 1],
            sx * sz * source[SLOPE + 2],
        )
        image[SLOPE + 3], image[SLOPE + 4], image[SLOPE + 5] = (
            source[SLOPE + 3],
            sy * sz * source[SLOPE + 4],
            source[SLOPE + 5],
        )
        for a in range(3 if tensor else 0):
            for b in range(3):
                image[TENSOR + 3 * a + b] = sign[g, a] * sign[g, b] * source[TENSOR + 3 * a + b]


@kernel
def _renumber(order, index, entry, count):
    """Rows of a sorted list in the numbers of the unsorted particles, with what fills them up."""
    for i in range(len(order)):
        for k in range((count[i] + LANES - 1) // LANES * LANES):
            index[entry[i] + k] = order[index[entry[i] + k]]


class Images:
    """The planes of a run and the present images: ``owner`` (g,), ``sign``, ``shift`` [m] at time 0 and ``drift``
    [m/s] (g, 3)."""

    AHEAD = 12  # steps that a list reckons with while a piston moves

    def __init__(self, planes: tuple[Plane, ...]):
        self.planes = planes
        self.speed = max((plane.image_speed for plane in planes), default=0.0)
        self.time, self.margin = 0.0, 0.0  # of the list: when it was made, how far images may drift until the next
        self.period = min((plane.period for plane in planes), default=np.inf)
        self.owner = np.zeros(0, dtype=np.int64)
        self.sign, self.shift, self.drift = np.ones((0, 3)), np.zeros((0, 3)), np.zeros((0, 3))

    def state(self) -> dict[str, float]:
        """What the present list reckons with, for a checkpoint."""
        return {"images_time": self.time, "images_margin": self.margin}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        self.time, self.margin = float(saved["images_time"]), float(saved["images_margin"])

    def wrap(self, position: np.ndarray) -> None:
        """Bring positions (n, 3) back into a periodic box, in place."""
        for plane in self.planes:
            plane.wrap(position[:, plane.axis])

    @property
    def longest(self) -> float:
        """Listed pairs may be this far apart at most [m], or a particle would meet two images of one other."""
        return self.period - 2.0 * self.margin

    def expect(self, dt: float, time: float, h: float) -> None:
        """The next list is made at ``time`` [s], for steps of ``dt`` [s] and supports up to ``h`` [m]."""
        self.time, self.margin = time, min(self.AHEAD * dt * self.speed, 0.1 * h)

    def stale(self, time: float) -> bool:
        """Whether images may have drifted further than the list reckons with."""
        return self.speed * (time - self.time) > self.margin

    def image_positions(self, position: np.ndarray, reach: np.ndarray) -> np.ndarray:
        """Make the images of ``position`` (n, 3) that anything within ``reach`` (n,) may see; their positions (g,
        3)."""
        most = float(reach.max())
        count, time = len(position), self.time
        all_positions, owner = position, np.arange(count)
        sign, shift, drift = (np.full((count, 3), value) for value in (1.0, 0.0, 0.0))
        for plane in self.planes:
            pieces = []
            for which, s, a, b in plane.images(all_positions[:, plane.axis], reach[owner], most, time):
                parts = [array[which].copy() for array in (sign, shift, drift)]
                parts[0][:, plane.axis] *= s
                parts[1][:, plane.axis] = s * parts[1][:, plane.axis] + a
                parts[2][:, plane.axis] = s * parts[2][:, plane.axis] + b
                pieces.append((owner[which], *parts))
            owner, sign, shift, drift = (
                np.concatenate([old, *new]) for old, *new in zip((owner, sign, shift, drift), *pieces)
            )
            all_positions = sign * position[owner] + shift + drift * time
        self.owner, self.sign, self.shift, self.drift = (
            np.ascontiguousarray(a[count:]) for a in (owner, sign, shift, drift)
        )
        return all_positions[count:]

    def listed(self, position: np.ndarray, reach: np.ndarray, half_width: float) -> neighbours.Neighbours:
        """Neighbours of the particles among particles and images (numbered behind them)."""
        wide = reach + 2.0 * self.margin
        beyond = self.image_positions(position, wide)
        all_positions, far = np.concatenate([position, beyond]), np.concatenate([wide, wide[self.owner]])
        order, grid = neighbours.sort(all_positions, far, half_width)
        pairs = neighbours.build(all_positions[order], far[order], grid)
        _renumber(order, pairs.index, pairs.entry, pairs.count)
        entry, count = np.empty_like(pairs.entry), np.empty_like(pairs.count)
        entry[order], count[order] = pairs.entry, pairs.count
        return neighbours.Neighbours(pairs.index, entry[: len(position)].copy(), count[: len(position)].copy())

    def rows(self, row: np.ndarray, count: int, time: float) -> None:
        """Fill the rows behind the first ``count`` with the images at ``time`` [s]."""
        _fill(row, count, self.owner, self.sign, self.shift + self.drift * time, self.drift)

    def extra(self, extra: np.ndarray, count: int, tensor: bool) -> None:
        """The same of extra rows: slopes, a fraction, and where there is one a ``tensor`` by rows."""
        _fill_extra(extra, count, self.owner, self.sign, tensor)
