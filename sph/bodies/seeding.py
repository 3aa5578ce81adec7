"""Which flaws a cloud's particles begin with."""

from __future__ import annotations

import numpy as np

from sph.bodies.particle_cloud import Cloud
from sph.damage import grady_kipp
from sph.materials.rows import Materials

MOST = 3e7
"""Flaws of one material that are kept one by one: 120 MB. Of a body so graded that it would need more each particle
keeps the weakest and the strongest."""


def seed_flaws(cloud: Cloud, materials: Materials, seed: int) -> None:
    """Flaws by identity, so that no sorting changes them; one random stream per material. Predamaged material is
    broken and has none."""
    solid = cloud.mass / (cloud.density * cloud.distention)
    order = np.argsort(cloud.identity)
    streams = np.random.SeedSequence([seed, 77]).spawn(len(materials.names))
    strains: list[np.ndarray] = []
    offset = 0
    for index, name in enumerate(materials.names):
        mine = order[cloud.material[order] == index]
        if materials.predamaged(name):
            cloud.root_damage[mine] = 1.0
            continue
        if not materials.rows.flawed[index] or len(mine) == 0:
            continue
        rng, weibull = np.random.default_rng(streams[index]), materials.weibull(name)
        if grady_kipp.expected(solid[mine]) <= MOST:
            start, strain = grady_kipp.flaws(solid[mine], weibull, rng)
        else:
            start, strain, cloud.flaw_total[mine] = grady_kipp.weakest(solid[mine], weibull, rng)
        cloud.flaw_first[mine], cloud.flaw_last[mine] = start[:-1] + offset, start[1:] + offset
        strains.append(strain)
        offset += len(strain)
    cloud.flaw_strain = np.concatenate(strains) if strains else np.zeros(0, dtype=np.float32)
