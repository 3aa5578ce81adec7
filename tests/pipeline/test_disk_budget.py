"""Snapshots move apart until a run fits into its budget; histories and what is computed stay."""

from __future__ import annotations

from dataclasses import replace

import pytest

from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.running import disk_budget, prediction, room
from pipeline.running.request import Request, settings_of

CASE = "cases/valhalla_980km"


@pytest.fixture
def asked(tmp_path):
    return Request(cases.read(CASE, "quick"), tmp_path)


def fitted(asked, budget):
    return disk_budget.fitted(
        lambda more: cases.read(CASE, "quick", more), lambda case: replace(asked, case=case), budget
    )


def disk(request):
    return room.needs(prediction.predictions(request, settings_of(request)).values())[1]


def test_a_budget_that_suffices_changes_nothing(asked):
    case, words = fitted(asked, 1.01 * disk(asked))
    assert (case.overrides, words) == ((), "")


def test_snapshots_move_apart_until_the_run_fits(asked):
    budget = 0.9 * disk(asked)
    case, words = fitted(asked, budget)
    before, after = settings_of(asked), settings_of(replace(asked, case=case))
    assert disk(replace(asked, case=case)) <= budget and "of disk are needed of" in words
    for stage in ("sph", "dem"):
        assert after[stage].snapshot_interval >= before[stage].snapshot_interval
        assert after[stage].history_interval == before[stage].history_interval
        assert after[stage].end_time >= disk_budget.KEPT * 0.999 * after[stage].snapshot_interval or (
            after[stage].snapshot_interval == before[stage].snapshot_interval
        )
        assert after[stage].end_time == before[stage].end_time
    changed = {key for stage in after for key, value in after[stage] if value != getattr(before[stage], key)}
    assert changed == {"snapshot_interval", "chain"}  # the error of the chain was found with other snapshots


def test_a_budget_that_nothing_meets_is_refused_with_what_is_needed(asked):
    with pytest.raises(InputError, match=r"--budget 1 kB: .* needs \d+ MB of disk even with snapshots up to 20"):
        fitted(asked, 1e3)
