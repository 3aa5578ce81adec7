"""Which flaws a cloud's particles begin with."""

from __future__ import annotations

import numpy as np

from matter.errors import InputError
from sph.cloud import Cloud
from sph.damage import grady_kipp
from sph.materials import Materials

MOST = 3e8
"""Flaws of one material: 1.2 GB."""


def seed_flaws(cloud: Cloud, materials: Materials, seed: int) -> None:
    """Flaws by identity, so that no sorting changes them; one random stream per material. Predamaged material is broken and
    has none. Raises ``InputError`` when a graded body would need more than ``MOST``."""
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
        number = grady_kipp.expected(solid[mine])
        if number > MOST:
            raise InputError(
                f"{name}: about {number:.1e} flaws would be needed to give every particle one (at most {MOST:.0e} are allowed): "
                f"its particles are of {solid[mine].min():.2g} to "
                f"{solid[mine].max():.2g} m^3; smaller ones far away (spacing_far) need fewer, broken material (predamaged = true) none"
            )
        start, strain = grady_kipp.flaws(solid[mine], materials.weibull(name), np.random.default_rng(streams[index]))
        cloud.flaw_first[mine], cloud.flaw_last[mine] = start[:-1] + offset, start[1:] + offset
        strains.append(strain)
        offset += len(strain)
    cloud.flaw_strain = np.concatenate(strains) if strains else np.zeros(0, dtype=np.float32)
