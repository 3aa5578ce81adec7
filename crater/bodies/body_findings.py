"""What the stage found on a body of any shape, stage by stage: measures of the body, its map, and the class of what
the impact left (``crater.bodies.classes``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from crater.bodies import body_state, exchange, height_map, measured
from crater.bodies.body_comparison import BodyComparison, Pair
from crater.bodies.classes import classed
from crater.bodies.mutual_orbit import Orbit
from crater.measures.measure import Measures
from crater.measures.uncertainty import Quantity
from crater.settings import RISE_LIMIT
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from matter.solids.body_shape import Shape
from matter.solids.pose_tracker import PoseTracker


@dataclass(frozen=True)
class Body:
    """A body that is hit: its ``shape``, and of ``target.json`` its rotation ``omega`` (3,) [1/s] and the ``orbit``,
    None where there is none; ``gravity`` at its surface [m/s^2], ``rise`` [m] above which what would rise flies;
    ``brought`` (3,) [kg m/s] by the projectile."""

    shape: Shape
    omega: np.ndarray
    orbit: Orbit | None
    gravity: float
    rise: float
    brought: np.ndarray


@dataclass(frozen=True)
class BodyStage:
    """What a stage (``sph``, ``dem``) left in the snapshot ``path`` at ``time`` [s], ``compared`` with the body
    before, all ``measures``, and what it is, ``kind`` (``crater.bodies.classes``) with its ``reason``."""

    stage: str
    path: Path
    time: float
    compared: BodyComparison
    measures: Mapping[str, Quantity | Pair]
    kind: str
    reason: str

    def as_dict(self, run: Path) -> dict[str, Any]:
        """JSON-ready: the measures, and the vectors behind them in the frame of the run and in the body's own."""
        compared, turn = self.compared, self.compared.shape.placed.turn
        vectors = {
            "beta": compared.moved.vector,
            "delta_v_m_s": compared.moved.change,
            "momentum_that_stays_kg_m_s": compared.moved.stays,
            "angular_velocity_before_1_s": compared.omega,
            "angular_velocity_1_s": compared.last.rotation,
            "centre_of_mass_moved_m": compared.last.centre - compared.first.centre,
            "normal": compared.shape.placed.normal,
            "flight": compared.moved.brought / np.linalg.norm(compared.moved.brought),
            **({} if compared.orbit is None else {"along_track": compared.orbit.track}),
        }
        return {
            "class": self.kind,
            "class_reason": self.reason,
            "snapshot": self.path.relative_to(run).as_posix(),
            "time_s": self.time,
            "noise_spacings": compared.chart.noise,
            "points": len(compared.chart.points.position),
            "measures": {name: entry.as_dict() for name, entry in self.measures.items()},
            "vectors": {name: value.tolist() for name, value in vectors.items()},
            "vectors_own_frame": {name: (value @ turn).tolist() for name, value in vectors.items()},
        }


def body_of(settings: Any, shape: Shape, facts: Mapping[str, Any], mass: float) -> Body:
    """The body of the ``settings`` with the ``facts`` of ``target.json``; ``mass`` [kg] of the projectile."""
    target = settings.target
    companion, orbit = facts.get("companion"), None
    if companion:
        position = np.array(companion["place_m"], dtype=float)
        # the body is at -position from its companion, and flies round the axis
        distance = float(np.linalg.norm(position))
        outward = -position / distance
        track = np.cross(np.array(companion["axis"], dtype=float), outward)
        orbit = Orbit(float(companion["mass_kg"]), distance, track, outward)
    return Body(
        shape,
        np.array(facts["angular_velocity_1_s"], dtype=float),
        orbit,
        float(facts["surface_gravity_m_s2"]),
        RISE_LIMIT * settings.impact.expected_transient_diameter,
        mass * np.asarray(target.aim(settings.impact)),
    )


def of_stage(body: Body, stage: str, before: Path, after: Path, crater: Measures | None) -> BodyStage:
    """What a ``stage`` left of a body in the snapshot ``after``; ``crater``: what was measured at the site there.
    Raises ``InputError`` where the snapshots cannot be compared."""
    first, last = snapshot.read(before), snapshot.read(after)
    for path, particles in ((before, first), (after, last)):
        if missing := {"identity", "mass", "velocity"} - set(particles):
            raise InputError(f"{path} lacks {', '.join(sorted(missing))}")
    compared = compare_bodies(body, first, last, before.name, after.name)
    measures = measured.all_of(compared)
    kind, reason = classed(compared, measures, crater)
    return BodyStage(stage, after, float(last.attributes.get("time", np.nan)), compared, measures, kind, reason)


def compare_bodies(
    body: Body, first: Particles, last: Particles, before: str = "before", after: str = "after"
) -> BodyComparison:
    """A body in the snapshots ``first`` and ``last``."""
    tracker = PoseTracker(first)
    if "layer" in first:  # before the impact the projectile is no part of the body
        first = first.select(first.layer >= 0)
    one, two = (
        body_state.at(particles, body.shape, tracker, body.gravity, body.rise, name)
        for particles, name in ((first, before), (last, after))
    )
    chart = height_map.surface_change(body.shape, one, two)
    return BodyComparison(
        body.shape,
        body.omega,
        one,
        two,
        chart,
        exchange.momentum_exchange(one, two, body.brought),
        body.orbit,
    )


def write_map(stage: BodyStage, path: Path) -> None:
    """The map of the body in its own frame, as triangles that ParaView and pyvista open."""
    from matter.files import surface_file

    chart, placed = stage.compared.chart, stage.compared.shape.placed
    own = chart.points.position @ placed.turn
    latitude, longitude = latitude_longitude(own)
    fields = {
        "height_change": (chart.change, "m", "height after less height before the impact, along the normal"),
        "height_before": (chart.before, "m", "ground before the impact, over the shape"),
        "height_after": (chart.after, "m", "ground after it, over the shape"),
        "height_error": (chart.error, "m", "error of a change of height where the surface is resurfaced"),
        "made_anew": (chart.deep, "m", "depth to which the surface is resurfaced; 0 where it is not"),
        "latitude": (latitude, "deg", "planetocentric latitude"),
        "longitude": (longitude, "deg", "planetocentric longitude, to the east"),
        "area": (chart.points.area, "m^2", "area that the point stands for"),
        "normal": (chart.points.normal @ placed.turn, "1", "outward normal of the shape"),
    }
    site = np.array([0.0, 0.0, placed.height]) @ placed.turn
    facts = {"site_m": site, "noise_spacings": chart.noise, "time": stage.time, "class": stage.kind}
    surface_file.write(path, own, chart.points.triangles, fields, facts)


def latitude_longitude(own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Planetocentric latitude and longitude [deg] of positions (n, 3) in the body's own frame."""
    r = np.maximum(np.linalg.norm(own, axis=1), 1e-300)
    return np.degrees(np.arcsin(own[:, 2] / r)), np.degrees(np.arctan2(own[:, 1], own[:, 0]))
