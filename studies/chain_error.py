"""The chain error of a case: other draws of particles and grains, a coarser size, an earlier and a later handoff;
written to the case's expected.toml.

    python studies/chain_error.py --case cases/valhalla_980km --preset quick --members 8 --out runs/chain_error
    [--threads T] [--only-evaluate] [--dry]

Each member is a run of ``run_case`` in OUT; stages that agree are made once. What is done is not made again: the same
command continues after any stop, and the table holds what is there so far. Formulas:
``pipeline/uncertainty/chain_error.py``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from matter.errors import InputError, Stopped
from pipeline.settings import expected
from pipeline.uncertainty import chain_error


def main() -> int:
    """Run the members, print the table, write expected.toml; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", type=Path, required=True, help="folder of the case")
    parser.add_argument("--preset", help="preset of the case (default: as run_case)")
    parser.add_argument(
        "--members",
        type=int,
        default=8,
        help="draws, the case as it is included; every second one has a shock stage of its own",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs")
    parser.add_argument("--threads", type=int, help="threads of each run")
    parser.add_argument("--only-evaluate", action="store_true", help="run nothing, evaluate what is done")
    parser.add_argument("--dry", action="store_true", help="do not write expected.toml")
    given = parser.parse_args()
    study = chain_error.Study(given.case, given.preset, given.out, given.members)
    failed: list[str] = []
    try:
        if not given.only_evaluate:
            failed = chain_error.make(study, given.threads, say=lambda words: print(words, flush=True))
        rows = chain_error.evaluate(study)
    except (InputError, Stopped) as reason:
        print(reason, file=sys.stderr)
        return reason.exit_code
    chain_error.keep(rows, failed, given.out)
    print(f"\n{chain_error.text(rows)}")
    if failed:
        print(f"could not be made: {', '.join(failed)}")
    if not given.dry:
        file = given.case / expected.FILE
        preset = f" --preset {given.preset}" if given.preset else ""
        chain_error.write(
            study, rows, f"python studies/chain_error.py --case {given.case}{preset} --members {given.members}", file
        )
        print(f"written to {file}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
