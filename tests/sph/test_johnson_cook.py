"""Johnson-Cook strength: the formula at stated points, and the plastic strain that a sheared particle gathers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sph.bodies.particle_cloud import Cloud
from sph.materials.rows import collect
from sph.materials.settings import Choice
from sph.stepping import state
from sph.stepping.integrator import Environment, Integrator
from sph.stepping.numerics import Numerics
from sph.strength import dispatch, johnson_cook

KIND = dispatch.FAMILY.kind("johnson_cook")
COPPER = johnson_cook.EXAMPLE


@pytest.mark.parametrize(
    ("strain", "rate", "T", "MPa"),
    [
        (0.0, 1.0, 298.0, 90.0),
        (0.3, 1.0, 298.0, 291.0437),
        (0.3, 1e4, 298.0, 358.0590),
        (1.0, 1e4, 827.0, 249.1903),
        (0.05, 1e6, 1250.2, 29.97597),
        (0.5, 1e3, 1356.0, 0.0),
        (0.5, 1e3, 2000.0, 0.0),
    ],
)
def test_yield_stress_of_ofhc_copper(strain, rate, T, MPa):
    """Constants of Johnson & Cook 1983, melting at 1356 K; values by hand: A + B 0.3^0.31 = 90 + 292 x 0.68851."""
    p = COPPER._replace(strain_rate=rate, melt_energy=1.0)
    row = np.array([*p])
    heat = (T - 298.0) / (1356.0 - 298.0)
    limit = dispatch.yield_stress(KIND, row, 1e9, heat, 0.3) * dispatch.hardening(KIND, row, strain)
    assert limit == pytest.approx(MPa * 1e6, rel=1e-5, abs=1e-6)


def test_other_laws_do_not_harden():
    for kind in range(len(dispatch.FAMILY.names)):
        assert (dispatch.hardening(kind, np.ones(dispatch.FAMILY.width), 0.5) != 1.0) == (kind == KIND)


def sheared(name, choice, steps, step):
    """A particle at rest, sheared in ``steps`` of engineering strain ``step``: J2 and plastic strain on the way."""
    materials = collect((name,), {name: choice})
    body = Cloud(1)
    body.mass[:], body.density[:], body.support_radius[:] = 1.0, materials.rho0[0], 1.0
    body.neighbours[:], body.distention[:], body.initial_distention[:] = 50, 1.0, 1.0
    body.plastic_strain = np.zeros(1 if materials.harden else 0)
    out, found = state.Evaluated(1), []
    for _ in range(steps):
        body.stress[0, 1] += materials.rows.shear[0] * step
        state.evaluate(body, materials.rows, True, False, out)
        found.append((body.stress[0, 1], *body.plastic_strain))
    return np.array(found), materials


@pytest.mark.validation
def test_plastic_strain_is_what_was_sheared_less_what_is_elastic():
    """gamma / sqrt(3) = eps + sqrt(3) tau / (3 G), to rounding, and Y(eps) holds, to the step: aluminium 6061 to a
    shear of 30 %."""
    found, materials = sheared("aluminum_6061", Choice(damage="none"), 3000, 1e-4)
    stress, strain = found.T
    gamma = 1e-4 * np.arange(1, 3001)
    G = materials.rows.shear[0]
    assert gamma / math.sqrt(3.0) == pytest.approx(strain + stress / (math.sqrt(3.0) * G), rel=1e-9)
    limit = 324e6 + 114e6 * strain[-1] ** 0.42
    assert math.sqrt(3.0) * stress[-1] == pytest.approx(limit, rel=1e-4)
    first = np.argmax(strain > 0.0)
    assert math.sqrt(3.0) * stress[first] == pytest.approx(324e6, rel=1e-6) and first == pytest.approx(
        324e6 / math.sqrt(3.0) / G / 1e-4, abs=1.5
    )


@pytest.mark.validation
def test_a_material_that_does_not_harden_keeps_its_stress_to_the_last_bit_beside_one_that_does():
    plain, _ = sheared("basalt", Choice(damage="none"), 50, 1e-2)
    materials = collect(("basalt",), {"basalt": Choice(damage="none")})
    body = Cloud(1)
    body.mass[:], body.density[:], body.support_radius[:] = 1.0, 2700.0, 1.0
    body.neighbours[:], body.distention[:], body.initial_distention[:], body.plastic_strain = 50, 1.0, 1.0, np.zeros(1)
    out = state.Evaluated(1)
    for one in plain[:, 0]:
        body.stress[0, 1] += materials.rows.shear[0] * 1e-2
        state.evaluate(body, materials.rows, True, False, out)
        assert body.stress[0, 1] == one
    assert body.plastic_strain[0] > 0.1


def test_a_material_that_hardens_keeps_its_plastic_strain():
    materials = collect(("aluminum_6061",), {})
    cloud = Cloud(8)
    cloud.mass[:], cloud.density[:], cloud.support_radius[:] = 1.0, 2703.0, 2.0
    cloud.position[:] = np.stack(np.meshgrid(*((0.0, 1.0),) * 3), axis=-1).reshape(-1, 3)
    Integrator(cloud, materials, 1.0, Numerics(), Environment())
    assert len(cloud.plastic_strain) == 8
