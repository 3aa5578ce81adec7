"""The particles of the shock stage while they run: arrays in the order of the neighbour grid, and how that order is
kept."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping
from typing import Any

import numpy as np

from matter.compilation.jit import parallel_kernel, prange
from matter.files import checkpoint
from matter.geometry import neighbours
from sph.bodies.target import Body
from sph.boundary.images import Images
from sph.pairs import bearing_pressure

# every array that belongs to a particle and travels with it when the cloud is sorted, with its trailing shape
ARRAYS: dict[str, tuple[tuple[int, ...], str]] = {
    "identity": ((), "int32"),
    "position": ((3,), "float64"),
    "velocity": ((3,), "float64"),
    "half_velocity": ((3,), "float64"),  # state half a step on, between drift and the closing kick
    "mass": ((), "float64"),
    "density": ((), "float64"),
    "half_density": ((), "float64"),
    "specific_energy": ((), "float64"),
    "half_energy": ((), "float64"),
    "support_radius": ((), "float64"),
    "start_support": (
        (),
        "float64",
    ),  # support radius and density at the start of the phase, where h follows the density
    "start_density": ((), "float64"),
    "stress": ((5,), "float64"),  # deviatoric, before damage: xx xy xz yy yz
    "half_change": ((5,), "float64"),  # of stress, by the rate at the beginning of a step, in half of it
    "root_damage": ((), "float64"),  # D^(1/3) by tension
    "half_damage": ((), "float64"),
    "distention": ((), "float64"),  # alpha at rest (P = 0): falls as pores close, 1 is solid
    "initial_distention": ((), "float64"),
    "peak_pressure": ((), "float64"),
    "mean_pressure": ((), "float64"),  # of the neighbours, at the last evaluation
    "gravity": ((3,), "float64"),
    "gravity_position": ((3,), "float64"),  # where gravity was last evaluated
    "initial_position": ((3,), "float64"),
    "neighbours": ((), "int32"),
    "material": ((), "int32"),
    "layer": ((), "int32"),
    "flaw_first": ((), "int32"),  # indices in flaw_strain
    "flaw_last": ((), "int32"),
    "flaw_total": ((), "float32"),  # where not all are kept, else 0
}

FIELDS = (*ARRAYS, "flaw_strain")
Fields = namedtuple("Fields", FIELDS)  # type: ignore[misc]
"""The arrays of a cloud as compiled loops take them. numba drops what a loop over ``prange`` itself writes to arrays
inside a tuple, without a word: such a loop calls the function that writes."""

OPTIONAL = ("late_density", "viscosity", "strain_rate", "plastic_strain", "vibration", "block")
"""Arrays (n, ...) that are empty until a law needs them: the density without pressure of the late stage
(``sph.stepping.late``), the fraction of the artificial viscosity where a switch governs it (``sph.viscosity.switch``),
the symmetric velocity gradient of the last evaluation (n, 6) [1/s] (``sph.viscosity.reconstructed``), the plastic
strain of a yield law that hardens (``sph.strength.johnson_cook``), the speed of the vibration that takes friction away
[m/s] (``sph.strength.block_model``), the block that a particle belongs to (-1: none; ``sph.bodies.rubble``)."""

# loops that gather something over all particles run in this many pieces, so that it does not depend on the number of
# threads
PARTS = 64


@parallel_kernel
def moved_further(x, since, limit, count, least, out):
    """``out`` (parts,): whether a particle with at least ``least`` neighbours is further than ``limit`` (n,) from
    where it was."""
    n, parts = len(x), len(out)
    for part in prange(parts):
        out[part] = False
        for i in range(part * n // parts, (part + 1) * n // parts):
            dx, dy, dz = x[i, 0] - since[i, 0], x[i, 1] - since[i, 1], x[i, 2] - since[i, 2]
            if count[i] >= least and dx * dx + dy * dy + dz * dz > limit[i] * limit[i]:
                out[part] = True
                break


class Cloud:
    """Arrays named in ``ARRAYS``, all (n, ...), plus ``OPTIONAL`` and ``flaw_strain`` (all flaws of all particles,
    ascending for each)."""

    identity: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    half_velocity: np.ndarray
    mass: np.ndarray
    density: np.ndarray
    half_density: np.ndarray
    specific_energy: np.ndarray
    half_energy: np.ndarray
    support_radius: np.ndarray
    start_support: np.ndarray
    start_density: np.ndarray
    stress: np.ndarray
    half_change: np.ndarray
    root_damage: np.ndarray
    half_damage: np.ndarray
    distention: np.ndarray
    initial_distention: np.ndarray
    late_density: np.ndarray
    peak_pressure: np.ndarray
    mean_pressure: np.ndarray
    viscosity: np.ndarray
    strain_rate: np.ndarray
    plastic_strain: np.ndarray
    vibration: np.ndarray
    block: np.ndarray
    gravity: np.ndarray
    gravity_position: np.ndarray
    initial_position: np.ndarray
    neighbours: np.ndarray
    material: np.ndarray
    layer: np.ndarray
    flaw_first: np.ndarray
    flaw_last: np.ndarray
    flaw_total: np.ndarray

    def __init__(self, count: int):
        for name, (shape, kind) in ARRAYS.items():
            setattr(self, name, np.zeros((count, *shape), dtype=kind))
        self.late_density, self.viscosity, self.strain_rate = np.zeros(0), np.zeros(0), np.zeros((0, 6))
        self.plastic_strain, self.vibration, self.block = np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int32)
        self.flaw_strain = np.zeros(0, dtype=np.float32)
        self.mean_pressure[:] = bearing_pressure.UNKNOWN

    def __len__(self) -> int:
        return len(self.mass)

    @property
    def fields(self) -> Fields:
        """The arrays as they stand, for a compiled loop."""
        return Fields(*(getattr(self, name) for name in FIELDS))

    @classmethod
    def from_bodies(cls, *bodies: Body) -> Cloud:
        """A cloud at rest of the given bodies, identities in their order."""
        cloud = cls(sum(len(body.mass) for body in bodies))
        cloud.identity[:] = np.arange(len(cloud))
        for name, field in (
            ("position", "position"),
            ("mass", "mass"),
            ("density", "density"),
            ("support_radius", "h"),
            ("layer", "layer"),
        ):
            getattr(cloud, name)[:] = np.concatenate([getattr(body, field) for body in bodies])
        cloud.distention[:] = np.concatenate([np.broadcast_to(body.distention, len(body.mass)) for body in bodies])
        cloud.initial_distention[:] = cloud.distention
        cloud.material[:] = np.concatenate([body.material for body in bodies])
        if any(np.ndim(body.block) for body in bodies):
            cloud.block = np.concatenate([np.broadcast_to(body.block, len(body.mass)) for body in bodies])
        cloud.initial_position[:] = cloud.position
        cloud.start_support[:], cloud.start_density[:] = cloud.support_radius, cloud.density
        cloud.neighbours[:] = 60  # until counted
        return cloud

    def state(self) -> dict[str, np.ndarray]:
        """Every array, for a checkpoint."""
        return {name: getattr(self, name) for name in (*ARRAYS, *OPTIONAL, "flaw_strain")}

    def restore(self, saved: checkpoint.State) -> None:
        """Take up a ``state``."""
        for name in (*ARRAYS, *OPTIONAL, "flaw_strain"):
            setattr(self, name, saved[name])

    @classmethod
    def restored(cls, saved: checkpoint.State) -> Cloud:
        """The cloud of a ``state``."""
        cloud = cls(len(saved["mass"]))
        cloud.restore(saved)
        return cloud

    def reorder(self, order: np.ndarray) -> None:
        """Put every array into a new order."""
        for name in ARRAYS:
            setattr(self, name, np.take(getattr(self, name), order, axis=0))
        for name in OPTIONAL:
            if len(getattr(self, name)):
                setattr(self, name, np.take(getattr(self, name), order, axis=0))


class Neighbourhood:
    """The neighbour list of a cloud, rebuilt (and the cloud sorted again) when a particle has moved so far that it
    could have a new neighbour.

    Every particle has a skin, ``SKIN`` of its h or what it flies in ``AHEAD`` steps (at most ``SKIN_MOST`` of its h):
    a pair is listed within h_ij plus both skins, so that no pair closer than h_ij is missed while nobody has moved by
    more than its skin. Fast particles thus do not rebuild the whole list at every step.

    A lone particle, one without any neighbour, waits for the time that skins reckon with to be over: ``AHEAD`` steps
    of the length that they had when the list was made. Flying on freely it stays within its skin until then, unless
    that is cut at ``SKIN_MOST`` of its h: debris of an impact in a late stage, where a step of the slow flow takes it
    past several of its h. Steps do not resolve what such a particle flies through, with or without a list of its own.
    Other results do not depend on the skins beyond the order of sums.
    """

    SKIN, SKIN_MOST, AHEAD = 0.02, 2.0, 12

    def __init__(self, cloud: Cloud, half_width: float, images: Images | None = None):
        self.half_width, self.builds, self.images = half_width, 0, images
        self.age, self.good_for = 0.0, 0.0
        self._parts = np.zeros(PARTS, dtype=np.bool_)
        self.pairs: neighbours.Neighbours | None = None
        self.rebuild(cloud, 0.0)

    def rebuild(self, cloud: Cloud, dt: float, time: float = 0.0) -> None:
        """Sort the cloud and list its neighbours; ``dt`` [s] the step that skins reckon with, ``time`` [s] that of the
        images."""
        self.positions = self.reach = np.zeros(0)  # of the list before: free from here on
        h = cloud.support_radius
        reach = np.einsum("ij,ij->i", cloud.velocity, cloud.velocity)  # speed, then skin, then reach, in one array
        np.sqrt(reach, out=reach)
        reach *= self.AHEAD * dt
        np.clip(reach, self.SKIN * h, self.SKIN_MOST * h, out=reach)
        reach *= 2.0
        reach += h
        if self.images is not None:
            self.images.wrap(cloud.position)
            self.images.expect(dt, time, float(h.max()))
            reach = np.minimum(reach, np.maximum(self.images.longest, (1.0 + 2.0 * self.SKIN) * h))
        order, grid = neighbours.sort(cloud.position, reach, self.half_width)
        cloud.reorder(order)
        reach = reach[order]
        del order
        self._list(cloud.position, reach, grid)
        self.builds += 1
        # [s]; less by rounding: as many steps of this length as skins reckon with, not one more
        self.age, self.good_for = 0.0, (1.0 - 1e-9) * self.AHEAD * dt

    def state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Where the particles were when the list was built (n, 3) [m], and with which reach (n,) [m]; how many lists
        there were, how old this one is and for how long lone particles wait [s]."""
        numbers = {"builds": self.builds, "list_age": self.age, "list_good_for": self.good_for}
        return {"places": self.positions, "reach": self.reach}, numbers

    def restore(self, saved: checkpoint.State, numbers: Mapping[str, Any]) -> None:
        """Build the list of a ``state`` again; the cloud is in its order already."""
        self.builds, self.age = int(numbers["builds"]), float(numbers["list_age"])
        self.good_for = float(numbers["list_good_for"])
        positions, reach = saved["places"], saved["reach"]
        self._list(positions, reach.copy(), neighbours.sort(positions, reach, self.half_width)[1])

    def _list(self, positions: np.ndarray, reach: np.ndarray, grid: neighbours.Grid) -> None:
        # by columns, as the list is made
        self.positions, self.reach = (positions.copy(order="F" if self.images is None else "C"), reach)
        if self.images is None:
            self.pairs = neighbours.build(self.positions, reach, grid, 1.0, self.pairs)
        else:
            self.pairs = self.images.listed(self.positions, reach, self.half_width)

    def update(self, cloud: Cloud, dt: float, time: float = 0.0) -> None:
        """Rebuild if needed, which sorts the cloud again."""
        self.age += dt
        room = 0.5 * (self.reach - cloud.support_radius)
        if room.min() < 0.0:  # a support has grown beyond its listing
            self.rebuild(cloud, dt, time)
            return
        least = 1 if self.age < self.good_for else 0
        moved_further(cloud.position, self.positions, room, cloud.neighbours, least, self._parts)
        if self._parts.any() or (self.images is not None and self.images.stale(time)):
            self.rebuild(cloud, dt, time)
