"""Mass that escapes from a self-gravitating body, and the momentum that the body keeps.

    a particle escapes:  v^2 / 2 > -phi(x)  and  v . x > 0       phi of all particles; about the centre of mass
    dP = p - sum of m v over what escapes                        momentum that stays, p that of the projectile
    beta = dP . N / (p . N)                                      N normal of the surface at the site (a sphere: +z)

(Cheng et al. 2023, Nature 616, 457, eq. 1: their ratio of momenta along the normal of the surface.) At the end of the
shock stage slow matter is still on its way; what leaves last is the slowest. Most of the mass may be ground that is
still dense and in contact, which friction can stop. Separated matter, below half of its density at the start, escapes
whatever the ground does; it is reported under the key ``parted``. ``blocks`` is what escapes of blocks, whole or
broken; one counts where most of its mass does.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from matter.blocks import block_bodies
from matter.geometry import tree
from sph.bodies import symmetry

SOURCES = ("Cheng2023",)
THETA = 0.3
SEPARATED = 0.5
"""Density over that of the start, below which matter counts as separated."""


def escaped_momentum(
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    softening: np.ndarray,
    momentum: np.ndarray,
    normal: np.ndarray,
    separated: np.ndarray | None = None,
    block: np.ndarray | None = None,
) -> dict[str, Any]:
    """Escaping mass [kg] and momentum (3,) [kg m/s] of particles (n, 3), (n,); ``momentum`` (3,) of the projectile,
    ``normal`` (3,) of the surface; mass and beta of the escaping particles that are ``separated`` (n,) bool; number,
    mass and momentum of the blocks among them, where ``block`` (n,) is that of each particle, -1 for none."""
    centre, drift = (mass @ values / mass.sum() for values in (position, velocity))
    offset, speed = position - centre, velocity - drift
    well = tree.minus_potential(position, mass, softening, THETA)
    escapes = (0.5 * np.einsum("ij,ij->i", speed, speed) > well) & (np.einsum("ij,ij->i", speed, offset) > 0.0)
    lost = mass[escapes] @ velocity[escapes]
    stays = momentum - lost
    more: dict[str, Any] = {}
    if separated is not None:
        free = escapes & separated
        thrown = float(mass[free] @ velocity[free] @ normal / (momentum @ normal))
        more = {"parted": {"mass_kg": float(mass[free].sum()), "beta": 1.0 - thrown}}
    if block is not None:
        more["blocks"] = _of_blocks(np.where(escapes, block, -1), block, mass, velocity)
    return {
        "mass_kg": float(mass[escapes].sum()),
        "momentum_kg_m_s": lost.tolist(),
        "momentum_that_stays_kg_m_s": stays.tolist(),
        "beta": float(stays @ normal / (momentum @ normal)),
        "beta_vector": (stays / np.linalg.norm(momentum)).tolist(),
        "normal": normal.tolist(),
        **more,
    }


def _of_blocks(away: np.ndarray, block: np.ndarray, mass: np.ndarray, velocity: np.ndarray) -> dict[str, Any]:
    """Number, mass and momentum of what is ``away`` (n,) of each ``block`` (n,)."""
    count, mine = int(block.max(initial=-1)) + 1, away >= 0
    lost, whole = (block_bodies.masses(which, count, mass) for which in (away, block))
    return {
        "number": int(np.count_nonzero(lost > 0.5 * whole)),
        "mass_kg": float(mass[mine].sum()),
        "momentum_kg_m_s": (mass[mine] @ velocity[mine]).tolist(),
    }


def escaping_mass(run: Any) -> dict[str, Any] | None:
    """The same of a ``Simulation`` as it stands; None without projectile or self-gravity."""
    chosen, cloud = run.settings, run.integrator.cloud
    if chosen.control or not run.integrator.environment.self_gravity or chosen.target.flat:
        return None
    sides = symmetry.signs(chosen.symmetry)
    parts = len(sides)
    mass = np.tile(cloud.mass, parts)
    ball = chosen.impact.projectile
    rho = float(run.materials.bulk_density[run.materials.index(ball.material)])
    normal = chosen.target.placed.normal if chosen.target.solid else np.array([0.0, 0.0, 1.0])
    return escaped_momentum(
        symmetry.unfolded(cloud.position, chosen.symmetry),
        symmetry.unfolded(cloud.velocity, chosen.symmetry),
        mass,
        np.tile(run.integrator.softening, parts),
        rho * ball.volume * np.array(chosen.target.aim(chosen.impact)),
        normal,
        np.tile(cloud.density < SEPARATED * cloud.start_density, parts),
        cloud.block if run.rubble else None,  # no mirror images where there are blocks
    )
