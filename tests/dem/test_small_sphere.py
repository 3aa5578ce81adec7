"""A cap of a sphere so small that its weight asks for softer springs than its solid has: a cap of Ryugu's size."""

import json
import math

import numpy as np
import pytest

from dem.beds import expected_grains, stage
from dem.beds.layered_body import LayeredBody
from dem.contact.settings import Contact
from dem.stiffness.stiffening import springs_for
from matter.case.body import Impact, Target
from matter.files import snapshot
from tests.dem import bodies

DENSITY, RADIUS = 1227.0, 448.0


@pytest.fixture(scope="module")
def settings():
    impact = {
        "speed": 2000.0,
        "angle_from_vertical": 0.0,
        "projectile": {"material": "copper", "radius": 0.0376},
        "expected_transient_diameter": 14.5,
    }
    return stage.Settings(
        target=Target.model_validate({"layers": [{"name": "soil", "material": "basalt", "thickness": RADIUS}]}),
        impact=Impact.model_validate(impact),
        contact=Contact(static_overlap=0.01),
        count=500,
        packing="rcp",
        arc_radius=9.0,
        depth=7.0,
        densities={"basalt": {"bulk": DENSITY, "solid": 2700.0}},
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory, settings):
    """A settled cap; the shock stage began without stress, so that its profile holds no pressure."""
    run = tmp_path_factory.mktemp("cap")
    path = run / "2_sph" / "target.json"
    bodies.write_layered(path, [("soil", "basalt", 0.0, RADIUS)], {}, core_density=DENSITY)
    content = json.loads(path.read_text())
    content["profile"]["pressure_Pa"] = [0.0] * len(content["profile"]["radius_m"])
    path.write_text(json.dumps(content))
    (run / "3_bed").mkdir()
    stage.run(settings, run, run / "3_bed")
    return run


def test_pressure_where_the_shock_stage_had_none_is_that_of_the_weight(run):
    body = LayeredBody.read(run / "2_sph" / "target.json")
    centre = 2.0 / 3.0 * math.pi * bodies.G * DENSITY**2 * RADIUS**2
    assert body.pressure(np.array(0.5 * RADIUS)) == pytest.approx(0.75 * centre, rel=1e-3)


def test_it_settles_in_springs_for_its_weight(run, settings):
    report = json.loads((run / "3_bed" / "bed_report.json").read_text())
    bed = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    weight = DENSITY * 4.0 / 3.0 * math.pi * bodies.G * DENSITY * RADIUS * settings.depth
    assert report["floor_pressure_target_Pa"] == pytest.approx(weight, rel=0.02)
    assert report["floor_pressure_Pa"] == pytest.approx(weight, rel=0.05)
    assert report["residual_speed_over_sqrt_g_r"]["rms"] < 1e-3
    assert 0.0 < report["free_run_speed_over_sqrt_g_r"] < 1e-3
    assert np.allclose(bed.stiffness / bed.radius, report["floor_pressure_target_Pa"] / (0.03 * 0.01))
    # in the springs of its solid the step would be 10 microseconds
    assert expected_grains.hard(settings)
    assert report["time_step_s"] == pytest.approx(expected_grains.expected(settings).step, rel=0.2) and (
        report["time_step_s"] > 0.01
    )


def test_a_collapse_takes_springs_for_its_flow(run):
    start = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    start = start.select(start.headroom == 0)
    start["velocity"][np.argmax(start.position[:, 2])] = [0.0, 0.0, -0.03]
    asked = springs_for("auto", start, Contact(static_overlap=0.01), sphere=True)
    assert 0.0 < asked.speed < 0.03 and asked.factor > 1.0
