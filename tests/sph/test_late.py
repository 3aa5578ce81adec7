"""The late stage with a low sound speed: what the switch keeps, and craters that do not depend on when it comes."""

import json
import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.optimize import brentq

from fixtures import columns
from matter.case.body import Impact, Layer, Projectile, Target
from matter.files import snapshot
from sph import cost_prediction, stage
from sph.bodies.particle_cloud import Cloud
from sph.bodies.target import Body
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.porosity import dispatch
from sph.stepping import late, timestep
from tests.sph.stage_runs import stopped

WEAK = Choice(
    strength="drucker_prager",
    damage="none",
    drucker_prager={"cohesion": "2 kPa", "friction_angle": "20 deg"},
    tension={"cut": "1 kPa"},
)
SPACING = 0.016


def settings(at, sound_speed="100 m/s", **changes):
    """2 cm of basalt at 2 km/s into weak ground: some 4,400 particles."""
    values = dict(
        target=Target(layers=(Layer(name="ground", material="basalt", thickness=0.4),), shape="half_space", width=0.8),
        impact=Impact(
            speed=2000.0, angle_from_vertical=0.0, projectile=Projectile(material="basalt", radius=0.012),
            expected_transient_diameter=0.3
        ),
        spacing_at_impact=SPACING, spacing_far=0.05, fine_radius=0.14, growth=0.2, contact_refinement=1.0,
        contact_radius=0.05, projectile_particles=8,
        first_step=1e-7, end_time=0.03, snapshot_interval=0.005, history_interval=0.0025, edge_width=0.12,
        materials={"basalt": WEAK},
        late=None if at is None else {"at": at, "sound_speed": sound_speed},
    )  # fmt: skip
    return stage.Settings(**(values | changes))


def crater_radius(folder):
    """Radius [m] of the circle as large as the part of the surface that has gone: ring by ring the share of its
    particles that moved by two spacings."""
    first, last = snapshot.read(snapshot.series(folder)[0]), snapshot.read(folder / "last.vtkhdf")
    top = (first.layer >= 0) & (first.position[:, 2] > -1.3 * SPACING)
    gone = np.linalg.norm(last.position - first.position, axis=1) > 2.0 * SPACING
    r = np.hypot(*first.position[:, :2].T)
    rings = [(a, top & (r >= a) & (r < a + 0.01)) for a in np.arange(0.0, 0.3, 0.01)]
    return math.sqrt(sum(((a + 0.01) ** 2 - a**2) * gone[ring].mean() for a, ring in rings if ring.any()))


def ball(material="basalt", **changes):
    """A disordered ball under some pressure and shear, evaluated."""
    materials = collect((material,), {material: Choice(**changes)} if changes else {})
    rng = np.random.default_rng(4)
    place = np.stack(np.meshgrid(*(np.arange(-4, 5),) * 3, indexing="ij"), axis=-1).reshape(-1, 3) + rng.uniform(
        -0.1, 0.1, (9**3, 3)
    )
    n, rho = len(place), float(materials.bulk_density[0])
    body = Body(
        place, np.full(n, rho), rho * rng.uniform(0.999, 1.002, n), np.full(n, 2.3), np.zeros(n, np.int32), np.zeros(n,
        np.int32),
        np.full(n, materials.rows.alpha0[0]),
    )  # fmt: skip
    i = columns.integrator(Cloud.from_bodies(body), materials, 5.0)
    i.switches.damage = False
    i.cloud.stress[:] = rng.normal(size=(n, 5)) * 1e6
    i.cloud.velocity[:] = rng.normal(size=(n, 3))
    i.start()
    return i


def energy(i):
    v = i.cloud.velocity
    return float(i.cloud.mass @ (0.5 * np.einsum("ij,ij->i", v, v) + i.cloud.specific_energy))


def borne(i, P, sound_speed):
    """The part of the pressures ``P`` that the particles' own motion holds up in the medium of ``sound_speed``."""
    up = np.maximum(P, 1e-300)
    return np.where(
        P > 0.0, np.minimum(i.cloud.density * sound_speed * np.linalg.norm(i.cloud.velocity, axis=1) / up, 1), 0.0
    )


