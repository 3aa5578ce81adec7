"""Weight that an ellipsoid or mesh bears from the start: pressures against closed forms, and that it stays at rest."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from matter.case.body import Target
from matter.constants import G
from matter.files import snapshot
from sph.bodies import solid_target
from sph.bodies.target import Zones
from sph.materials.rows import collect

RHO = 2700.0
UNIFORM = Zones(5.0, 1.0, 5.0, 1.0, 5.0, 0.3)
CASE = """
[case]
title = "A body without an impact"
stages = ["sph"]
[target]
shape = "ellipsoid"
axes = ["1004 m", "1004 m", "876 m"]
spin_period = "7.63 h"
[[target.layers]]
material = "basalt"
[impact]
speed = "2 km/s"
angle_from_vertical = "0 deg"
expected_transient_diameter = "14.5 m"
[impact.projectile]
material = "copper"
radius = "1 m"
[sph]
control = true
numerics = "reconstructed"
spacing_at_impact = "10 m"
spacing_far = "60 m"
fine_radius = "30 m"
growth = 0.3
first_step = "1 us"
end_time = "4 s"
snapshot_interval = "4 s"
history_interval = "1 s"
[sph.late]
at = "15 ms"
sound_speed = "50 m/s"
[sph.materials.basalt]
strength = "drucker_prager"
predamaged = true
"""


def body(axes: tuple[float, float, float], **more) -> Target:
    return Target.model_validate(
        {"shape": "ellipsoid", "axes": list(axes), "layers": [{"name": "rock", "material": "basalt"}], **more}
    )


def borne(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) in the body's own frame, and pressures (n,)."""
    built = solid_target.build(target, collect(("basalt",)), UNIFORM, 1)
    found = solid_target.weight(target, collect(("basalt",)), built.position, built.mass)
    return built.position @ target.placed.turn, found


def test_a_ball_bears_the_weight_of_what_lies_above():
    place, found = borne(body((150.0,) * 3))
    known = 2.0 / 3.0 * math.pi * G * RHO**2 * (75.0**2 - np.sum(place**2, axis=1))
    middle = known.max()
    assert np.sqrt(np.mean((found - known) ** 2)) < 0.01 * middle
    assert np.abs(found - known).max() < 0.04 * middle


@pytest.mark.validation
def test_a_spheroid_that_turns_as_a_fluid_would_is_in_balance():
    """Maclaurin's spheroid of c = 0.8 a: P = pi G rho^2 A_3 c^2 (1 - (x^2 + y^2) / a^2 - z^2 / c^2). Source:
    Chandrasekhar 1969, Ellipsoidal Figures of Equilibrium, section 32."""
    a, c = 90.0, 72.0
    e = math.sqrt(1.0 - (c / a) ** 2)
    polar = 2.0 / e**2 * (1.0 - math.sqrt(1.0 - e**2) * math.asin(e) / e)
    omega2 = 2.0 * math.pi * G * RHO * (
        math.sqrt(1.0 - e**2) * (3.0 - 2.0 * e**2) * math.asin(e) / e**3 - 3.0 * (1.0 - e**2) / e**2
    )  # fmt: skip
    period = 2.0 * math.pi / math.sqrt(omega2)
    place, found = borne(body((2 * a, 2 * a, 2 * c), spin_period=f"{period} s"))
    middle = math.pi * G * RHO**2 * polar * c**2
    known = middle * (1.0 - (place[:, 0] ** 2 + place[:, 1] ** 2) / a**2 - place[:, 2] ** 2 / c**2)
    assert np.sqrt(np.mean((found - known) ** 2)) < 0.015 * middle
    # told apart from the same body at rest, whose equator bears more
    _, still = borne(body((2 * a, 2 * a, 2 * c)))
    assert np.sqrt(np.mean((still - known) ** 2)) > 0.05 * middle


def test_a_literal_start_bears_nothing():
    literal = body((150.0,) * 3, start="literal")
    built = solid_target.build(literal, collect(("basalt",)), UNIFORM, 1)
    assert (built.density == built.density[0]).all()
    assert (solid_target.weight(literal, collect(("basalt",)), built.position, built.mass) == 0.0).all()


@pytest.mark.validation
def test_a_body_that_bears_its_weight_stays_at_rest_also_across_a_softer_late_stage(tmp_path, run_case):
    """A literal start falls by g t, some 0.7 mm/s in four seconds, all of it."""
    (tmp_path / "case.toml").write_text(CASE)
    code, folder = run_case(tmp_path)
    assert code == 0
    last = snapshot.read(folder / "2_sph" / "last.vtkhdf")
    outwards = last.position / np.linalg.norm(last.position, axis=1)[:, None]
    up = np.einsum("ij,ij->i", last.velocity, outwards)
    fall = 1.4e-4 * 4.0
    assert math.sqrt(last.mass @ up**2 / last.mass.sum()) < 0.15 * fall
    assert last.pressure.max() == pytest.approx(2.0 / 3.0 * math.pi * G * RHO**2 * 470.0**2, rel=0.2)


BLOCKS = """
[[target.blocks]]
material = "gabbro"
law = "list"
[[target.blocks.placed]]
at = ["30 m", "0 m"]
depth = "45 m"
size = ["70 m", "70 m", "70 m"]
[[target.blocks.placed]]
at = ["-60 m", "20 m"]
depth = "60 m"
size = ["90 m", "80 m", "80 m"]
"""
POROUS = """
porosity = "p_alpha"
p_alpha = { alpha0 = 1.5 }
crush_quadratic = { Pe = "10 MPa", Ps = "1.5 GPa" }
tension = { cut = "0 Pa" }
"""


@pytest.mark.validation
def test_a_body_with_blocks_stays_at_rest_and_turns_about_its_centre_of_mass(tmp_path, run_case):
    """Dense blocks to one side: neither they nor the ground fall, and the whole goes nowhere."""
    case = CASE.replace("[impact]\n", BLOCKS + "[impact]\n").replace('"30 m"\ngrowth', '"90 m"\ngrowth') + POROUS
    (tmp_path / "case.toml").write_text(case)
    code, run = run_case(tmp_path)
    assert code == 0
    folder = run / "2_sph"
    last, report = snapshot.read(folder / "last.vtkhdf"), json.loads((folder / "stage_report.json").read_text())
    assert report["blocks"]["resolved"] == 2 and report["blocks"]["whole"] == 2
    centre, drift = (last.mass @ values / last.mass.sum() for values in (last.position, last.velocity))
    omega = np.array(json.loads((folder / "target.json").read_text())["angular_velocity_1_s"])
    fall = 4.0 * np.pi / 3.0 * G * 1800.0 * 470.0 * 4.0
    assert np.linalg.norm(np.cross(omega, centre)) > 1e-3 * fall  # what it would drift by
    assert np.linalg.norm(drift) < 1e-9 * fall
    rest = last.velocity - drift - np.cross(omega, last.position - centre)
    rms = np.sqrt(last.mass @ np.einsum("ij,ij->i", rest, rest) / last.mass.sum())
    assert rms < 0.15 * fall
    for number in (0, 1):
        mine = last["block"] == number
        assert np.linalg.norm(last.mass[mine] @ rest[mine] / last.mass[mine].sum()) < 0.15 * fall
