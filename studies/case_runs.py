"""Runs of a shipped case as processes of their own, which a study lists by the arguments of ``run_case``."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def sets(*values: str) -> tuple[str, ...]:
    """``--set`` for each value."""
    return tuple(part for value in values for part in ("--set", value))


def run(case: Path, arguments: Sequence[str], out: Path, check: bool = False) -> tuple[int, Path | None]:
    """``run_case`` of a case with these arguments: its exit code, and the run folder that it names. What is done is
    not made again."""
    code = "from pipeline.cli import run_case; run_case()"
    command = [sys.executable, "-c", code, str(case), *arguments, "--out", str(out), *(["--check"] if check else [])]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    folder: Path | None = None
    assert process.stdout is not None
    for line in process.stdout:
        print("   ", line, end="", flush=True)
        if line.startswith("run folder: "):
            folder = Path(line.removeprefix("run folder: ").strip())
    return process.wait(), folder
