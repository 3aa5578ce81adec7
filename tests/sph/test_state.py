"""The evaluation of particles with each yield law, growth law and with pores: what the pair loop gets to see."""

import math

import numpy as np
import pytest

from matter.case import material
from matter.errors import InputError
from sph.bodies.particle_cloud import Cloud
from sph.damage import growth, growth_linear
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.pairs import bearing_pressure
from sph.pairs.row import SOUND
from sph.stepping import state


def cloud(n=1, **fields):
    """n resting particles of one material, changed by ``fields``."""
    values = {
        "mass": 1e9, "density": 2700.0, "support_radius": 100.0, "distention": 1.0, "initial_distention": 1.0,
        "neighbours": 50,
        "flaw_first": np.arange(n), "flaw_last": np.arange(1, n + 1),
    }  # fmt: skip
    if "distention" in fields:
        fields["initial_distention"] = fields["distention"]
    body = Cloud(n)
    body.flaw_strain = np.array(fields.pop("flaw_strain", np.full(n, 1e9)), dtype=np.float32)
    for name, value in {**values, **fields}.items():
        getattr(body, name)[:] = value
    return body


def evaluated(body, name, crushing=True, **changes):
    materials = collect((name,), {name: Choice.model_validate(changes)})
    out = state.Evaluated(len(body.mass))
    state.evaluate(body, materials.rows, True, True, out, crushing)
    assert not out.status.any()
    return out, materials


def invariant(stress):
    a, b, c, d, e = stress
    return math.sqrt(0.5 * (a * a + d * d + (a + d) ** 2) + b * b + c * c + e * e)


SAND = {
    "strength": "drucker_prager",
    "drucker_prager": {"friction_angle": "30 deg", "cohesion": "0 Pa"},
    "damage": "none",
}


def test_sand_yields_with_its_pressure_and_pulls_nothing():
    body = cloud(3, density=[2730.0, 2800.0, 2600.0], stress=np.full((3, 5), 1e10))
    out, _ = evaluated(body, "basalt", **SAND)
    B = 6 * 0.5 / (math.sqrt(3) * 2.5)
    for i in (0, 1):
        assert invariant(body.stress[i]) == pytest.approx(B * out.pressure[i], rel=1e-12) and out.pressure[i] > 1e8
    assert out.pressure[2] == 0.0 and invariant(body.stress[2]) == 0.0


def test_sand_rubs_by_the_mean_pressure_of_its_neighbours():
    """Where it touches them: not at 0.85 of its density at rest, nor before the first sum over pairs, where it is its
    own."""
    body = cloud(
        4,
        density=[2730.0, 2690.0, 0.85 * 2700.0, 2730.0],
        stress=np.full((4, 5), 1e10),
        mean_pressure=[1e8, 1e8, 1e8, bearing_pressure.UNKNOWN],
    )
    out, _ = evaluated(body, "basalt", **SAND)
    B = 6 * 0.5 / (math.sqrt(3) * 2.5)
    found = [invariant(stress) for stress in body.stress]
    assert found == pytest.approx([B * 1e8, B * 1e8, 0.0, B * out.pressure[3]], rel=1e-12)
    assert out.pressure[0] > 2e8 and out.pressure[1] == out.pressure[2] == 0.0
    again = body.stress.copy()
    evaluated(body, "basalt", **SAND)
    np.testing.assert_allclose(body.stress, again, rtol=1e-14)


def test_broken_rock_keeps_its_friction_and_von_mises_does_not():
    """Collins and Drucker-Prager mix damage into the yield stress: what yields goes to the pair loop whole."""
    for strength, carries in (("collins", True), ("drucker_prager", True), ("von_mises", False)):
        body = cloud(2, density=[2800.0, 2800.0], stress=np.full((2, 5), 1e10), root_damage=[0.0, 1.0])
        out, _ = evaluated(body, "basalt", strength=strength)
        assert (abs(out.row[1, 11]) > 1e7) == carries, strength
        assert out.row[1, 11] == pytest.approx(body.stress[1, 1] if carries else 0.0)
        assert out.pressure[0] == out.pressure[1]
    body = cloud(2, density=[2800.0, 2800.0], stress=np.full((2, 5), 1e10), root_damage=[0.0, 1.0])
    out, _ = evaluated(body, "basalt", strength="collins")
    assert invariant(body.stress[1]) == pytest.approx(0.8 * out.pressure[1], rel=1e-12)
    assert invariant(body.stress[0]) > invariant(body.stress[1])


