"""A body at one moment, as it would stand about its shape of before: which particles it consists of, its axes, its
rotation.

The body is the largest group of particles that touch, without what flies (``crater.ground.cloud``). Its axes are those
of the even ellipsoid of its moments of inertia, its rotation that of its angular momentum.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crater.ground import cloud as clouds
from crater.ground.cloud import Cloud
from matter.constants import G
from matter.geometry import tree
from matter.particles import Particles
from matter.solids.body_shape import Shape
from matter.solids.pose_tracker import Pose, PoseTracker, motion

THETA, OF_SPACING, OF_GRAINS = 0.3, 0.5, 0.01
"""Opening angle of the tree, and its softening as in the stages: half a spacing, and next to nothing of a grain."""


class BodyState(NamedTuple):
    """``particles`` of a snapshot; their ``position`` (n, 3) [m] about the shape of before; (n,) which are of the
    ``body``, and which are ``bound`` to it; the ``well`` (n,) [J/kg] that each would have to climb to leave it; the
    ``cloud`` of the body about the shape; the ``pose``."""

    particles: Particles
    position: np.ndarray
    body: np.ndarray
    bound: np.ndarray
    well: np.ndarray
    cloud: Cloud
    pose: Pose

    @property
    def size(self) -> np.ndarray:
        """Spacing (n,) [m] of the particles of the body."""
        return self.cloud.spacing


class Rigid(NamedTuple):
    """Of some particles: ``mass`` [kg], ``centre`` (3,) [m] about the shape of before, full ``axes`` (3,) [m] of the
    even ellipsoid of their inertia, longest first, and their ``rotation`` (3,) [1/s] in the frame of the run."""

    mass: float
    centre: np.ndarray
    axes: np.ndarray
    rotation: np.ndarray


def at(particles: Particles, shape: Shape, tracker: PoseTracker, gravity: float, rise: float, what: str) -> BodyState:
    """The body in ``particles``: what would rise above ``rise`` [m] at ``gravity`` [m/s^2] flies. Raises
    ``InputError`` where no body is left."""
    pose = tracker.pose(particles)
    position = pose.back(particles.position)
    solid = particles.state == 0 if "state" in particles else np.ones(len(particles), dtype=bool)
    cloud = clouds.particle_cloud(particles, what)
    about = replace(cloud, position=position[solid])
    foot = shape.nearest_point(about.position)
    speed = None
    if "velocity" in particles:
        moving = pose.back_velocity(particles.position[solid], particles.velocity[solid])
        speed = np.einsum("ij,ij->i", moving, foot.normal)
    held = clouds.supported(about, foot.height, speed, gravity, rise, what)
    body = np.zeros(len(particles), dtype=bool)
    body[np.flatnonzero(solid)[held]] = True
    well = depth_of_well(particles)
    return BodyState(particles, position, body, bound(particles, well), well, about.select(held), pose)


def depth_of_well(particles: Particles) -> np.ndarray:
    """-phi (n,) [J/kg] of each particle: that of all others; of those that were booked as gone that of the body as a
    point, at the position where they left. Zero without velocities, which nothing climbs."""
    if "velocity" not in particles:
        return np.zeros(len(particles))
    here = _present(particles)
    x, m = particles.position, particles.mass
    soft = OF_GRAINS * particles.radius if "radius" in particles else OF_SPACING * _spacing(particles)
    well = G * m[here].sum() / np.maximum(np.linalg.norm(_from_centre(particles), axis=1), 1e-300)
    well[here] = tree.minus_potential(x[here], m[here], soft[here], THETA)
    return np.asarray(well)


def bound(particles: Particles, well: np.ndarray) -> np.ndarray:
    """(n,) whether a particle is bound: v^2 / 2 < ``well`` (n,) [J/kg], or v . x < 0, about the centre of mass;
    without velocities all are."""
    if "velocity" not in particles:
        return _present(particles)
    speed = particles.velocity - particles.mass @ particles.velocity / particles.mass.sum()
    fast = 0.5 * np.einsum("ij,ij->i", speed, speed) > well
    return np.asarray(~(fast & (np.einsum("ij,ij->i", speed, _from_centre(particles)) > 0.0)))


def _present(particles: Particles) -> np.ndarray:
    return np.asarray(particles.state != 2 if "state" in particles else np.ones(len(particles), dtype=bool))


def _from_centre(particles: Particles) -> np.ndarray:
    """Position (n, 3) [m] from the centre of mass; of those that were booked as gone as they were booked."""
    here, x, m = _present(particles), particles.position, particles.mass
    return np.where(here[:, None], x - m[here] @ x[here] / m[here].sum(), x)


def _spacing(particles: Particles) -> np.ndarray:
    if "smoothing_length" in particles:
        return 0.5 * particles.smoothing_length
    return np.asarray(np.cbrt(particles.mass / particles.density))


def rigid(state: BodyState, which: np.ndarray) -> Rigid:
    """The particles chosen by a mask as one rigid body."""
    p = state.particles
    m, position = p.mass[which], state.position[which]
    centre = m @ position / m.sum()
    away = position - centre
    moments = np.linalg.eigvalsh(np.einsum("i,ij,ik->jk", m, away, away) / m.sum())
    rotation = np.zeros(3)
    if "velocity" in p:
        rotation = motion(p.position[which], p.velocity[which], m, np.zeros(3))[1]
    return Rigid(float(m.sum()), centre, 2.0 * np.sqrt(5.0 * np.maximum(moments[::-1], 0.0)), rotation)
