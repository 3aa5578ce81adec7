"""The stage as a whole, at a size of seconds: conservation, resume to the last bit, bad input."""

import csv
import json

import numpy as np
import pytest

from matter.case.body import Layer, Target
from matter.errors import InputError, UnphysicalState
from matter.files import snapshot
from matter.geometry import tree
from sph import stage
from sph.stepping import history, watch
from tests.sph.stage_runs import CALLISTO, IMPACT, finished_run, resumed_run


def settings(**changes):
    """A body of some two thousand particles; damage and pressures that tests ask for are those of ``monaghan``."""
    values = dict(
        numerics="monaghan",
        target=CALLISTO, impact=IMPACT, spacing_at_impact=130e3, spacing_far=300e3, fine_radius=400e3, growth=0.15,
        contact_refinement=1.5,
        relaxation_time=100.0, end_time=60.0, snapshot_interval=30.0, history_interval=10.0,
    )  # fmt: skip
    return stage.Settings(**(values | changes))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return finished_run(settings(), tmp_path_factory.mktemp("run"))


def test_conservation_and_outputs(finished):
    report = json.loads((finished / "stage_report.json").read_text())
    assert report["drift_over_projectile"]["energy_J"] < 0.02
    assert report["drift_over_projectile"]["momentum_kg_m_s"] < 1e-10
    assert report["drift_over_projectile"]["angular_momentum_kg_m2_s"] < 0.01
    target = json.loads((finished / "target.json").read_text())
    assert target["mass_kg"] == pytest.approx(8.4989e22, rel=1e-4)
    assert sum(layer["mass_kg"] for layer in target["layers"]) == pytest.approx(target["mass_kg"], rel=1e-12)
    last, first = snapshot.read(finished / "last.vtkhdf"), snapshot.read(snapshot.series(finished)[0])
    assert len(snapshot.series(finished)) == 3
    assert np.array_equal(last.identity, np.arange(len(last)))
    assert first.attributes["time"] == 0.0 and last.attributes["time"] == 60.0
    assert np.all(first.deviatoric_stress == 0) and np.all(first.damage == 0)
    assert first.mass.sum() == last.mass.sum()
    assert last.peak_pressure.max() > 1e10
    assert last.damage.max() == pytest.approx(1.0, abs=0.01)


def test_the_report_says_how_finely_the_projectile_was_resolved_and_what_it_reached(finished):
    report = json.loads((finished / "stage_report.json").read_text())
    last = snapshot.read(finished / "last.vtkhdf")
    ball = last.layer < 0
    assert report["projectile"]["particles"] == ball.sum()
    volume = 4.0 / 3.0 * np.pi * IMPACT.projectile.radius**3
    assert report["projectile"]["particles_per_radius"] == pytest.approx(
        IMPACT.projectile.radius / (volume / ball.sum()) ** (1 / 3), rel=1e-12
    )
    found = report["peak_pressure"]
    assert (
        max(found["projectile_largest_Pa"], found["target_largest_Pa"])
        == report["peak_pressure_Pa"]
        == last.peak_pressure.max()
    )
    assert found["projectile_largest_Pa"] >= found["projectile_half_Pa"] >= found["projectile_nine_tenths_Pa"] > 0.0
    assert found["planar_speed_m_s"] == pytest.approx(IMPACT.speed * np.cos(IMPACT.angle_from_vertical), rel=1e-12)
    assert 1e9 < found["planar_limit_Pa"] < 2e11 and report["edges"] is None
    said = last.attributes["measuring"]
    target = json.loads((finished / "target.json").read_text())
    assert said["datum"]["radius_m"] == target["radius_m"] and said["gravity_m_s2"] == target["surface_gravity_m_s2"]


@pytest.mark.parametrize(("at", "phase"), [(60.0, "relax"), (130.0, "impact")])
def test_stopped_and_resumed_run_is_the_same_to_the_last_bit(finished, tmp_path, at, phase, monkeypatch):
    assert resumed_run(monkeypatch, settings(), tmp_path, at, finished) == phase


def test_control_run_has_no_projectile(tmp_path):
    stage.run(settings(control=True, end_time=20.0, relaxation_time=20.0, snapshot_interval=20.0), tmp_path, tmp_path)
    assert (snapshot.read(tmp_path / "last.vtkhdf").layer >= 0).all()


def test_literal_start_is_uniform(tmp_path):
    literal = CALLISTO.model_copy(update={"start": "literal"})
    stage.run(settings(target=literal, end_time=1.0, snapshot_interval=1.0, history_interval=1.0), tmp_path, tmp_path)
    first = snapshot.read(tmp_path / "snap_0000.vtkhdf")
    assert set(np.unique(first.density[first.layer >= 0])) == {2700.0, 998.0, 917.0}
    assert first.attributes["target_radius_m"] == pytest.approx(2142e3)


