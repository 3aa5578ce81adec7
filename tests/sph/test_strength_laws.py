"""Yield surfaces: limits, angles, mixing by damage, softening."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sph.strength import collins, dispatch, drucker_prager, thermal_softening

PHI = math.radians(30)
ROCK = collins.Parameters(90e6, 2.0, 1.5e9, 1e5, 0.8, 3.4e6)


def test_softening_is_linear_and_bounded():
    assert thermal_softening.softening(0.0, 7e5) == 1.0 and thermal_softening.softening(-1e5, 7e5) == 1.0
    assert thermal_softening.softening(3.5e5, 7e5) == pytest.approx(0.5)
    assert thermal_softening.softening(7e5, 7e5) == 0.0 and thermal_softening.softening(1e9, 7e5) == 0.0
    assert thermal_softening.softening(1e9, math.inf) == 1.0


@settings(max_examples=60, deadline=None)
@given(phi=st.floats(0.01, 1.2), cohesion=st.floats(0.0, 1e8), confining=st.floats(0.0, 1e9))
def test_drucker_prager_is_mohr_coulomb_in_triaxial_compression(phi, cohesion, confining):
    """At the failure of Mohr-Coulomb, s1 = s3 (1 + sin)/(1 - sin) + 2 c cos/(1 - sin), the cone yields as well."""
    cone = drucker_prager.cone(drucker_prager.Parameters(phi, cohesion))
    s1 = confining * (1 + math.sin(phi)) / (1 - math.sin(phi)) + 2 * cohesion * math.cos(phi) / (1 - math.sin(phi))
    P, root_J2 = (s1 + 2 * confining) / 3, (s1 - confining) / math.sqrt(3)
    assert drucker_prager.shear_strength(P, 0.0, 0.0, cone) == pytest.approx(root_J2, rel=1e-9, abs=1e-6)


def test_damage_breaks_cohesion_and_leaves_friction():
    cone = drucker_prager.cone(drucker_prager.Parameters(PHI, 1e6, 1e6))
    sand = drucker_prager.cone(drucker_prager.Parameters(PHI, 0.0, 1e6))
    assert drucker_prager.shear_strength(1e7, 0.0, 1.0, cone) == pytest.approx(
        drucker_prager.shear_strength(1e7, 0.0, 0.0, sand)
    )
    assert drucker_prager.shear_strength(1e7, 0.0, 0.5, cone) == pytest.approx(0.5 * (cone.A + 2 * cone.B * 1e7))
    assert drucker_prager.apex(0.0, 0.0, cone) == pytest.approx(1e6 / math.tan(PHI))
    assert drucker_prager.shear_strength(-drucker_prager.apex(0.0, 0.5, cone), 0.0, 0.5, cone) == pytest.approx(
        0.0, abs=1e-3
    )
    assert drucker_prager.apex(0.0, 0.0, sand) == 0.0 == drucker_prager.apex(0.0, 1.0, cone)
    assert (
        drucker_prager.apex(0.25e6, 0.0, cone) == pytest.approx(0.75e6 / math.tan(PHI))
        and drucker_prager.apex(2e6, 0.0, cone) == 0.0
    )
    assert drucker_prager.shear_strength(1e7, 1e6, 0.0, cone) == 0.0
    assert drucker_prager.apex(0.0, 0.0, drucker_prager.cone(drucker_prager.Parameters(0.0, 1e6))) > 1e200


@settings(max_examples=80, deadline=None)
@given(P=st.floats(-1e9, 1e11), D=st.floats(0.0, 1.0), u=st.floats(0.0, 4e6))
def test_collins_lies_between_its_branches(P, D, u):
    intact, broken = collins.intact(P, ROCK), collins.broken(P, ROCK)
    assert 0.0 <= broken <= intact <= ROCK.limiting_strength
    Y = collins.shear_strength(P, u, D, ROCK)
    soft = thermal_softening.softening(u, ROCK.melt_energy)
    assert soft * broken - 1e-3 <= Y <= soft * intact + 1e-3


def test_collins_limits():
    assert collins.intact(0.0, ROCK) == 90e6
    assert collins.intact(1e13, ROCK) == pytest.approx(ROCK.limiting_strength, rel=1e-3)
    step = 1e3  # the slope at P = 0 is the internal friction, on both sides
    assert (collins.intact(step, ROCK) - collins.intact(-step, ROCK)) / (2 * step) == pytest.approx(2.0, rel=1e-4)
    assert collins.intact(-45e6, ROCK) == pytest.approx(0.0, abs=1.0) and collins.intact(-1e9, ROCK) == 0.0
    assert collins.broken(1e8, ROCK) == pytest.approx(1e5 + 0.8e8)
    assert collins.broken(1e11, ROCK) == collins.intact(1e11, ROCK)


def test_dispatch_compares_with_the_same_invariant():
    """Limits of sqrt(J2) become limits of sqrt(3 J2)."""
    import numpy as np

    row = np.array(ROCK, dtype=float)
    number = dispatch.FAMILY.kind
    whole = math.sqrt(3) * collins.shear_strength(1e8, 0.0, 0.3, ROCK)
    assert dispatch.yield_stress(number("collins"), row, 1e8, 0.0, 0.3) == pytest.approx(whole)
    assert dispatch.yield_stress(number("von_mises"), np.array([1e9, 1e6, 0, 0, 0, 0]), 1e8, 5e5, 0.3) == 0.5e9
    assert dispatch.yield_stress(number("none"), row, 1e8, 0.0, 0.0) == 0.0
    assert dispatch.apex(number("collins"), row, 0.0, 0.0) > 1e200
