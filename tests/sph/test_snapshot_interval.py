"""``snapshot_interval`` to the letter: a snapshot at every multiple of it and at the end, whatever the interval of the
history."""

import csv

import numpy as np
import pytest

from matter.case.body import Impact, Layer, Projectile, Target
from matter.files import snapshot
from sph import stage

ROCK = Target(layers=(Layer(name="rock", material="basalt", thickness=6e3),), shape="block", width=12e3)
IMPACT = Impact(
    speed=5e3,
    angle_from_vertical=0.0,
    projectile=Projectile(material="basalt", radius=700.0),
    expected_transient_diameter=8e3,
)


def run(folder, **intervals):
    """Times [s] of the snapshots and of the rows of the history."""
    chosen = stage.Settings(
        target=ROCK, impact=IMPACT, spacing_at_impact=900.0, spacing_far=1500.0, fine_radius=3e3, growth=0.1,
        contact_refinement=1.0, contact_radius=2e3,
        relaxation_time=0.1, damping=0.5, first_step=0.01, edge_width=3e3, **intervals,
    )  # fmt: skip
    stage.run(chosen, folder, folder)
    with open(folder / "history.csv", newline="") as file:
        rows = [float(row["time_s"]) for row in csv.DictReader(file)]
    return [float(snapshot.attributes(path)["time"]) for path in snapshot.series(folder)], rows


@pytest.mark.parametrize("history", [0.125, 0.2, 0.5, 0.7, 5.0])
def test_half_a_second_gives_a_snapshot_every_half_second(tmp_path, history):
    shots, rows = run(tmp_path, end_time=1.6, snapshot_interval=0.5, history_interval=history)
    assert shots == pytest.approx([0.0, 0.5, 1.0, 1.5, 1.6], abs=1e-9)
    wanted = {round(k * history, 9) for k in range(1 + int(1.6 / history + 1e-9))}
    assert wanted <= set(np.round(rows, 9)) and rows == sorted(rows)


def test_no_snapshot_twice_where_the_end_is_a_multiple(tmp_path):
    shots, _ = run(tmp_path, end_time=1.0, snapshot_interval=0.5, history_interval=0.3)
    assert shots == pytest.approx([0.0, 0.5, 1.0], abs=1e-9)
