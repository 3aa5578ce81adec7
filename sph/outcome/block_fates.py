"""What became of the blocks of the shock stage: each as one body of its particles (``matter.blocks.block_bodies``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from matter.blocks import block_bodies
from sph.stepping import state

if TYPE_CHECKING:
    from sph.simulation import Simulation


def fates(run: Simulation) -> dict[str, Any]:
    """Numbers for the stage's report: whole and broken blocks, momentum of blocks and of the ground between them
    [kg m/s], and of each listed block how far it moved [m], its velocity [m/s] and its damage."""
    cloud, placing = run.integrator.cloud, run.placing
    assert placing is not None
    count, damage = len(placing.centre), state.damage_of(cloud, run.integrator.materials.rows)
    values = np.concatenate(
        [cloud.position, cloud.initial_position, cloud.velocity, damage[:, None]], axis=1
    )  # fmt: skip
    mean = block_bodies.means(cloud.block, count, cloud.mass, values)
    position, before, velocity, hurt = np.split(mean, np.cumsum([3, 3, 3]), axis=1)
    way, hurt = position - before, hurt[:, 0]
    found = np.isfinite(hurt)
    momentum = cloud.mass[:, None] * cloud.velocity
    between = (cloud.block < 0) & (cloud.layer >= 0)
    listed = [
        {
            "block": j,
            "displacement_m": way[j].tolist(),
            "velocity_m_s": velocity[j].tolist(),
            "damage": float(hurt[j]),
        }
        for j in range(placing.listed)
        if found[j]
    ]
    return {
        "whole": int((hurt[found] < block_bodies.WHOLE).sum()),
        "broken": int((hurt[found] >= block_bodies.WHOLE).sum()),
        "block_momentum_kg_m_s": momentum[cloud.block >= 0].sum(axis=0).tolist(),
        "matrix_momentum_kg_m_s": momentum[between].sum(axis=0).tolist(),
        "largest_displacement_m": float(np.linalg.norm(way[found], axis=1).max(initial=0.0)),
        "listed": listed,
    }