def test_the_switch_scales_stress_and_keeps_strain_weight_motion_and_energy():
    i = ball()
    P, S, wave, total = (
        i.forces.evaluated.pressure.copy(),
        i.cloud.stress.copy(),
        i.forces.evaluated.wave.copy(),
        energy(i),
    )
    weight = np.where(np.arange(len(P)) % 2 == 0, 2e6, 0.0)
    ratio = 2700.0 * 300.0**2 / 26.7e9
    before, after = i.enter_late_stage(300.0, 0.0, weight)
    b = borne(i, P, 300.0)
    assert 0.005 < np.median(b[P > 0.0]) < 0.5
    held = np.maximum(np.minimum(weight, np.maximum(P, 0.0)), b * P)
    pressed = P > 0.0
    assert pressed.sum() > 300 and i.forces.evaluated.pressure[pressed] == pytest.approx(
        (held + ratio * (P - held))[pressed], rel=1e-6
    )
    assert np.abs(i.forces.evaluated.pressure[~pressed]).max() < 2.0 * ratio * np.abs(P).max()
    assert i.cloud.stress == pytest.approx((b + (1.0 - b) * ratio)[:, None] * S, rel=1e-12)
    assert i.forces.evaluated.wave == pytest.approx(wave * math.sqrt(ratio), rel=5e-3)  # Poisson's ratio stays
    assert energy(i) == total and after < before
    i.step_limit.dt = 0.0
    assert i.next_step(1e9) > 5.0 * i.forces.numerics.courant * 0.5 * 2.3 / wave.max() / 2.2


def test_a_second_switch_goes_from_the_first_medium_to_a_softer_one():
    """Without weight, at rest, two switches in a row are one; what carries weight carries it through the second."""
    twice, once, weighed = still = ball(), ball(), ball()
    none = np.zeros(len(twice.cloud))
    for i in still:
        i.cloud.velocity[:] = 0.0
    twice.enter_late_stage(300.0, 0.0, none)
    P, S, total = twice.forces.evaluated.pressure.copy(), twice.cloud.stress.copy(), energy(twice)
    before, after = twice.enter_late_stage(30.0, 0.0, none)
    once.enter_late_stage(30.0, 0.0, none)
    assert twice.cloud.late_density == pytest.approx(once.cloud.late_density, rel=1e-12)
    assert twice.cloud.stress == pytest.approx(once.cloud.stress, rel=1e-12)
    assert twice.forces.evaluated.pressure == pytest.approx(
        once.forces.evaluated.pressure, rel=1e-6, abs=1e-9 * np.abs(P).max()
    )
    assert energy(twice) == total and 0.0 < after < before
    weighed.enter_late_stage(300.0, 0.0, none)
    weighed.enter_late_stage(30.0, 0.0, np.full(len(P), 100.0))
    held = np.minimum(100.0, np.maximum(P, 0.0))
    pressed = P > 0.0
    assert weighed.forces.evaluated.pressure[pressed] == pytest.approx((held + 0.01 * (P - held))[pressed], rel=1e-6)
    assert weighed.cloud.stress == pytest.approx(0.01 * S, rel=1e-12)


