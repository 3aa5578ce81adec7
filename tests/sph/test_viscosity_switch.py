"""The switch of the artificial viscosity: its law, what a pair takes, and that a shock is still a shock."""

import json
import math

import numpy as np
import pytest

from fixtures import columns, shocks, solutions
from sph.materials.rows import collect
from sph.pairs import rates, scheme
from sph.pairs.row import VISCOSITY_FRACTION
from sph.viscosity import morris_monaghan
from tests.sph.test_rates import _Cloud, rows_of
from tests.sph.test_smoothing import stopped_and_whole


def test_morris_monaghan_follows_its_equation():
    """Against the exact solution for constant div v, and within its bounds for any step."""
    law, least = morris_monaghan.next_fraction, morris_monaghan.LEAST
    c, h, dt = 1000.0, 100.0, 1e-3
    for divergence in (-2.0, 0.0, 3.0):
        source, fading = max(-divergence, 0.0), 0.4 * c / h
        f, t = 0.7, 0.0
        while t < 0.2 - 1e-9:
            f, t = law(f, dt, divergence, c, h), t + dt
        end = (source + fading * least) / (source + fading)
        assert f == pytest.approx(end + (0.7 - end) * math.exp(-(source + fading) * t), rel=2e-3)
    assert least <= law(1.0, 1e9, 5.0, c, h) < least + 1e-6 and 0.99 < law(least, 1e9, -1e9, c, h) <= 1.0


@pytest.mark.validation
@pytest.mark.parametrize("share", [1.0, 0.25])
def test_a_pair_takes_the_mean_share(share):
    """Force and heat of the viscosity alike; with all of it, what no switch gives."""
    c = _Cloud(1000)
    none, whole = c.evaluate(0.0, 0.0), c.evaluate()
    out, second = rates.Rates(1000), np.zeros((1000, 16))
    second[:, VISCOSITY_FRACTION] = share + np.where(np.arange(1000) == 431, 0.2, 0.0)
    c.summed(scheme.Scheme(switched=True), rows_of(c.rows(), second), out, rates.Damping(1.0, 2.0))
    far = np.linalg.norm(c.position - c.position[431], axis=1) > c.support_radius.max()
    for name in ("acceleration", "energy"):
        wanted = getattr(none, name) + share * (getattr(whole, name) - getattr(none, name))
        assert np.abs(getattr(out, name) - wanted)[far].max() < 1e-11 * np.abs(wanted).max()
    extra = none.acceleration[431] + (share + 0.1) * (whole.acceleration - none.acceleration)[431]
    assert out.acceleration[431] == pytest.approx(extra, rel=1e-9)
    force = c.mass[:, None] * out.acceleration
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert abs((force * c.velocity).sum() + c.mass @ out.energy) < 1e-12 * np.abs(force * c.velocity).sum()


@pytest.mark.validation
def test_a_piston_still_drives_the_right_shock():
    """Basalt at 1 km/s, 40 layers, against the table of Rankine and Hugoniot: 2 % of P, 1 % of the density."""
    row = shocks.published("basalt", 1000.0)
    got = columns.shocked(
        collect(("basalt",)), 1000.0, float(row["us_m_s"]), layers=40, viscosity_switch="morris_monaghan"
    )
    assert got.P == pytest.approx(float(row["P_Pa"]), rel=0.02)
    assert got.rho == pytest.approx(float(row["rho_kg_m3"]), rel=0.01)


@pytest.mark.validation
def test_a_stage_with_switch_and_corrected_gradients_resumes_to_the_last_bit(tmp_path, monkeypatch):
    whole, parts = stopped_and_whole(tmp_path, monkeypatch, viscosity_switch="morris_monaghan", gradients="corrected")
    for name in whole:
        assert np.array_equal(whole[name], parts[name]), name
    report = json.loads((tmp_path / "whole" / "stage_report.json").read_text())
    assert (
        report["drift_over_projectile"]["energy_J"] < 0.02
        and report["removed_angular_momentum_over_projectile"] < 0.01
    )


@pytest.mark.validation
def test_a_shell_stops_where_yielding_has_taken_its_energy():
    """2,500 particles, two spacings thick: within 3 % (without switch and correction 20 % too soon, viscosity taking
    half of the energy)."""
    stop, viscous, energy = solutions.shell(2500, gradients="corrected", viscosity_switch="morris_monaghan")
    assert stop == pytest.approx(1.0, abs=0.03) and 0.0 < viscous < 0.08 and abs(energy) < 1e-3
