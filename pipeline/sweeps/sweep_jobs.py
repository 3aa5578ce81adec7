"""Job files of a sweep for a cluster: an array of Slurm, or Snakemake. Each member is ``run_case`` on a file system
that all nodes see; 75 means: again."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

from matter.errors import InputError
from matter.files import archive
from pipeline.case import stages
from pipeline.running import run_process
from pipeline.sweeps.sweep import Sweep

KINDS = ("slurm-array", "snakemake")
_SCRIPT = """\
#!/bin/bash
# One member of the sweep: member.sh NUMBER, from 1 to {count}. Exit code {stopped}: stopped, run it again.
cd -- {here}
command=$(sed -n "${{1}}p" {commands})
exec bash -c "$command"
"""
_SLURM = """\
#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{count}
#SBATCH --cpus-per-task={threads}
#SBATCH --requeue
#SBATCH --signal=B:TERM@300
#SBATCH --output=/dev/null
# sbatch slurm.sh: what members have in common is made once, the others wait for it.
# A member that ran out of time saves, and is put into the queue again.
exec >> {logs}/"$SLURM_ARRAY_TASK_ID".log 2>&1
bash {member} "$SLURM_ARRAY_TASK_ID" &
child=$!
trap 'kill -TERM "$child"' TERM
wait "$child"; code=$?
if kill -0 "$child" 2>/dev/null; then wait "$child"; code=$?; fi
if [ "$code" = {stopped} ]; then scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}"; fi
exit "$code"
"""
_SNAKEMAKE = """\
# snakemake --snakefile Snakefile --cores N: members that stopped (exit code {stopped}) are tried again and continue.
MEMBERS = range(1, {count} + 1)


rule all:
    input:
        expand({done}, member=MEMBERS),


rule member:
    output:
        touch({done}),
    threads: {threads}
    retries: 5
    shell:
        {command}
"""


def write(sweep: Sweep, kind: str, threads: int) -> str:
    """Write the job files into the sweep's folder; what to do with them.

    Raises ``InputError`` for an unknown kind, and for paths and values that hold a control character: a line of these
    files would become two.
    """
    if kind not in KINDS:
        raise InputError(
            f"--emit {kind}: there is no such kind{stages.nearest(kind, list(KINDS))} (there are {', '.join(KINDS)})"
        )
    sweep_folder, here = sweep.folder.resolve(), Path.cwd()
    program = [sys.executable, "-m", "bolide", "run_case"]
    members = [shlex.join([*program, *sweep.arguments(one, threads)]) for one in sweep.members]
    for text in (str(sweep_folder), str(here), *members):
        if not text.isprintable():
            raise InputError(f"--emit {kind}: {text!r} holds a control character, and job files are read by lines")
    (sweep_folder / "logs").mkdir(parents=True, exist_ok=True)
    (sweep_folder / "done").mkdir(exist_ok=True)
    member = sweep_folder / "member.sh"
    archive.write_text(sweep_folder / "commands.txt", "".join(f"exec {command}\n" for command in members))
    quoted = {
        name: shlex.quote(str(path))
        for name, path in (
            ("here", here), ("commands", sweep_folder / "commands.txt"), ("logs", sweep_folder / "logs"),
            ("member", member),
        )
    }  # fmt: skip
    values = {
        **quoted, "name": re.sub(r"[^\w.+-]", "_", sweep.folder.name), "count": len(sweep.members), "threads": threads,
        "stopped": run_process.STOPPED,
        "done": repr(f"{_braced(str(sweep_folder / 'done'))}/{{member}}"),
        "command": repr(f"bash {_braced(quoted['member'])} {{wildcards.member}}"),
    }  # fmt: skip
    archive.write_text(member, _SCRIPT.format(**values))
    file = sweep_folder / ("slurm.sh" if kind == "slurm-array" else "Snakefile")
    archive.write_text(file, (_SLURM if kind == "slurm-array" else _SNAKEMAKE).format(**values))
    shown = shlex.quote(str(file))
    start = f"sbatch {shown}" if kind == "slurm-array" else f"snakemake --snakefile {shown} --cores N"
    return (
        f"{len(sweep.members)} members: {start}; then the same command with --status, and with --sweep for the table "
        f"and the page"
    )


def _braced(text: str) -> str:
    """A text as Snakemake's patterns hold it, where braces name wildcards."""
    return text.replace("{", "{{").replace("}", "}}")
