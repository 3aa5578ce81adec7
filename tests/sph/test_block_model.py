"""Friction lost while blocks shake: decay, growth and yield in closed form, a slope that flows and one that stands, a
stage that closes its energy and resumes."""

import csv
import math

import numpy as np
import pytest

from fixtures import slopes
from matter.case.body import Impact, Layer, Projectile, Target
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import FIELDS
from sph import stage
from sph.bodies.particle_cloud import Cloud
from sph.materials import used_laws
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.stepping import history, state, vibration
from sph.strength import block_model, collins
from tests.sph.stage_runs import finished_run, resumed_run

ROCK = {
    "strength": "collins",
    "predamaged": True,
    "collins": {"cohesion": "10 MPa", "internal_friction": 1.2, "limiting_strength": "3.5 GPa",
                "cohesion_damaged": "10 kPa", "friction_damaged": 0.6},
}  # fmt: skip
SHAKEN = {"gamma_eta": 8e-3, "gamma_beta": 115.0}
"""Granite of iSALE's example of Chicxulub."""


def rock(**values):
    return collect(("basalt",), {"basalt": Choice(**ROCK, block_model=SHAKEN | values)})


def followed(steps, speed, divergence, materials, v_vib=0.0, until=0.0):
    """v_vib after ``steps`` [s] that begin at the time ``until``, of matter that moves at ``speed``."""
    field, velocity = np.array([v_vib]), np.array([[0.0, 0.6 * speed, -0.8 * speed]])
    for dt in steps:
        until += dt
        rows, flow = materials.rows.vibration, np.array([divergence])
        vibration.follow(dt, until, np.zeros(1, dtype=np.int32), rows, velocity, flow, field)
    return float(field[0])


def test_decay_time_and_viscosity_are_those_that_isale_prints():
    """a = 7.2 km: 165.6 s and 288,000 m^2/s of granite, 72 s and 2,880,000 m^2/s of dunite."""
    for gammas, wanted in (((8e-3, 115.0), (165.6, 288_000.0)), ((0.08, 50.0), (72.0, 2_880_000.0))):
        found = rock(gamma_eta=gammas[0], gamma_beta=gammas[1]).hit_by(7200.0).rows.vibration[0]
        assert (found[block_model.DECAY_TIME], found[block_model.VISCOSITY]) == pytest.approx(wanted, rel=1e-12)


def test_vibration_decays_as_exp_minus_t_over_T_whatever_the_steps():
    materials, steps = rock().hit_by(7200.0), np.random.default_rng(1).uniform(0.01, 5.0, 60)
    found = followed(steps, 900.0, 1e-3, materials, v_vib=120.0)
    assert found == pytest.approx(120.0 * math.exp(-steps.sum() / 165.6), rel=1e-12)


def test_vibration_grows_where_a_shock_closes_in_up_to_its_limits():
    """A tenth of the speed, at most 200 m/s, only in compression and only until t_off; a weaker shock adds nothing."""
    materials = rock().hit_by(7200.0)
    assert followed([1.0], 900.0, -1e-3, materials) == pytest.approx(90.0)
    assert followed([1.0], 9000.0, -1e-3, materials) == 200.0
    assert followed([1.0], 900.0, 1e-3, materials) == 0.0
    assert followed([1.0], 900.0, -1e-3, materials, until=14.9) == pytest.approx(90.0)
    assert followed([1.0], 900.0, -1e-3, materials, until=15.1) == 0.0
    assert followed([1.0], 100.0, -1e-3, materials, v_vib=50.0) == pytest.approx(50.0 * math.exp(-1.0 / 165.6))
    assert followed([1.0], 900.0, -1e-3, collect(("basalt",), {"basalt": Choice(**ROCK)})) == 0.0


def yielded(materials, v_vib, rate=0.0, pressure=1e8, damage=1.0):
    """sqrt(J2) of rock in far too large a shear stress, strained at ``rate`` [1/s] along xz, its pressure and
    density."""
    c = Cloud(1)
    c.mass[:], c.support_radius[:], c.neighbours[:] = 1.0, 1.0, 60
    c.density[:] = 2700.0 * (1.0 + pressure / 26.7e9)
    c.distention[:] = c.initial_distention[:] = 1.0
    c.root_damage[:] = damage ** (1.0 / 3.0)
    c.stress[0, 2] = 1e11
    c.strain_rate = np.zeros((1, 6))
    c.strain_rate[0, 2] = 0.5 * rate
    if materials.vibrate:
        c.vibration = np.array([v_vib])
    out = state.Evaluated(1)
    state.evaluate(c, materials.rows, True, False, out)
    return abs(c.stress[0, 2]), out.pressure[0], c.density[0]


C = math.sqrt(26.7e9 / 2700.0)


@pytest.mark.parametrize("v_vib", [0.0, 1.0, 5.0, 11.0, 200.0])
@pytest.mark.parametrize("damage", [1.0, 0.5])
def test_friction_is_that_of_the_pressure_which_the_vibration_leaves(v_vib, damage):
    """Y(P - D^2 rho c v_vib), and never that of a tension: P = 0.1 GPa is carried whole at 11.8 m/s."""
    found, P, rho = yielded(rock().hit_by(7200.0), v_vib, damage=damage)
    p = collins.Parameters(10e6, 1.2, 3.5e9, 10e3, 0.6, 3.4e6)
    left = P - damage**2 * min(P, rho * C * v_vib)
    assert found == pytest.approx(collins.shear_strength(left, 0.0, damage, p), rel=1e-9)
    assert 0.0 <= left <= P and (v_vib < 11.5 or damage < 1.0 or left < 0.1 * P)


