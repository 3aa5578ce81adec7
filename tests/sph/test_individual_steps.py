"""What steps of their own would gain: powers of two, the bound between neighbours, visits saved, and where it is
written."""

import json

import numpy as np
import pytest

from matter.geometry import neighbours
from sph.pairs.scheme import Pairs
from sph.stepping import individual_steps
from tests.sph.test_smoothing import stopped_and_whole

NONE = np.zeros(0, dtype=np.int64)


def chain(n: int, spacing: float) -> Pairs:
    """n particles in a row that see their next neighbours, or nobody where ``spacing`` is above the support of 1.5."""
    place = np.zeros((n, 3))
    place[:, 0] = spacing * np.arange(n)
    h = np.full(n, 1.5)
    return Pairs.from_neighbours(neighbours.build(place, h, neighbours.sort(place, h)[1]))


def test_steps_are_powers_of_two_and_neighbours_stay_within_four():
    step = np.array([1.0, 1.9, 2.1, 1e30, 1e30, 1e30, 40.0])
    assert individual_steps.levels(step, chain(7, 10.0), NONE).tolist() == [0, 0, 1, 12, 12, 12, 5]
    assert individual_steps.levels(step, chain(7, 1.0), NONE).tolist() == [0, 0, 1, 3, 5, 7, 5]


def test_images_hold_their_neighbours_too():
    """The second of two rows is the image of the first: its owner's step counts."""
    pairs = chain(4, 1.0)
    owner = np.array([0, 1])
    step = np.array([1.0, 1e30])
    held = individual_steps.levels(step, Pairs(pairs.partner, pairs.first[:2], pairs.number[:2]), owner)
    assert held.tolist() == [0, 2]
    alone = Pairs(
        np.array([3, 2], dtype=pairs.partner.dtype),
        np.array([0, 1], dtype=pairs.first.dtype),
        np.array([1, 1], dtype=pairs.number.dtype),
    )
    assert individual_steps.levels(step, alone, owner).tolist() == [0, 2]  # 1 sees the image of 0 alone


def test_a_run_says_it_four_times_and_through_a_stop(tmp_path, monkeypatch):
    stopped_and_whole(tmp_path, monkeypatch)
    one, other = (
        json.loads((tmp_path / name / "stage_report.json").read_text())["individual_steps"]["series"]
        for name in ("whole", "parts")
    )
    assert one == other and len(one) == 3  # outputs at 5, 10 and 15 s: the first two shares fall on one of them each
    for row in one:
        count = np.array(row["particles_by_power_of_two"])
        assert count.sum() > 1000 and 0.0 <= row["visits_saved"] < 1.0 and row["shortest_s"] > 0.0
        if len(count) == 1:
            assert row["visits_saved"] == 0.0
    assert one[-1]["time_s"] == pytest.approx(15.0)