@pytest.mark.parametrize("law", growth.FAMILY.names[1:])
def test_growth_goes_by_the_chosen_law(law):
    strains = np.array([1e-4, 2e-4, 3e-4, 4e-4, 5e-4, 6e-4, 7e-4, 8e-4], dtype=np.float32)
    young = 9 * 26.7e9 * 22.7e9 / (3 * 26.7e9 + 22.7e9)
    pull = 4.5e-4 * young
    body = cloud(
        1,
        density=[2700.0],
        stress=[[pull, 0, 0, -0.5 * pull, 0]],
        flaw_last=[8],
        flaw_strain=strains,
        root_damage=[0.1],
    )
    out, materials = evaluated(body, "basalt", damage=law)
    radius = (1e9 / 2700 * 3 / (4 * math.pi)) ** (1 / 3)
    crack = materials.rows.crack_speed[0]
    assert crack == pytest.approx(1837.3, abs=0.1)
    strain = (pull - out.pressure[0]) / young
    m0 = math.log(8) / math.log(8)
    rate, cap = {
        "cube_root": (4 ** (1 / 3) * crack / radius, 0.5 ** (1 / 3)),
        "single": (crack / radius, 1.0),
        "linear": (4 * growth_linear.crack_speed(crack, 26.7e9, 22.7e9, 2700.0, 1e-3) / 100.0, 0.5 ** (1 / 3)),
        "weibull": ((strain / 1e-4) ** (m0 / 3) * crack / 100.0, 1.0),
        "fraction": (0.5 * crack / radius, 0.5 ** (1 / 3)),
    }[law]
    assert out.damage_rate[0] == pytest.approx(rate, rel=1e-6) and out.damage_cap[0] == pytest.approx(cap)


POROUS = {"porosity": "p_alpha", "p_alpha": {"alpha0": 1.5}, "crush_quadratic": {"Pe": "0.1 GPa", "Ps": "1 GPa"}}


def test_pores_close_and_break():
    """Below Pe nothing; on the curve alpha(P), S / alpha, damage by crushing; above Ps solid and broken."""
    body = cloud(3, density=[1800.0, 2300.0, 2900.0], distention=[1.5] * 3, stress=np.full((3, 5), 1e6))
    out, materials = evaluated(body, "basalt", **POROUS)
    assert out.distention[0] == body.distention[0] == 1.5 and out.pressure[0] == pytest.approx(0.0, abs=1.0)
    alpha = out.distention[1]
    assert 1.0 < alpha < 1.5
    assert alpha == pytest.approx(1 + 0.5 * ((1e9 - out.pressure[1]) / 0.9e9) ** 2, abs=1e-9)
    assert out.distention[2] == 1.0 == body.distention[2]
    D = state.damage_of(body, materials.rows)
    assert D == pytest.approx([0.0, 1 - (alpha - 1) / 0.5, 1.0], abs=1e-9)
    assert out.row[:, 11] == pytest.approx(body.stress[:, 1] * (1 - D) / out.distention, abs=1e-6)
    assert out.strain_ratio[1, 0] < 0.5 and out.strain_ratio[1, 1] == 1.0 and np.all(out.strain_ratio[[0, 2]] == 1.0)
    solid, _ = evaluated(cloud(1, density=[2900.0]), "basalt")
    assert out.pressure[2] == pytest.approx(solid.pressure[0], rel=1e-12)


def test_pores_held_open_in_relaxation():
    body = cloud(1, density=[2300.0], distention=[1.5])
    out, _ = evaluated(body, "basalt", crushing=False, **POROUS)
    assert body.distention[0] == 1.5 == out.distention[0] and out.pressure[0] > 1e9


def test_alpha0_of_one_changes_nothing():
    fields = {"density": [2800.0], "stress": np.full((1, 5), 1e8), "root_damage": [0.3]}
    plain, _ = evaluated(cloud(**fields), "basalt")
    one, materials = evaluated(cloud(**fields), "basalt", porosity="p_alpha", p_alpha={"alpha0": 1.0})
    assert np.array_equal(plain.row, one.row) and not materials.porous
    beside = collect(("basalt", "pumice"))  # compiled with pores, for the sake of another material
    out = state.Evaluated(1)
    state.evaluate(cloud(**fields), beside.rows, True, True, out)
    assert np.array_equal(plain.row, out.row) and beside.porous


