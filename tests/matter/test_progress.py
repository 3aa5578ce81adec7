"""Progress: who listens hears, a request to stop ends in Stopped."""

from __future__ import annotations

import math

import pytest

from matter import progress
from matter.errors import Stopped
from matter.progress import Progress
from pipeline.running import screen


@pytest.fixture(autouse=True)
def _quiet():
    yield
    progress.silence()
    progress.clear_stop()


def test_listeners_hear_fraction_and_note():
    heard = []
    progress.listen(lambda state: heard.append((state.fraction, state.note)))
    state = Progress("sph", 200.0, interval_s=0.0)
    state.update(50.0, "t = 50 s")
    state.update(300.0)
    assert heard == [(0.25, "t = 50 s"), (1.0, "")]


def test_reports_are_not_more_frequent_than_asked_unless_forced():
    heard = []
    progress.listen(lambda state: heard.append(state.done))
    state = Progress("sph", 100.0, interval_s=1000.0)
    for k in range(10):
        state.update(k)
    state.update(10, force=True)
    assert heard == [0, 10]


def test_the_time_left_counts_from_where_this_session_began(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    state = Progress("dem", 100.0, start=50.0, _started=now[0])
    assert math.isnan(state.eta_s)
    now[0] += 10.0
    state.update(60.0)
    assert state.eta_s == pytest.approx(40.0)
    assert Progress("x", 0.0).fraction == 0.0


def test_the_time_left_of_work_that_may_end_earlier_never_goes_up(monkeypatch):
    """A collapse of 100 s, or up to 300 s where the ground has not come to rest, at an even pace."""
    now, said = [0.0], []
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    state = Progress("dem", 300.0, soonest=100.0, _started=0.0)
    for second in (0.0, 50.0, 99.0, 101.0, 150.0, 299.0):
        now[0] = second
        state.update(second)
        said.append((state.fraction, state.eta_s, screen.left(state)))
    assert [words for _, _, words in said] == [
        "-- left", "50.0 s to 4 min 10 s left", "1.0 s to 3 min 21 s left", "at most 3 min 19 s left",
        "at most 2 min 30 s left", "at most 1.0 s left",
    ]  # fmt: skip
    shares, left = ([row[k] for row in said[1:]] for k in (0, 1))
    assert shares == sorted(shares) and left == sorted(left, reverse=True)
    assert screen.left(Progress("sph", 600.0, _started=0.0, done=299.0)) == "5 min 01 s left"


def test_a_request_to_stop_is_raised_at_the_next_safe_place():
    progress.stop_here("sph")
    progress.request_stop()
    assert progress.stop_requested()
    with pytest.raises(Stopped, match="sph: stopped on request") as caught:
        progress.stop_here("sph")
    assert caught.value.exit_code == 75
