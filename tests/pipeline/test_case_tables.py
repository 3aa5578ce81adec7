"""What the tables of Deep Impact and momentum transfer read from snapshots, on clouds with known answers."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from matter.particles import Particles

PATH = Path(__file__).resolve().parents[2] / "studies" / "benz_jutzi_runs.py"
spec = importlib.util.spec_from_file_location("benz_jutzi_runs", PATH)
assert spec is not None and spec.loader is not None
benz_jutzi = importlib.util.module_from_spec(spec)
spec.loader.exec_module(benz_jutzi)


def cloud(position, velocity, layer, **more):
    """Particles of 1 kg in the half-sphere of 22 m."""
    x = np.asarray(position, dtype=float)
    fields = {
        "position": x, "initial_position": x.copy(), "velocity": np.asarray(velocity, dtype=float),
        "mass": np.ones(len(x)),
        "layer": np.asarray(layer, dtype=np.int32), "smoothing_length": np.full(len(x), 1.0), **more,
    }  # fmt: skip
    return Particles(fields, {"target_depth_m": 22.0, "time": 0.05})


def test_rising_matter_is_counted_by_its_vertical_speed_away_from_the_rim():
    place = [[0, 0, -1], [0, 0, 1], [0, 0, -2], [0, 0, -18], [0, 0, 0.5]]
    speed = [[0, 0, 3], [9, 0, 1.5], [9, 0, -3], [0, 0, 9], [0, 0, 30]]
    row = benz_jutzi.ejecta(cloud(place, speed, [0, 0, 0, 0, -1]))
    assert row["mass_kg"] == [2.0, 2.0, 1.0] and row["air_kg"] == [1.0, 1.0, 0.0]
    assert row["momentum"] == [4.5, 4.5, 3.0] and row["ball_momentum"] == [30.0, 30.0, 30.0]


def test_transferred_momentum_counts_the_projectile_and_its_peak():
    series = {
        "time_s": [0.0, 1e-3, 2e-3],
        "momentum": [[0.0] * 3, [8.0] * 3, [4.0] * 3],
        "ball_momentum": [[0.0] * 3, [1.0] * 3, [1.0] * 3],
    }
    row = {"series": series, "projectile_momentum": 10.0}
    assert benz_jutzi.transferred(row, 1.0) == pytest.approx([1.0, 1.9, 1.5])


def test_a_front_of_known_speed_arrives_in_time():
    depths, times, speed = np.arange(1.0, 30.0), [i * 1e-3 for i in range(15)], 2500.0
    final = 1e9 / depths**2
    looks = [np.where(depths <= speed * t + 1e-9, final, 1e-3 * final) for t in times]
    found = benz_jutzi.arrivals(times, looks, depths)
    assert found["arrival_s"] == pytest.approx([d / speed for d in benz_jutzi.DEPTHS], abs=0.3e-3)
    assert found["peak_Pa"] == pytest.approx([1e9 / d**2 for d in benz_jutzi.DEPTHS])


def test_the_compacted_zone_and_a_profile_that_falls():
    depth = np.repeat(np.arange(0.5, 16.0), 6)
    place = np.stack([np.zeros_like(depth), np.zeros_like(depth), -depth], axis=1)
    alpha = np.clip(1.0 + 0.4 * (depth - 3.2), 1.0, 3.0)
    row = {"rings": benz_jutzi.rings(cloud(place, np.zeros_like(place), np.zeros(len(depth)), distention=alpha), 1.0)}
    assert benz_jutzi.compacted(row) == (3.0, True)
    row["rings"]["distention"][9] -= 0.5
    assert benz_jutzi.compacted(row) == (3.0, False)


def test_the_slope_of_a_power_law():
    v = benz_jutzi.SPEEDS
    assert benz_jutzi.slope({"speed_m_s": v.tolist(), "mass_above_kg": (v**-1.4).tolist()}) == pytest.approx(-1.4)


def test_printed_resolutions_are_those_of_a_hexagonal_lattice():
    assert benz_jutzi.lattice(0.0, 22.0, 917.0, 700_000) == pytest.approx((0.356, 29.2), rel=2e-3)
    assert benz_jutzi.lattice(400.0, 0.0, 5500.0, 15) == pytest.approx((0.190, 26.7), rel=3e-3)