def test_too_coarse_a_layer_is_named(tmp_path):
    thin = Target(
        layers=(
            Layer(name="core", material="basalt", thickness=2000e3),
            Layer(name="crust", material="ice", thickness=1.0),
        )
    )
    with pytest.raises(InputError, match="crust"):
        stage.run(
            settings(target=thin, spacing_at_impact=300e3, spacing_far=300e3, contact_refinement=1.0),
            tmp_path,
            tmp_path,
        )


@pytest.mark.parametrize("limit", [("GAIN", -1e9), ("COLLAPSE", 2.0)])
def test_a_run_that_goes_wrong_is_stopped_on_its_way(tmp_path, monkeypatch, limit):
    """Limits that every run breaks: both are looked at, and what was written until then is kept."""
    monkeypatch.setattr(watch, *limit)
    monkeypatch.setattr(watch, "IN_A_ROW", 3)
    with pytest.raises(UnphysicalState, match=r"unstable: at 10 s|the step has fallen to"):
        stage.run(settings(relaxation_time=20.0), tmp_path, tmp_path)
    assert (tmp_path / "snap_0000.vtkhdf").is_file() and not (tmp_path / "last.vtkhdf").exists()


def test_the_energy_of_many_particles_is_checked_over_all_pairs(finished, tmp_path, monkeypatch):
    """The rows of a run that takes them from a tree are off; the report goes by what all pairs say."""
    exact = rows_of(finished)
    monkeypatch.setattr(history, "DIRECT", 100)
    out = finished_run(settings(), tmp_path)
    report, rows = json.loads((out / "stage_report.json").read_text()), rows_of(out)
    assert json.loads((finished / "stage_report.json").read_text())["energy_check"] is None
    checked = report["energy_check"]
    assert checked["times_s"][0] == 0.0 and checked["times_s"][-1] == 60.0 and len(checked["times_s"]) >= 2
    known = [float(exact[time]["total_J"]) - float(exact[0.0]["total_J"]) for time in checked["times_s"]]
    size = abs(float(exact[0.0]["gravitational_J"]))
    assert checked["change_J"] == pytest.approx(known, abs=1e-12 * size)
    by_rows = max(abs(float(row["total_J"]) - float(rows[0.0]["total_J"])) for row in rows.values())
    assert abs(by_rows - checked["largest_J"]) > 1e-8 * size
    assert report["drift"]["energy_J"] == checked["largest_J"]


def test_a_wide_tree_is_taken_where_the_bodys_own_energy_counts_little(monkeypatch):
    """The sum over all pairs is what a body takes whose own energy is a tenth of the projectile's, and no less."""
    place = np.random.default_rng(5).normal(size=(300, 3))
    mass, softening = np.full(300, 1e9), np.full(300, 0.1)
    exact = tree.potential_energy(place, mass, softening)
    beside = -exact / history.WEAK
    assert history.gravitational_energy(place, mass, softening, 0.9 * beside) == exact
    near = history.gravitational_energy(place, mass, softening, 1.1 * beside)
    assert near != exact and abs(near - exact) < 2e-5 * 1.1 * beside
    monkeypatch.setattr(history, "DIRECT", 200)
    fine = history.gravitational_energy(place, mass, softening, 0.9 * beside)
    assert fine not in (exact, near) and fine == pytest.approx(exact, rel=1e-5)


@pytest.mark.parametrize("shape", ["ball", "shell", "rod", "two", "debris"])
def test_no_body_has_less_gravity_than_an_even_ball_of_its_moment(monkeypatch, shape):
    """So that a heavy body's own energy is summed once, finely, and not by a wide tree before."""
    rng = np.random.default_rng(3)
    place = rng.normal(size=(4000, 3))
    place *= (rng.uniform(size=4000) ** (1 / 3) / np.linalg.norm(place, axis=1))[:, None]
    if shape == "shell":
        place /= np.linalg.norm(place, axis=1)[:, None]
    elif shape == "rod":
        place *= (0.1, 0.1, 1.0)
    elif shape == "two":
        place[:2000] += (6.0, 0.0, 0.0)
    elif shape == "debris":
        place[:20] *= 300.0
    mass, softening = np.full(4000, 1e9), np.full(4000, 1e-6)
    own = abs(tree.potential_energy(place, mass, softening, 0.0))
    least = history._at_least(place, mass)
    assert least < 1.01 * own and (shape != "ball" or least > 0.98 * own)
    made = []
    sums = tree.potential_energy
    monkeypatch.setattr(tree, "potential_energy", lambda *a: made.append(a[3]) or sums(*a))
    history.gravitational_energy(place, mass, softening, 0.9 * least / history.WEAK)
    assert made == [0.0]
    history.gravitational_energy(place, mass, softening, 1.1 * own / history.WEAK)
    assert made == [0.0, history.WIDE]


def rows_of(out):
    """Rows of the history by their time."""
    with open(out / "history.csv", newline="") as file:
        return {float(row["time_s"]): row for row in csv.DictReader(file)}
