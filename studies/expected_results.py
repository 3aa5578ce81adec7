"""README's second command, and whether it ends as the case's expected.toml says: exit 1 where a measure differs by
more than two standard errors.

    python studies/expected_results.py [--case cases/valhalla_980km] [--preset quick] [--out runs] [--threads T]

A finished run is only held against the file. CI does the same at the tiny size (tests/pipeline/test_end_to_end.py).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.running import run_process
from pipeline.running.request import Request
from pipeline.settings import expected


def main() -> int:
    """Run, compare, print; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=Path, default=Path("cases/valhalla_980km"), help="folder of the case")
    parser.add_argument("--preset", default="quick", help="preset of the case")
    parser.add_argument("--out", type=Path, default=Path("runs"), help="folder of the runs")
    parser.add_argument("--threads", type=int, help="threads of the run")
    given = parser.parse_args()
    try:
        case = cases.read(given.case, given.preset)
        if (table := expected.expected_result(case)) is None:
            raise InputError(
                f"{given.case / expected.FILE} says nothing of the preset {given.preset}: studies/chain_error.py "
                f"writes it"
            )
        arguments = [str(given.case), "--preset", given.preset, "--out", str(given.out)]
        code = run_process.as_process(arguments + (["--threads", str(given.threads)] if given.threads else []))
        if code not in (0, 1):
            return code
        found = expected.verdicts(table, expected.values(Request(case, given.out).run_folder))
    except InputError as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    differing = [f"{one.crater} {one.measure}: {one.deviation:+.1f} sigma" for one in found if not one.agrees]
    print(
        f"{len(found) - len(differing)} of {len(found)} measures as expected"
        + "".join(f"\n  differs: {line}" for line in differing)
    )
    return 1 if differing or not found else 0


if __name__ == "__main__":
    sys.exit(main())
