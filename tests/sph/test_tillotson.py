"""Tillotson: golden values, derivatives, continuity, inverses."""

import csv
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sph.eos import tillotson
from sph.materials.settings import parameters

GOLDEN = [
    row
    for row in csv.reader((Path(__file__).parent.parent / "data" / "tillotson_golden.csv").open())
    if not row[0].startswith("#")
]
MATERIALS = ("basalt", "ice", "water", "water_thesis", "iron")


def law(name):
    return parameters(tillotson.Parameters, name, "tillotson")


@pytest.mark.parametrize("name,eta,u,pressure,speed", GOLDEN)
def test_golden_values(name, eta, u, pressure, speed):
    p = law(name)
    rho = float(eta) * p.rho0
    assert tillotson.pressure(rho, float(u), p) == pytest.approx(float(pressure), rel=2e-7, abs=1.0)
    assert tillotson.sound_speed(rho, float(u), p) == pytest.approx(float(speed), rel=2e-6)


@pytest.mark.parametrize("name", MATERIALS)
@settings(max_examples=60, deadline=None)
@given(eta=st.floats(0.05, 2.0), scaled=st.floats(0.0, 3.0))
def test_derivatives_match_differences(name, eta, scaled):
    p = law(name)
    rho, u = eta * p.rho0, scaled * p.Ecv
    edges = (abs(eta - 1.0) < 1e-3, abs(u - p.Eiv) < 1e-3 * p.Eiv, abs(u - p.Ecv) < 1e-3 * p.Ecv, u < 1e-3 * p.Eiv)
    if any(edges) or abs(eta - (1.0 - 0.5 * p.A / p.B)) < 1e-3:
        return
    _, d_rho, d_u = tillotson.pressure_and_derivatives(rho, u, p)
    step = 1e-6
    by_rho = (tillotson.pressure(rho * (1 + step), u, p) - tillotson.pressure(rho * (1 - step), u, p)) / (
        2 * step * rho
    )
    by_u = (tillotson.pressure(rho, u * (1 + step), p) - tillotson.pressure(rho, u * (1 - step), p)) / (2 * step * u)
    assert d_rho == pytest.approx(by_rho, rel=1e-5, abs=1e-5 * p.A / p.rho0)
    assert d_u == pytest.approx(by_u, rel=1e-5, abs=1e-5 * p.rho0)


@pytest.mark.parametrize("name", MATERIALS)
def test_continuous_across_regions(name):
    p = law(name)
    for eta in (0.4, 0.9, 0.999999):
        for u in (p.Eiv, p.Ecv):
            below, above = (tillotson.pressure(eta * p.rho0, u * f, p) for f in (1 - 1e-9, 1 + 1e-9))
            assert above == pytest.approx(below, rel=1e-6, abs=1e-6 * p.A)
    for u in (0.0, 0.5 * p.Eiv, 0.5 * (p.Eiv + p.Ecv), 2 * p.Ecv):
        below, above = (tillotson.pressure(p.rho0 * f, u, p) for f in (1 - 1e-9, 1 + 1e-9))
        assert above == pytest.approx(below, rel=1e-6, abs=1e-6 * p.A)


@pytest.mark.parametrize("name", MATERIALS)
@settings(max_examples=40, deadline=None)
@given(eta=st.floats(1.0, 1.8), scaled=st.floats(0.0, 5.0))
def test_inverses(name, eta, scaled):
    p = law(name)
    rho, u = eta * p.rho0, scaled * p.Eiv
    P = tillotson.pressure(rho, u, p)
    assert tillotson.density(P, u, p) == pytest.approx(rho, rel=1e-9)
    assert tillotson.energy(rho, P, p) == pytest.approx(u, rel=1e-6, abs=1e-6 * p.Eiv)


def test_cold_expanded_water_never_pushes():
    """A mu + B mu^2 turns up again below mu = -A / (2 B): at half density it would push with 2.2 GPa."""
    p = law("water")
    assert all(tillotson.pressure(eta * p.rho0, 0.0, p) < 0.0 for eta in (0.9, 0.7, 0.5, 0.1))


def test_compression_stiffens():
    for name in MATERIALS:
        p = law(name)
        for eta in (1.0, 1.2, 1.6, 2.0):
            for u in (0.0, p.Eiv, p.Ecv):
                assert tillotson.pressure_and_derivatives(eta * p.rho0, u, p)[1] > 0.0