def test_tension_of_porous_material_is_cut_by_its_distention():
    body = cloud(1, density=[1700.0], distention=[1.5])
    out, materials = evaluated(body, "basalt", **POROUS)
    assert out.pressure[0] == pytest.approx(-materials.rows.tension[0] / 1.5)


@pytest.mark.parametrize("choice", [{}, {"strength": "collins"}, {"strength": "none", "damage": "none"}])
def test_tension_softens_with_heat_as_strength_does(choice):
    """Basalt melts at 3.4 MJ/kg, by whichever law yields; without one it is no solid that holds longer."""
    heat = np.array([0.0, 1.7e6, 3.4e6, 5e6])
    body = cloud(4, density=[1000.0] * 4, specific_energy=heat)
    materials = collect(
        ("basalt",),
        {"basalt": Choice(tillotson={"Ecv": "100 MJ/kg", "Eiv": "50 MJ/kg", "a": "1e-6", "b": "1e-6"}, **choice)},
    )
    out = state.Evaluated(4)
    state.evaluate(body, materials.rows, True, True, out)
    assert out.pressure == pytest.approx([-130e6, -65e6, 0.0, 0.0], abs=1.0)


@pytest.mark.parametrize("name", ["aluminum", "copper", "granite", "regolith"])
def test_what_begins_to_boil_is_no_solid_though_no_melt_energy_is_given(name):
    """All of the tension below Tillotson's Eiv, neither pulled nor sheared from there on."""
    materials = collect((name,), {name: Choice(tillotson={"a": "1e-6", "b": "1e-6"})})  # cold matter that is warm
    boils = float(material.section(name, "tillotson")["Eiv"])
    heat = boils * np.array([0.0, 0.99, 1.0, 2.0])
    body = cloud(4, density=[0.8 * materials.rows.rho0[0]] * 4, specific_energy=heat, stress=np.full((4, 5), 5e9))
    out = state.Evaluated(4)
    state.evaluate(body, materials.rows, True, False, out)
    cut = float(materials.rows.tension[0])
    assert out.pressure == pytest.approx([-cut, -cut, 0.0, 0.0], abs=1.0)
    assert np.all(body.stress[2:] == 0.0)
    assert np.all(body.stress[:2] > 0.0) or name == "granite"  # pulled apart it holds none when cold either
    squeezed = cloud(4, density=[1.1 * materials.rows.rho0[0]] * 4, specific_energy=heat, stress=np.full((4, 5), 5e9))
    state.evaluate(squeezed, materials.rows, True, False, out)
    assert np.all(squeezed.stress[:2] > 0.0) and np.all(squeezed.stress[2:] == 0.0)


def test_a_cones_tip_softens_with_heat():
    """Its cohesion of 1 MPa at 45 deg ends it at a tension of 1 MPa, at half the melt energy at half of that."""
    choice = {
        "strength": "drucker_prager",
        "damage": "none",
        "drucker_prager": {"cohesion": "1 MPa", "friction_angle": "45 deg"},
        "melting": {"energy": "3.4 MJ/kg"},
    }
    body = cloud(2, density=[1000.0] * 2, specific_energy=[0.0, 1.7e6])
    out, _ = evaluated(
        body, "basalt", tillotson={"Ecv": "100 MJ/kg", "Eiv": "50 MJ/kg", "a": "1e-6", "b": "1e-6"}, **choice
    )
    assert out.pressure == pytest.approx([-1e6, -0.5e6], rel=1e-9)


@pytest.mark.parametrize("law", ["cube_root", "linear"])
def test_cracks_are_as_much_slower_in_pores_as_sound(law):
    """Herrmann's elastic part: sound in the porous material has 0.6 of the speed in its matrix, and so have its
    cracks."""
    young = 9 * 26.7e9 * 22.7e9 / (3 * 26.7e9 + 22.7e9)
    strains, pull = np.array([1e-4, 9e-4], dtype=np.float32), 4.5e-4 * young
    found = []
    for speeds in ({}, {"elastic_speed": "1800 m/s", "solid_speed": "3000 m/s"}):
        body = cloud(
            1,
            density=[1800.0],
            distention=[1.5],
            stress=[[pull, 0, 0, -0.5 * pull, 0]],
            flaw_last=[2],
            flaw_strain=strains,
            root_damage=[0.1],
        )
        pores = POROUS | {"p_alpha": {"alpha0": 1.5} | speeds}
        out, _ = evaluated(body, "basalt", damage=law, **pores)
        found.append(out.damage_rate[0])
    assert found[1] / found[0] == pytest.approx(0.6, rel=1e-6)


