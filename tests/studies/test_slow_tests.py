"""Which slow tests are due, and that one which the time cuts short is no failure."""

from __future__ import annotations

import sys

from studies import slow_tests

TESTS = ["a::one", "a::two", "b::three", "b::four"]


def test_never_run_tests_come_first_in_an_order_of_the_day_then_the_oldest():
    results = {"a::one": {"at": "2026-11-02T00:00:00Z"}, "b::four": {"at": "2026-11-01T00:00:00Z"}}
    assert slow_tests.due(TESTS, results, "2026-11-27")[2:] == ["b::four", "a::one"]
    days = {tuple(slow_tests.due(TESTS, {}, f"2026-11-{day}")) for day in range(10, 28)}
    assert len(days) > 5 and all(sorted(order) == sorted(TESTS) for order in days)


def test_minutes_end_the_last_test_and_a_failure_is_told(monkeypatch, tmp_path, capsys):
    """The second test takes longer than what is left; only a test that fails by itself ends with exit code 1."""
    outcomes = {"a::one": "passed", "a::two": "stopped after 30 s", "b::three": "failed"}

    def run_one(test, limit):
        return {"at": "2026-11-27T12:00:00Z", "outcome": outcomes[test], "wall_s": 40.0, "commit": ""}

    clock = iter((0.0, 0.0, 30.0, 60.0, 0.0, 0.0, 120.0))
    monkeypatch.setattr(slow_tests, "run_one", run_one)
    monkeypatch.setattr(slow_tests.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(slow_tests, "due", lambda tests, *_: tests)
    out = str(tmp_path / "slow.json")
    for tests, code in ((["a::one", "a::two"], 0), (["b::three"], 1)):
        monkeypatch.setattr(slow_tests, "slow_tests", lambda where, tests=tests: tests)
        monkeypatch.setattr(sys, "argv", ["slow_tests", "--minutes", "1", "--out", out])
        assert slow_tests.main() == code
    said = capsys.readouterr().out
    assert "| a::two | 2026-11-27T12:00:00Z | cut short | 40 |" in said and "b::three failed in 40 s" in said


def test_the_table_names_tests_that_never_ran():
    assert "| a::one | never | | |" in slow_tests.table(["a::one"], {})
