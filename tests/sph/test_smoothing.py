"""Support radii that follow the density, and lists that follow them."""

import numpy as np
import pytest

from fixtures import columns
from matter.files import checkpoint, snapshot
from sph import stage
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.materials.rows import collect
from sph.pairs import smoothing
from sph.stepping.numerics import LIMITS_OF_LENGTH
from tests.sph.stage_runs import stopped
from tests.sph.test_stage import settings

BASALT = collect(("basalt",))


def test_h_follows_the_density_between_its_limits():
    rho = np.array([1.0, 8.0, 0.125, 1000.0, 0.001])
    h = np.empty(5)
    smoothing.follow(rho, np.ones(5), np.full(5, 3.0), 0.25, 4.0, 9.0, h)
    assert h == pytest.approx([3.0, 1.5, 6.0, 0.75, 9.0])


def burst(numerics="reconstructed", courant=0.3):
    """A ball of 900 particles that its own pressure drives apart."""
    rng = np.random.default_rng(5)
    place = np.stack(np.meshgrid(*(np.arange(-6, 7),) * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(
        -0.1, 0.1, (13**3, 3)
    )
    place = place[np.linalg.norm(place, axis=1) < 6.0]
    n = len(place)
    body = Body(
        place, np.full(n, 3000.0), np.full(n, 3000.0), np.full(n, 2.4), np.zeros(n, np.int32), np.zeros(n, np.int32)
    )
    i = columns.integrator(Cloud.from_bodies(body), BASALT, 6.0, numerics=numerics, courant=courant)
    i.switches.strength = i.switches.damage = False
    i.cloud.specific_energy[:] = 2e7
    i.start()
    return i


def energy(i):
    v = i.cloud.velocity
    return float(i.cloud.mass @ (0.5 * np.einsum("ij,ij->i", v, v) + i.cloud.specific_energy))


FORMER = pytest.mark.xfail(
    strict=True, reason="steps at one Courant number are longer since 6ef4c6c6, where all parts"
)


@pytest.mark.parametrize("courant", [0.2, pytest.param(0.3, marks=FORMER)])
def test_a_burst_keeps_its_energy_and_loses_no_neighbour(courant):
    i = burst(courant=courant)
    begun = energy(i)
    for _ in range(60):
        i.step(i.next_step(1.0))
    c = i.cloud
    longest = c.support_radius / c.start_support
    assert longest.max() > 1.2 and longest == pytest.approx(
        np.clip((c.start_density / c.density) ** (1 / 3), *LIMITS_OF_LENGTH), rel=0.03
    )
    d = np.linalg.norm(c.position[:, None] - c.position, axis=2)
    near = d < 0.5 * (c.support_radius[:, None] + c.support_radius)
    assert np.array_equal(near.sum(axis=1) - 1, c.neighbours)
    assert energy(i) == pytest.approx(begun, rel=1e-3)
    assert np.abs(c.mass @ c.velocity).max() < 1e-10 * c.mass.sum() * np.abs(c.velocity).max()


@pytest.mark.parametrize("courants", [(0.2, 0.1), pytest.param((0.3, 0.15), marks=FORMER)])
def test_the_error_of_the_energy_is_that_of_the_step_alone(courants):
    """Second order in the step: a support that follows the density adds no work of its own (-4.3e-4 and -1.2e-4)."""
    errors = []
    for courant in courants:
        i = burst(courant=courant)
        begun = energy(i)
        while i.time < 2e-3:
            i.step(i.next_step(2e-3))
        errors.append(energy(i) / begun - 1.0)
    assert abs(errors[1]) < 0.3 * abs(errors[0]) and abs(errors[1]) < 3e-4


def test_fixed_h_loses_the_neighbours_that_a_following_one_keeps():
    """What the law is for."""
    counts = []
    for numerics in ("monaghan", "reconstructed"):
        i = burst(numerics)
        for _ in range(60):
            i.step(i.next_step(1.0))
        counts.append(np.median(i.cloud.neighbours))
    assert counts[0] < 0.75 * counts[1]


def stopped_and_whole(tmp_path, monkeypatch, **chosen):
    """The last snapshots of a small stage run in one go and of one that was stopped and resumed; it leaves the folders
    ``whole`` and ``parts``."""
    chosen = settings(relaxation_time=20.0, end_time=15.0, history_interval=5.0, snapshot_interval=15.0, **chosen)
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    whole.mkdir()
    parts.mkdir()
    stage.run(chosen, tmp_path, whole)
    phase, _ = stopped(monkeypatch, lambda: stage.run(chosen, tmp_path, parts), 26.0)
    assert phase == "impact"
    assert checkpoint.newest(parts) is not None
    stage.run(chosen, tmp_path, parts)
    return snapshot.read(whole / "last.vtkhdf"), snapshot.read(parts / "last.vtkhdf")


def test_a_stage_resumes_to_the_last_bit(tmp_path, monkeypatch):
    one, other = stopped_and_whole(tmp_path, monkeypatch, numerics="reconstructed")
    for name in one:
        assert np.array_equal(one[name], other[name]), name
    first = snapshot.read(snapshot.series(tmp_path / "whole")[0])
    assert np.min(one.smoothing_length / first.smoothing_length) < 0.98
