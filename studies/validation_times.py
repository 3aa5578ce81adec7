"""The slow comparisons with the literature (tests marked ``validation``), one by one: what each takes, and whether it
passes.

    python studies/validation_times.py [tests/sph ...] [--out runs/validation_times.json] [--limit 3600] [--again
    failed] [--list]

Every test is a process of its own, so that one that runs out of memory or time takes no other with it. The file is
written after each; the same command goes on with those that are missing (``--again failed`` repeats what did not pass,
``--again all`` everything). Prints a table at the end and exits with 1 where a test failed. Wall times count
compilation where a kernel was not in the cache.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from matter.files import archive
from pipeline.store import provenance

ROOT = Path(__file__).resolve().parents[1]
PYTEST = (sys.executable, "-m", "pytest", "-p", "no:cacheprovider")
OUTCOMES = {0: "passed", 1: "failed", 2: "interrupted", 4: "usage", 5: "not found"}


def validation_tests(where: list[str]) -> list[str]:
    """Node ids of the tests marked ``validation`` below ``where``; raises ``SystemExit`` with pytest's words when they
    cannot be collected."""
    found = subprocess.run(
        [*PYTEST, "--collect-only", "-m", "validation", *where], cwd=ROOT, capture_output=True, text=True
    )
    if found.returncode not in (0, 5):
        raise SystemExit(found.stdout + found.stderr)
    return [line for line in found.stdout.splitlines() if "::" in line]


def run_one(test: str, limit: float) -> dict[str, Any]:
    """Outcome and wall time [s] of one test; the end of its output where it did not pass."""
    begun = time.monotonic()
    process = subprocess.Popen(
        [*PYTEST, "-m", "validation", test],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
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
    result = {"outcome": outcome, "wall_s": round(wall, 1), "commit": provenance.commit().get("commit", "")[:7]}
    return result if outcome == "passed" else {**result, "output": said[-2000:]}


def table(results: dict[str, dict[str, Any]]) -> str:
    """Markdown: test, outcome, wall time, the longest first."""
    rows = sorted(results.items(), key=lambda item: -item[1]["wall_s"])
    total = sum(row["wall_s"] for _, row in rows)
    lines = ["| test | outcome | wall [s] |", "|---|---|---|"]
    lines += [f"| {test} | {row['outcome']} | {row['wall_s']:.0f} |" for test, row in rows]
    return "\n".join(
        [*lines, f"| {len(rows)} tests | {sum(row['outcome'] == 'passed' for _, row in rows)} passed | {total:.0f} |"]
    )


def main() -> int:
    """Collect, run what is missing, print; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("where", nargs="*", default=["tests"], help="folders, files or single tests")
    parser.add_argument("--out", type=Path, default=Path("runs/validation_times.json"), help="what was found so far")
    parser.add_argument("--limit", type=float, default=3600.0, help="longest time of one test [s]")
    parser.add_argument("--again", choices=("failed", "all"), help="repeat these")
    parser.add_argument("--list", action="store_true", help="only say which tests there are")
    given = parser.parse_args()
    tests = validation_tests(given.where)
    if given.list:
        print("\n".join(tests))
        return 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(75))  # the test that runs is stopped too
    kept: dict[str, dict[str, Any]] = json.loads(given.out.read_text()) if given.out.is_file() else {}
    for test in tests:
        done = kept.get(test)
        if done and given.again != "all" and not (given.again == "failed" and done["outcome"] != "passed"):
            continue
        print(test, end=" ", flush=True)
        kept[test] = run_one(test, given.limit)
        given.out.parent.mkdir(parents=True, exist_ok=True)
        archive.write_text(given.out, json.dumps(kept, indent=1) + "\n")
        print(f"{kept[test]['outcome']} in {kept[test]['wall_s']:.0f} s", flush=True)
    shown = {test: kept[test] for test in tests}
    print(table(shown))
    return int(any(row["outcome"] != "passed" for row in shown.values()))


if __name__ == "__main__":
    sys.exit(main())
