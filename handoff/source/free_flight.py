"""Free flight of matter over a domain: how high it would come, and whether it leaves for good.

Over flat ground and a round body as the undisturbed column says (``handoff.source.hydrostatic``); about a body of any
shape as if its mass were at its centre (``handoff.source.two_body``): what comes to the distance Q from the centre
rises to

    h + Q - r

above the shape, from the height h at the distance r. Rising is moving away from the ground, which turns with the body;
speeds against escape are those of the inertial frame.
"""

from __future__ import annotations

import math

import numpy as np

from handoff.domains.domain import Domain
from handoff.domains.whole_body import WholeBody
from handoff.source import two_body
from handoff.source.hydrostatic import Column


def strength(column: Column) -> float:
    """G M [m^3/s^2] of the body."""
    return column.surface_gravity * column.body_radius**2


def rising(domain: Domain, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Upward speed (n,) [m/s] against the ground."""
    flow = domain.flow(position, velocity)
    return np.asarray(np.einsum("ij,ij->i", flow, domain.frame.up(position)))


def apex(domain: Domain, column: Column, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Greatest height (n,) [m] above the datum that matter at ``position`` (n, 3) [m] reaches with its ``velocity``
    (n, 3) [m/s]; what moves downwards has it where it is."""
    height, upward = domain.frame.height(position), rising(domain, position, velocity)
    if not isinstance(domain, WholeBody):
        return column.apex(height, upward, np.linalg.norm(velocity, axis=1))
    farthest = two_body.apocentre(strength(column), position, velocity)
    r = np.linalg.norm(position, axis=1)
    with np.errstate(invalid="ignore"):
        return np.where(upward > 0.0, np.where(np.isinf(farthest), math.inf, height + farthest - r), height)


def escapes(domain: Domain, column: Column, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """(n,) whether matter rises and is faster than escape."""
    speed, upward = np.linalg.norm(velocity, axis=1), rising(domain, position, velocity)
    if not isinstance(domain, WholeBody):
        return (upward > 0.0) & (speed >= column.escape_speed(domain.frame.height(position)))
    return (upward > 0.0) & np.isinf(two_body.apocentre(strength(column), position, velocity))
