"""What the shock stage holds per particle, counted by allocation: no machine's page size, no compiled kernel."""

import tracemalloc

import numpy as np
import pytest

from sph.bodies import seeding
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.stepping.environment import Environment
from sph.stepping.integrator import Integrator
from sph.stepping.numerics import SETS, Numerics

POROUS = {"ice": Choice(porosity="p_alpha", p_alpha={"alpha0": 1.1})}


@pytest.fixture(params=SETS)
def ice(request):
    """20 x 20 x 20 particles of porous ice with flaws, of a set of numerics and with its supports: 37 or 81 neighbours
    in the middle."""
    chosen = Numerics(numerics=request.param)
    materials = collect(("ice",), POROUS)
    place = np.stack(np.meshgrid(*(np.arange(20.0),) * 3, indexing="ij"), axis=-1).reshape(
        -1, 3
    ) + np.random.default_rng(1).uniform(-0.1, 0.1, (8000, 3))
    rho = np.full(8000, materials.bulk_density[0])
    zero = np.zeros(8000, dtype=np.int32)

    def made() -> Integrator:
        cloud = Cloud.from_bodies(
            Body(place * 1e3, rho * 1e9, rho, np.full(8000, 1.03e3 * chosen.support), zero, zero, np.full(8000, 1.1))
        )
        seeding.seed_flaws(cloud, materials, 1)
        return Integrator(cloud, materials, 2e4, chosen, Environment(self_gravity=False, down=1.0))

    made.name = request.param
    return made


def peak(work) -> float:
    """Most bytes per particle that stand at once during ``work()``, with what stood before it."""
    tracemalloc.reset_peak()
    work()
    return tracemalloc.get_traced_memory()[1] / 8000.0


BOUNDS = {"monaghan": (1000.0, 25.0, 45.0), "reconstructed": (1300.0, 60.0, 85.0)}
"""Bytes a particle, and between which numbers its neighbours are on average."""


def test_a_particle_takes_a_kilobyte_and_the_room_of_its_neighbours(ice):
    """Cloud, flaws, list, rates and what comes on top while flaws are seeded, the cloud is sorted anew and a step is
    taken."""
    bound, fewest, most = BOUNDS[ice.name]
    warm = ice()  # libraries, compiled kernels
    warm.start()
    warm.step(warm.next_step(1.0))
    warm.neighbourhood.rebuild(warm.cloud, 0.1)
    del warm
    tracemalloc.start()
    try:
        held = []
        assert peak(lambda: held.append(ice())) < bound
        i = held[0]
        assert peak(i.start) < bound
        assert peak(lambda: i.step(i.next_step(1.0))) < bound
        sorting = peak(lambda: i.neighbourhood.rebuild(i.cloud, 0.1))
        assert 600.0 < sorting < bound
        flaws = i.cloud.flaw_strain.nbytes / 8000.0
        assert (
            20.0 < flaws < 80.0 and fewest < i.neighbourhood.pairs.count.mean() < most
        )  # the bound is not met by leaving something out
    finally:
        tracemalloc.stop()
