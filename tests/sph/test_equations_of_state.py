"""Every equation of state and every material behind the dispatch: derivatives, sound speed, inverses, stiffening."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matter.case import material
from sph.eos import dispatch, murnaghan
from sph.materials.rows import collect
from sph.materials.settings import law_of, parameters

# tables are held in test_table.py and test_shipped_tables.py: one pressure may belong to a range of densities there
NAMES = [name for name in material.names() if law_of(name, "eos", "tillotson") != "table"]
ROWS = collect(tuple(NAMES)).rows
TILLOTSON = dispatch.FAMILY.kind("tillotson")
GAS = (dispatch.FAMILY.kind("ideal_gas"), np.array([1.2, 1.4]))


def eos(name):
    i = NAMES.index(name)
    return ROWS.eos[i], ROWS.eos_row[i]


@pytest.mark.parametrize("name", NAMES)
def test_dispatch_is_the_law_itself(name):
    kind, row = eos(name)
    law = dispatch.FAMILY.module(dispatch.FAMILY.kind(law_of(name, "eos", "tillotson")))
    p = parameters(law.Parameters, name, law.__name__.rpartition(".")[2])
    for eta in (0.6, 1.0, 1.3):
        for u in (0.0, 3e5, 5e6, 3e7):
            assert dispatch.pressure_and_derivatives(kind, row, eta * p.rho0, u) == law.pressure_and_derivatives(
                eta * p.rho0, u, p
            )


def test_ideal_gas():
    kind, row = GAS
    P, d_rho, d_u = dispatch.pressure_and_derivatives(kind, row, 2.0, 5e5)
    assert (P, d_rho, d_u) == pytest.approx((4e5, 2e5, 0.8))
    assert dispatch.sound_speed(kind, row, 2.0, 5e5) == pytest.approx(math.sqrt(1.4 * P / 2.0))
    assert dispatch.energy(kind, row, 2.0, P) == pytest.approx(5e5)
    assert dispatch.density(kind, row, P, 5e5) == pytest.approx(2.0)
    assert dispatch.density(kind, row, -1.0, 5e5) == -1.0 and dispatch.energy(kind, row, 2.0, -1.0) == -1.0


@settings(max_examples=60, deadline=None)
@given(K0=st.floats(1e5, 1e12), n=st.floats(1.0, 8.0), eta=st.floats(0.5, 2.0))
def test_murnaghan(K0, n, eta):
    p = murnaghan.Parameters(1500.0, K0, n)
    P, d_rho, d_u = murnaghan.pressure_and_derivatives(eta * p.rho0, 0.0, p)
    step = 1e-6
    above, below = (murnaghan.pressure_and_derivatives(eta * p.rho0 * f, 0.0, p)[0] for f in (1 + step, 1 - step))
    assert d_rho == pytest.approx((above - below) / (2 * step * eta * p.rho0), rel=1e-6)
    assert murnaghan.sound_speed(eta * p.rho0, 0.0, p) == pytest.approx(math.sqrt(d_rho)) and d_u == 0.0
    assert murnaghan.density(P, 0.0, p) == pytest.approx(eta * p.rho0, rel=1e-9)
    assert murnaghan.energy(eta * p.rho0, P, p) == 0.0
    assert murnaghan.energy(eta * p.rho0, P + 0.1 * K0, p) == -1.0
    assert murnaghan.density(-1.01 * K0 / n, 0.0, p) == -1.0


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=40, deadline=None)
@given(eta=st.floats(0.2, 1.8), u=st.floats(0.0, 4e7))
def test_sound_speed_is_that_of_a_small_adiabatic_compression(name, eta, u):
    kind, row = eos(name)
    rho = eta * row[0]
    P = dispatch.pressure_and_derivatives(kind, row, rho, u)[0]
    kinks = [row[6], row[7]] if kind == TILLOTSON else []
    if (
        abs(eta - 1.0) < 1e-3
        or any(abs(u - k) < 2e-2 * k for k in kinks)
        or (kind == TILLOTSON and abs(eta - 1.0 + 0.5 * row[3] / row[4]) < 1e-3)
    ):
        return
    step = 1e-6 * rho
    along = [dispatch.pressure_and_derivatives(kind, row, rho + s, u + s * P / rho**2)[0] for s in (step, -step)]
    squared = (along[0] - along[1]) / (2 * step)
    if u < 1e-5 * abs(P) / rho:  # u below zero is read as zero: a kink
        return
    assert dispatch.sound_speed(kind, row, rho, u) ** 2 == pytest.approx(
        max(squared, 0.0), rel=1e-4, abs=1e-4 * dispatch.modulus(kind, row) / row[0]
    )


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=40, deadline=None)
@given(eta=st.floats(0.85, 1.8), u=st.floats(0.0, 2e7))
def test_density_and_energy_invert_the_pressure(name, eta, u):
    kind, row = eos(name)
    P = dispatch.pressure_and_derivatives(kind, row, eta * row[0], u)[0]
    found = dispatch.density(kind, row, P, u)
    back = dispatch.pressure_and_derivatives(kind, row, found, u)[0]
    assert back == pytest.approx(P, rel=1e-8, abs=1e-9 * dispatch.modulus(kind, row))
    if eta >= 1.0:
        assert found == pytest.approx(eta * row[0], rel=1e-8)
    if kind == TILLOTSON and eta >= 1.0:
        assert dispatch.energy(kind, row, eta * row[0], P) == pytest.approx(u, rel=1e-6, abs=1.0)


@pytest.mark.parametrize("name", NAMES)
def test_compression_stiffens_and_no_density_bears_any_tension(name):
    kind, row = eos(name)
    for eta in (1.0, 1.2, 1.6, 2.0):
        for u in (0.0, 1e6, 2e7):
            assert dispatch.pressure_and_derivatives(kind, row, eta * row[0], u)[1] > 0.0
    assert dispatch.density(kind, row, -100.0 * dispatch.modulus(kind, row), 0.0) == -1.0


@pytest.mark.parametrize("name", ["basalt", "ice", "aluminum"])
def test_hot_expanded_states_have_an_inverse(name):
    kind, row = eos(name)
    for u in (2.0 * row[7], 20.0 * row[7]):
        for P in (1e3, 1e6, 1e9):
            rho = dispatch.density(kind, row, P, u)
            assert rho > 0.0 and dispatch.pressure_and_derivatives(kind, row, rho, u)[0] == pytest.approx(P, rel=1e-6)


@pytest.mark.parametrize("module", dispatch.FAMILY.laws, ids=dispatch.FAMILY.title)
@settings(max_examples=60, deadline=None)
@given(eta=st.floats(0.3, 2.0), u=st.floats(1e4, 4e7))
def test_derivatives_of_every_law_are_those_of_its_pressure(module, eta, u):
    """Also of laws that no material takes: ``EXAMPLE`` stands for one. Places where the law says that derivatives jump
    are left out."""
    p, kind = module.EXAMPLE, dispatch.FAMILY.laws.index(module)
    numbers = dispatch.FAMILY.row(kind, p)
    row = np.zeros(max(dispatch.FAMILY.width, len(numbers)))
    row[: len(numbers)] = numbers
    rho = eta * p.rho0
    densities, energies = module.kinks(p) if hasattr(module, "kinks") else ((), ())
    if any(abs(rho - k) < 1e-4 * k for k in densities) or any(abs(u - k) < 1e-4 * k for k in energies):
        return
    step = 1e-6
    P, d_rho, d_u = dispatch.pressure_and_derivatives(kind, row, rho, u)
    scale = 1e-8 * (abs(P) + dispatch.modulus(kind, row)) / step
    above, below = (dispatch.pressure_and_derivatives(kind, row, rho * f, u)[0] for f in (1 + step, 1 - step))
    assert d_rho == pytest.approx((above - below) / (2 * step * rho), rel=1e-4, abs=scale / rho)
    above, below = (dispatch.pressure_and_derivatives(kind, row, rho, u * f)[0] for f in (1 + step, 1 - step))
    assert d_u == pytest.approx((above - below) / (2 * step * u), rel=1e-4, abs=scale / u)