def test_fine_particles_are_softer_at_both_switches():
    """An eighth of the mass: half the sound speed, a quarter of pressure, stress and shear wave's square; a millionth:
    no less than that. What has the mass of the crater's particles is as without them, and energy is kept."""
    rough, fine = ball(), ball()
    kind = fine.cloud.identity % 3
    for i in (rough, fine):
        i.cloud.mass *= np.choose(kind, (1.0, 0.125, 1e-6))
        i.cloud.velocity[:] = 0.0
    spacing = float((fine.cloud.mass.max() / fine.materials.bulk_density[0]) ** (1.0 / 3.0))
    total, none = energy(fine), np.zeros(len(kind))
    own = np.where(kind == 0, 1.0, 0.25)
    for speed in (300.0, 30.0):
        before = rough.enter_late_stage(speed, 0.0, none), fine.enter_late_stage(speed, spacing, none)
        one, other = rough.forces.evaluated, fine.forces.evaluated
        assert other.sound == pytest.approx(np.sqrt(own) * speed, rel=1e-12)
        assert other.wave == pytest.approx(np.sqrt(own) * one.wave, rel=5e-3)
        assert other.pressure == pytest.approx(own * one.pressure, rel=1e-6, abs=1e-9 * np.abs(one.pressure).max())
        assert fine.cloud.stress == pytest.approx(own[:, None] * rough.cloud.stress, rel=1e-12)
        assert energy(fine) == total and 0.0 < before[1][1] < before[0][1]
    limits = []
    for i in (rough, fine):
        linear = i.damping._replace(beta=0.0)
        limits.append(timestep.steps(i.cloud, i.forces.rates, i.forces.evaluated, linear, 0.5, timestep.MONAGHAN)[0])
    assert limits[1] / limits[0] == pytest.approx(1.0 / np.sqrt(own), rel=5e-3)


def test_total_energy_is_kept_after_the_switch():
    i = ball()
    i.enter_late_stage(300.0, 0.0, np.zeros(len(i.cloud)))
    begun, kinetic = energy(i), energy(i) - i.cloud.mass @ i.cloud.specific_energy
    for _ in range(40):
        i.step(i.next_step(1e9))
    assert abs(energy(i) - begun) < 2e-3 * kinetic


def test_pores_close_under_the_pressure_that_closed_them_before():
    """A porous ball that is squeezed: below that pressure they stay as they are, beyond it they lie on their curve."""
    i = ball(porosity="p_alpha", p_alpha={"alpha0": 1.5}, crush_quadratic={"Pe": "0.1 MPa", "Ps": "10 MPa"})
    i.enter_late_stage(100.0, 0.0, np.zeros(len(i.cloud)))
    rest = i.cloud.distention.copy()
    assert rest.max() > 1.3 and np.array_equal(i.forces.evaluated.distention, rest)
    assert i.forces.evaluated.sound == pytest.approx(100.0)
    i.cloud.velocity[:] = -20.0 * i.cloud.position
    before = dict(zip(i.cloud.identity, rest))
    for _ in range(10):
        i.step(i.next_step(1e9))
    c, P = i.cloud, i.forces.evaluated.pressure
    rest = np.array([before[name] for name in c.identity])
    gave, curve = c.distention < rest, 1.0 + 0.5 * ((10e6 - P) / 9.9e6) ** 2
    assert gave.any() and P.max() > 1e5
    inside = c.neighbours > 45.0  # the others keep a part of their pressure
    assert c.distention[gave & inside] == pytest.approx(curve[gave & inside], rel=1e-9)
    assert (c.distention <= np.where(P > 1e5, curve, rest) + 1e-9)[inside].all()


@pytest.mark.parametrize("sound_speed", [1300.0, 650.0])
def test_a_piston_closes_the_pores_of_the_late_medium_at_the_speed_of_its_jump_conditions(sound_speed):
    """Sand under a piston of 5 m/s: mass and momentum through the front with P = c^2 (rho - solid / alpha) on the
    crush curve. A softer medium has the slower wave: at 1.3 km/s 328 m/s, by the materials' own laws 343."""
    sand = Choice(
        porosity="strain_alpha",
        strain_alpha={"alpha0": 1.8, "eps_e": 0.0, "kappa": 0.988, "alpha_x": 1.29},
    )
    materials, piston = collect(("granite",), {"granite": sand}), 5.0
    rows = materials.rows
    law = (rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0], rows.eos[0], rows.eos_row[0])
    rest = float(materials.bulk_density[0])

    def miss(U):
        P = rest * U * piston
        return rest * U / (U - piston) - P / sound_speed**2 - rows.rho0[0] / dispatch.at_pressure(*law, P)[1]

    wanted = brentq(miss, 2.0 * piston, 2000.0)
    column = columns.Column(materials, 60, piston=piston)
    i = column.integrator
    i.start()
    i.enter_late_stage(sound_speed, 0.0, np.zeros(len(column.cloud)))
    place = []
    for until in (0.5, 0.75):
        column.run(until * column.height / wanted)
        place.append(columns.front(column, 0.5 * piston))
    assert np.diff(place)[0] == pytest.approx(0.25 * column.height, rel=0.03)
    behind = slice(10, 30)
    assert column.layers(i.forces.evaluated.pressure)[behind] == pytest.approx(rest * wanted * piston, rel=0.03)
    alpha = dispatch.at_pressure(*law, rest * wanted * piston)[1]
    assert 1.8 - column.layers(column.cloud.distention)[behind] == pytest.approx(1.8 - alpha, rel=0.05)


