"""Porosity laws: curves, the implicit P-alpha state, its invariants, and what must not depend on it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sph.eos import dispatch as eos
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.porosity import (
    compaction_damage,
    crush,
    crush_quadratic,
    crush_two_power,
    dispatch,
    p_alpha,
    strain_alpha,
)

QUADRATIC = crush_quadratic.Parameters(80e6, 700e6)
PUMICE = crush_two_power.Parameters(4.64, 1.90, 1e6, 6.8e7, 2.13e8, 12.0, 3.0)
CURVES = [(kind, crush.FAMILY.row(kind, module.EXAMPLE)) for kind, module in enumerate(crush.FAMILY.laws)]


def padded(values):
    row = np.zeros(crush.FAMILY.width)
    row[: len(values)] = values
    return row


def material(name="basalt", **changes):
    """A function (rho, u, rest) -> what ``compact`` gives, and the rows."""
    rows = collect((name,), {name: Choice.model_validate({"porosity": "p_alpha", **changes})}).rows
    law = (rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0], rows.eos[0], rows.eos_row[0])

    def state(rho, u, rest, crushing=True):
        return dispatch.compact(*law, rho, u, rest, crushing)

    def pressure(rho, u, alpha):
        return eos.pressure_and_derivatives(rows.eos[0], rows.eos_row[0], alpha * rho, u)[0] / alpha

    return state, pressure, rows


MATERIALS = {
    "quadratic": ("basalt", {"p_alpha": {"alpha0": 1.5}, "crush_quadratic": {"Pe": "0.1 GPa", "Ps": "1 GPa"}}),
    "elastic": ("aluminum", {}),
    "two powers": ("pumice", {}),
}  # fmt: skip


@pytest.mark.parametrize("kind,values", CURVES)
def test_crush_curves_fall_from_one_to_zero(kind, values):
    row = padded(values)
    Pe = crush.onset(kind, row)
    assert crush.openness(kind, row, 0.0) == 1.0 == crush.openness(kind, row, Pe)
    assert (
        crush.openness(kind, row, 1e9) == 0.0 == crush.slope(kind, row, 1e9)
        and crush.slope(kind, row, 0.5 * Pe) == 0.0
    )
    grid = np.geomspace(Pe, 8e8, 300)
    values = [crush.openness(kind, row, P) for P in grid]
    assert np.all(np.diff(values) <= 0.0)
    for P in grid[1:-1]:
        step = 1e-5 * P
        by_difference = (crush.openness(kind, row, P + step) - crush.openness(kind, row, P - step)) / (2 * step)
        assert crush.slope(kind, row, P) == pytest.approx(by_difference, rel=1e-4, abs=1e-6 / P)


def test_published_curves():
    """Benz & Jutzi 2007, eq. 3.5; the measured pumice curve at its own distention."""
    assert crush_quadratic.openness(390e6, QUADRATIC) == pytest.approx(0.25, abs=1e-12)
    assert 1 + 3.64 * crush_two_power.openness(6.8e7, PUMICE) == pytest.approx(1 + 0.9 * ((213 - 68) / (213 - 1)) ** 3)


@pytest.mark.parametrize("which", MATERIALS)
@settings(max_examples=60, deadline=None)
@given(stretch=st.floats(-0.02, 1.2), u=st.floats(0.0, 2e6), start=st.floats(0.0, 1.0))
def test_a_particle_lies_on_or_below_its_crush_curve(which, stretch, u, start):
    state, pressure, rows = material(MATERIALS[which][0], **MATERIALS[which][1])
    alpha0, pores = rows.alpha0[0], p_alpha.Pores(*rows.pores[0])
    rest = 1.0 + start * (alpha0 - 1.0)
    rho = rows.rho0[0] / rest * (1.0 + stretch)
    alpha, new, loading, unloading, slow = state(rho, u, rest)
    assert 1.0 <= new <= rest and 1.0 <= alpha <= rest + 1e-12
    P = pressure(rho, u, alpha)
    on_curve = p_alpha.on_curve(P, rows.crush[0], rows.crush_row[0], pores)
    if P > crush.onset(rows.crush[0], rows.crush_row[0]):
        assert alpha <= on_curve + 1e-9
    if new < rest - 1e-9 and alpha > 1.0:
        assert alpha == pytest.approx(on_curve, abs=1e-8)
    assert 0.0 <= loading <= unloading + 1e-9 and unloading <= 1.0 + 1e-12 and 0.5 < slow <= 1.0
    again = state(rho, u, new)
    assert again[0] == pytest.approx(alpha, abs=1e-9) and again[1] == pytest.approx(new, abs=1e-9)


@pytest.mark.parametrize("which", MATERIALS)
def test_f_is_the_derivative_along_the_adiabatic_path(which):
    """f = 1 + (rho / alpha) d alpha / d rho by differences, with du = P / rho^2 d rho, on the crush curve; never
    negative (heat alone can make it so)."""
    state, pressure, rows = material(MATERIALS[which][0], **MATERIALS[which][1])
    u, checked = 2e4, 0
    for share in np.linspace(1.01, rows.alpha0[0], 30):
        rho = rows.rho0[0] / rows.alpha0[0] * share
        alpha, rest, f, _, _ = state(rho, u, rows.alpha0[0])
        if not 1.0 < rest < rows.alpha0[0]:
            continue
        P, step = pressure(rho, u, alpha), 1e-6 * rho
        ahead = state(rho + step, u + step * P / rho**2, rest)[0]
        back, _, _, _, _ = state(rho - step, u - step * P / rho**2, rows.alpha0[0])
        assert f == pytest.approx(max(1 + rho / alpha * (ahead - back) / (2 * step), 0.0), abs=1e-7)
        checked += 1
    assert checked > 5


def test_unloading_is_elastic_and_reversible():
    state, _, rows = material("aluminum")
    rest0 = rows.alpha0[0]
    loaded = state(2300.0, 0.0, rest0)
    assert loaded[1] < rest0
    path = [2300.0, 2290.0, 2280.0, 2290.0, 2300.0]
    alphas, rest = [], loaded[1]
    for rho in path:
        alpha, rest, *_ = state(rho, 0.0, rest)
        alphas.append(alpha)
    assert alphas[0] == pytest.approx(alphas[-1], abs=1e-10) and alphas[2] > alphas[0]
    assert rest == pytest.approx(loaded[1], abs=1e-10)


@pytest.mark.parametrize("stretch", np.linspace(-0.02, 1.3, 12))
def test_springs_of_pores_softer_than_their_crushing_stay_finite(stretch):
    """c_e so low that the elastic line falls faster than the crush curve: unloading leads back to alpha_0 at most, not
    through the pole of 1 / h^2."""
    state, pressure, rows = material(
        "basalt",
        p_alpha={"alpha0": 2.2, "elastic_speed": "500 m/s"},
        crush_quadratic={"Pe": "10 kPa", "Ps": "1.5 GPa"},
    )
    rho = rows.rho0[0] / 2.2 * (1.0 + stretch)
    for u in (0.0, 1e5):
        alpha, rest, loading, unloading, slow = state(rho, u, 2.2)
        assert (
            1.0 <= alpha <= rest <= 2.2
            and 0.0 <= loading
            and np.isfinite([loading, unloading, slow, pressure(rho, u, alpha)]).all()
        )
        assert state(rho, u, rest)[1] <= rest


def test_elastic_wave_speed_is_the_given_one():
    """sqrt(dP/drho) at rest is c_e where the solid's c_0 is that of its equation of state, and h tells it without a
    derivative."""
    c0 = math.sqrt(75.2e9 / 2700)
    state, pressure, rows = material(
        "aluminum", p_alpha={"alpha0": 1.275, "elastic_speed": "4110 m/s", "solid_speed": f"{c0!r} m/s"}
    )
    rho = rows.rho0[0] / 1.275
    loads = [(r, pressure(r, 0.0, state(r, 0.0, 1.275)[0])) for r in (rho, rho * (1 + 1e-5))]
    assert math.sqrt((loads[1][1] - loads[0][1]) / (loads[1][0] - loads[0][0])) == pytest.approx(4110, rel=1e-3)
    assert state(rho, 0.0, 1.275)[4] * c0 == pytest.approx(4110, rel=1e-9)


def test_no_pores_is_no_porosity():
    state, _, rows = material("aluminum", p_alpha={"alpha0": 1})
    assert state(3000.0, 1e5, rows.alpha0[0]) == (1.0, 1.0, 1.0, 1.0, 1.0)
    assert compaction_damage.root(1.0, 1.0) == 0.0


def test_held_pores_give_way_elastically_only():
    state, _, _ = material("aluminum")
    alpha, rest, *_ = state(2600.0, 0.0, 1.275, False)
    assert rest == 1.275 and 1.1 < alpha < 1.275


def test_damage_of_crushing_is_linear_in_the_distention():
    for alpha in (1.5, 1.4, 1.1, 1.0):
        assert compaction_damage.root(alpha, 1.5) ** 3 == pytest.approx(1 - (alpha - 1) / 0.5, abs=1e-12)
    assert compaction_damage.total(0.7, 0.6) == 1.0 and compaction_damage.total(0.2, 0.3) == pytest.approx(0.5)


STRAIN = strain_alpha.Parameters(1.8, -1e-3, 0.988, 1.29)


def test_strain_alpha_is_smooth_and_monotonic():
    grid = -np.linspace(0.0, 1.2, 4001)
    alpha = np.array([strain_alpha.distention(e, STRAIN) for e in grid])
    assert alpha[0] == 1.8 and alpha[-1] == 1.0 and np.all(np.diff(alpha) <= 0.0)
    x = -1e-3 + math.log(1.29 / 1.8) / 0.988
    c = x + 2 * (1 - 1.29) / (0.988 * 1.29)
    assert strain_alpha.distention(x, STRAIN) == pytest.approx(1.29) and strain_alpha.distention(c, STRAIN) == 1.0
    for e in (-0.1, -0.3, x - 1e-3, 0.5 * (x + c)):
        slope = (strain_alpha.distention(e + 1e-6, STRAIN) - strain_alpha.distention(e - 1e-6, STRAIN)) / 2e-6
        assert strain_alpha.slope(e, STRAIN) == pytest.approx(slope, rel=1e-5)
    above, below = (strain_alpha.slope(x + d, STRAIN) for d in (1e-9, -1e-9))
    assert above == pytest.approx(below, rel=1e-6)
    assert strain_alpha.strain_factor(-0.2, STRAIN) == pytest.approx(1 - 0.988)


def test_strain_alpha_in_a_material_is_irreversible():
    rows = collect(("aluminum",), {"aluminum": Choice(porosity="strain_alpha")}).rows
    law = (rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0], rows.eos[0], rows.eos_row[0])
    alpha, rest, f, free, _ = dispatch.compact(*law, 2400.0, 0.0, 1.275, True)
    assert 1.0 < alpha == rest < 1.275 and f == pytest.approx(1 - 0.999, abs=1e-9) and free == 1.0
    assert dispatch.compact(*law, 2200.0, 0.0, rest, True)[:2] == (rest, rest)
    assert dispatch.compact(*law, 2900.0, 0.0, rest, True)[0] == 1.0


@pytest.mark.parametrize("name,changes", [*MATERIALS.values(), ("aluminum", {"porosity": "strain_alpha"})])
def test_the_cold_material_under_pressure_is_in_balance(name, changes):
    """``at_pressure`` is where ``compact`` carries that pressure."""
    rows = collect((name,), {name: Choice.model_validate({"porosity": "p_alpha", **changes})}).rows
    law = (rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0], rows.eos[0], rows.eos_row[0])
    for P in (0.0, 1e5, 1e7, 1e8, 5e8, 5e9):
        rho, rest = dispatch.at_pressure(*law, P)
        alpha, new, *_ = dispatch.compact(*law, rho, 0.0, rows.alpha0[0], True)
        assert new == pytest.approx(rest, abs=1e-6)
        got = eos.pressure_and_derivatives(rows.eos[0], rows.eos_row[0], alpha * rho, 0.0)[0] / alpha
        assert got == pytest.approx(P, rel=1e-5, abs=1e3)


@pytest.mark.parametrize("name,changes", [*MATERIALS.values(), ("aluminum", {"porosity": "strain_alpha"})])
@pytest.mark.parametrize("sound_speed", [30.0, 300.0, 3000.0])
def test_pores_of_the_late_medium_close_under_the_pressure_of_their_own_law(name, changes, sound_speed):
    """In a linear medium of any stiffness as far as ``at_pressure`` says, and no further: released and loaded again to
    less, they stay."""
    rows = collect((name,), {name: Choice.model_validate({"porosity": "p_alpha", **changes})}).rows
    law = (rows.porosity[0], rows.pores[0], rows.crush[0], rows.crush_row[0], rows.eos[0], rows.eos_row[0])
    solid, start, c2 = float(rows.rho0[0]), float(rows.alpha0[0]), sound_speed**2
    medium = dispatch.LinearMedium(solid, c2)
    closed = 0
    for P in (1e4, 1e6, 1e7, 1e8, 3e8, 5e9):
        rest = dispatch.at_pressure(*law, P)[1]
        rho = P / c2 + solid / rest
        got = dispatch.compact_linear(*law, rho, 0.0, start, medium)
        assert got == pytest.approx(rest, abs=3e-7)
        assert dispatch.compact_linear(*law, solid / got, 0.0, got, medium) == got
        assert dispatch.compact_linear(*law, solid / got + 0.99 * P / c2, 0.0, got, medium) == got
        closed += rest < start
    assert closed >= 2
