"""The published claims W01-W37 (Winter 2017, chapters 1 and 2), scored one by one against a census.

    python studies/encounter_claims.py CENSUS [--literal CENSUS] [--out DIR]

``CENSUS`` is the folder of a census of the population ``literal`` at Callisto; ``--literal`` one made with the
integrator ``rkck``, for the claims on step sizes. Writes ``claims.json`` and ``claims.md``.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from matter.files import archive
from nbody.population import encounters
from nbody.population.encounters import ENTRY
from studies.winter_2017.impacts import angles, bookkeeping, speeds
from studies.winter_2017.score import Evidence, Score
from studies.winter_2017.setup import inputs, integration, starts


def score(e: Evidence) -> list[Score]:
    """All claims in order."""
    return [*inputs(e), *integration(e), *starts(e), *bookkeeping(e), *speeds(e), *angles(e)]


def as_markdown(scores: list[Score], e: Evidence, command: str) -> str:
    """The scores as a table."""
    a = e.attributes
    tally = {
        verdict: sum(s.verdict == verdict for s in scores) for verdict in ("met", "not met", "arithmetic", "input")
    }
    lines = [
        "# Published claims W01-W37 against the census",
        "",
        f"Made by `{command}` from {int(((e.table['event'] == ENTRY) & (e.table['moon'] == 1)).sum()):,} entries at "
        f"Callisto and "
        f"{int(((e.table['event'] == ENTRY) & (e.table['moon'] == 0)).sum()):,} at Ganymede ({a['particles']:,} "
        f"particles, population {a['population']}, "
        f"integrator {a['integrator']}, seed {a['seed']}: not the seed with which the reading of the set-up was "
        f"found).",
        "",
        ", ".join(f"{n} {verdict}" for verdict, n in tally.items()) + ".",
        "",
        "| id | claim | published | found | reproduced if | verdict | note |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {s.id} | {s.claim} | {s.published} | {s.found} | {s.tolerance} | {s.verdict} | {s.note} |" for s in scores
    ]
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> int:
    """Command line: see the module's head."""
    parser = argparse.ArgumentParser(prog="python studies/encounter_claims.py")
    parser.add_argument("census", type=Path)
    parser.add_argument("--literal", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs/results/nbody"))
    given = parser.parse_args(arguments)
    table, attributes = encounters.read(given.census / "encounters.h5")
    literal = encounters.read(given.literal / "encounters.h5") if given.literal else None
    evidence = Evidence(table, attributes, literal)
    scores = score(evidence)
    command = "python studies/encounter_claims.py " + " ".join(arguments if arguments is not None else sys.argv[1:])
    archive.write_text(
        given.out / "claims.json", json.dumps({"command": command, "claims": [asdict(s) for s in scores]}, indent=1)
    )
    text = as_markdown(scores, evidence, command)
    archive.write_text(given.out / "claims.md", text)
    print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
