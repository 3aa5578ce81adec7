"""Small granular scenes for the tests."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.grains.assembly import Assembly
from matter.particles import Particles

SMOOTH = GrainLaw(friction=0.0, shape=0.0, rolling=0.0, twisting=0.0)


def grains(position: Any, radius: Any = 1.0, **fields: Any) -> Particles:
    """Grains at rest of unit mass and k_n = 1e4 N/m unless said otherwise."""
    position = np.atleast_2d(np.asarray(position, dtype=float))
    n = len(position)
    defaults = dict(
        identity=np.arange(n), velocity=np.zeros((n, 3)), angular_velocity=np.zeros((n, 3)), mass=np.ones(n),
        material=np.zeros(n),
        species=np.zeros(n), stiffness=np.full(n, 1e4), radius=np.broadcast_to(np.asarray(radius, dtype=float), (n,)),
    )  # fmt: skip
    return Particles({"position": position, **defaults, **fields})


def assembly(
    particles: Particles, law: GrainLaw | None = None, walls=(), g=(0.0, 0.0, 0.0), dt=None, threads=1, **contact: Any
) -> Assembly:
    """An assembly with one law for solid grains and uniform gravity."""
    settings = Contact(**({"shell": law} if law else {}), **contact)
    return Assembly(particles, settings, walls, Field.constant(g), dt=dt, threads=threads)


def cluster(side: int = 6, seed: int = 1, fall: float = 0.3) -> Particles:
    """A few hundred spinning grains of mixed size and species that fall onto each other."""
    rng = np.random.default_rng(seed)
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3), -1).reshape(-1, 3) * 2.05
    n = len(lattice)
    centre = lattice.mean(axis=0)
    radius = rng.uniform(0.85, 1.0, n)
    return grains(
        lattice - centre + rng.normal(0.0, 0.02, (n, 3)), radius, velocity=-fall * (lattice - centre) + rng.normal(0.0,
        0.5, (n, 3)),
        angular_velocity=rng.normal(0.0, 1.0, (n, 3)), mass=1000.0 * radius**3, stiffness=1e6 * radius,
        species=rng.integers(0, 2, n),
    )  # fmt: skip


def keeps_its_momenta_and_never_gains_energy(bed: Assembly, steps: int = 1000) -> None:
    """Momenta to rounding over these steps; dissipation, more than 0.3 of the energy, only grows and is what the rest
    lacks."""
    p, l = bed.momentum(), bed.angular_momentum()
    scale_p = float(np.sum(bed.mass * np.linalg.norm(bed.velocity, axis=1)))
    scale_l = float(bed.mass @ np.linalg.norm(np.cross(bed.position, bed.velocity), axis=1))
    start, spent = sum(bed.energies().values()), 0.0
    for _ in range(steps):
        bed.step()
        assert bed.report[0] >= spent - 1e-9 * start
        spent = bed.report[0]
    assert spent > 0.3 * start
    assert np.abs(bed.momentum() - p).max() < 1e-12 * scale_p
    assert np.abs(bed.angular_momentum() - l).max() < 1e-12 * scale_l
    assert sum(bed.energies().values()) + spent == pytest.approx(start, rel=0.01)
