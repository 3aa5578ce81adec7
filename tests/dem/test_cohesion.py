"""Cohesion: pull-off force, binding energy, friction that a pull adds, invariants of a sticky cluster."""

import math

import numpy as np
import pytest

from dem.contact.contact import Bodies
from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import PLANE, Wall
from dem.grains.assembly import Assembly
from dem.laws import cohesion_sjkr, cohesion_zhang
from tests.dem.scenes import cluster, grains, keeps_its_momenta_and_never_gains_energy

STICKY = GrainLaw(cohesion=100.0, shape=0.5, friction=0.5, restitution=0.5)
ZHANG = Contact(shell=STICKY, cohesion="zhang", overlap_stop=1.5)


def hangs(pull: float, contact: Contact, wall: bool) -> bool:
    """Whether a grain of unit radius that touches holds against a force growing slowly to ``pull`` [N]."""
    bed = (
        Assembly(grains([[0, 0, 0.999]]), contact, [Wall(PLANE, species=0)], Field.constant((0, 0, 0)))
        if wall
        else Assembly(
            grains([[0, 0, 0], [0, 0, 1.999]], mass=[1e12, 1.0], stiffness=[1e4, 1e4]),
            contact,
            [],
            Field.constant((0, 0, 0)),
        )
    )
    light = bed.mass < 2.0
    bed.drag[light] = 5.0
    steps = int(6.0 / bed.dt)
    for n in range(2 * steps):
        bed.gravity.uniform[2] = pull * min(1.0, n / steps)
        bed.weight[:] = light
        bed.step()
    return (
        bool(abs(bed.position[bed.mass < 2.0, 2] - bed.position[bed.mass > 2.0, 2]) < 2.0)
        if not wall
        else bool(bed.position[0, 2] < 1.0)
    )


@pytest.mark.parametrize("wall, size", [(False, 0.5), (True, 1.0)])
def test_a_contact_opens_at_the_pull_of_zhangs_law(wall, size):
    force = cohesion_zhang.pull(
        0.01, Bodies(1e4, 0.5, size, 1.0, 0.0 if wall else 1.0, 0.0), cohesion_zhang.Parameters(100.0, 0.5)
    )
    assert force == pytest.approx(100.0 * (2 * 0.5 * size) ** 2)
    assert hangs(0.99 * force, ZHANG, wall) and not hangs(1.01 * force, ZHANG, wall)


@pytest.mark.validation
def test_sjkr_opens_at_its_deepest_net_attraction():
    # on a wall k pi x (2 r - x) - k_n x has its maximum at x = r - k_n / (2 pi k)
    k, stiffness = 2000.0, 1e4
    contact = Contact(shell=STICKY.model_copy(update={"cohesion": k}), cohesion="sjkr", overlap_stop=1.9)
    x = 1.0 - stiffness / (2 * math.pi * k)
    force = k * cohesion_sjkr.area(x, 1.0, 0.0) - stiffness * x
    assert force > 0.0
    bed = Assembly(grains([[0, 0, 1.0 - x]]), contact, [Wall(PLANE, species=0)])
    assert bed.A[0, 2] == pytest.approx(-force, rel=1e-12)


@pytest.mark.parametrize("first, second", [(1.0, 1.0), (1.0, 0.2), (1.0, 0.0)])
def test_the_area_and_its_integral(first, second):
    x = np.linspace(1e-9, 0.3 * (second or first), 2001)
    area = np.array([cohesion_sjkr.area(v, first, second) for v in x])
    if second:  # the circle in which two spheres cut each other
        d = first + second - x
        exact = math.pi * (first**2 - ((d * d + first**2 - second**2) / (2 * d)) ** 2)
    else:
        exact = math.pi * (first**2 - (first - x) ** 2)
    assert np.allclose(area, exact, rtol=1e-6, atol=1e-15)
    assert cohesion_sjkr.volume(x[-1], first, second) == pytest.approx(np.trapezoid(area, x), rel=1e-6)


def test_a_pull_presses_and_so_adds_friction():
    # Coulomb's limit counts what presses the contact: the weight and the pull
    force = 100.0 * (2 * 0.5) ** 2

    def slides(g: float) -> bool:
        flat = STICKY.model_copy(update={"rolling": 5.0, "shape": 0.5})
        contact = Contact(shell=flat, cohesion="zhang", overlap_stop=1.5)
        sink = (force + 1.0) / 1e4
        ball = Assembly(
            grains([[0, 0, 1.0 - sink]]), contact, [Wall(PLANE, species=0)], Field.constant((g, 0.0, -1.0))
        )
        for _ in range(1500):
            ball.step()
        return bool(ball.velocity[0, 0] > 0.1)

    limit = 0.5 * (1.0 + force)
    assert not slides(0.97 * limit) and slides(1.05 * limit)


@pytest.mark.parametrize("law, strength", [("zhang", 3e4), pytest.param("sjkr", 3e5, marks=pytest.mark.validation)])
@pytest.mark.parametrize("normal", ["hooke", pytest.param("hertz", marks=pytest.mark.validation)])
def test_a_sticky_cluster_keeps_its_momenta_and_never_gains_energy(law, strength, normal):
    grain = STICKY.model_copy(update={"cohesion": strength, "elastic_modulus": 3e6})
    contact = Contact(
        shell=grain, ocean=grain, cohesion=law, normal=normal,
        overlap_stop=1.5,
        steps_per_contact=60,
    )  # fmt: skip
    bed = Assembly(cluster(fall=0.1), contact)
    keeps_its_momenta_and_never_gains_energy(bed)
    assert bed.contacts > 50


@pytest.mark.parametrize(
    "normal, law",
    [
        *(("hooke", law) for law in ("none", "zhang")),
        pytest.param("hooke", "sjkr", marks=pytest.mark.validation),
        *(pytest.param("hertz", law, marks=pytest.mark.validation) for law in ("none", "zhang", "sjkr")),
    ],
)
def test_the_measured_force_of_a_contact_at_rest_is_the_one_that_acts(law, normal):
    from dem.beds import bed_measures

    grain = GrainLaw(cohesion=50.0 if law != "none" else 0.0, shape=0.5, elastic_modulus=1e4)
    contact = Contact(shell=grain, cohesion=law, normal=normal)
    pair = Assembly(grains([[0, 0, 0], [0, 1.35, 0]], [1.0, 0.4]), contact)
    force = bed_measures.contact_forces(pair)[2]
    assert np.allclose(force[0], pair.A[1, :3] * pair.mass[1], rtol=1e-9)
