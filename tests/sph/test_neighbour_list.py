"""When the shock stage makes its neighbour list anew."""

import numpy as np

from sph.bodies.particle_cloud import Cloud, Neighbourhood
from sph.bodies.target import Body

DT = 1.0


def cloud_with(lone: float, of_block: float) -> tuple[Cloud, Neighbourhood]:
    """A block of 6 x 6 x 6 and a lone particle 50 spacings away, with the speeds [m/s] of the latter and of a corner
    of the block; the list as for steps of ``DT``."""
    block = np.stack(np.meshgrid(*(np.arange(6.0),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    place = np.vstack([block, [[50.0, 0.0, 0.0]]])
    n = len(place)
    zero, one = np.zeros(n, dtype=np.int32), np.ones(n)
    cloud = Cloud.from_bodies(Body(place, one, one, 2.6 * one, zero, zero, one))
    cloud.velocity[-1, 0], cloud.velocity[n - 2, 1] = lone, of_block
    cloud.neighbours[:] = [30] * (n - 1) + [0]
    around = Neighbourhood(cloud, 20.0)
    around.rebuild(cloud, DT)
    return cloud, around


def builds_of(lone: float, of_block: float, steps: int, dt: float = DT) -> int:
    """How often the list is made anew while particles fly straight on."""
    cloud, around = cloud_with(lone, of_block)
    before = around.builds
    for _ in range(steps):
        cloud.position += dt * cloud.velocity
        around.update(cloud, dt)
    return around.builds - before


def test_lone_debris_waits_for_the_list_to_be_as_old_as_skins_look_ahead():
    """It flies past 100 of its h a step: with a neighbour the list is made at each, alone at every twelfth."""
    ahead = Neighbourhood.AHEAD
    assert builds_of(260.0, 0.0, 3 * ahead) == 3
    assert builds_of(0.0, 0.0, 3 * ahead) == 0
    assert builds_of(0.0, 260.0, 5) == 5


def test_a_lone_particle_is_looked_for_sooner_when_steps_get_longer():
    """As where the late stage lowers the sound speed: skins reckon with the steps before it."""
    assert builds_of(0.2, 0.0, 1, dt=11.0) == 0
    assert builds_of(0.2, 0.0, 1, dt=13.0) == 1


def test_a_pair_that_comes_into_reach_is_listed_before_a_lone_particle_of_usual_speed_touches():
    """What flies less than its h a step is found in time, lone or not: its skin reaches twelve steps ahead."""
    cloud, around = cloud_with(-0.2, 0.0)
    while True:
        cloud.position += DT * cloud.velocity
        around.update(cloud, DT)
        lone = int(np.flatnonzero(cloud.neighbours == 0)[0])
        separation = np.linalg.norm(np.delete(cloud.position, lone, axis=0) - cloud.position[lone], axis=1).min()
        if separation < 2.6:
            break
    assert around.pairs is not None and around.pairs.count[lone] > 0
