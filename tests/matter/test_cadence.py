"""When checkpoints are written: by the clock, by steps, never more than a share of the time, always before a stop."""

from __future__ import annotations

import pytest

from matter import cadence, progress
from matter.errors import InputError


@pytest.fixture
def clock(monkeypatch):
    """A clock that the test moves, and a pace that is put back."""
    now = [100.0]
    monkeypatch.setattr(cadence.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(cadence, "pace", cadence.Pace())
    cadence.taken()
    return now


def write(checkpoints, clock, cost):
    with checkpoints.writing():
        clock[0] += cost


def test_by_the_clock(clock):
    checkpoints = cadence.Cadence()
    clock[0] += 14.0
    assert not checkpoints.due()
    clock[0] += 2.0
    assert checkpoints.due()
    write(checkpoints, clock, 0.1)
    assert not checkpoints.due()


def test_large_states_are_written_less_often(clock):
    checkpoints, began = cadence.Cadence(), clock[0]
    for _ in range(20_000):
        clock[0] += 1.0
        if checkpoints.due():
            write(checkpoints, clock, 5.0)
    assert 0.01 < checkpoints.spent_s / (clock[0] - began) < 0.03
    assert checkpoints.count == pytest.approx(20_000 / 251, abs=2)


def test_by_steps_alone(clock):
    cadence.set_pace(cadence.Pace.from_text("3 steps"))
    checkpoints, found = cadence.Cadence(), []
    for step in range(1, 10):
        clock[0] += 1000.0
        if checkpoints.due():
            write(checkpoints, clock, 50.0)
            found.append(step)
    assert found == [3, 6, 9]
    assert cadence.taken() == {"checkpoints": 3, "checkpoints_wall_s": 150.0}
    assert cadence.taken()["checkpoints"] == 0


def test_always_before_a_stop(clock):
    checkpoints = cadence.Cadence()
    assert not checkpoints.due()
    progress.request_stop()
    try:
        assert checkpoints.due()
    finally:
        progress.clear_stop()


def test_a_pace_is_read_or_refused_by_name():
    assert cadence.Pace.from_text("2 min") == cadence.Pace(120.0)
    assert cadence.Pace.from_text("500 steps").steps == 500
    for text in ("soon", "0 s", "-3 s", "0 steps", "3 m", "nan s", "1e9 s", "1.5 steps"):
        with pytest.raises(InputError, match=r"--checkpoint-every .* a time of the clock"):
            cadence.Pace.from_text(text)
