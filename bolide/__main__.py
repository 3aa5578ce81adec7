"""``python -m bolide COMMAND ...``: the commands where their scripts are not on the path, ``python -m bolide run_case
--help`` for example."""

from __future__ import annotations

import sys

from pipeline import cli
from pipeline.commands import command

COMMANDS = (
    "run_case",
    "inspect_handoff",
    "compare_profiles",
    "measure_crater",
    "impact_census",
    "fly_ejecta",
    "import_snapshot",
    "export_snapshot",
)


def main() -> None:
    """Run the command that is named first."""
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name == "--version":
        command.show_version(True)
    if name not in COMMANDS:
        print(f"python -m bolide COMMAND ..., with a COMMAND of {', '.join(COMMANDS)}", file=sys.stderr)
        raise SystemExit(0 if name in ("-h", "--help") else 2)
    del sys.argv[1]
    getattr(cli, name)()


if __name__ == "__main__":
    main()
