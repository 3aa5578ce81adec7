"""What the shock stage holds per particle, counted by allocation: no machine's page size, no compiled kernel."""

import tracemalloc

import numpy as np
import pytest

from sph.cloud import Cloud
from sph.damage import seeding
from sph.integrator import Integrator
from sph.material_settings import Choice
from sph.materials import collect
from sph.numerics import Numerics
from sph.surroundings import Surroundings
from sph.target import Body

POROUS = {"ice": Choice(porosity="p_alpha", p_alpha={"alpha0": 1.1})}


@pytest.fixture
def ice():
    """20 x 20 x 20 particles of porous ice with flaws, 37 neighbours in the middle."""
    materials = collect(("ice",), POROUS)
    place = np.stack(np.meshgrid(*(np.arange(20.0),) * 3, indexing="ij"), axis=-1).reshape(
        -1, 3
    ) + np.random.default_rng(1).uniform(-0.1, 0.1, (8000, 3))
    rho = np.full(8000, materials.bulk_density[0])
    zero = np.zeros(8000, dtype=np.int32)

    def made() -> Integrator:
        cloud = Cloud.of(Body(place * 1e3, rho * 1e9, rho, np.full(8000, 2.06e3), zero, zero, np.full(8000, 1.1)))
        seeding.seed_flaws(cloud, materials, 1)
        return Integrator(cloud, materials, 2e4, Numerics(), Surroundings(self_gravity=False, down=1.0))

    return made


def peak(work) -> float:
    """Most bytes per particle that stand at once during ``work()``, with what stood before it."""
    tracemalloc.reset_peak()
    work()
    return tracemalloc.get_traced_memory()[1] / 8000.0


def test_a_particle_takes_less_than_a_kilobyte(ice):
    """Cloud, flaws, list, rates and what comes on top while flaws are seeded, the cloud is sorted anew and a step is
    taken."""
    warm = ice()  # libraries, compiled kernels
    warm.start()
    warm.step(warm.next_step(1.0))
    warm.neighbourhood.rebuild(warm.cloud, 0.1)
    del warm
    tracemalloc.start()
    try:
        held = []
        assert peak(lambda: held.append(ice())) < 1000.0
        i = held[0]
        assert peak(i.start) < 1000.0
        assert peak(lambda: i.step(i.next_step(1.0))) < 1000.0
        sorting = peak(lambda: i.neighbourhood.rebuild(i.cloud, 0.1))
        assert 600.0 < sorting < 1000.0
        flaws = i.cloud.flaw_strain.nbytes / 8000.0
        assert (
            20.0 < flaws < 80.0 and 25.0 < i.neighbourhood.pairs.count.mean() < 45.0
        )  # the bound is not met by leaving something out
    finally:
        tracemalloc.stop()
