"""Another code's frame turned into this project's: the target's centre (or a point of flat ground) at the origin, the
impact point on +z."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from matter.errors import InputError
from matter.particles import FIELDS, Particles

_SYMMETRIC = ((0, 1, 2), (1, 3, 4), (2, 4, 5))


def placed(
    particles: Particles, origin: Sequence[float] = (0.0, 0.0, 0.0), up: Sequence[float] = (0.0, 0.0, 1.0)
) -> Particles:
    """The same particles with ``origin`` [m] moved to (0, 0, 0) and the direction ``up`` turned onto +z by the
    shortest way.

    Vectors and stresses turn with it; velocities are not shifted. Raises ``InputError`` for an ``up`` of no length.
    """
    turn = rotation_onto_z(np.asarray(up, dtype=float))
    fields = {}
    for name in particles:
        values = particles[name]
        if name in ("position", "initial_position"):
            values = (values - np.asarray(origin, dtype=float)) @ turn.T
        elif FIELDS[name].shape == (3,):
            values = values @ turn.T
        elif FIELDS[name].shape == (6,):
            full = turn @ values[:, np.array(_SYMMETRIC)] @ turn.T
            values = np.stack(
                [full[:, 0, 0], full[:, 0, 1], full[:, 0, 2], full[:, 1, 1], full[:, 1, 2], full[:, 2, 2]], axis=1
            )
        fields[name] = values
    return Particles(fields, particles.attributes, particles.tables)


def rotation_onto_z(up: np.ndarray) -> np.ndarray:
    """Rotation matrix (3, 3) by the shortest way from ``up`` (3,) to +z (Rodrigues; half a turn about x for -z)."""
    length = float(np.linalg.norm(up))
    if not np.isfinite(length) or length == 0.0:
        raise InputError(f"up = {tuple(up.tolist())} has no direction")
    x, y, z = up / length
    if z < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    return np.eye(3) + cross + cross @ cross / (1.0 + z)