@pytest.mark.parametrize("sound_speed", [None, 1000.0, 10.0])
def test_rock_breaks_under_the_stress_that_broke_it_before(sound_speed):
    """Half of what opens the weakest flaw leaves a ball whole, twice as much breaks it, at any sound speed."""
    i = ball()
    c, rows, weakest = i.cloud, i.materials.rows, 2e-4
    c.flaw_first[:], c.flaw_last[:], c.flaw_strain = 0, 1, np.array([weakest], dtype=np.float32)
    i.switches.damage = True
    if sound_speed is not None:
        i.enter_late_stage(sound_speed, 0.0, np.zeros(len(c)))
    pressure = i.forces.evaluated.pressure
    for times, breaks in ((0.5, False), (2.0, True)):
        c.stress[:] = 0.0
        tension = times * weakest * rows.young[0]
        c.stress[:, 0] = tension + pressure
        c.stress[:, 3] = -0.5 * c.stress[:, 0]
        i.evaluate()
        found = i.forces.evaluated.damage_rate[pressure > 0.0] > 0.0
        assert len(found) > 100 and (found == breaks).all()


def test_a_gas_and_softer_matter_keep_their_moduli():
    materials = collect(
        ("basalt", "ice"),
        {"ice": Choice(eos="ideal_gas", strength="none", damage="none", ideal_gas={"rho0": "1 kg/m^3", "gamma": 1.4})},
    )
    late_medium = late.late_medium(materials, 100.0, 0.0)
    assert late.late_medium(materials, 100.0, 1.0).full.tolist() == [2700.0, 0.0]
    assert late_medium.ratio[1] == 1.0 and late_medium.ratio[0] == pytest.approx(2700e4 / 26.7e9)
    stiff = late.late_medium(materials, 1e5, 0.0)
    assert stiff.ratio[0] == 1.0 and np.array_equal(stiff.rows.shear, materials.rows.shear)


def test_the_prediction_knows_the_longer_steps():
    """Those of the crater's particles, since the ball's finer ones are softer, by the late sound speed, its shear wave
    and alpha."""
    rare = {"history_interval": 1.0}
    chosen, short = settings("1 ms", end_time=0.3, **rare), settings("1 ms", end_time=0.010, **rare)
    finest = (4.0 / 3.0 * math.pi * 0.012**3 / cost_prediction.projectile_particles(chosen)) ** (1.0 / 3.0)
    wave = 100.0 * math.sqrt(1.0 + 4.0 / 3.0 * 22.7 / 26.7)
    assert 0.5 * SPACING < finest < SPACING
    step = chosen.courant * 0.5 * chosen.support * SPACING / ((1.0 + 0.45 * 0.62 * 0.1) * wave)
    assert cost_prediction.steps(chosen)[1] - cost_prediction.steps(short)[1] == pytest.approx(0.29 / step, rel=1e-6)
    often = cost_prediction.steps(settings("1 ms", end_time=0.3, history_interval=2.5e-3))[1]
    assert often - cost_prediction.steps(chosen)[1] == 119.0  # rows from 1 ms on, each of which cuts a step
    assert stage.predict(settings(None, end_time=0.3))["wall_s"] > 50.0 * stage.predict(chosen)["wall_s"]


