"""The crater right before and right after the handover."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from crater.ground import datum
from crater.results import handover
from crater.results.measurement_config import MeasurementConfig
from fixtures import synthetic_craters as synthetic
from matter.files import snapshot
from matter.particles import Particles

RIM, SPACING = 1000.0, 110.0
TIMES = {"2_sph/snap_0001": 1.0, "2_sph/snap_0002": 2.0, "4_handoff/start": 2.0}
DEPTH = {"2_sph/snap_0001": 0.15, "2_sph/snap_0002": 0.2, "4_handoff/start": 0.25}


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    """A run handed over at 2 s: bowls of 0.15, 0.2 and, as grains, 0.25 of the diameter."""
    folder = tmp_path_factory.mktemp("run")
    for name, time in TIMES.items():
        shape = synthetic.Shape(synthetic.bowl(RIM, DEPTH[name]), RIM, 3.3 * RIM)
        cloud = synthetic.cloud_on_plane(shape, SPACING, np.random.default_rng(3), "jitter")
        (folder / name).parent.mkdir(exist_ok=True)
        particles = Particles(synthetic.as_fields(cloud, SPACING), {"time": time})
        snapshot.write(particles, folder / f"{name}{snapshot.SUFFIX}")
    (folder / "4_handoff" / "handoff.json").write_text(json.dumps({"time_s": 2.0}))
    return folder


def shots(run: Path) -> list[Path]:
    return [run / f"2_sph/snap_000{k}{snapshot.SUFFIX}" for k in (1, 2)]


def test_the_snapshot_that_was_handed_over_is_the_one_at_that_time(run, tmp_path):
    assert handover.shock_snapshot(run, shots(run)) == shots(run)[1]
    assert handover.shock_snapshot(run, shots(run)[:1]) is None
    assert handover.shock_snapshot(tmp_path, shots(run)) is None


def test_both_sides_and_their_change(run):
    chosen = MeasurementConfig(datum.plane(), None, 1.6, 300.0, None, 2.0 * RIM)
    before = handover.closely(handover.shock_snapshot(run, shots(run)), "sph", chosen, None)
    after = handover.closely(run / handover.START, "dem", chosen, None)
    found = handover.facts(before, after, run)
    assert found["time_s"] == 2.0
    assert found["snapshots"] == {"before": "2_sph/snap_0002.vtkhdf", "after": "4_handoff/start.vtkhdf"}
    depth = found["depth_m"]
    assert depth["change"]["value"] == pytest.approx(depth["after"]["value"] - depth["before"]["value"], rel=1e-12)
    assert depth["change"]["sigma"] == pytest.approx(math.hypot(depth["after"]["sigma"], depth["before"]["sigma"]))
    assert depth["change"]["value"] > 3.0 * depth["change"]["sigma"]
    assert depth["before"]["value"] == pytest.approx(2.0 * RIM * DEPTH["2_sph/snap_0002"], rel=0.1)
    assert set(handover.NAMES) < set(found)


def test_nothing_is_said_where_one_side_is_missing(run):
    chosen = MeasurementConfig(datum.plane(), None, 1.6, 300.0, None, 2.0 * RIM)
    assert handover.closely(run / "4_handoff" / "none.vtkhdf", "dem", chosen, None) is None
    after = handover.closely(run / handover.START, "dem", chosen, None)
    assert handover.facts(None, after, run) == {} and handover.changes(after, None) == {}
