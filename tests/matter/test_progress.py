"""Progress: who listens hears, a request to stop ends in Stopped."""

from __future__ import annotations

import math

import pytest

from matter import progress
from matter.errors import Stopped
from matter.progress import Progress


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


def test_a_request_to_stop_is_raised_at_the_next_safe_place():
    progress.stop_here("sph")
    progress.request_stop()
    assert progress.stop_requested()
    with pytest.raises(Stopped, match="sph: stopped on request") as caught:
        progress.stop_here("sph")
    assert caught.value.exit_code == 75
