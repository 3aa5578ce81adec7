"""A bowl of loose flat ground through the whole chain: shock stage, settled bowl of grains, handoff, collapse, crater. Half a minute."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from matter import snapshot

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
    report = json.loads((done / "5_dem" / "stage_report.json").read_text())
    assert report["momentum_error"] < 1e-9 and abs(report["energy_error"]) < 0.01
    measures = json.loads((done / "6_crater" / "measures.json").read_text())
    assert 0.5 < measures["transient"]["depth_m"]["value"] < 4.0
    with open(done / "6_crater" / "profile.csv") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    height = {float(row["radius_m"]): float(row["height_m"]) for row in rows}
    assert max(h for r, h in height.items() if 1.0 < r < 4.0) < -1.0
    assert min(h for r, h in height.items() if 7.0 < r < 9.0) > -0.5
