"""The densities that the scaling laws are given: of what the shock stage began with, of the material's file else."""

import json

import pytest

from crater.results import findings
from crater.settings import Settings
from matter.case import at_rest
from matter.constants import G

IMPACT = {
    "speed": 6000.0,
    "angle_from_vertical": 0.0,
    "projectile": {"material": "aluminum", "radius": 0.5},
    "expected_transient_diameter": 20.0,
}
ELLIPSOID = {"shape": "ellipsoid", "axes": [60.0, 55.0, 40.0], "layers": [{"name": "rubble", "material": "basalt"}]}


def settings(material: str = "basalt", **target) -> Settings:
    ball = {"layers": [{"name": "all", "material": material, "thickness": 100.0}]}
    return Settings.model_validate({"target": target or ball, "impact": IMPACT})


def written(run, **facts):
    (run / "2_sph").mkdir()
    (run / "2_sph" / "target.json").write_text(json.dumps(facts))


def test_a_body_of_any_shape_is_as_dense_as_the_shock_stage_says(tmp_path):
    """Its target.json holds mass and volume, and no profile."""
    written(tmp_path, frame="solid", mass_kg=2400.0 * 5e4, volume_m3=5e4)
    assert findings.densities(settings(**ELLIPSOID), tmp_path, None)[1] == pytest.approx(2400.0)


def test_ground_of_layers_is_as_dense_as_its_surface(tmp_path):
    written(tmp_path, profile={"density_kg_m3": [2000.0, 1800.0]})
    assert findings.densities(settings(), tmp_path, None)[1] == 1800.0


def test_without_a_shock_stage_the_file_counts_with_its_pores(tmp_path):
    from crater.stage import _ground

    ball, ground = findings.densities(settings("pumice"), tmp_path, None)
    bulk = at_rest.of_file("pumice").bulk
    assert (ball, ground) == (at_rest.of_file("aluminum").bulk, bulk) and bulk < 700.0
    assert _ground(settings("pumice"), tmp_path)[1] == pytest.approx(4 / 3 * 3.141592653589793 * G * bulk * 100.0)
