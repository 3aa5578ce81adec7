"""Columns: matter of one dimension in the production kernels of three, periodic across, with a piston, a wall or a quiet end.

One set of numerics for all of them: ``NUMERICS`` and ``SUPPORT``. Viscosity and step are the stage's defaults. The kernel is Wendland's with h = 2.6 spacings
(68 neighbours in this lattice): the discrete divergence of a lattice compressed by 1 to 1.9 along z is then within 0.6 % of the true one, where the
cubic spline with the stage's h = 2 (38 neighbours) is off by up to 2.6 %, which shows in P and in the shock's speed (-1.2 % and -1.9 % in basalt). Sums are
weighted by the first volumes and h follows the density: with present volumes ice at 10 km/s is 5.5 % off in P, and with fixed h Sod's tube 10 % in its density.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sph.boundary.edge import Edge
from sph.boundary.images import Images
from sph.boundary.periodic import Periodic
from sph.boundary.wall import Wall
from sph.cloud import Cloud
from sph.integrator import Integrator, Surroundings
from sph.materials import Materials
from sph.numerics import Numerics
from sph.target import Body

SUPPORT = 2.6  # h over the spacing
NUMERICS = {"alpha": 2.0, "beta": 10.0, "courant": 0.3, "kernel": "wendland", "support": SUPPORT, "volumes": "start", "smoothing": "density"}


def integrator(cloud: Cloud, materials: Materials, radius: float, kind: type[Integrator] = Integrator, **options) -> Integrator:
    """An integrator without self-gravity unless it is asked for; ``options`` are keys of ``sph.numerics`` and of ``Surroundings``."""
    outside = {"self_gravity": False} | {key: options.pop(key) for key in Surroundings._fields if key in options}
    unknown = set(options) - set(Numerics.model_fields)
    assert not unknown, unknown
    numerics = Numerics().model_copy(update={"theta": 0.5, "gravity_shift": 0.0} | options)  # tolerances beyond what a case may ask for, too
    return kind(cloud, materials, radius, numerics, Surroundings(**outside))


def lattice(layers: int, across: int) -> tuple[np.ndarray, float, float, float]:
    """Hexagonal close packing of spacing 1 in layers square to z, its lower face at z = 0: points (n, 3), width along x and y, distance of the layers.

    ``across`` is the (even) number of points along x and of rows along y.
    """
    a = 2.0 ** (1.0 / 6.0)
    k, j, i = (index.ravel() for index in np.meshgrid(np.arange(layers), np.arange(across), np.arange(across), indexing="ij"))
    x = a * (i + 0.5 * ((j + k) % 2))
    y = a * math.sqrt(0.75) * (j + (k % 2) / 3.0)
    gap = a * math.sqrt(2.0 / 3.0)
    wide, deep = a * across, a * math.sqrt(0.75) * across
    return np.stack([x % wide, y % deep, gap * (k + 0.5)], axis=1), wide, deep, gap


class Column:
    """A column of one material (index 0), ``layers`` high, spacing 1 m; ``piston`` [m/s] drives its lower face, or it rests on a wall or an ``edge``."""

    def __init__(self, materials: Materials, layers: int, across: int = 4, piston: float | None = None, ends: bool = False, **options):
        place, wide, deep, self.gap = lattice(layers, across)
        n = len(place)
        rho = float(materials.bulk_density[0])
        self.height = layers * self.gap
        self.rho0 = rho
        body = Body(
            place, np.full(n, rho), np.full(n, rho), np.full(n, SUPPORT), np.zeros(n, np.int32), np.zeros(n, np.int32), np.full(n, materials.rows.alpha0[0])
        )
        planes: list[Periodic | Wall] = [Periodic(0, 0.0, wide), Periodic(1, 0.0, deep)]
        if piston is not None:
            planes.append(Wall(2, 0.0, piston))
        if ends:
            planes.append(Wall(2, self.height))
        self.integrator = integrator(Cloud.of(body), materials, self.height, images=Images(tuple(planes)), **(NUMERICS | options))
        self.integrator.strength = self.integrator.damage = False

    @property
    def cloud(self) -> Cloud:
        return self.integrator.cloud

    def run(self, until: float) -> None:
        """Steps up to the time ``until`` [s]."""
        i = self.integrator
        while i.time < until:
            i.step(i.next_step(until))

    def layers(self, values: np.ndarray) -> np.ndarray:
        """Means of ``values`` (n,) over the layers, counted from the lower face by where their particles began."""
        layer = (self.cloud.initial_position[:, 2] / self.gap).astype(int)
        return np.bincount(layer, values) / np.bincount(layer)


class Shock(NamedTuple):
    """What a piston of ``piston`` [m/s] drove: plateau means, their scatter over layers, and the front's speed; SI."""

    P: float
    rho: float
    u: float
    speed: float
    scatter: float
    width: float
    distention: float
    particles: int
    steps: int


def front(column: Column, level: float) -> float:
    """Place [m] where the mean velocity of the layers falls through ``level`` [m/s], seen from above."""
    v = column.layers(column.cloud.velocity[:, 2])
    z = column.layers(column.cloud.position[:, 2])
    above = np.flatnonzero(v > level)
    if len(above) == 0:
        return 0.0
    k = int(above[-1])
    if k + 1 >= len(v):
        raise AssertionError("the front has left the column")
    return float(z[k] + (z[k + 1] - z[k]) * (v[k] - level) / (v[k] - v[k + 1]))


def shocked(materials: Materials, piston: float, expected: float, layers: int = 100, across: int = 4, fastest: float = 0.0, **options) -> Shock:
    """Drive a piston into a column until a front of the ``expected`` speed [m/s] has run through 85 % of ``layers``, and measure.

    The column is higher where a ``fastest`` wave [m/s] runs ahead: a precursor that is back from the free upper end spoils what the front meets.

    The plateau is the layers between 35 and 75 % of the shocked ones, counted from the piston: off its heated first layers and off the front.
    """
    column = Column(materials, round(layers * max(1.0, fastest / expected)), across, piston=piston, **options)
    i = column.integrator
    i.start()
    end = 0.85 * layers * column.gap / expected
    times, places = [], []
    for part in range(6):
        column.run((0.5 + 0.1 * part) * end)
        times.append(i.time)
        places.append(front(column, 0.5 * piston))
    speed = float(np.polyfit(times, places, 1)[0])
    v = column.layers(column.cloud.velocity[:, 2])
    wet = int(np.flatnonzero(v > 0.5 * piston)[-1]) + 1
    chosen = slice(round(0.35 * wet), round(0.75 * wet))
    P, rho, u = (column.layers(a)[chosen] for a in (i.evaluated.pressure, column.cloud.density, column.cloud.specific_energy))
    z = column.layers(column.cloud.position[:, 2])
    high, low = (float(np.interp(-share * piston, -v[wet - 12 :], z[wet - 12 :])) for share in (0.1, 0.9))
    alpha = column.layers(i.evaluated.alpha)[chosen]
    return Shock(P.mean(), rho.mean(), u.mean(), speed, float(P.std() / P.mean()), (high - low) / SUPPORT, float(alpha.max()), len(column.cloud), i.steps)


def quiet_end(column: Column, width: float) -> None:
    """End the column below in a quiet layer of ``width`` [m] before a fixed rim."""
    cloud = column.cloud
    order = np.argsort(cloud.identity)
    column.integrator.edge = Edge(
        cloud.position[order, 2], cloud.smoothing_length[order], cloud.density[order], cloud.specific_energy[order], np.full(len(order), width)
    )
