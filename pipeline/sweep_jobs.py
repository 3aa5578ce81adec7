"""Job files of a sweep for a cluster: an array of Slurm, or Snakemake. Each member is ``run_case`` on a file system
that all nodes see; 75 means: again."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

from matter import archive
from matter.errors import InputError
from pipeline import run_process, stages
from pipeline.sweep import Sweep

KINDS = ("slurm-array", "snakemake")
_SCRIPT = """\
#!/bin/bash
# One member of the sweep: {name} NUMBER, from 1 to {count}. Exit code {stopped}: stopped, the same command continues.
cd {here}
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
#SBATCH --output={logs}/%a.log
#SBATCH --open-mode=append
# sbatch {file}: what members have in common is made once, the others wait for it.
# A member that ran out of time saves, and is put into the queue again.
bash {member} "$SLURM_ARRAY_TASK_ID" &
child=$!
trap 'kill -TERM "$child"' TERM
wait "$child"; code=$?
if kill -0 "$child" 2>/dev/null; then wait "$child"; code=$?; fi
if [ "$code" = {stopped} ]; then scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_${{SLURM_ARRAY_TASK_ID}}"; fi
exit "$code"
"""
_SNAKEMAKE = """\
# snakemake --snakefile {file} --cores N: members that stopped (exit code {stopped}) are tried again and continue.
MEMBERS = range(1, {count} + 1)


rule all:
    input:
        expand("{done}/{{member}}", member=MEMBERS),


rule member:
    output:
        touch("{done}/{{member}}"),
    threads: {threads}
    retries: 5
    shell:
        "bash {member} {{wildcards.member}}"
"""


def write(sweep: Sweep, kind: str, threads: int) -> str:
    """Write the job files into the sweep's folder; what to do with them. Raises ``InputError`` for an unknown kind."""
    if kind not in KINDS:
        raise InputError(
            f"--emit {kind}: there is no such kind{stages.nearest(kind, list(KINDS))} (there are {', '.join(KINDS)})"
        )
    place = sweep.folder.resolve()
    (place / "logs").mkdir(parents=True, exist_ok=True)
    (place / "done").mkdir(exist_ok=True)
    member, commands = place / "member.sh", place / "commands.txt"
    program = [sys.executable, "-m", "bolide", "run_case"]
    archive.write_text(
        commands, "".join(f"exec {shlex.join([*program, *sweep.arguments(one, threads)])}\n" for one in sweep.members)
    )
    values = {
        "name": sweep.folder.name, "count": len(sweep.members), "threads": threads, "stopped": run_process.STOPPED,
        "here": shlex.quote(str(Path.cwd())),
        "commands": shlex.quote(str(commands)), "member": shlex.quote(str(member)), "logs": place / "logs",
        "done": place / "done",
    }  # fmt: skip
    archive.write_text(member, _SCRIPT.format(**values))
    file = place / ("slurm.sh" if kind == "slurm-array" else "Snakefile")
    archive.write_text(file, (_SLURM if kind == "slurm-array" else _SNAKEMAKE).format(**values, file=file))
    start = f"sbatch {file}" if kind == "slurm-array" else f"snakemake --snakefile {file} --cores N"
    return (
        f"{len(sweep.members)} members: {start}; then the same command with --status, and with --sweep for the table "
        f"and the page"
    )
