"""One small settled bed for all tests that need one."""

from __future__ import annotations

import pytest

from dem.beds import stage
from dem.trials import friction_angle
from matter.case.body import Impact, Target
from tests.dem import bodies


@pytest.fixture(scope="session")
def bed_settings() -> stage.Settings:
    layers = [
        {"name": "core", "material": "basalt", "thickness": 1842e3},
        {"name": "ocean", "material": "water", "thickness": 150e3},
        {"name": "shell", "material": "ice", "thickness": 150e3},
    ]
    impact = {
        "speed": 18234.0, "angle_from_vertical": 0.698, "projectile": {"material": "ice", "radius": 53.9e3},
        "expected_transient_diameter": 980e3,
    }  # fmt: skip
    return stage.Settings(
        target=Target.model_validate({"layers": layers}),
        impact=Impact.model_validate(impact),
        count=3000,
        arc_radius=1.0e6,
        packing="rcp",
    )


@pytest.fixture(scope="session")
def bed_run(tmp_path_factory, bed_settings):
    """A run folder with ``2_sph/target.json`` and a settled bed of 3000 grains."""
    run = tmp_path_factory.mktemp("run")
    bodies.write_callisto(run / "2_sph" / "target.json")
    (run / "3_bed").mkdir()
    stage.run(bed_settings, run, run / "3_bed")
    return run


@pytest.fixture(scope="module")
def known_friction_angle():
    """The friction angle of the default law, as ``dem.trials.friction_angle`` measures it in a minute."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction_angle, "measure", lambda contact: {"angle_deg": 27.4, "fraction": 0.58})
        yield
