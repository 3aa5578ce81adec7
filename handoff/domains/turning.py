"""From the inertial frame of a run into the axes in which a body's bed lies, and back.

Both agree at the moment of the impact. At the time t the body has turned by omega t, so that

    x_bed = R(-omega t) x,   v_bed = R(-omega t) v

are positions and velocities along the axes of the body at that time; these axes do not turn, so momentum, angular
momentum and energy are those of the inertial frame. The grains begin there:

    x = R(omega t) x_bed,   v = R(omega t) v_bed,   spin = R(omega t) spin_bed

and the springs of their contacts are turned with them. In a few seconds no impact that leaves a body turns it
otherwise, or moves it, by a length that counts: the mass times the velocity that it takes over is the projectile's.
"""

from __future__ import annotations

import numpy as np

from handoff.domains.domain import Domain
from handoff.domains.whole_body import WholeBody
from matter.geometry.rotation import rotation
from matter.particles import Particles

_VECTORS = ("position", "velocity", "angular_velocity", "gravity")
_SPRINGS = (slice(0, 3), slice(3, 6))
"""Columns of ``contacts/history`` that are vectors: the tangential and the rolling spring."""


def turn(particles: Particles, region: Domain) -> np.ndarray:
    """R(omega t) (3, 3) at the time of the ``particles``; the identity where nothing turns."""
    if not isinstance(region, WholeBody):
        return np.eye(3)
    return rotation(region.omega * float(particles.attributes.get("time", 0.0)))


def to_bed(particles: Particles, region: Domain) -> Particles:
    """The ``particles`` of a snapshot along the axes in which the bed lies; stresses keep theirs (only their size is
    read)."""
    return _turned(particles, turn(particles, region).T)


def to_run(particles: Particles, region: Domain) -> Particles:
    """Grains along the axes of the bed in the inertial frame of the run."""
    return _turned(particles, turn(particles, region))


def _turned(particles: Particles, matrix: np.ndarray) -> Particles:
    if np.array_equal(matrix, np.eye(3)):
        return particles
    fields = {name: particles[name] @ matrix.T if name in _VECTORS else particles[name] for name in particles}
    tables = dict(particles.tables)
    if "contacts/history" in tables:
        history = np.array(tables["contacts/history"], dtype=float)
        for columns in _SPRINGS:
            history[:, columns] = history[:, columns] @ matrix.T
        tables["contacts/history"] = history
    return Particles(fields, particles.attributes, tables)
