"""Whole blocks join the grains that the rest of the source became."""

from __future__ import annotations

import numpy as np

from handoff.domains.domain import Domain
from handoff.transfer import grain_provenance
from handoff.transfer.blocks.whole_blocks import WholeBlocks
from handoff.transfer.ejecta import BALLISTIC, IN_CONTACT
from matter.particles import Particles


def joined(start: Particles, blocks: WholeBlocks, source: Particles, bed: Particles, region: Domain) -> Particles:
    """The ``start`` with the whole blocks behind its grains, and the contacts of those that stayed in place from the
    settled ``bed``. Ejecta that lie in a block fly until they land."""
    grains = Particles(blocks.grains, start.attributes)
    particle = np.flatnonzero(blocks.taken)
    taken = grain_provenance.of_groups(source, particle, blocks.rows_of(particle, source), len(grains))
    grain_provenance.give(grains, source, region, taken)
    names = [*bed.attributes["materials"]]
    grains["material"] = [start.attributes["materials"].index(names[k]) for k in grains.material]
    plain = Particles(start, start.attributes)
    plain["block"] = np.full(len(start), -1)
    for centre, radius, state in zip(grains.position, grains.radius, grains.state):
        hit = np.linalg.norm(plain.position - centre, axis=1) < radius + plain.radius
        hit &= (plain.identity >= start.attributes["bed_grains"]) & (plain.state == IN_CONTACT)
        if state == IN_CONTACT:
            plain["state"][hit] = BALLISTIC
    fields = {name: np.concatenate([plain[name], grains[name]]) for name in plain}
    return Particles(fields, start.attributes, _contacts(start, blocks, bed))


def _contacts(start: Particles, blocks: WholeBlocks, bed: Particles) -> dict[str, np.ndarray]:
    """The tables of the start, with the contacts of the blocks in place with each other, with walls, and with grains
    that are as large as they were."""
    still = blocks.grains.identity[blocks.in_place]
    order = np.argsort(bed.identity)
    known = np.isin(start.identity, bed.identity)
    row = order[np.searchsorted(bed.identity, start.identity[known], sorter=order)]
    same = start.identity[known][start.radius[known] == bed.radius[row]]
    tables = dict(start.tables)
    for prefix in ("contacts/", "contacts/wall_"):
        pair = bed.tables.get(f"{prefix}pair")
        if pair is None or len(pair) == 0:
            continue
        members = pair if prefix == "contacts/" else pair[:, :1]
        some = np.isin(members, still).any(axis=1) & np.isin(members, np.concatenate([still, same])).all(axis=1)
        for name in ("pair", "history"):
            key = f"{prefix}{name}"
            tables[key] = np.concatenate([tables[key], bed.tables[key][some]])
    return tables
