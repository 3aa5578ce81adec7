"""Springs of the start for the speeds that were handed over: the bed settles in soft springs for its weight, the
collapse begins in stiffer ones.

Under weak gravity springs that carry a bed's weight at small overlaps are a thousand times too soft for the flow of an
impact, and a bed that settled in springs for that flow would take a thousand times as long, since its overlaps at rest
are as much smaller. So k_n is raised between bed and collapse

    k_n = m (v / (x_max r))^2   in the mean of the compact grains,   x_max = ``static_overlap``,
    times ``stiffness_factor``,

by one factor q for all grains. Every contact keeps its forces: the overlap x in which it settled becomes x / q by an
offset (``dem.stiffness.change``), so that the bed stays in balance; its springs hold 1 / q of the energy that they
held. v is the fastest approach of two neighbouring compact grains at the handoff, or given. A bed in its solid's own
springs, that of a large body, keeps them unless v is given. The contact wave speed stays below ``WAVE_SPEED_LIMIT``
times the sound speed of the grains' material, and no bed is made softer.

Source of k_n: Schwartz, Richardson & Michel 2012, Granular Matter 14, 363, section 2.4; the offsets are this project's
own.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from dem.beds.bed_walls import Domain
from dem.beds.whole_body_bed import WholeBody
from dem.contact.grain_solid import elastic
from dem.contact.settings import Contact
from dem.grains.assembly import Assembly
from dem.stiffness import change
from matter.particles import Particles

NEAR = 0.3
"""Largest gap of neighbours, in mean radii: they meet before the flow has changed."""


class Springs(NamedTuple):
    """``speed`` [m/s] that the springs of the start are for (0: the bed's own springs), and k_n over that of the
    bed."""

    speed: float = 0.0
    factor: float = 1.0


def springs_for(asked: float | Literal["auto", "bed"], start: Particles, contact: Contact, sphere: bool) -> Springs:
    """The springs that a start asks for. ``auto``: for the fastest approach in it, but where grains of a layered
    ``sphere`` have their solid's own (``Contact.stiffness``) those of the bed.

    Laws whose springs cannot change (``hertz``, cohesion by ``sjkr``) leave ``auto`` at the bed's.
    """
    if asked == "bed" or (asked == "auto" and not contact.springs_can_change):
        return Springs()
    compact = start.select(_compact(start))
    if len(compact) == 0 or (asked == "auto" and sphere and not softer_than_solid(compact, start)):
        return Springs()
    speed = fastest_approach(compact) if asked == "auto" else float(asked)
    wanted = compact.mass * (speed / (contact.static_overlap * compact.radius)) ** 2 * contact.stiffness_factor
    factor = float(np.mean(wanted / compact.stiffness))
    for here, _, sound in _solids(compact, start):
        limit = contact.stiffness_limit(compact.radius[here], compact.mass[here], sound)
        factor = min(factor, float(np.min(limit / compact.stiffness[here])))
    return Springs(speed, factor) if factor > 1.0 else Springs()


def softer_than_solid(grains: Particles, start: Particles) -> bool:
    """Whether the springs of all grains are softer than 2 K r of what they are made of."""
    solids = _solids(grains, start)
    return bool(solids) and all(
        float(np.max(grains.stiffness[here] / grains.radius[here])) < 2.0 * bulk for here, bulk, _ in solids
    )


def _solids(grains: Particles, start: Particles) -> list[tuple[np.ndarray, float, float]]:
    """For each material of these grains: which they are, its bulk modulus [Pa] and sound speed [m/s]."""
    names, solid = start.attributes.get("materials", []), start.attributes.get("reference_densities_kg_m3")
    return [
        (grains.material == number, *elastic(names[number], solid[number] if solid else None))
        for number in (np.unique(grains.material).astype(int) if names else ())
    ]


def fastest_approach(grains: Particles) -> float:
    """Largest closing speed [m/s] of two of these grains that touch or nearly do."""
    reach = 2.0 * float(grains.radius.max()) + NEAR * float(grains.radius.mean())
    pairs = cKDTree(grains.position).query_pairs(reach, output_type="ndarray")
    if len(pairs) == 0:
        return 0.0
    first, second = pairs.T
    way = grains.position[second] - grains.position[first]
    distance = np.linalg.norm(way, axis=1)
    near = distance < grains.radius[first] + grains.radius[second] + NEAR * float(grains.radius.mean())
    closing = np.einsum("ij,ij->i", way, grains.velocity[first] - grains.velocity[second])[near] / distance[near]
    return float(max(0.0, closing.max(initial=0.0)))


def stiffen(bed: Assembly, springs: Springs) -> tuple[float, float]:
    """Give the bed these springs, at the start; energy of all springs before and after [J]. What weight takes counts
    from here on."""
    before = bed.elastic
    change.at_rest(bed)
    change.change(bed, springs.factor)
    change.at_rest(bed)
    bed.stiffness_energy = bed.weight_energy = bed.stiffness_excess = 0.0
    return before, bed.elastic


def damped_for(domain: Domain | WholeBody, springs: Springs) -> Domain | WholeBody:
    """The domain with its damped layer for the faster waves; a whole body has none."""
    if isinstance(domain, WholeBody):
        return domain
    return replace(domain, damping_rate=domain.damping_rate * springs.factor**0.5)


def _compact(start: Particles) -> np.ndarray:
    """Grains of the bed in the contact search: neither ejecta nor in flight."""
    of_bed = start.identity < start.attributes.get("bed_grains", np.iinfo(np.int64).max)
    return of_bed & (start.state == 0) if "state" in start else of_bed