def test_what_flows_is_a_bingham_fluid_and_never_stronger_than_the_rock():
    materials, plain = rock().hit_by(7200.0), collect(("basalt",), {"basalt": Choice(**ROCK)})
    still, P, rho = yielded(materials, 5.0)
    g = 0.3 * (0.6 * P - still) / (rho * 288_000.0)
    assert yielded(materials, 5.0, g)[0] == pytest.approx(still + rho * 288_000.0 * g, rel=1e-9)
    assert yielded(materials, 5.0, 1e3 * g)[0] == yielded(plain, 0.0)[0] == yielded(materials, 0.0, g)[0]


def test_compression_alone_is_no_shear():
    assert block_model.viscous(np.array([-0.2, 0.0, 0.0, -0.2, 0.0, -0.2]), 3e3, 1e5) < 1e-6
    rate = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0])
    assert block_model.viscous(rate, 3e3, 1e5) == pytest.approx(math.sqrt(3.0) * 3e3 * 1e5)


@pytest.mark.parametrize(
    "choice, words",
    [
        (Choice(strength="von_mises", block_model=SHAKEN), "'von_mises' has no friction"),
        (Choice(**ROCK, block_model={"gamma_eta": 1e-3}), "gamma_beta is missing"),
        (Choice(**ROCK, block_model=SHAKEN | {"gamma_beta": 0.0}), "gamma_beta: .*greater than 0"),
        (Choice(**ROCK, block_model=SHAKEN | {"t_of": "16 s"}), "t_of: unknown, did you mean 't_off'"),
        (Choice(**ROCK, block_model=SHAKEN | {"v_max": 200.0}), "v_max: the unit is missing"),
    ],
)
def test_bad_values_are_refused(choice, words):
    with pytest.raises(InputError, match=words):
        collect(("basalt",), {"basalt": choice})


def test_a_material_without_the_law_cites_and_carries_none_of_it():
    plain, shaken = (
        collect(("basalt",), {"basalt": Choice(**ROCK, **more)}) for more in ({}, {"block_model": SHAKEN})
    )
    file = used_laws.ROOM / "strength" / "block_model.py"
    assert file in used_laws.idle_sources(plain) and file not in used_laws.idle_sources(shaken)
    assert shaken.vibrate and not plain.vibrate


# ---------------------------------------------------------------- a stage
def settings(**changes):
    """10 m of basalt at 5 km/s into broken rock: some thousand particles."""
    values = dict(
        target=Target(
            layers=(Layer(name="rock", material="basalt", thickness=120.0),), shape="half_space", width=240.0,
            gravity=1.62
        ),
        impact=Impact(
            speed=5000.0, angle_from_vertical=0.0, projectile=Projectile(material="basalt", radius=10.0),
            expected_transient_diameter=100.0
        ),
        spacing_at_impact=9.0, spacing_far=20.0, fine_radius=30.0, growth=0.2, contact_refinement=1.0,
        contact_radius=20.0, symmetry="quarter", end_time=0.06, snapshot_interval=0.02, history_interval=0.01,
        edge_width=30.0, materials={"basalt": Choice(**ROCK, block_model=SHAKEN | {"t_off": "40 ms"})},
    )  # fmt: skip
    return stage.Settings(**(values | changes))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return finished_run(settings(), tmp_path_factory.mktemp("run"))


def rows_of(folder):
    with open(folder / "history.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_vibration_is_shown_in_snapshots_and_ledger_and_takes_part_in_no_balance(finished):
    """After t_off it only decays, everywhere by the same factor; the total energy is kept as without it."""
    first, then, last = (snapshot.read(path) for path in snapshot.series(finished)[1:4])
    assert FIELDS["vibration"].unit == "m/s" and 180.0 < first.vibration.max() <= 200.0
    shaken = (then.vibration > 0.0) & (last.vibration > 0.0)
    assert shaken.sum() > 100
    wanted = math.exp(-0.02 / (115.0 * 10.0 / 5000.0))
    assert last.vibration[shaken] == pytest.approx(wanted * then.vibration[shaken], rel=1e-6)
    rows = rows_of(finished)
    assert float(rows[-1][history.VIBRATION]) == pytest.approx(vibration.energy(last.mass, last.vibration), rel=1e-9)
    total = np.array([float(row["total_J"]) - float(row["outside_energy_J"]) for row in rows])
    hit = 0.5 * 2700.0 * settings().impact.projectile.volume * 5000.0**2
    assert np.abs(total - total[0]).max() < 5e-3 * hit


def test_stopped_and_resumed_run_is_the_same_to_the_last_bit(finished, tmp_path, monkeypatch):
    assert snapshot.read(finished / "last.vtkhdf").vibration.max() > 1.0
    resumed_run(monkeypatch, settings(), tmp_path, 0.03, finished)


def test_other_numerics_are_refused(tmp_path):
    with pytest.raises(InputError, match="block_model needs numerics"):
        stage.run(settings(numerics="monaghan"), tmp_path, tmp_path)


# ---------------------------------------------------------------- a slope
COARSE = pytest.mark.xfail(strict=True, reason="the layers next to the rock hardly move: slopes.viscous, found 0.79")


@pytest.mark.validation
@pytest.mark.parametrize("layers", [pytest.param(14, marks=COARSE), 28])
def test_a_slope_that_stands_flows_as_a_viscous_sheet_while_it_shakes(layers):
    """Sand of 30 deg (it slides from 34.7 deg on) at 25 deg stands; with its pressure carried whole it has the
    transient of a viscous sheet in closed form."""
    assert abs(slopes.slope(math.radians(25.0))) < 0.02
    speed, off = slopes.viscous(math.radians(25.0), layers=layers)
    assert speed == pytest.approx(1.0, abs=0.1) and off < 0.12
