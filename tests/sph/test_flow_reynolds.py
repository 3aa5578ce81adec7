"""The Reynolds number of a flow whose radius, speed, spacing and sound speed are known."""

import json

import numpy as np
import pytest

from matter.files import snapshot
from sph import stage
from sph.stepping import flow_reynolds
from sph.stepping.late import Settings as Late
from tests.sph.test_late import settings

SPACING, HOLE, SPEED, C, ALPHA = 0.06, 0.5, 0.14, 3145.0, 2.0


def ground(hole=HOLE, pole=0.0):
    """A half-space of 1,230 kg/m^3 with a half-spherical hole, a flow that falls with the square of the distance, a
    few particles that fly in the hole."""
    edge = np.arange(-2.0, 2.0, SPACING) + 0.5 * SPACING
    place = np.stack(np.meshgrid(edge, edge, edge[edge < 0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    place += np.random.default_rng(2).normal(0.0, 0.05 * SPACING, place.shape)
    r = np.linalg.norm(place, axis=1)
    place = place[r > hole]
    dust = np.random.default_rng(1).uniform(-0.2, -0.05, (5, 3))
    place = np.concatenate([dust, place]) if hole > 0.0 else place
    r = np.linalg.norm(place, axis=1)[:, None]
    velocity = SPEED * (max(hole, 0.1) / r) ** 2 * place / r
    n = len(place)
    rho = np.full(n, 1230.0)
    return dict(
        position=place + [0.0, 0.0, pole], velocity=velocity, mass=rho * SPACING**3, half_length=np.full(n, SPACING),
        sound=np.full(n, C), fraction=1.0,
        density=rho, rest_density=rho, alpha=ALPHA, radius=pole or None,
    )  # fmt: skip


def test_of_a_known_flow():
    found = flow_reynolds.measure(**ground())
    # rms of v0 (R/r)^2 between R and 2 R, by volume: v0 sqrt(3/7 (1 - 1/2))
    speed = SPEED * np.sqrt(3.0 * (1.0 - 0.5) / 7.0)
    assert found["radius_m"] == pytest.approx(HOLE, rel=0.03)
    assert found["speed_m_s"] == pytest.approx(speed, rel=0.05)
    assert found["reynolds"] == pytest.approx(20.0 * speed * HOLE / (ALPHA * C * SPACING), rel=0.08)
    assert found["reynolds"] < 0.003  # the figure of the shot into Ryugu


def test_it_grows_as_viscosity_falls_and_with_a_switch():
    whole = flow_reynolds.measure(**ground())["reynolds"]
    assert flow_reynolds.measure(**ground() | {"alpha": 0.5 * ALPHA})["reynolds"] == pytest.approx(2.0 * whole)
    assert flow_reynolds.measure(**ground() | {"fraction": 0.05})["reynolds"] == pytest.approx(20.0 * whole)
    assert flow_reynolds.measure(**ground() | {"alpha": 0.0})["reynolds"] is None


def test_at_the_pole_of_a_body_far_larger_than_the_crater_it_is_that_of_flat_ground():
    flat, round_ = flow_reynolds.measure(**ground()), flow_reynolds.measure(**ground(pole=1e4))
    assert round_["reynolds"] == pytest.approx(flat["reynolds"], rel=1e-3)


def test_ground_without_a_crater_has_none():
    assert flow_reynolds.measure(**ground(hole=0.0)) is None


def test_compacted_matter_leaves_a_hole_and_expanded_matter_fills_none():
    loose = ground()
    compact = flow_reynolds.measure(**loose | {"density": 2.0 * loose["density"]})
    thin = flow_reynolds.measure(**loose | {"density": 0.5 * loose["density"]})
    assert compact is None or compact["radius_m"] > 1.2 * HOLE
    assert thin["radius_m"] == pytest.approx(HOLE, rel=0.03)


def row(time, number):
    return {"time_s": time, "reynolds": number}


def test_warnings():
    assert flow_reynolds.warnings([row(1.0, 11.0), row(2.0, None)]) == [] and flow_reynolds.warnings([]) == []
    early = flow_reynolds.warnings([row(0.01, 0.003), row(2.0, 40.0)])
    assert len(early) == 1 and "0.003 at 0.01 s" in early[0] and "1 of 2" in early[0]
    assert "at the end (Re = 2.5 at 2 s)" in flow_reynolds.warnings([row(0.01, 0.003), row(2.0, 2.5)])[1]


@pytest.mark.validation
@pytest.mark.parametrize("numerics,first,low", [("monaghan", 2.0, 0.2), ("reconstructed", 0.3, 0.02)])
def test_viscosity_of_the_late_stage_begins_on_time_and_is_reported(tmp_path, numerics, first, low):
    """The low viscosity from 0.5 ms on, the low sound speed from 1 ms on, in steps, report and snapshots; smooth flow
    feels a tenth of a reconstructed one."""
    chosen = settings(None, numerics=numerics, end_time=2e-3, snapshot_interval=5e-4, history_interval=5e-4,
    late=Late.model_validate(
        {"at": "1 ms", "sound_speed": "100 m/s", "viscosity_at": "0.5 ms", "alpha": 0.2},
        context={"units": "required"}))  # fmt: skip
    stage.run(chosen, tmp_path, tmp_path)
    report = json.loads((tmp_path / "stage_report.json").read_text())
    alpha = [(row["time_s"], row["alpha"], row["sound_speed_m_s"]) for row in report["flow"]["series"]]
    assert report["late_viscosity"] == {"alpha": 0.2, "beta": 10.0}
    assert all(a == pytest.approx(first if t < 5e-4 else low) for t, a, _ in alpha if t != pytest.approx(5e-4))
    assert all(
        c > 500.0 if t < 1e-3 else c == pytest.approx(100.0, rel=0.02) for t, _, c in alpha if t != pytest.approx(1e-3)
    )
    assert len(alpha) >= 6 and alpha[-1][0] == pytest.approx(2e-3)
    assert sum(t == pytest.approx(5e-4) for t, _, _ in alpha) >= 2  # before and after
    shear = [snapshot.read(path).attributes["shear_moduli_Pa"][0] for path in snapshot.series(tmp_path)]
    assert shear[0] == pytest.approx(22.7e9) and shear[-1] == pytest.approx(
        22.7e9 * 2700.0 * 100.0**2 / 26.7e9
    )  # softened with the switch
    assert numerics == "reconstructed" or "Reynolds number" in report["warnings"][0]


def test_the_late_viscosity_is_low_by_default_and_begins_with_the_switch():
    late = settings("1 ms").late
    assert (late.alpha, late.viscosity_time) == (0.1, 1e-3)
    with pytest.raises(ValueError, match="viscosity_at must be before end_time"):
        settings(None, late={"at": "1 ms", "sound_speed": "100 m/s", "viscosity_at": "1 s"})
