"""The slow tests, one by one: comparisons with the literature (marked ``validation``) and faults by the hundred
(``campaign``); when each last ran, what it took, and whether it passed.

    python studies/slow_tests.py [tests/sph ...] [--minutes 240] [--limit 3600] [--out runs/slow_tests.json] [--list]

Every test is a process of its own, so that one that runs out of memory or time takes no other with it. Tests that
never ran, and then those that ran longest ago, come first; after ``--minutes`` no further one begins, and the next
call goes on from there. The file is written after each test. Among tests that never ran the date draws the order: each
day ``.ci/run``, which keeps no file, takes another part of them for its few minutes. A test that the end of those
minutes stops has neither passed nor failed. ``--list`` only says when each test last ran and what came out.

Prints a table at the end and exits with 1 where a test failed. Wall times count compilation where a kernel was not in
the cache.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from matter.files import archive
from pipeline.store import provenance

ROOT = Path(__file__).resolve().parents[1]
PYTEST = (sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-m", "validation or campaign")
OUTCOMES = {0: "passed", 1: "failed", 2: "interrupted", 4: "usage", 5: "not found"}
CUT_SHORT = "cut short"
"""Outcome of a test that the end of the minutes stopped."""


def slow_tests(where: list[str]) -> list[str]:
    """Node ids of the slow tests below ``where``; raises ``SystemExit`` with pytest's words when they cannot be
    collected."""
    found = subprocess.run([*PYTEST, "--collect-only", *where], cwd=ROOT, capture_output=True, text=True)
    if found.returncode not in (0, 5):
        raise SystemExit(found.stdout + found.stderr)
    return [line for line in found.stdout.splitlines() if "::" in line]


def due(tests: list[str], results: dict[str, dict[str, Any]], today: str) -> list[str]:
    """The tests in the order in which they are due: never run, in an order that the date ``today`` draws, then by the
    time at which they last ran."""
    order = sorted(tests)
    random.Random(today).shuffle(order)
    return sorted(order, key=lambda test: results.get(test, {}).get("at", ""))


def run_one(test: str, limit: float) -> dict[str, Any]:
    """Time, outcome and wall time [s] of one test; the end of its output where it did not pass."""
    begun, at = time.monotonic(), time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    process = subprocess.Popen(
        [*PYTEST, test], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    late = False
    try:
        said, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        late = True
        os.killpg(process.pid, signal.SIGKILL)
        said, _ = process.communicate()
    except (KeyboardInterrupt, SystemExit):
        os.killpg(process.pid, signal.SIGKILL)
        raise
    wall = time.monotonic() - begun
    outcome = f"stopped after {limit:g} s" if late else OUTCOMES.get(process.returncode, f"exit {process.returncode}")
    commit = provenance.commit().get("commit", "")[:7]
    result = {"at": at, "outcome": outcome, "wall_s": round(wall, 1), "commit": commit}
    return result if outcome == "passed" else {**result, "output": said[-2000:]}


def table(tests: list[str], results: dict[str, dict[str, Any]]) -> str:
    """Markdown: test, when it last ran, outcome, wall time, the longest first; tests that never ran at the end."""
    ran = sorted((test for test in tests if test in results), key=lambda test: -results[test]["wall_s"])
    lines = ["| test | last run | outcome | wall [s] |", "|---|---|---|---|"]
    lines += [f"| {test} | {(row := results[test])['at']} | {row['outcome']} | {row['wall_s']:.0f} |" for test in ran]
    lines += [f"| {test} | never | | |" for test in tests if test not in results]
    passed = sum(results[test]["outcome"] == "passed" for test in ran)
    total = sum(results[test]["wall_s"] for test in ran)
    return "\n".join([*lines, f"| {len(tests)} tests | {len(ran)} ran | {passed} passed | {total:.0f} |"])


def main() -> int:
    """Collect, run what is due, print; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("where", nargs="*", default=["tests"], help="folders, files or single tests")
    parser.add_argument("--out", type=Path, default=Path("runs/slow_tests.json"), help="what was found so far")
    parser.add_argument("--limit", type=float, default=3600.0, help="longest time of one test [s]")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="longest time of all")
    parser.add_argument("--list", action="store_true", help="only say when each test last ran")
    given = parser.parse_args()
    tests = slow_tests(given.where)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(75))  # the test that runs is stopped too
    results: dict[str, dict[str, Any]] = json.loads(given.out.read_text()) if given.out.is_file() else {}
    end = time.monotonic() + 60.0 * given.minutes
    for test in [] if given.list else due(tests, results, time.strftime("%Y-%m-%d")):
        left = end - time.monotonic()
        if left <= 0.0:
            break
        print(test, end=" ", flush=True)
        result = run_one(test, min(given.limit, left))
        if left < given.limit and result["outcome"].startswith("stopped"):
            result["outcome"] = CUT_SHORT
        print(f"{result['outcome']} in {result['wall_s']:.0f} s", flush=True)
        results[test] = result
        given.out.parent.mkdir(parents=True, exist_ok=True)
        archive.write_text(given.out, json.dumps(results, indent=1) + "\n")
    print(table(tests, results))
    good = ("passed", CUT_SHORT)
    return int(any(results[test]["outcome"] not in good for test in tests if test in results))


if __name__ == "__main__":
    sys.exit(main())
