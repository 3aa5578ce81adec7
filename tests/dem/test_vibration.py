"""Friction that grains lose while their ground shakes (``dem.laws.shaken_friction``)."""

import math

import numpy as np
import pytest

from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import PLANE, Wall
from dem.grains import shaking
from dem.grains.assembly import Assembly, Extras
from dem.grains.shaking import Vibration
from dem.laws import shaken_friction
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from pipeline.case import bibliography
from tests.dem.scenes import grains

SOUND = 1.0
FLOOR = Wall(PLANE, species=0)
LONG, WIDE = 24.0, 8.0
BOX = (
    FLOOR, Wall(PLANE, direction=(1, 0, 0)), Wall(PLANE, point=(LONG, 0, 0), direction=(-1, 0, 0)),
    Wall(PLANE, direction=(0, 1, 0)), Wall(PLANE, point=(0, WIDE, 0), direction=(0, -1, 0)),
)  # fmt: skip
LAW = Contact(shell=GrainLaw(friction=0.5, shape=0.4, restitution=0.4))
PACKED = 0.6
SPEED = 20.0
"""rho c v_vib of 2.9: three times what bears on the lowest grains of the layer."""


def filling(radius, mass):
    """Density of grains that fill their volume over ``PACKED``."""
    return PACKED * mass / (4.0 / 3.0 * np.pi * radius**3)


def shaken(some: Particles, speed, decay_time, g=(0.0, 0.0, -1.0), walls=BOX, law=LAW, **more) -> Assembly:
    """Grains of one material that shake at ``speed``."""
    some["vibration"] = np.broadcast_to(np.asarray(speed, dtype=float), (len(some),))
    how = Vibration(np.array([decay_time]), np.array([SOUND]))
    return Assembly(some, law, walls, Field.constant(g), extras=Extras(shaking=how), **more)


# ---------------------------------------------------------------- the law
def test_friction_is_that_of_the_pressure_which_the_vibration_leaves():
    assert shaken_friction.bearing_fraction(0.0, 3.0, 2.0, 5.0) == 1.0
    assert shaken_friction.bearing_fraction(0.1, 3.0, 2.0, 5.0) == pytest.approx(2.0 / 3.0)
    assert 0.0 < shaken_friction.bearing_fraction(0.3, 3.0, 2.0, 5.0) < 1e-6
    assert 0.0 < shaken_friction.bearing_fraction(9.0, 3.0, 2.0, 5.0) < 1e-6
    assert shaken_friction.bearing_fraction(9.0, 0.0, 2.0, 5.0) == 1.0  # nothing bears
    assert shaken_friction.speed_after(8.0, 3.0, 2.0) == pytest.approx(8.0 * math.exp(-1.5))
    assert set(shaken_friction.SOURCES) <= set(bibliography.entries())
    assert all(word in shaken_friction.__doc__ for word in ("Source:", "LIGGGHTS", "LAMMPS"))


def test_vibration_decays_as_exp_minus_t_over_T_whatever_the_steps():
    some = grains([[0.0, 0, 0], [5.0, 0, 0], [9.0, 0, 0]], material=[0, 1, 2], vibration=[3.0, 4.0, 5.0])
    how = Vibration(np.array([2.0, 0.5, math.inf]), np.array([SOUND, SOUND, 0.0]))
    bed = Assembly(some, LAW, dt=1e-3, extras=Extras(shaking=how))
    for dt, steps in ((1e-3, 537), (2.3e-3, 101)):
        bed.change_step(dt)
        for _ in range(steps):
            bed.step()
    t = 0.537 + 0.2323
    wanted = [3.0 * math.exp(-t / 2.0), 4.0 * math.exp(-t / 0.5), 5.0]
    np.testing.assert_allclose(bed.particles({}).vibration, wanted, rtol=1e-13)