def test_still_longer_steps_are_predicted_too():
    """From 10 ms on at a tenth of the sound speed: 290 ms cost as much as 29 ms did, and progress counts them so."""
    slower = {"at": "1 ms", "sound_speed": "100 m/s", "slower": [{"at": "10 ms", "sound_speed": "10 m/s"}]}
    rare = {"history_interval": 1.0}
    whole, slow = settings("1 ms", end_time=0.3, **rare), settings(None, late=slower, end_time=0.3, **rare)
    short = settings("1 ms", end_time=0.010, **rare)
    begun, total = cost_prediction.steps(short)[1], cost_prediction.steps(slow)[1]
    assert total - begun == pytest.approx(0.1 * (cost_prediction.steps(whole)[1] - begun), rel=1e-9)
    done = cost_prediction.work(slow)
    assert done(0.01) == pytest.approx(begun, rel=1e-9) and done(0.3) == pytest.approx(total, rel=1e-9)


def test_a_late_stage_after_the_end_is_refused():
    with pytest.raises(ValidationError, match=r"late\.at must be before end_time"):
        settings("0.03 s")
    with pytest.raises(ValidationError, match=r"late\.slower: every at must be before end_time"):
        settings(
            None, late={"at": "1 ms", "sound_speed": "9 m/s", "slower": [{"at": "0.03 s", "sound_speed": "3 m/s"}]}
        )


def test_the_viscosity_of_the_shock_may_go_alone(tmp_path):
    """Every material keeps its moduli and, for the prediction, its step at rest, without what fast ejecta ask for."""
    chosen = settings(None, late={"viscosity_at": "1 ms"}, end_time=1.5e-3)
    stage.run(chosen, tmp_path, tmp_path)
    report = json.loads((tmp_path / "stage_report.json").read_text())
    assert report["late"] is None and report["late_viscosity"] == {"alpha": 0.1, "beta": 10.0}
    rare = {"history_interval": 1.0, "late": None}
    before, long = (cost_prediction.steps(settings(None, end_time=end, **rare))[1] for end in (1e-3, 0.101))
    rare["late"] = {"viscosity_at": "1 ms"}
    after = cost_prediction.steps(settings(None, end_time=0.101, **rare))[1] - before
    assert after / (long - before) == pytest.approx(1.0 / 1.18, rel=1e-6)


@pytest.mark.parametrize("late", [{}, {"at": "1 ms"}, {"sound_speed": "9 m/s", "viscosity_at": "1 ms"}])
def test_half_a_late_stage_is_refused(late):
    with pytest.raises(ValidationError, match=r"at and sound_speed: give both|at is missing"):
        settings(None, late=late)


@pytest.mark.parametrize(("at", "speed"), [("1 ms", "50 m/s"), ("2 ms", "100 m/s")])
def test_a_part_that_is_not_later_and_slower_is_refused(at, speed):
    with pytest.raises(ValidationError, match="later and slower than the one before"):
        settings(None, late={"at": "1 ms", "sound_speed": "100 m/s", "slower": [{"at": at, "sound_speed": speed}]})


def test_resumed_before_and_after_the_switch_it_is_the_same_to_the_last_bit(tmp_path, monkeypatch):
    slower = [{"at": "100 us", "sound_speed": "200 m/s"}]
    chosen = settings(
        None,
        late={"at": "60 us", "sound_speed": "500 m/s", "slower": slower},
        spacing_at_impact=0.03,
        spacing_far=0.07,
        edge_width=0.2,
        end_time=2.5e-4,
        snapshot_interval=1e-4,
        history_interval=5e-5,
    )
    folders = [tmp_path / name for name in ("whole", "early", "between", "late")]
    for folder, (begin, end) in zip(folders, ((None, None), (4e-5, 6e-5), (8e-5, 1e-4), (1.2e-4, 2.5e-4))):
        folder.mkdir()
        if begin is not None:
            _, time = stopped(monkeypatch, lambda folder=folder: stage.run(chosen, tmp_path, folder), begin)
            assert begin < time < end
        stage.run(chosen, tmp_path, folder)
    whole = snapshot.read(folders[0] / "last.vtkhdf")
    for folder in folders[1:]:
        other = snapshot.read(folder / "last.vtkhdf")
        for name in whole:
            assert np.array_equal(whole[name], other[name]), name
        assert (folder / "history.csv").read_bytes() == (folders[0] / "history.csv").read_bytes()
    report = json.loads((folders[0] / "stage_report.json").read_text())
    (second,) = report["late_slower"]
    assert report["late"]["time_s"] == pytest.approx(6e-5)
    assert second["time_s"] == pytest.approx(1e-4) and second["sound_speed_m_s"] == 200.0
    for one in (report["late"], second):  # what motion holds up is at most the kinetic energy
        assert one["elastic_energy_after_J"] < one["elastic_energy_before_J"] + one["kinetic_energy_J"]
    assert len(snapshot.series(folders[0])) == 4  # at 0, 0.1, 0.2 and 0.25 ms: none of its own at the switch


