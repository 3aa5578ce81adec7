"""Which flaws a cloud's particles begin with."""

from __future__ import annotations

import numpy as np

from matter import progress
from sph.bodies.particle_cloud import Cloud
from sph.damage import grady_kipp
from sph.materials.rows import Materials

MOST = 3e8
"""Flaws of one material that are dealt out one by one: 1.2 GB. A body so graded that it would need more has them by
the size of its particles."""


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
            start, strain = grady_kipp.flaws_by_size(solid[mine], weibull, rng)
            spread = float(solid[mine].max() / solid[mine].min())
            progress.tell(
                f"{name}: its particles differ by {spread:.2g} in volume, too much to deal out flaws one by one: each "
                f"has those of a uniform body of its size, "
                "and large ones break as in a coarser run"
            )
        cloud.flaw_first[mine], cloud.flaw_last[mine] = start[:-1] + offset, start[1:] + offset
        strains.append(strain)
        offset += len(strain)
    cloud.flaw_strain = np.concatenate(strains) if strains else np.zeros(0, dtype=np.float32)
