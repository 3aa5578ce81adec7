"""Kutta's method with control of its error: its order, its agreement with the default integrator, and resuming."""

import numpy as np
import pytest

from fixtures import columns
from matter.files import snapshot
from sph import stage
from sph.bodies.cloud import Cloud
from sph.bodies.target import Body
from sph.boundary.images import Images
from sph.boundary.periodic import Periodic
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.stepping.integrator import Integrator
from sph.stepping.runge_kutta import RungeKutta
from tests.sph.stops import stopped
from tests.sph.test_stage import settings

ELASTIC = collect(("basalt",), {"basalt": Choice(strength="none", damage="none", tension={"cut": "1e4 GPa"})})


def ball(kind, viscous=False, box=None, **options):
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
    alpha, beta = (2.0, 10.0) if viscous else (0.0, 0.0)
    i = columns.integrator(Cloud.of(body), ELASTIC, 5.0, kind, alpha=alpha, beta=beta, images=images, **options)
    i.damage = False
    i.cloud.velocity[:] = -20.0 * place + np.cross([3.0, -2.0, 5.0], place) + (2000.0 if box else 0.0)
    i.start()
    return i


def run(i, until, dt):
    while i.time < until * (1.0 - 1e-9):
        i.step(min(dt, until - i.time))
    order = np.argsort(i.cloud.identity)
    return i.cloud.position[order], i.cloud.density[order]


def test_kuttas_method_is_of_third_order_and_the_default_of_second():
    end = 1e-3
    exact = run(ball(RungeKutta, tolerance=1e9), end, end / 160)
    orders = []
    for kind, options in ((RungeKutta, {"tolerance": 1e9}), (Integrator, {})):
        errors = [np.abs(run(ball(kind, **options), end, end / parts)[1] - exact[1]).max() for parts in (10, 20)]
        orders.append(np.log2(errors[0] / errors[1]))
    assert 2.6 < orders[0] < 3.6 and 1.7 < orders[1] < 2.4


def test_both_integrators_agree():
    """With viscosity, within the step's own error."""
    end = 2e-3
    one, other = ball(RungeKutta, viscous=True, tolerance=1e-6), ball(Integrator, viscous=True)
    a = run(one, end, 1e-4)
    b = run(other, end, 5e-6)
    assert one.steps < other.steps and np.abs(a[0] - b[0]).max() < 1e-4 and a[1] == pytest.approx(b[1], rel=1e-4)


def test_steps_that_err_are_tried_again():
    i = ball(RungeKutta, viscous=True, tolerance=1e-7)
    i.step(1e-3)
    assert i.rejected > 0 and i.time < 1e-3 and i.allowed < 1e-3
    i.dt = 0.0
    assert i.next_step(1.0) <= i.allowed
    loose = ball(RungeKutta, viscous=True, tolerance=1e3)
    loose.step(1e-4)
    assert loose.rejected == 0 and loose.allowed > 1e-4


def test_a_sort_within_a_step_changes_nothing():
    """A ball that flies through the side of a periodic box is wrapped and sorted in between; beside it, one that does
    not move on."""
    i, still = ball(RungeKutta, box=6.0, tolerance=1e9), ball(RungeKutta, tolerance=1e9)
    builds = i.neighbourhood.builds
    moved, stayed = run(i, 2e-3, 2e-4), run(still, 2e-3, 2e-4)
    assert i.neighbourhood.builds > builds
    apart = (moved[0] - stayed[0] - 2000.0 * 2e-3 + 6.0) % 12.0 - 6.0
    assert np.abs(apart).max() < 1e-9 and moved[1] == pytest.approx(stayed[1], rel=1e-11)


def test_a_stage_with_it_resumes_to_the_last_bit(tmp_path, monkeypatch):
    chosen = settings(
        integrator="rk3",
        tolerance=1e-4,
        relaxation_time=20.0,
        end_time=6.0,
        history_interval=3.0,
        snapshot_interval=6.0,
    )
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    whole.mkdir()
    parts.mkdir()
    stage.run(chosen, tmp_path, whole)
    phase, _ = stopped(monkeypatch, lambda: stage.run(chosen, tmp_path, parts), 23.0)
    assert phase == "impact"
    stage.run(chosen, tmp_path, parts)
    one, other = snapshot.read(whole / "last.vtkhdf"), snapshot.read(parts / "last.vtkhdf")
    for name in one:
        assert np.array_equal(one[name], other[name]), name
