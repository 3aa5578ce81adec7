"""Periodic planes, walls, pistons, fixed rims and quiet layers."""

import pkgutil
from pathlib import Path

import numpy as np
import pytest

import sph.boundary
from fixtures import columns
from fixtures.quiet_end import returned
from matter.case.body import Layer, Target
from matter.errors import InputError
from matter.geometry import neighbours
from pipeline.case import bibliography
from sph import stage as shock
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.boundary import dispatch
from sph.boundary.edge import LAYERS, Edge
from sph.boundary.images import Images
from sph.boundary.periodic import Periodic
from sph.boundary.wall import Wall
from sph.materials.rows import collect
from sph.pairs import rates
from sph.pairs.row import SUPPORT, VZ, XZ, YZ, Z
from sph.stepping import sides_and_floor
from tests.sph.test_rates import rows_of
from tests.sph.test_stage import settings

BASALT = collect(("basalt",))


def disordered(planes, side=8, seed=3, stress=1e8, **options):
    """A cube of basalt, edge ``side``, points jittered, moving and stressed at random, inside ``planes``; evaluated
    once."""
    rng = np.random.default_rng(seed)
    place = np.stack(np.meshgrid(*(np.arange(side) + 0.5,) * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(
        -0.2, 0.2, (side**3, 3)
    )
    n = len(place)
    rho = 2700.0 * rng.uniform(0.95, 1.05, n)
    body = Body(place, rho.copy(), rho, rng.uniform(1.9, 2.3, n), np.zeros(n, np.int32), np.zeros(n, np.int32))
    cloud = Cloud.from_bodies(body)
    cloud.velocity[:] = rng.normal(size=(n, 3)) * 50.0
    cloud.stress[:] = rng.normal(size=(n, 5)) * stress
    i = columns.integrator(cloud, BASALT, 20.0, images=Images(planes), **options)
    i.switches.damage = False
    i.start()
    return i


BOX = tuple(Periodic(axis, 0.0, 8.0) for axis in range(3))
ROOM = tuple(Wall(axis, at) for axis in range(3) for at in (0.0, 8.0))


def test_periodic_box_against_the_box_and_its_26_copies():
    """Rates in a periodic box are those of the middle one of 27 boxes."""
    i = disordered(BOX)
    shift = np.stack(np.meshgrid(*([0, -8, 8],) * 3, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
    c, n = i.cloud, len(i.cloud)
    row = np.concatenate([i.forces.evaluated.row[:n]] * 27)
    row[:, :3] += np.repeat(shift, n, axis=0)
    order, grid = neighbours.sort(row[:, :3].copy(), row[:, SUPPORT].copy())
    found = neighbours.build(row[order, :3].copy(), row[order, SUPPORT].copy(), grid)

    stress = np.concatenate([c.stress] * 27)[order]
    out = rates.Rates(27 * n)
    matter = rates.Matter(np.zeros(27 * n, dtype=np.int32), i.rows.shear, np.ones((27 * n, 2)), stress, True)
    rates.compute(i.forces.scheme, rows_of(row[order].copy()), found, matter, i.damping, out)
    back = np.argsort(order)[:n]
    for name in ("acceleration", "stress", "density", "energy", "divergence", "approach"):
        one, many = getattr(i.forces.rates, name), getattr(out, name)[back]
        assert np.abs(one - many).max() < 1e-11 * np.abs(many).max(), name
    assert np.array_equal(i.forces.rates.count, out.count[back])


@pytest.mark.parametrize(
    "planes", [BOX, ROOM, (*BOX[:2], Wall(2, 0.0), Wall(2, 8.0))], ids=["periodic", "walls", "column"]
)
def test_images_keep_what_they_should(planes):
    """Momentum in a periodic box; energy in each; along a wall, too, momentum."""
    i = disordered(planes)
    c, r = i.cloud, i.forces.rates
    force = c.mass[:, None] * r.acceleration
    work = (force * c.velocity).sum() + c.mass @ r.energy
    assert abs(work) < 1e-12 * np.abs(force * c.velocity).sum()
    for axis in range(3):
        if any(isinstance(plane, Periodic) and plane.axis == axis for plane in planes):
            assert abs(force[:, axis].sum()) < 1e-12 * np.abs(force[:, axis]).sum()


def test_a_wall_is_where_the_mirrored_half_would_be():
    """Rates before a wall are those of a body and its mirror image without one, corner to corner."""
    i = disordered((Wall(2, 0.0),))
    c, n = i.cloud, len(i.cloud)
    mirror = i.forces.evaluated.row[:n].copy()
    mirror[:, [Z, VZ, XZ, YZ]] *= -1.0
    row = np.concatenate([i.forces.evaluated.row[:n], mirror])
    order, grid = neighbours.sort(row[:, :3].copy(), row[:, SUPPORT].copy())
    found = neighbours.build(row[order, :3].copy(), row[order, SUPPORT].copy(), grid)
    image = c.stress * np.array([1, 1, -1, 1, -1])

    stress = np.concatenate([c.stress, image])[order]
    out = rates.Rates(2 * n)
    matter = rates.Matter(np.zeros(2 * n, dtype=np.int32), i.rows.shear, np.ones((2 * n, 2)), stress, True)
    rates.compute(i.forces.scheme, rows_of(row[order].copy()), found, matter, i.damping, out)
    back = np.argsort(order)[:n]
    for name in ("acceleration", "stress", "density", "energy"):
        one, many = getattr(i.forces.rates, name), getattr(out, name)[back]
        assert np.abs(one - many).max() < 1e-11 * np.abs(many).max(), name


@pytest.mark.validation
def test_total_energy_in_a_room_over_many_steps():
    """Walls at rest do no work: the drift while half the motion turns to heat is the integrator's, and falls with its
    step."""

    def drift(courant):
        i = disordered(ROOM, stress=0.0, courant=courant)
        i.switches.strength = False
        i.start()
        c = i.cloud

        def kinetic():
            return 0.5 * float(c.mass @ np.einsum("ij,ij->i", c.velocity, c.velocity))

        begun, heat = kinetic(), float(c.mass @ c.specific_energy)
        while kinetic() > 0.5 * begun:
            i.step(i.next_step(1e9))
        assert (c.position > -0.3).all() and (c.position < 8.3).all()
        return abs(kinetic() + float(c.mass @ c.specific_energy) - begun - heat) / begun

    coarse, fine = drift(0.3), drift(0.1)
    assert coarse < 1e-2 and fine < 0.5 * coarse


def test_matter_that_leaves_a_periodic_box_comes_in_again():
    i = disordered(BOX, stress=0.0)
    i.cloud.velocity[:] = (300.0, -200.0, 100.0)
    i.switches.strength = False
    i.start()
    calm = i.forces.rates.acceleration.copy(), i.cloud.identity.copy()
    while i.time < 0.08:  # some three box lengths
        i.step(i.next_step(0.08))
    assert i.neighbourhood.builds > 3
    assert (i.cloud.position > -1.0).all() and (i.cloud.position < 9.0).all()
    assert np.isfinite(calm[0]).all()
    assert i.cloud.mass @ i.cloud.velocity / i.cloud.mass.sum() == pytest.approx([300.0, -200.0, 100.0], rel=1e-9)


def test_a_box_narrower_than_a_support_is_refused():
    with pytest.raises(InputError, match="below the largest support"):
        disordered((Periodic(0, 0.0, 1.5),))


@pytest.mark.validation
def test_a_piston_and_a_wind_on_a_wall_are_the_same_shock():
    """Galilei: a piston into matter at rest, and matter that runs into a wall, give the same states to rounding
    growth."""
    piston, end = columns.Column(BASALT, 24, piston=1000.0), 2e-3
    wall = columns.Column(BASALT, 24, piston=0.0)
    wall.cloud.velocity[:, 2] = -1000.0
    for column in (piston, wall):
        column.integrator.start()
        while column.integrator.time < end:  # the same steps in both: their limits differ in the last bits
            column.integrator.step(2e-5)
    a, b = (np.argsort(column.cloud.identity) for column in (piston, wall))
    P, Q = piston.integrator.forces.evaluated.pressure[a], wall.integrator.forces.evaluated.pressure[b]
    assert P.max() > 8e9
    assert np.abs(P - Q).max() < 1e-6 * P.max()


@pytest.mark.parametrize(
    "name,pistons",
    [pytest.param("basalt", (500.0, 5000.0), marks=pytest.mark.validation), ("water_thesis", (2000.0,))],
)
def test_piston_reaches_the_hugoniot(name, pistons):
    """Small columns, to the accuracy of their length; the tables at full length are in ``test_shocks.py``."""
    from sph.shock_states import hugoniot

    materials = collect((name,))
    for piston in pistons:
        wanted = hugoniot.behind(*hugoniot.solid(materials.rows, 0), piston)
        got = columns.shocked(materials, piston, wanted.shock_speed, layers=50)
        assert got.P == pytest.approx(wanted.P, rel=0.02)
        assert got.rho == pytest.approx(wanted.rho, rel=0.015)
        assert got.u == pytest.approx(
            wanted.u, rel=0.05
        )  # the heated layers at the piston reach far into a short column
        assert got.speed == pytest.approx(wanted.shock_speed, rel=0.02)


@pytest.mark.parametrize(
    "sigma", [pytest.param(4.0, marks=pytest.mark.validation), pytest.param(8.0, marks=pytest.mark.validation)]
)
def test_quiet_end_returns_less_than_five_percent_of_a_wave(sigma):
    assert abs(returned("quiet", sigma)) < 0.05


@pytest.mark.validation
def test_a_wall_returns_it_all():
    assert returned("wall", 4.0) > 0.9


def test_a_fixed_rim_carries_weight_and_stays():
    """Basalt under its weight on a fixed rim, periodic across: the rim does not move, and the pressure above it stays
    the weight."""
    column = columns.Column(BASALT, 30, down=10.0)
    i, c = column.integrator, column.cloud
    weight = 2700.0 * 10.0 * (column.height - c.position[:, 2])
    c.density[:] = 2700.0 * (1.0 + weight / 26.7e9)
    order = np.argsort(c.identity)
    i.edge = Edge(c.position[order, 2], c.support_radius[order], c.density[order], c.specific_energy[order])
    rim = np.flatnonzero(i.edge.fixed)
    where = c.position[np.argsort(c.identity)][rim].copy()
    i.start()
    for _ in range(400):
        i.step(i.next_step(1e9), velocity_factor=0.99)
    order = np.argsort(c.identity)
    assert np.array_equal(c.position[order][rim], where) and len(rim) > 20
    inside = (c.position[:, 2] > 5.0) & (c.position[:, 2] < 20.0)
    got = np.polyfit(column.height - c.position[inside, 2], i.forces.evaluated.pressure[inside], 1)
    assert got[0] == pytest.approx(2.7e4, rel=0.1)
    assert np.abs(c.velocity).max() < 0.01


MACHINERY = {"dispatch", "edge", "images", "external_budget", "sides_and_floor"}
"""Files of the folder that are no boundary."""


def test_no_boundary_file_is_left_out_of_the_list():
    files = {info.name for info in pkgutil.iter_modules(sph.boundary.__path__)}
    assert files - MACHINERY == set(dispatch.FAMILY.names), "a file of sph/boundary is not in FAMILY, or gone"


@pytest.mark.parametrize("law", dispatch.FAMILY.laws, ids=dispatch.FAMILY.title)
def test_a_boundary_brings_what_its_kind_needs(law):
    """Words, who it pushes back, its sources, and either planes or a rim; a layer its key, width and law."""
    assert law.WORDS and isinstance(law.TAKES_MOMENTUM, bool)
    assert set(getattr(law, "SOURCES", ())) <= set(bibliography.entries())
    assert not (hasattr(law, "planes") and hasattr(law, "RIM"))
    rim = getattr(law, "RIM", False)
    assert law.TAKES_MOMENTUM <= (rim or hasattr(law, "planes"))
    assert not hasattr(law, "fade") or (rim and law.Parameters._fields and law.width and law.coefficient)
    for key in getattr(getattr(law, "Parameters", None), "_fields", ()):
        assert shock.Settings.model_fields[key].description


@pytest.mark.parametrize(
    "law", [law for law in dispatch.FAMILY.laws if hasattr(law, "planes")], ids=lambda law: law.__name__
)
def test_planes_take_momentum_if_and_only_if_they_say_so(law):
    i = disordered(law.planes(2, 0.0, 8.0))
    force = i.cloud.mass * i.forces.rates.acceleration[:, 2]
    assert (abs(force.sum()) > 1e-6 * np.abs(force).sum()) == law.TAKES_MOMENTUM


def test_the_bibliography_leaves_out_boundaries_that_are_not_taken():
    def idle(**chosen):
        return {Path(file).stem for file in sides_and_floor.idle_files(settings(**chosen))}

    assert idle() == {"fixed", "quiet", "wall", "periodic"}
    layers = (Layer(name="rock", material="basalt", thickness=6e3),)
    block = Target(layers=layers, shape="block", width=6e3)
    assert idle(target=block, sides="periodic", floor="quiet", spacing_at_impact=900.0) == {"free", "wall"}
    assert set(LAYERS) == {"quiet"}


def test_a_rim_that_takes_everything_is_refused():
    with pytest.raises(InputError, match="fixed rim"):
        Edge(np.full(5, 0.5), np.full(5, 1.0), np.full(5, 1e3), np.zeros(5))
