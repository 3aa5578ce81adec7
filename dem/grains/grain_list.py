"""Grains in the order of their search cells, and the list of their pairs: what is sorted, saved and restored together.

First stand the grains in the contact search, then the ballistic ones, last those that have left; ``identity`` finds a
grain again. All of the state can be saved and restored bit for bit (``saved``, ``restore``).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from dem.contact import walls
from dem.contact.columns import MASS, OFFSET, RADIUS, STIFFNESS, TOUCHING, WX, XYZ
from dem.contact.contact_scheme import Chunk, Scheme
from dem.contact.gravity import Field
from dem.grains import contact_tables, pair_list, shaking, size_levels
from dem.grains.self_gravity import SelfGravity
from dem.grains.shaking import Vibration
from matter.compilation import gather
from matter.errors import InputError
from matter.files import checkpoint
from matter.particles import Particles

ACTIVE, BALLISTIC, LEFT = 0, 1, 2
# per-grain arrays that are sorted, saved and restored together
PER_GRAIN = (
    "X", "V", "W", "A", "E", "F", "identity", "material", "kind", "state", "returned", "drag", "weight", "density",
    "headroom",
    "wall_history", "reference",
)  # fmt: skip
FORCES = ("A", "E", "F")
PULLED = ("self_acceleration", "cached_acceleration")
SHAKEN = ("vibration", "bearing")
_LISTED = ("row", "col", "hist", "report", "booked")
_NUMBERS = (
    "dt", "skin", "steps", "builds", "since_build", "start_time", "elastic", "contacts", "over_warn", "worst", "speed",
    "active", "moving",
    "mean_radius", "softness", "rest_energy", "stiffness_energy", "weight_energy", "stiffness_excess",
    "lost_in_flight", "vibration_time",
)  # fmt: skip


class GrainList:
    """The arrays of the grains (``dem.contact.columns``), which are where, and who may touch whom;
    ``dem.grains.assembly.Assembly`` makes it and moves it."""

    X: np.ndarray
    V: np.ndarray
    W: np.ndarray
    A: np.ndarray
    E: np.ndarray
    F: np.ndarray
    identity: np.ndarray
    material: np.ndarray
    kind: np.ndarray
    state: np.ndarray
    headroom: np.ndarray
    density: np.ndarray
    weight: np.ndarray
    wall_history: np.ndarray
    reference: np.ndarray
    row: np.ndarray
    col: np.ndarray
    first: np.ndarray
    hist: np.ndarray
    walls: np.ndarray
    scheme: Scheme
    gravity: Field
    self_gravity: SelfGravity | None
    outer: tuple[Any, ...]
    self_acceleration: np.ndarray
    cached_acceleration: np.ndarray
    shaking: Vibration | None
    vibration: np.ndarray
    bearing: np.ndarray
    vibration_time: float
    pull_state: np.ndarray
    pull_interval: float
    threads: int
    _pool: ThreadPoolExecutor | None
    _known: np.ndarray
    dt: float
    steps: int
    start_time: float
    skin: float
    mean_radius: float
    builds: int
    since_build: int
    elastic: float
    active: int
    moving: int
    _per_grain: tuple[str, ...]

    @property
    def time(self) -> float:
        """Time [s]: start + steps dt."""
        return self.start_time + self.steps * self.dt

    # -- lists

    def touching(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Present indices of the two grains of each contact, and its history."""
        where = np.flatnonzero(self.hist[:, TOUCHING] != 0.0)
        return self.first[where].astype(np.int64), self.col[where].astype(np.int64), self.hist[where]

    def _each(self, function: Callable[[int], Any]) -> list[Any]:
        """Run ``function(chunk)`` for all chunks, chunk 0 on this thread."""
        if self._pool is None:
            return [function(0)]
        others = [self._pool.submit(function, c) for c in range(1, self.threads)]
        mine = function(0)
        return [mine] + [other.result() for other in others]

    def _spread(self, count: int, work: Callable[[int, int], Any]) -> list[Any]:
        """``work(lo, hi)`` for equal shares of range(count), one per thread."""
        return self._each(lambda c: work(count * c // self.threads, count * (c + 1) // self.threads))

    def _rebuild(
        self, known: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None, forces_follow: bool = False
    ) -> None:
        """Sort the grains by cell and build the list; ``known`` contacts replace those of the present list.

        ``forces_follow``: forces are evaluated before anybody reads them again, and need not be sorted.
        """
        if known is None:
            history, old = self.hist, (self.first, self.col, self._known, self.hist)
        else:
            first, second, history = known
            old = first.astype(np.int32), second.astype(np.int32), np.ones(len(first), dtype=np.int8), history
        self._adapt_skin(float(history[:, OFFSET].max(initial=0.0)) if self.scheme.offset else 0.0)
        active = int(np.count_nonzero(self.state == ACTIVE))
        self.active, self.moving = active, active + int(np.count_nonzero(self.state == BALLISTIC))
        by_state = np.argsort(self.state, kind="stable")
        in_place = not (self.state[1:] < self.state[:-1]).any()
        searched = self.X[:active] if in_place else self.X[by_state[:active]]
        # grains of very different sizes: cells only order them, of the size of the mean grain; their pairs are found
        # class by class
        mixed = size_levels.several(searched[:, RADIUS])
        reach = 2.0 * (self.mean_radius if mixed else float(self.X[:, RADIUS].max())) + self.skin
        cells = pair_list.Cells(searched, reach, self._spread)
        order = np.concatenate([by_state[cells.order], by_state[active:]])
        new_index = self._reorder(order, FORCES if forces_follow and in_place else ())
        room = max(len(self.col) + len(self.col) // 8, 6 * active, 64)
        if mixed:
            self.row, self.first, self.col = size_levels.build(self.X[:active], self.skin, room)
        else:
            self.row, self.first, self.col = pair_list.build(self.X[:active], cells, self.skin, room, self._spread)
        self.hist = gather.aligned_zeros((len(self.col), self.scheme.history))
        self._known = np.zeros(len(self.col), dtype=np.int8)
        new = self.row, self.col, self.hist, self._known
        self._spread(len(old[0]), lambda begin, end: pair_list.carry(begin, end, old, new_index, *new))
        self.F[active:] = 0.0
        self.wall_history[active:] = 0.0
        self._near_walls()
        self.builds += 1
        self.since_build = 0
        self._cut()

    def _reorder(self, order: np.ndarray, without: tuple[str, ...]) -> np.ndarray:
        """Put the grains into this order, but for the tables ``without``, and remember their positions; where each of
        them now stands (n,) int32."""
        names = [name for name in self._per_grain if name not in ("reference", *without)]
        old = {name: getattr(self, name) for name in names}
        new = {name: gather.aligned_zeros(a.shape) if name == "V" else np.empty_like(a) for name, a in old.items()}
        new_index = np.empty(len(order), dtype=np.int32)

        def move(lo: int, hi: int) -> None:
            for name in names:
                np.take(old[name], order[lo:hi], axis=0, out=new[name][lo:hi], mode="clip")
            new_index[order[lo:hi]] = np.arange(lo, hi)
            self.reference[lo:hi] = new["X"][lo:hi, :3]

        self._spread(len(order), move)
        vars(self).update(new)
        return new_index

    def _not_empty(self) -> np.ndarray:
        """1 for entries of the list with a history: those in contact and, with offsets, open ones that remember
        one."""
        filled = self.hist[:, TOUCHING] != 0.0
        return (filled | (self.hist[:, OFFSET] != 0.0) if self.scheme.offset else filled).astype(np.int8)

    def _near_walls(self) -> None:
        """Which grains can reach a wall before the list is built again: none moves further than half a skin until
        then."""
        self.walled = np.empty(len(self.X), dtype=np.int8)
        reach = self.reference, self.X[:, RADIUS], self.walls, self.skin
        self._spread(len(self.X), lambda lo, hi: walls.within_reach(lo, hi, *reach, self.walled))

    def _adapt_skin(self, offset: float) -> None:
        """Set the skin of the list about to be built: a list should serve 10 to 60 steps.

        A rebuild costs about three steps, and every entry beyond touch costs in each. Contacts with an ``offset`` [m]
        must stay in the list.
        """
        if self.builds > 1 and self.since_build < 10:
            self.skin = min(self.skin * 1.25, 0.5 * self.mean_radius)
        elif self.builds > 1 and self.since_build > 60:
            self.skin = max(self.skin * 0.8, 0.05 * self.mean_radius)
        self.skin = max(self.skin, 2.0 * offset)

    def _cut(self) -> None:
        """Chunks of rows with about equal numbers of list entries."""
        goals = np.linspace(0, self.row[-1], self.threads + 1)[1:-1]
        inner = np.searchsorted(self.row[1:], goals)
        rows = [0, *inner.tolist(), self.active]
        entries = self.row[rows].tolist()
        chunks = [Chunk(c, rows[c], rows[c + 1], entries[c], entries[c + 1], self.active) for c in range(self.threads)]
        self._chunks = [tuple(chunk) for chunk in chunks]
        self._moving_chunks = [*self._chunks[:-1], tuple(chunks[-1]._replace(hi=self.moving))]

    def _begin_unloaded(self) -> None:
        """Offsets for pairs that overlap without ever having been in contact, so that their springs begin at zero."""
        first = self.first
        overlap = (
            self.X[first, RADIUS]
            + self.X[self.col, RADIUS]
            - np.linalg.norm(self.position[first] - self.position[self.col], axis=1)
        )
        fresh = (overlap > 0.0) & (self.hist[:, TOUCHING] == 0.0) & (self.hist[:, OFFSET] == 0.0)
        self.hist[fresh, OFFSET] = -overlap[fresh]
        self._known = self._not_empty()

    # -- what the state holds

    @property
    def mass(self) -> np.ndarray:
        """Masses [kg], in the present order."""
        return self.V[:, MASS]

    @property
    def position(self) -> np.ndarray:
        """Positions [m], in the present order."""
        return self.X[:, XYZ]

    @property
    def velocity(self) -> np.ndarray:
        """Velocities [m/s], in the present order."""
        return self.W[:, XYZ]

    def momentum(self) -> np.ndarray:
        """Linear momentum of all grains that have not left [kg m/s]."""
        return self.mass[: self.moving] @ self.velocity[: self.moving]

    def angular_momentum(self) -> np.ndarray:
        """Angular momentum about the origin, orbital and spin [kg m^2/s]."""
        k = slice(0, self.moving)
        inertia = 0.4 * self.mass[k] * self.X[k, RADIUS] ** 2
        return self.mass[k] @ np.cross(self.position[k], self.velocity[k]) + inertia @ self.W[k, WX:]

    def energies(self) -> dict[str, float]:
        """Kinetic, rotational, gravitational and elastic energy [J] of the grains that have not left."""
        k = slice(0, self.moving)
        m = self.mass[k]
        own = self.self_gravity.energy(self.position[k], m, self.X[k, RADIUS]) if self.self_gravity else 0.0
        own += sum(outer.energy(self, k) for outer in self.outer)
        return {
            "kinetic_J": float(0.5 * m @ np.sum(self.velocity[k] ** 2, axis=1)),
            "rotational_J": float(0.2 * (m * self.X[k, RADIUS] ** 2) @ np.sum(self.W[k, WX:] ** 2, axis=1)),
            "gravitational_J": float((m * self.weight[k]) @ self.gravity.potential(self.position[k])) + own,
            "elastic_J": self.elastic,
        }

    def wall_overlaps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Grain, wall and overlap [m], offset included, of every contact with a wall."""
        grain, wall = np.nonzero(self.wall_history[:, : len(self.walls), TOUCHING])
        d = walls.distances(self.walls, wall, self.X[grain])
        offset = self.wall_history[grain, wall, OFFSET] if self.scheme.offset else 0.0
        return grain, wall, self.X[grain, RADIUS] + offset - d

    def where(self, i: int) -> str:
        """Time, position and values of a grain, for a message."""
        x, v = self.position[i], self.velocity[i]
        return (
            f"t = {self.time:.6g} s, position ({x[0]:.5g}, {x[1]:.5g}, {x[2]:.5g}) m, "
            f"velocity ({v[0]:.4g}, {v[1]:.4g}, {v[2]:.4g}) m/s, "
            f"radius {self.X[i, RADIUS]:.4g} m, mass {self.V[i, MASS]:.4g} kg, k_n {self.V[i, STIFFNESS]:.4g} N/m"
        )

    # -- files

    def particles(self, attributes: dict[str, Any], tables: bool = True) -> Particles:
        """The grains as a snapshot in the order of their identities; ``tables`` adds the contact history."""
        order = np.argsort(self.identity, kind="stable")
        fields = {
            "identity": self.identity, "position": self.position, "velocity": self.velocity,
            "angular_velocity": self.W[:, WX:],
            "mass": self.V[:, MASS], "radius": self.X[:, RADIUS], "material": self.material, "species": self.kind,
            "headroom": self.headroom,
            "density": self.density, "stiffness": self.V[:, STIFFNESS], "state": self.state,
        }  # fmt: skip
        if self.shaking is not None:
            elapsed = self.time - self.vibration_time
            fields["vibration"] = shaking.speeds(self.vibration, self.material, elapsed, self.shaking)
        history: dict[str, np.ndarray] = {}
        if tables:
            history = contact_tables.written(
                self.identity,
                self.touching(),
                self.wall_history[:, : len(self.walls)],
                contact_tables.columns(bool(self.scheme.offset)),
            )
        return Particles({name: values[order] for name, values in fields.items()}, attributes, history)

    def saved(self) -> dict[str, Any]:
        """The whole state, everything that a checkpoint must hold: arrays and numbers."""
        return {name: getattr(self, name) for name in (*self._saved, *_NUMBERS)}

    @property
    def _saved(self) -> tuple[str, ...]:
        return self._per_grain + _LISTED + (("pull_state",) if self.scheme.attract else ())

    def restore(self, saved: checkpoint.State) -> None:
        """Take up what was ``saved``, bit for bit."""
        for name in self._saved:
            setattr(self, name, np.ascontiguousarray(saved[name]))
        for name in _NUMBERS:
            setattr(self, name, saved[name])
        self.first = pair_list.first_of(self.row)
        self.V, self.hist = gather.aligned(self.V), gather.aligned(self.hist)
        self._known = self._not_empty()
        self._near_walls()


def check(grains: Particles) -> None:
    """Raise ``InputError`` for grains that no assembly can be made of, naming the first."""
    for name in ("mass", "radius", "stiffness"):
        bad = ~(grains[name] > 0.0)
        if bad.any():
            i = int(np.flatnonzero(bad)[0])
            raise InputError(
                f"{name} of grain {grains.identity[i]} is {grains[name][i]:.6g}: it must be positive ({bad.sum()} "
                f"such grains)"
            )
    for name in ("position", "velocity", "angular_velocity"):
        if not np.isfinite(grains[name]).all():
            i = int(np.flatnonzero(~np.isfinite(grains[name]).all(axis=1))[0])
            raise InputError(f"{name} of grain {grains.identity[i]} is not finite")
    if len(np.unique(grains.identity)) != len(grains):
        raise InputError("two grains share an identity")
    if len(grains) < 1:
        raise InputError("no grains")
