"""The stage with a porous, frictional shell: balance, conservation, the crush curve, resume to the last bit, and
mistakes in a case."""

import json
import math

import numpy as np
import pytest
from pydantic import ValidationError

from matter.files import snapshot
from sph import stage
from sph.bodies import target
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.porosity import p_alpha
from tests.sph.stage_runs import CALLISTO, IMPACT, finished_run, resumed_run

SHELL = Choice(
    strength="drucker_prager",
    porosity="p_alpha",
    p_alpha={"alpha0": 1.3, "elastic_speed": "2 km/s"},
    crush_quadratic={"Pe": "20 MPa", "Ps": "500 MPa"},
)


def settings(**changes):
    values = dict(
        target=CALLISTO, impact=IMPACT, spacing_at_impact=150e3, spacing_far=320e3, fine_radius=300e3, growth=0.2,
        contact_refinement=1.5,
        relaxation_time=60.0, end_time=30.0, snapshot_interval=15.0, history_interval=5.0, materials={"ice": SHELL},
    )  # fmt: skip
    return stage.Settings(**(values | changes))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return finished_run(settings(), tmp_path_factory.mktemp("porous"))


def test_the_shell_starts_in_balance_compacted_by_its_own_weight():
    materials = collect(CALLISTO.materials, {"ice": SHELL})
    profile = target.hydrostatic(CALLISTO, materials=materials)
    shell = profile.layer == 2
    assert profile.distention[~shell].max() == 1.0
    assert profile.distention[shell][-1] == pytest.approx(1.3, abs=1e-3) and profile.distention[shell][0] < 1.25
    assert np.all(np.diff(profile.distention[shell]) >= -1e-12)
    pores = p_alpha.Pores(*materials.rows.pores[2])
    deep = np.flatnonzero(shell & (profile.pressure > 20e6))
    assert len(deep) > 100
    for i in deep[::20]:
        alpha = p_alpha.on_curve(profile.pressure[i], materials.rows.crush[2], materials.rows.crush_row[2], pores)
        solid = materials.rho0[2] * (1 + alpha * profile.pressure[i] / 9.47e9)  # to first order: 1 % of compression
        assert profile.density[i] == pytest.approx(solid / alpha, rel=1e-3)
    uniform = 917 / 1.3 * 4 / 3 * math.pi * (2142e3**3 - 1992e3**3)
    assert profile.mass[-1] - profile.mass[np.flatnonzero(shell)[0] - 1] == pytest.approx(uniform, rel=1e-9)


def test_conservation_and_the_crush_curve(finished):
    report = json.loads((finished / "stage_report.json").read_text())
    assert report["drift_over_projectile"]["energy_J"] < 0.02
    assert report["drift_over_projectile"]["momentum_kg_m_s"] < 1e-10
    rows = collect(("ice",), {"ice": SHELL}).rows
    pores = p_alpha.Pores(*rows.pores[0])
    first, last = snapshot.read(finished / "snap_0000.vtkhdf"), snapshot.read(finished / "last.vtkhdf")
    assert np.all(first.damage == 0.0)  # what its weight has closed counts as intact
    ice = (last.layer == 2) | (last.layer < 0)
    assert last.distention[~ice].max() == 1.0 and last.distention[ice].min() == 1.0
    crushed = 0
    for alpha, P in zip(last.distention[ice], last.pressure[ice]):
        if P > 20e6:
            limit = p_alpha.on_curve(P, rows.crush[0], rows.crush_row[0], pores)
            assert alpha <= limit + 1e-9
            crushed += alpha < 1.29
    assert crushed > 20
    assert (last.distention - first.distention).max() < 0.02  # pores open elastically only


def test_stopped_and_resumed_run_is_the_same_to_the_last_bit(finished, tmp_path, monkeypatch):
    assert resumed_run(monkeypatch, settings(), tmp_path, 72, finished) == "impact"


def test_predamaged_target_is_broken_from_the_start(tmp_path):
    choice = Choice(predamaged=True)
    stage.run(
        settings(
            materials={"ice": choice}, end_time=1.0, snapshot_interval=1.0, history_interval=1.0, relaxation_time=5.0
        ),
        tmp_path,
        tmp_path,
    )
    first = snapshot.read(tmp_path / "snap_0000.vtkhdf")
    ice = (first.layer == 2) | (first.layer < 0)
    assert np.all(first.damage[ice] == 1.0) and np.all(first.damage[~ice] == 0.0)


@pytest.mark.parametrize(
    "materials,message",
    [
        ({"iron": Choice()}, "material 'iron' is not used in this run"),
        ({"ice": Choice(porosity="p_alpha", crush_two_power={"Pe": "1 MPa"})}, "alpha_e is missing"),
        ({"ice": Choice(porosity="p_alpha", crush_quadratic={"Ps": "1 kPa"})}, "Ps must be above Pe"),
    ],
)
def test_mistakes_are_found_before_anything_runs(materials, message):
    with pytest.raises(ValidationError, match=message):
        settings(materials=materials)
