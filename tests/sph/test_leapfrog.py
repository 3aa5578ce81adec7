"""The leapfrog: its order, and that sorting the particles between two steps changes nothing."""

import numpy as np
import pytest

from fixtures import columns
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.boundary.images import Images
from sph.boundary.periodic import Periodic
from sph.materials.rows import collect
from sph.materials.settings import Choice

ELASTIC = collect(("basalt",), {"basalt": Choice(strength="none", damage="none", tension={"cut": "1e4 GPa"})})


def ball(box=None):
    """A ball of 251 particles, squeezed and turning; in a periodic ``box`` it flies through its side."""
    rng = np.random.default_rng(4)
    place = np.stack(np.meshgrid(*(np.arange(-4, 5),) * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(
        -0.05, 0.05, (9**3, 3)
    )
    place = place[np.linalg.norm(place, axis=1) < 3.9]
    n = len(place)
    body = Body(
        place, np.full(n, 2700.0), np.full(n, 2700.0), np.full(n, 2.3), np.zeros(n, np.int32), np.zeros(n, np.int32)
    )
    images = Images(tuple(Periodic(axis, -box, box) for axis in range(3))) if box else None
    i = columns.integrator(Cloud.from_bodies(body), ELASTIC, 5.0, alpha=0.0, beta=0.0, images=images)
    i.switches.damage = False
    i.cloud.velocity[:] = -20.0 * place + np.cross([3.0, -2.0, 5.0], place) + (2000.0 if box else 0.0)
    i.start()
    return i


def run(i, until, dt):
    while i.time < until * (1.0 - 1e-9):
        i.step(min(dt, until - i.time))
    order = np.argsort(i.cloud.identity)
    return i.cloud.position[order], i.cloud.density[order]


def test_it_is_of_second_order():
    end = 1e-3
    exact = run(ball(), end, end / 320)
    errors = [np.abs(run(ball(), end, end / parts)[1] - exact[1]).max() for parts in (10, 20)]
    assert 1.7 < np.log2(errors[0] / errors[1]) < 2.4


def test_a_sort_between_steps_changes_nothing():
    """A ball that flies through the side of a periodic box is wrapped and sorted in between; beside it, one that does
    not move on."""
    i, still = ball(box=6.0), ball()
    builds = i.neighbourhood.builds
    moved, stayed = run(i, 2e-3, 2e-4), run(still, 2e-3, 2e-4)
    assert i.neighbourhood.builds > builds
    separation = (moved[0] - stayed[0] - 2000.0 * 2e-3 + 6.0) % 12.0 - 6.0
    assert np.abs(separation).max() < 1e-9 and moved[1] == pytest.approx(stayed[1], rel=1e-11)