def test_pressure_on_a_grain_is_a_third_of_the_trace_of_its_stress():
    """Five unequal grains upon each other: every force is the weight above it."""
    radius, k = np.array([1.0, 0.8, 1.0, 0.9, 1.0]), 1e4
    mass = np.arange(1.0, 6.0)
    force = np.cumsum(mass[::-1])[::-1]  # on the lower side of each
    gap = np.empty(5)
    gap[0] = radius[0] - force[0] / k
    gap[1:] = radius[:-1] + radius[1:] - force[1:] / k
    x = np.column_stack([np.zeros(5), np.zeros(5), np.cumsum(gap)])
    some = grains(x, radius, mass=mass, stiffness=np.full(5, k), density=filling(radius, mass))
    speed = np.array([0.3, 0.6, 0.9, 0.3, 5.0])
    bed = shaken(some, speed, 1e9, walls=(FLOOR,))
    # arms from each centre to the planes of contact below and above it
    below = np.r_[gap[0], 0.5 * (gap[1:] + (radius[1:] ** 2 - radius[:-1] ** 2) / gap[1:])]
    above = np.r_[gap[1:] - below[1:], 0.0]
    volume = 4.0 / 3.0 * np.pi * radius**3 / PACKED
    P = (force * below + np.r_[force[1:], 0.0] * above) / (3.0 * volume)
    wanted = 1.0 - np.minimum(filling(radius, mass) * SOUND * speed / P, 1.0)
    wanted = np.maximum(wanted, shaken_friction.LEAST)
    assert 0.1 < wanted[:4].min() and wanted[4] == shaken_friction.LEAST
    order = np.argsort(bed.identity)
    np.testing.assert_allclose(bed.bearing[order], wanted, rtol=1e-9)


