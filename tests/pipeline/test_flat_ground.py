"""A bowl of loose flat ground through the whole chain: shock stage, settled bowl of grains, handoff, collapse, crater.
Half a minute: ``pytest -m validation``. The chain on flat ground is in the fast suite by ``test_first_crater.py``, a
bowl's settling by ``tests/dem/test_flat_bed.py``, a literal start by ``tests/sph/test_ground.py``."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from matter.files import snapshot

pytestmark = pytest.mark.validation

ROOT = Path(__file__).resolve().parents[2]
CASE = """\
[case]
title = "A block of half a metre into a bowl of loose ground"
source = "none: a test of the chain"
stages = ["sph", "bed", "handoff", "dem", "crater"]

[target]
shape = "half_sphere"
start = "literal"
gravity = "1 m/s^2"

[[target.layers]]
name = "soil"
material = "basalt"
thickness = "10 m"

[impact]
speed = "3 km/s"
angle_from_vertical = "0 deg"
expected_transient_diameter = "6 m"

[impact.projectile]
material = "basalt"
radius = "0.6 m"

[sph]
numerics = "monaghan"  # a hollow of two spacings, 1.55 m deep; 1.3 m, the least that is found, with the default
spacing_at_impact = "0.8 m"
spacing_far = "1.5 m"
fine_radius = "3 m"
growth = 0.1
contact_refinement = 1.0
projectile_particles = 1
sides = "quiet"
edge_width = "3 m"
end_time = "30 ms"
snapshot_interval = "10 ms"
history_interval = "5 ms"

[sph.late]
at = "5 ms"
sound_speed = "150 m/s"

[sph.materials.basalt]
strength = "drucker_prager"
predamaged = true

[bed]
count = 1500
arc_radius = "10 m"
shape = "bowl"
headroom_fraction = 0.3
largest_speed = "20 m/s"

[handoff]
time = "last"

[dem]
end_time = "1 s"
latest_time = "2 s"
still_interval = "0.3 s"
snapshot_interval = "0.2 s"
history_interval = "0.05 s"

[dem.contact]
static_overlap = 0.1
overlap_stop = 1.5
steps_per_contact = 20
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> Path:
    """The run folder."""
    place = tmp_path_factory.mktemp("bowl")
    (place / "case.toml").write_text(CASE)
    code = "from pipeline.cli import run_case; run_case()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    command = [sys.executable, "-c", code, str(place / "case.toml"), "--out", str(place / "runs")]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    # at this size (a cavity three grains deep) limits of the handoff may well be broken
    assert process.returncode in (0, 1) and "Traceback" not in process.stderr, process.stdout + process.stderr
    return next((place / "runs").glob("bowl*-*"))


def test_the_bowl_carries_its_weight_though_the_shock_stage_began_without_it(done):
    target = json.loads((done / "2_sph" / "target.json").read_text())
    assert not any(target["profile"]["pressure_Pa"])
    report = json.loads((done / "3_bed" / "bed_report.json").read_text())
    assert report["weight_carried"] == pytest.approx(1.0, abs=3e-3)
    assert report["mass_kg"] == pytest.approx(2.0 / 3.0 * 3.14159 * 10.0**3 * 2700.0, rel=0.02)


def test_what_is_handed_over_closes_its_books(done):
    rows = {row["name"]: row for row in json.loads((done / "4_handoff" / "ledger.json").read_text())}
    assert abs(rows["mass_total_rel"]["value"]) < 1e-12
    assert abs(rows["momentum_linear_rel_after"]["value"]) < 1e-10
    start = snapshot.read(done / "4_handoff" / "start.vtkhdf")
    assert start.attributes["frame"] == "plane" and start.attributes["domain"]["shape"] == "bowl"


def test_a_hollow_is_left_in_the_grains(done):
    """The flow that is handed over at 30 ms goes on: the hollow of the grains is wider than the crater of the shock
    stage, holds at least as much within the errors, and no wider than free flight would make it. Grains that lose the
    flow leave 5.2 m and 15 m^3 of 5.9 m and 21 m^3. (A bound of 1 m of depth stood here while ground in motion was
    taken for ejecta: at 1590728 the handoff emptied a cavity of 6.4 m radius and 139 m^3 where the shock stage had dug
    12.)"""
    report = json.loads((done / "5_dem" / "stage_report.json").read_text())
    assert report["momentum_error"] < 1e-9 and abs(report["energy_error"]) < 0.01
    measures = json.loads((done / "6_crater" / "measures.json").read_text())
    dug, left = measures["transient"], measures["final"]
    assert 0.5 < dug["depth_m"]["value"] < 4.0
    assert left["diameter_apparent_m"]["value"] > 1.2 * dug["diameter_apparent_m"]["value"]
    assert left["volume_m3"]["value"] + left["volume_m3"]["sigma"] > dug["volume_m3"]["value"]
    flown = heights(done / "6_crater" / "profile_ballistic.csv")
    rim = (
        min(r for r, h in flown.items() if r > 2.0 and h > -0.1)
        if any(h > -0.1 for r, h in flown.items() if r > 2.0)
        else max(flown)
    )
    assert 0.5 * left["diameter_apparent_m"]["value"] < 1.2 * rim
    assert max(h for r, h in heights(done / "6_crater" / "profile.csv").items() if 1.0 < r < 4.0) < 0.0


def test_the_ground_around_the_hollow_stays(done):
    grains = snapshot.read(done / "5_dem" / f"last{snapshot.SUFFIX}")
    x, y, z = grains.position.T
    ring = (np.hypot(x, y) > 7.0) & (np.hypot(x, y) < 9.0)
    assert np.percentile((z + grains.radius)[ring], 90.0) > -0.5


def heights(path: Path) -> dict[float, float]:
    """Height by radius of a profile [m]."""
    with open(path) as file:
        return {
            float(row["radius_m"]): float(row["height_m"])
            for row in csv.DictReader(line for line in file if not line.startswith("#"))
        }
