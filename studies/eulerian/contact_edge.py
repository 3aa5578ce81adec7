"""Pressure at the edge of the contact of a ball and flat ground, while the shock is attached to it (Lesser 1981, Proc.
R. Soc. Lond. A 377, 289).

The edge runs outwards at U / tan(beta) over the ground, sin(beta) = x / a at distance x from the axis. Seen from it,
ground and ball stream in at U / tan(beta) and U / sin(beta) with the angle beta between them. An oblique shock turns
each; together they turn by beta, at one pressure:

    theta_1(P) + theta_2(P) = beta,   tan(theta) = up cos(s) / (q - up sin(s)),   sin(s) = us / q

That pressure rises from the planar limit to where no turn is enough: there the shock leaves the edge, and jets begin.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sph.materials.rows import Materials
from sph.shock_states import hugoniot

STEP = np.radians(0.25)


class Edge(NamedTuple):
    """The last attached state: pressure [Pa], distance from the axis over the ball's radius."""

    pressure: float
    distance: float


def last_attached(materials: Materials, speed: float, points: int = 400) -> Edge:
    """For the first of ``materials`` on itself at ``speed`` [m/s]; shocks up to 0.9 of it are tabulated."""
    pressure, rest = hugoniot.solid(materials.rows, 0)
    up = np.linspace(0.01, 0.9, points) * speed
    us = np.array([hugoniot.behind(pressure, rest, float(v)).shock_speed for v in up])
    found = Edge(0.0, 0.0)
    for beta in np.arange(STEP, np.radians(80.0), STEP):
        ball, ground = (_turn(us, up, speed / way(beta)) for way in (np.sin, np.tan))
        n = min(int(ball.argmax()), int(ground.argmax())) + 1
        turned = ball[:n] + ground[:n]
        if turned[-1] < beta:
            break
        found = Edge(float(np.interp(beta, turned, (rest.rho * us * up)[:n])), float(np.sin(beta)))
    return found


def _turn(us: np.ndarray, up: np.ndarray, q: float) -> np.ndarray:
    """Angle by which shocks of speed ``us`` turn a stream of speed ``q``; -1 where it is too slow."""
    sine = np.minimum(us / q, 1.0)
    return np.where(us < q, np.arctan2(up * np.sqrt(1.0 - sine**2), q - up * sine), -1.0)
