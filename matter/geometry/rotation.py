"""Rotations in space."""

from __future__ import annotations

import math

import numpy as np


def rotation(turn: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) of a rotation about the axis of ``turn`` (3,) by its length [rad] (Rodrigues' formula)."""
    angle = float(np.linalg.norm(turn))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = turn / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
