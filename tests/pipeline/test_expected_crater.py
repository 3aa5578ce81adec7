"""The crater that is expected of an impact, against numbers worked out from the published laws by hand."""

from __future__ import annotations

import math

import pytest

from crater.scaling import crater_size as scaling
from matter.case.body import Impact, Target
from pipeline.case import expected_crater
from sph.materials.rows import collect


def shot(radius: float, speed: float = 12e3, angle: float = 0.0, material: str = "granite") -> Impact:
    ball = {"material": material, "radius": radius}
    return Impact.model_validate(
        {"speed": speed, "angle_from_vertical": angle, "projectile": ball, "expected_transient_diameter": 1.0}
    )


def ground(gravity: float, material: str = "granite") -> Target:
    layer = {"name": "ground", "material": material, "thickness": 1e3}
    return Target.model_validate({"shape": "half_space", "gravity": gravity, "layers": [layer]})


def test_weight_alone_is_the_mean_of_the_laws():
    """Water: no strength; Zahnle, Collins, Schmidt-Housen."""
    found = expected_crater.of_case(ground(9.81, "water"), shot(100.0, material="water"), collect(("water",)))
    event = scaling.ImpactEvent(100.0, 12e3, 0.0, 9.81, found.ground.density, found.ground.density)
    laws = [scaling.LAWS[name](event) for name in scaling.GROUNDS["fluid"]]
    assert found.ground.kind == "fluid" and found.diameter == pytest.approx(math.prod(laws) ** (1.0 / 3.0), rel=1e-9)
    assert not found.held


def test_strength_alone_is_holsapples_law():
    """V = K m / rho pi_3^(-3 mu / 2), K = 0.095, mu = 0.55 (Holsapple 1993), as a paraboloid of d / D = 1/3;
    Schmidt-Housen's exponent differs by 1 %."""
    found = expected_crater.of_case(ground(0.0), shot(0.5), collect(("granite",)))
    pi_3 = found.ground.strength / (2680.0 * 12e3**2)
    volume = 0.095 * 4.0 / 3.0 * math.pi * 0.5**3 * pi_3 ** (-1.5 * 0.55)
    paraboloid = (24.0 * volume / math.pi) ** (1.0 / 3.0)
    # the geometric mean with Schmidt-Housen, which lies 1.3 to 1.7 times higher
    assert 1.0 < found.diameter / paraboloid < 1.35
    assert found.held


def test_the_regime_changes_between_metres_and_kilometres():
    held = [
        expected_crater.of_case(ground(9.81), shot(radius), collect(("granite",))).held
        for radius in (0.05, 0.5, 100.0, 25e3)
    ]
    assert held == [True, True, False, False]


def test_faster_and_larger_makes_larger():
    sizes = [
        expected_crater.of_case(ground(9.81), shot(r, v), collect(("granite",))).diameter
        for r, v in ((100.0, 12e3), (100.0, 24e3), (200.0, 12e3))
    ]
    assert sizes[1] / sizes[0] == pytest.approx(2.0**0.44, rel=0.03)
    assert sizes[2] / sizes[0] == pytest.approx(2.0**0.78, rel=0.03)


def layered(*layers: tuple[str, float], shape: str = "half_space") -> Target:
    """Flat ground or a ball of (material, thickness [m]), the lowest first."""
    told = [{"name": name, "material": name, "thickness": thickness} for name, thickness in layers]
    gravity = {} if shape == "sphere" else {"gravity": 3.71}
    return Target.model_validate({"shape": shape, "layers": told, **gravity})


def test_of_several_layers_that_one_counts_in_which_the_middle_of_the_crater_lies():
    """2 m of regolith over ice: the ice's crater. 40 m of it: the regolith's own."""
    rows = collect(("ice", "regolith", "basalt"))
    impact = shot(2.0, 7e3, material="basalt")
    deep = {name: expected_crater.of_case(layered((name, 1e3)), impact, rows).diameter for name in ("ice", "regolith")}
    cover = expected_crater.of_case(layered(("ice", 1e3), ("regolith", 2.0)), impact, rows)
    assert cover.material == "ice" and cover.held and cover.diameter == deep["ice"]
    told = expected_crater.of_case(layered(("ice", 1e3), ("regolith", 2.0)), impact, rows, diameter=50.0)
    assert told.material == "ice" and told.diameter == 50.0
    thick = expected_crater.of_case(layered(("ice", 1e3), ("regolith", 40.0)), impact, rows)
    assert thick.material == "regolith" and thick.ground.kind == "sand" and thick.diameter == deep["regolith"]


def test_a_crater_that_reaches_hard_ground_below_ends_there():
    """Lunar soil that is deep enough for the middle of basalt's own crater, but not for that of the soil's."""
    rows, impact = collect(("regolith", "basalt")), shot(2.0, 7e3, material="basalt")
    soil, rock = (
        expected_crater.of_case(layered((name, 1e3)), impact, rows).diameter for name in ("regolith", "basalt")
    )
    middle = (1.0 - math.sqrt(0.5)) / 3.0  # half of a paraboloid a third as deep as wide lies above
    depth = middle * math.sqrt(soil * rock)
    found = expected_crater.of_case(layered(("basalt", 1e3), ("regolith", depth)), impact, rows)
    assert rock < found.diameter < soil and 0.9 * depth < middle * found.diameter < depth
    assert found.material == "regolith"


def test_a_body_with_a_crater_as_wide_as_itself_breaks():
    """8 km at 5 km/s into 100 km of basalt, half of the energy of Benz & Asphaug 1999; a kilometre makes a crater."""
    rows, body = collect(("basalt",)), layered(("basalt", 50e3), shape="sphere")
    large, small = (expected_crater.of_case(body, shot(a, 5e3, material="basalt"), rows) for a in (8e3, 1e3))
    assert large.breaks and large.diameter == 50e3
    assert not small.breaks and small.diameter < 0.8 * 100e3
