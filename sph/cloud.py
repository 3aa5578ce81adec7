"""The particles of the shock stage while they run: arrays in the order of the neighbour grid, and how that order is kept."""

from __future__ import annotations

import numpy as np

from matter import neighbours
from sph.target import Body

# every array that belongs to a particle and travels with it when the cloud is sorted, with its trailing shape
ARRAYS: dict[str, tuple[tuple[int, ...], str]] = {
    "identity": ((), "int64"),
    "position": ((3,), "float64"),
    "velocity": ((3,), "float64"),
    "half_velocity": ((3,), "float64"),  # state half a step on, between drift and the closing kick
    "mass": ((), "float64"),
    "density": ((), "float64"),
    "half_density": ((), "float64"),
    "specific_energy": ((), "float64"),
    "half_energy": ((), "float64"),
    "smoothing_length": ((), "float64"),
    "stress": ((5,), "float64"),  # deviatoric, before damage: xx xy xz yy yz
    "half_stress": ((5,), "float64"),
    "root_damage": ((), "float64"),  # D^(1/3)
    "half_damage": ((), "float64"),
    "peak_pressure": ((), "float64"),
    "gravity": ((3,), "float64"),
    "gravity_position": ((3,), "float64"),  # where gravity was last evaluated
    "initial_position": ((3,), "float64"),
    "neighbours": ((), "int32"),
    "material": ((), "int32"),
    "layer": ((), "int32"),
    "flaw_first": ((), "int64"),
    "flaw_last": ((), "int64"),
}


class Cloud:
    """Arrays named in ``ARRAYS``, all (n, ...), plus ``flaw_strain`` (all flaws of all particles, ascending for each)."""

    identity: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    half_velocity: np.ndarray
    mass: np.ndarray
    density: np.ndarray
    half_density: np.ndarray
    specific_energy: np.ndarray
    half_energy: np.ndarray
    smoothing_length: np.ndarray
    stress: np.ndarray
    half_stress: np.ndarray
    root_damage: np.ndarray
    half_damage: np.ndarray
    peak_pressure: np.ndarray
    gravity: np.ndarray
    gravity_position: np.ndarray
    initial_position: np.ndarray
    neighbours: np.ndarray
    material: np.ndarray
    layer: np.ndarray
    flaw_first: np.ndarray
    flaw_last: np.ndarray

    def __init__(self, count: int):
        for name, (shape, kind) in ARRAYS.items():
            setattr(self, name, np.zeros((count, *shape), dtype=kind))
        self.flaw_strain = np.zeros(0, dtype=np.float32)

    def __len__(self) -> int:
        return len(self.mass)

    @classmethod
    def of(cls, *bodies: Body) -> Cloud:
        """A cloud at rest of the given bodies, identities in their order."""
        cloud = cls(sum(len(body.mass) for body in bodies))
        cloud.identity[:] = np.arange(len(cloud))
        for name, field in (
            ("position", "position"),
            ("mass", "mass"),
            ("density", "density"),
            ("smoothing_length", "h"),
            ("layer", "layer"),
        ):
            getattr(cloud, name)[:] = np.concatenate([getattr(body, field) for body in bodies])
        cloud.material[:] = np.concatenate([body.material for body in bodies])
        cloud.initial_position[:] = cloud.position
        cloud.neighbours[:] = 60  # until counted
        return cloud

    def reorder(self, order: np.ndarray) -> None:
        """Put every array into a new order."""
        for name in ARRAYS:
            setattr(self, name, np.ascontiguousarray(getattr(self, name)[order]))


class Neighbourhood:
    """The neighbour list of a cloud, rebuilt (and the cloud sorted anew) when a particle has moved so far that it could have a new neighbour.

    A pair closer than h_ij is always listed while nobody has moved more than (reach - 1) h / 2 since the list was built.
    """

    def __init__(self, cloud: Cloud, half_width: float, reach: float = 1.1):
        self.half_width, self.reach, self.builds = half_width, reach, 0
        self.found: neighbours.Neighbours | None = None
        self.rebuild(cloud)

    def rebuild(self, cloud: Cloud, places: np.ndarray | None = None) -> None:
        """Sort the cloud and list its neighbours. ``places``: positions of an earlier list to restore (the cloud is in its order already)."""
        if places is None:
            order, grid = neighbours.sort(cloud.position, cloud.smoothing_length, self.half_width)
            cloud.reorder(order)
            places = cloud.position
        else:
            _, grid = neighbours.sort(places, cloud.smoothing_length, self.half_width)
        self.places = places.copy()
        self.found = neighbours.build(self.places, cloud.smoothing_length, grid, self.reach, self.found)
        self.builds += 1

    def update(self, cloud: Cloud) -> bool:
        """Rebuild if needed; True when the cloud was sorted anew."""
        moved = cloud.position - self.places
        limit = 0.5 * (self.reach - 1.0) * cloud.smoothing_length
        if np.einsum("ij,ij->i", moved, moved).max(initial=0.0) <= limit.min() ** 2 or not (np.einsum("ij,ij->i", moved, moved) > limit**2).any():
            return False
        self.rebuild(cloud)
        return True
