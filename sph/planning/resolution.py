"""Where particles are how fine when a case does not say it, and how many there are: rules that go by projectile,
crater and the number of particles asked for.

    within 1.2 crater radii (0.6 D)   spacing d                   the crater and what is thrown out of it lie there; at
                                                                  least 3 projectile radii
    within 2 projectile radii         d / f                       the contact, where peak pressures arise
    outside                           grows by 0.1 per distance   waves that leave find no step in spacing
    far away                          4 d                         at least a tenth of a body's radius: its own balance
                                                                  needs no more

d is solved for the number of particles. f = sqrt(10 d / a) puts the contact halfway, in the logarithm, between the
crater's spacing and ten particles per projectile radius a, so that with more particles both converge. It is 1 at
least; and at most 2, since the step of all particles follows from the finest, or what two per radius take.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from matter.case.body import Impact, Target
from sph.bodies import solid_target
from sph.bodies.target import Zones

PARTICLES = 20_000
"""Particles of the target when a case does not say: minutes on two cores."""
FINE, LEAST_FINE = 0.6, 3.0
"""Radius of the fine zone over the crater's diameter, and at least over the projectile's radius."""
CONTACT = 2.0
"""Radius of the contact zone over the projectile's."""
PER_RADIUS, LEAST_PER_RADIUS, REFINED = 10.0, 2.0, 2.0
"""Particles per projectile radius that the contact aims at, those that it has at least, and how much finer than the
crater it is at most for more."""
FAR = 4.0
"""Spacing far away over that of the crater."""
PER_BODY, PER_GROUND = 10.0, 11.0
"""Particles per radius of a body that are enough far away from the impact, and those that flat ground has at least
along its depth: four of them are its quiet layer."""


def refinement(spacing: float, radius: float) -> float:
    """How much finer the contact is than the crater, for a ``spacing`` [m] and a projectile's ``radius`` [m]."""
    wanted = max(min(math.sqrt(PER_RADIUS * spacing / radius), REFINED), LEAST_PER_RADIUS * spacing / radius)
    return min(max(math.ceil(10.0 * wanted) / 10.0, 1.0), 10.0)


def spacing_far(target: Target, spacing: float) -> float:
    """Spacing far from the impact [m]."""
    if not target.flat:
        return max(FAR * spacing, target.radius / PER_BODY)
    return max(spacing, min(FAR * spacing, min(target.radius, target.half_width) / PER_GROUND))


def fine_radius(impact: Impact) -> float:
    """Radius of the fine zone [m]."""
    return max(FINE * impact.expected_transient_diameter, LEAST_FINE * impact.projectile.radius)


def area(target: Target, distance: np.ndarray) -> np.ndarray:
    """Area (n,) [m^2] of the part inside the target of spheres about the impact point, at these distances (n,) [m]."""
    if target.solid:
        return solid_target.area(target.placed, distance)
    whole = 2.0 * math.pi * distance**2
    if target.shape == "sphere":
        return whole * np.clip(1.0 - distance / (2.0 * target.radius), 0.0, None)
    if target.shape == "half_sphere":
        return np.where(distance <= target.radius, whole, 0.0)
    azimuth = (np.arange(32) + 0.5) * (0.25 * math.pi / 32)
    width = target.half_width / (np.cos(azimuth) if target.shape == "block" else np.ones(1))
    deepest = np.minimum(1.0, target.radius / distance)  # cosines from straight down that lie inside
    shallow = np.sqrt(np.clip(1.0 - (width[:, None] / distance) ** 2, 0.0, None))
    return whole * np.clip(deepest - shallow, 0.0, None).mean(axis=0)


def cumulative_number(target: Target, zones: Zones) -> tuple[np.ndarray, np.ndarray]:
    """Distances [m] from the impact point, and the number of particles within each: the sum of area over spacing^3."""
    reach = (
        solid_target.reach(target.placed)
        if target.solid
        else 2.0 * target.radius
        if target.shape == "sphere"
        else math.hypot(target.radius, math.sqrt(2.0) * target.half_width)
    )
    edge = np.concatenate([[0.0], np.geomspace(min(0.1 * zones.contact, 0.01 * reach), reach, 3000)])
    middle = 0.5 * (edge[1:] + edge[:-1])
    number = area(target, middle) * np.diff(edge) / zones.spacing(middle) ** 3
    return edge, np.concatenate([[0.0], np.cumsum(number)])


def count(target: Target, zones: Zones) -> float:
    """Expected number of the target's particles."""
    return float(cumulative_number(target, zones)[1][-1])


def solved(target: Target, impact: Impact, particles: int, fine: float, growth: float, contact_radius: float) -> float:
    """The spacing at the impact [m] that gives about this many particles; the coarsest that makes sense where that
    still has more."""
    radius = impact.projectile.radius

    def zones(spacing: float) -> Zones:
        return Zones(
            spacing / refinement(spacing, radius), contact_radius, spacing, fine, spacing_far(target, spacing), growth
        )

    def excess(log: float) -> float:
        return math.log(count(target, zones(math.exp(log))) / particles)

    most = 0.12 * min(target.radius, target.half_width if target.flat else target.radius)
    low, high = math.log(1e-4 * min(most, radius)), math.log(most)
    if excess(high) > 0.0:
        return most
    spacing = math.exp(float(brentq(excess, low, high, xtol=1e-3)))
    digits = 2 - math.floor(math.log10(spacing))
    return round(spacing, digits)  # three digits: a spacing is no finer than that