@pytest.mark.validation
def test_the_crater_does_not_depend_on_the_time_of_the_switch(tmp_path):
    """Radii of switches at 1 and 3 ms within 5 %; it doubles between the later one and the end."""
    radii = []
    for at in ("1 ms", "3 ms"):
        folder = tmp_path / at.replace(" ", "_")
        folder.mkdir()
        stage.run(settings(at), tmp_path, folder)
        report = json.loads((folder / "stage_report.json").read_text())
        assert report["drift_over_projectile"]["energy_J"] < 0.01
        radii.append(crater_radius(folder))
    assert radii[0] == pytest.approx(radii[1], rel=0.05) and 0.15 < radii[1] < 0.25


@pytest.mark.validation
def test_the_crater_does_not_depend_on_a_lower_sound_speed_later_on(tmp_path):
    """100 m/s to the end, or 40 m/s from 5 ms on, when the flow makes some 5 m/s: the radius within 5 %, in fewer than
    two thirds of the late steps."""
    slower = [{"at": "5 ms", "sound_speed": "40 m/s"}]
    radii, steps = [], []
    for name, parts in (("once", []), ("twice", slower)):
        folder = tmp_path / name
        folder.mkdir()
        chosen = settings(None, late={"at": "1 ms", "sound_speed": "100 m/s", "slower": parts})
        stage.run(chosen, tmp_path, folder)
        report = json.loads((folder / "stage_report.json").read_text())
        assert report["drift_over_projectile"]["energy_J"] < 0.01 and len(report["late_slower"]) == len(parts)
        radii.append(crater_radius(folder))
        steps.append(report["steps"] - report["late"]["steps_before"])
    assert radii[0] == pytest.approx(radii[1], rel=0.05) and steps[1] < 0.67 * steps[0]


@pytest.mark.validation
@pytest.mark.xfail(strict=True, reason="501 steps for 419: predicted by the crater's spacing, some come closer")
def test_the_late_steps_of_a_run_are_those_predicted(tmp_path):
    """Within 10 % above and 40 % below; they were when the finest particles set the step."""
    chosen = settings(None, late={"at": "1 ms", "sound_speed": "100 m/s"})
    stage.run(chosen, tmp_path, tmp_path)
    report = json.loads((tmp_path / "stage_report.json").read_text())
    steps = report["steps"] - report["late"]["steps_before"]
    begun = cost_prediction.steps(settings("1 ms", end_time=0.001 + 1e-9))[1]
    assert 0.6 < steps / (cost_prediction.steps(chosen)[1] - begun) < 1.1


def test_snapshots_say_with_which_reference_density_they_were_made(tmp_path):
    """A case's own one, so that nothing after the shock stage takes the library's for it."""
    own = {"basalt": Choice(strength="drucker_prager", damage="none", tillotson={"rho0": "3500 kg/m^3"})}
    stage.run(settings(None, materials=own, end_time=2e-7, snapshot_interval=1e-7), tmp_path, tmp_path)
    first = snapshot.read(tmp_path / "snap_0000.vtkhdf")
    assert first.attributes["reference_densities_kg_m3"] == [3500.0]
    assert np.median(first.density) == pytest.approx(3500.0)