def test_a_contact_that_slips_carries_what_is_left():
    """mu f |F_n|, with the smaller f of two grains: those of 0.4 and 0.7."""
    k, overlap, mu = 1e4, 1e-3, 0.5
    smooth = Contact(shell=GrainLaw(friction=mu, shape=0.0, restitution=1.0))
    some = grains([[0.0, 0, 0], [0, 0, 2.0 - overlap]], stiffness=[k, k], velocity=[[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    volume = 4.0 / 3.0 * np.pi / PACKED
    P, rho = k * overlap * (1.0 - 0.5 * overlap) / (3.0 * volume), 1.0 / volume
    some["density"] = filling(some.radius, some.mass)
    speed = (1.0 - np.array([0.4, 0.7])) * P / (rho * SOUND)
    bed = shaken(some, speed, 1e9, (0.0, 0.0, 0.0), (), smooth, dt=1e-6)
    bed.step()
    assert -bed.A[int(np.argmin(bed.identity)), 0] == pytest.approx(mu * 0.4 * k * overlap, rel=1e-5)


# ---------------------------------------------------------------- a layer that is tilted by 20 degrees
TILT = math.radians(20.0)
TILTED = (math.sin(TILT), 0.0, -math.cos(TILT))


@pytest.fixture(scope="module")
def layer() -> Particles:
    """Some 320 grains at rest in a level box, with their contacts."""
    rng = np.random.default_rng(4)
    x = np.stack(np.meshgrid(np.arange(10), np.arange(3), np.arange(11)), -1).reshape(-1, 3) * 2.3
    x = x + 1.5 + rng.uniform(-0.15, 0.15, x.shape)
    radius = rng.uniform(0.85, 1.0, len(x))
    start = grains(x, radius, mass=radius**3, stiffness=2e3 * radius, density=filling(radius, radius**3))
    bed = Assembly(start, LAW, BOX, Field.constant((0.0, 0.0, -1.0)))
    for drag, steps in ((0.1, 8_000), (1.0, 6_000)):
        bed.drag[:] = drag
        for _ in range(steps):
            bed.step()
    return bed.particles({"time": 0.0})


def slope(bed: Assembly) -> float:
    """Angle of the surface against the level [deg], by the highest grains of six strips; 20 before it flows."""
    strip = np.clip((bed.position[:, 0] / LONG * 6).astype(int), 0, 5)
    top = [np.sort((bed.position[:, 2] + bed.X[:, 3])[strip == k])[-4:].mean() for k in range(6)]
    rise = np.polyfit(LONG / 6 * (np.arange(6) + 0.5), top, 1)[0]
    return 20.0 - math.degrees(math.atan(rise))


def way(bed: Assembly, before: Particles) -> float:
    """How far the middle has gone down the slope, in mean radii."""
    return float(bed.mass @ bed.position[:, 0] - before.mass @ before.position[:, 0]) / bed.mass.sum() / 0.925


def run(bed: Assembly, time: float) -> Assembly:
    while bed.time < time:
        bed.step()
    return bed


@pytest.fixture(scope="module")
def tilted(layer) -> dict[str, list[tuple[float, float, float]]]:
    """Way, slope and mean speed after 10 and 15 sqrt(r/g), by what shakes the layer."""
    down = Field.constant(TILTED)
    runs = {
        "nothing": Assembly(layer, LAW, BOX, down),
        "too little": shaken(layer, SPEED / 200.0, 1e9, TILTED),
        "for ever": shaken(layer, SPEED, 1e9, TILTED),
        "for a while": shaken(layer, SPEED, 1.0, TILTED),
    }
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in runs}
    for name, bed in runs.items():
        for time in (10.0, 15.0):
            run(bed, time)
            rms = float(np.sqrt(np.mean(np.sum(bed.velocity**2, axis=1))))
            found[name].append((way(bed, layer), slope(bed), rms))
    return found


def test_a_tilted_layer_stands_without_vibration_and_below_its_threshold(tilted):
    """p_vib of 0.014 against a mean of 0.6 that bears."""
    for name in ("nothing", "too little"):
        gone, angle, speed = tilted[name][1]
        assert 0.0 < gone < 0.25 and angle > 15.0 and speed < 0.01, (name, gone, angle, speed)


def test_it_flows_while_it_shakes(tilted):
    """Ten times as far as without, of the way to the level: the floor keeps its friction."""
    gone, angle, _ = tilted["for ever"][1]
    level = math.tan(TILT) * LONG**2 / (12.0 * 10.0)  # of ten radii in depth
    assert 0.7 * level < gone < level and angle < 14.0
    assert gone > 8.0 * tilted["nothing"][1][0]


def test_it_stands_again_when_the_vibration_has_died_away(tilted):
    """p_vib falls below the pressure at half the depth after 2 decay times: half of the way is gone."""
    (before, _, _), (gone, angle, speed) = tilted["for a while"]
    assert 0.5 < gone < 1.0 and 9.0 < angle < 14.0
    assert gone - before < 0.02 and speed < 0.01


# ---------------------------------------------------------------- files
def test_saved_between_two_looks_and_restored_it_goes_on_to_the_last_bit(layer):
    def made() -> Assembly:
        return shaken(layer, SPEED * np.linspace(0.0, 1.0, len(layer)), 2.0, TILTED)

    bed = made()
    for _ in range(1003):
        bed.step()
    assert bed.steps % shaking.EVERY != 0 and np.ptp(bed.bearing) > 0.5
    kept = {name: np.copy(value) if isinstance(value, np.ndarray) else value for name, value in bed.saved().items()}
    again = made()
    again.restore(kept)
    for _ in range(304):
        bed.step()
        again.step()
    assert bed.builds == again.builds
    for name, value in bed.saved().items():
        assert np.array_equal(value, getattr(again, name)), name


def test_a_snapshot_holds_the_vibration_of_its_own_time(layer, tmp_path):
    bed = shaken(layer, SPEED, 2.0)
    for _ in range(7):
        bed.step()
    snapshot.write(bed.particles({"time": bed.time}), tmp_path / "one.vtkhdf")
    held = snapshot.read(tmp_path / "one.vtkhdf")
    np.testing.assert_allclose(held.vibration, SPEED * math.exp(-bed.time / 2.0), rtol=1e-13)


def test_grains_begin_with_the_vibration_of_their_materials():
    decay = {"ice": {"decay_time_s": 3.0, "sound_m_s": 1500.0}}
    some = grains([[0.0, 0, 0], [5.0, 0, 0]], material=[1, 0], vibration=[3.0, 0.0])
    some.attributes |= {"materials": ["water", "ice"], "block_model": decay}
    taken = shaking.of_start(some)
    assert taken is not None
    assert taken.decay_time.tolist() == [math.inf, 3.0] and taken.sound.tolist() == [0.0, 1500.0]
    some.attributes["block_model"] = {}
    with pytest.raises(InputError, match="no decay time of ice"):
        shaking.of_start(some)
    some["vibration"][:] = 0.0
    assert shaking.of_start(some) is None
    assert shaking.of_start(grains([[0.0, 0, 0]])) is None