def test_a_value_for_a_law_that_is_not_taken_is_refused():
    with pytest.raises(InputError, match=r"\[p_alpha\] is given, but porosity is 'none'"):
        collect(("basalt",), {"basalt": Choice(p_alpha={"alpha0": 1.5})})
    with pytest.raises(InputError, match=r"\[weibull\] is given, but damage is 'none'"):
        collect(("basalt",), {"basalt": Choice(damage="none", weibull={"m": 9})})


@pytest.mark.parametrize(
    "changes,message",
    [
        ({"strength": "drucker_prager", "drucker_prager": {"cohesion": 5.0}}, "cohesion: the unit is missing"),
        ({"strength": "drucker_prager", "drucker_prager": {"cohesion": "5 m"}}, "not a quantity in Pa"),
        ({"strength": "drucker_prager", "drucker_prager": {"angle": "5 deg"}}, "angle"),
        (
            {"strength": "collins", "collins": {"limiting_strength": "1 MPa"}},
            "limiting_strength must be above cohesion",
        ),
        ({"porosity": "p_alpha", "crush_quadratic": {"Pe": "3 GPa"}}, "Ps must be above Pe"),
        ({"porosity": "p_alpha", "p_alpha": {"elastic_speed": "9 km/s"}}, "elastic_speed must not be above"),
        ({"porosity": "p_alpha", "p_alpha": {"alpha0": 0.9}}, "greater than or equal to 1"),
        ({"porosity": "p_alpha", "crush_two_power": {"Pe": "1 MPa"}}, "alpha_e is missing"),
        (
            {"porosity": "p_alpha", "crush_quadratic": {"Pe": "1 MPa"}, "crush_two_power": {"Pe": "1 MPa"}},
            r"\[crush_two_power\] is given, but crush is 'quadratic'",
        ),
        (
            {"strength": "collins", "collins": {"melt_energy": "1 MJ/kg"}},
            r"melt_energy: \[melting\] energy says it, not a key here",
        ),
        (
            {"eos": "table", "table": {"rho0": "2650 kg/m^3", "file": "x", "temperature": "200 K"}},
            r"temperature: \[thermal\] temperature says it, not a key here",
        ),
        ({"eos": "murnaghan"}, r"has no \[murnaghan\]"),
    ],
)
def test_bad_values_are_named(changes, message):
    with pytest.raises(InputError, match=message):
        collect(("basalt",), {"basalt": Choice.model_validate(changes)})


def test_a_change_of_a_material_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="material 'basat' is not used in this run; did you mean 'basalt'"):
        collect(("basalt", "ice"), {"basat": Choice()})


@pytest.mark.parametrize("changes", [SAND, {**SAND, **POROUS}], ids=["solid grains", "with pores"])
def test_thin_matter_without_strength_is_no_stiffer_than_at_rest(changes):
    """The longitudinal speed that the step goes by: sand that has parted has no shear wave, a
    metal keeps its own."""
    alpha = 1.5 if "porosity" in changes else 1.0
    rest = 2700.0 / alpha
    densities = rest * np.array([0.9999, 0.1, 0.005])
    body = cloud(3, density=densities, distention=np.full(3, alpha), initial_distention=np.full(3, alpha))
    out, materials = evaluated(body, "basalt", **changes)
    shear2 = 4.0 / 3.0 * materials.rows.shear[0] / 2700.0
    np.testing.assert_allclose(out.wave**2 - out.row[:, SOUND] ** 2, shear2, rtol=1e-9)
    held = {name: value for name, value in changes.items() if name != "drucker_prager"} | {"strength": "von_mises"}
    body = cloud(3, density=densities, distention=np.full(3, alpha), initial_distention=np.full(3, alpha))
    out, _ = evaluated(body, "basalt", **held)
    np.testing.assert_allclose(out.wave**2 - out.row[:, SOUND] ** 2, shear2 * rest / densities, rtol=1e-9)


def test_pressed_sand_keeps_the_shear_wave_of_its_own_density():
    out, materials = evaluated(cloud(1, density=[2800.0]), "basalt", **SAND)
    assert out.wave[0] ** 2 - out.row[0, SOUND] ** 2 == pytest.approx(4.0 / 3.0 * materials.rows.shear[0] / 2800.0)
