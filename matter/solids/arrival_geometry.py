"""The site of an impact from the direction in which the projectile flies.

With d the direction of flight in the body's own frame, u that from the centre of mass to the site and N the normal of
the surface there, the angle a from the vertical and the azimuth of ``matter.solids.placed`` follow from

    cos a = -d . N,   T = d + cos(a) N,   f = T - (T . u) / (N . u) N,   azimuth = atan2(f . e, f . n)

n, e: north and east at the site. f is square to u, and its part square to N is T: the way of the projectile along the
ground.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.solids.solid import Solid


class Arrival(NamedTuple):
    """Where and how a projectile meets a body: angles [rad] of the site, of the flight seen from above it, and from
    the vertical there."""

    latitude: float
    longitude: float
    azimuth: float
    angle_from_vertical: float


def arrival(
    solid: Solid, flight: tuple[float, float, float], latitude: float | None = None, longitude: float | None = None
) -> Arrival:
    """How a projectile that flies along ``flight`` (3,), of any length, in the body's own frame meets it at a site, or
    (without ``latitude`` and ``longitude`` [rad]) where its line through the centre of mass enters.

    Raises ``InputError`` where it comes from behind the surface or along it.
    """
    d = np.asarray(flight, dtype=float) / np.linalg.norm(flight)
    if latitude is None or longitude is None:
        up = -d
        latitude, longitude = math.asin(float(np.clip(up[2], -1.0, 1.0))), math.atan2(float(up[1]), float(up[0]))
    else:
        c = math.cos(latitude)
        up = np.array([c * math.cos(longitude), c * math.sin(longitude), math.sin(latitude)])
    _, normal = solid.site(up)
    cosine = float(-d @ normal)
    if cosine < 1e-3:
        raise InputError(
            f"at latitude {math.degrees(latitude):.4g} deg, longitude {math.degrees(longitude):.4g} deg the surface "
            f"looks away from a projectile that flies along ({d[0]:.3g}, {d[1]:.3g}, {d[2]:.3g})"
        )
    along = d + cosine * normal
    if np.linalg.norm(along) < 1e-9:
        return Arrival(latitude, longitude % (2.0 * math.pi), math.radians(90.0), 0.0)
    f = along - (along @ up) / (normal @ up) * normal
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    azimuth = math.atan2(float(f @ east), float(f @ np.cross(up, east)))
    return Arrival(
        latitude,
        longitude % (2.0 * math.pi),
        azimuth % (2.0 * math.pi),
        math.atan2(float(np.linalg.norm(along)), cosine),
    )
