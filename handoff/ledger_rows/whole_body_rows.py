"""Rows of the ledger on a whole body: its mass, momentum, angular momentum and kinetic energy, in the inertial frame
about the body's centre at the moment of the impact, from the snapshot and the start as they stand in their files.

    particles = grains kept + ejecta that became grains + whole blocks + what stays in the list + what was removed

Ejecta that return are grains; those that escape, orbit or come back after the run stay in the list
(``handoff.transfer.ejecta``), and so do whole blocks that escape. Nothing is removed: all matter belongs to the body,
and what stood where grains were carved away is in the ejecta or in the grains around. Energy alone is not kept: grains
average out what is smaller than they are.
"""

from __future__ import annotations

import numpy as np

from handoff.domains.whole_body import WholeBody
from handoff.ledger import LIMITS, Ledger
from handoff.source import two_body
from handoff.transfer import correction
from handoff.transfer.ejecta import BOOKED
from handoff.transfer.handed import Handoff
from matter.particles import Particles

_KEPT = {"mass": "mass_total_rel", "momentum": "momentum_linear_rel_after", "angular": "momentum_angular_rel_after"}
"""Rows of the acceptance list whose limits these share."""


def parts(handoff: Handoff, source: Particles, start: Particles) -> dict[str, correction.Sums]:
    """Sums over the particles of the ``source`` and over what they became in the ``start``, both in the inertial frame
    of the run; scales are those against the ground."""
    region, kept = handoff.region, len(handoff.mapped.change)
    number = np.arange(len(start))
    flying = kept + len(handoff.ejecta.fate)
    away = np.zeros(len(start), dtype=bool)
    away[kept:flying] = handoff.ejecta.fate != two_body.RETURNS
    which = {"grains kept": number < kept, "grains of ejecta": (number >= kept) & (number < flying) & ~away}
    if handoff.blocks is not None:
        away[flying:] = start.state[flying:] == BOOKED
        which["whole blocks"] = (number >= flying) & ~away
    which["in the list"] = away
    pace = region.pace(source.position, source.velocity)
    sums = {"particles": correction.sums(source.mass, source.position, source.velocity, pace=pace)}
    for name, mine in which.items():
        some = start.select(mine)
        sums[name] = correction.sums(some.mass, some.position, some.velocity, some.radius, some.angular_velocity)
    return sums


def enter(ledger: Ledger, handoff: Handoff, source: Particles, start: Particles) -> None:
    """Enter the rows; none where the grains are not a whole body."""
    if not isinstance(handoff.region, WholeBody):
        return
    sums = parts(handoff, source, start)
    before = sums["particles"]
    first, *others = (some for name, some in sums.items() if name != "particles")
    after = sum(others, start=first)
    scale = {"mass": before.mass, "momentum": before.momentum_scale, "angular": before.angular_scale}
    words = {"mass": ("whole_mass_rel", "kg"), "momentum": ("whole_momentum_rel", "kg m/s"),
             "angular": ("whole_angular_momentum_rel", "kg m^2/s")}  # fmt: skip
    for key, (name, unit) in words.items():
        off = float(np.linalg.norm(np.asarray(getattr(after, key)) - np.asarray(getattr(before, key))))
        value = off / scale[key] if scale[key] > 0.0 else off
        ledger.amend(name, value, _told(sums, key, unit), LIMITS[_KEPT[key]].limit)
    change = after.kinetic / before.kinetic - 1.0 if before.kinetic > 0.0 else 0.0
    ledger.state("whole_kinetic_energy_rel", change, "1", _told(sums, "kinetic", "J"))


def _told(sums: dict[str, correction.Sums], key: str, unit: str) -> str:
    shown = {name: _shown(getattr(some, key)) for name, some in sums.items()} | {"removed": "0"}
    first, *others = (f"{name} {value}" for name, value in shown.items())
    return f"{first} = {' + '.join(others)} {unit}"


def _shown(value: float | np.ndarray) -> str:
    if isinstance(value, np.ndarray):
        return "(" + ", ".join(f"{component:.6g}" for component in value) + ")"
    return f"{value:.9g}"
