"""Table 9 of Winter 2017, projectiles of equal energy, worked out anew."""

from __future__ import annotations

import math
from collections.abc import Mapping

from studies.winter_2017.evidence import KM, Finding, Run
from studies.winter_2017.published import DIAMETER, ICE, MASSES, RADII, RATIOS, SPEEDS


def masses(radius_2: float) -> list[tuple[float, float]]:
    """Radius [m] and mass [kg] of Table 9 for the four speeds, from the radius at v2: m v^2 constant, ice of 917
    kg/m^3."""
    m2 = 4.0 / 3.0 * math.pi * ICE * radius_2**3
    masses_of_speeds = [m2 * (SPEEDS[1] / v) ** 2 for v in SPEEDS]
    return [((3.0 * m / (4.0 * math.pi * ICE)) ** (1.0 / 3.0), m) for m in masses_of_speeds]


def table_radii(_: Mapping[str, Run]) -> Finding:
    """The printed radii against equal energy: within 0.2 %."""
    return _arithmetic({c: [r * KM for r, _ in masses(RADII[c][1] * 1e3)] for c in RADII}, RADII, 0.002, 2)


def table_masses(_: Mapping[str, Run]) -> Finding:
    """The printed masses against equal energy: within 0.2 %."""
    return _arithmetic({c: [m / 1e16 for _, m in masses(RADII[c][1] * 1e3)] for c in RADII}, MASSES, 0.002, 2)


def table_ratios(_: Mapping[str, Run]) -> Finding:
    """The printed ratios of projectile to crater: within 0.0051."""
    return _arithmetic(
        {c: [2.0 * r / DIAMETER[c][0] for r, _ in masses(RADII[c][1] * 1e3)] for c in RADII}, RATIOS, 0.0, 3, 0.0051
    )


def _arithmetic(
    ours: dict[str, list[float]],
    published: Mapping[str, tuple[float, ...]],
    relative: float,
    digits: int,
    absolute: float = 0.0,
) -> Finding:
    off = []
    for case, row in published.items():
        for number, (a, b) in enumerate(zip(ours[case], row), 1):
            if abs(a - b) > relative * b + absolute:
                off.append(f"{case} at v{number}: printed {b}, right {a:.{digits}f}")
    told = "; ".join(f"{case}: " + "/".join(f"{x:.{digits}f}" for x in row) for case, row in ours.items())
    return Finding(told, "", not off, "; ".join(off) or "arithmetic")
