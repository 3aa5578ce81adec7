"""Which flaws a cloud's particles begin with."""

from __future__ import annotations

import numpy as np

from sph.cloud import Cloud
from sph.damage import grady_kipp
from sph.materials import Materials

MOST = 3e8
"""Flaws of one material: 1.2 GB. Where more would be needed, the weakest are kept."""
KEPT, KEPT_EACH = 20_000_000, 50
"""Of these: in all, and in the mean of the particles at least."""


def seed_flaws(cloud: Cloud, materials: Materials, seed: int) -> None:
    """Flaws by identity, so that no sorting changes them; one random stream per material. Predamaged material is broken and
    has none."""
    solid = cloud.mass / (cloud.density * cloud.distention)
    place = np.argsort(cloud.identity)
    streams = np.random.SeedSequence([seed, 77]).spawn(len(materials.names))
    strains: list[np.ndarray] = []
    offset = 0
    for index, name in enumerate(materials.names):
        mine = place[cloud.material[place] == index]
        if materials.predamaged(name):
            cloud.root_damage[mine] = 1.0
            continue
        if not materials.rows.flawed[index] or len(mine) == 0:
            continue
        rng, weibull = np.random.default_rng(streams[index]), materials.weibull(name)
        if grady_kipp.expected(solid[mine]) <= MOST:
            start, strain = grady_kipp.flaws(solid[mine], weibull, rng)
        else:  # a graded body: its large particles hold their volume's share of what gives every small one a flaw
            start, strain = grady_kipp.weakest(solid[mine], weibull, max(KEPT, KEPT_EACH * len(mine)), rng)
        cloud.flaw_first[mine], cloud.flaw_last[mine] = start[:-1] + offset, start[1:] + offset
        strains.append(strain)
        offset += len(strain)
    cloud.flaw_strain = np.concatenate(strains) if strains else np.zeros(0, dtype=np.float32)
