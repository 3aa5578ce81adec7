"""``run_case`` with ``--sweep``, ``--vary`` or ``--ensemble``: many runs of a case, or what was asked for instead of
running them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matter.errors import InputError
from pipeline.running import run_process
from pipeline.sweeps import ensemble as ensembles
from pipeline.sweeps import sweep as sweeps
from pipeline.sweeps import sweep_dask, sweep_jobs, sweep_run, sweep_table


def swept(
    case: Any,
    out: Path,
    vary: list[str],
    ensemble: int | None,
    until: str | None,
    threads: int | None,
    instead: list[tuple[Any, str]],
    recompute: Any,
    scheduler: str | None,
) -> int:
    """Run a sweep or an ensemble, or what was asked for ``instead``."""
    asked = [(value, option) for value, option in instead if value]
    if ensemble is not None and vary:
        raise InputError("--ensemble varies the seeds alone: leave out --vary")
    if ensemble is None and not vary and not case.sweep:
        raise InputError(
            f"{' and '.join(option for _, option in asked) or '--sweep'} goes with [sweep] in the case or with "
            f"--vary: nothing is varied"
        )
    if recompute:
        raise InputError("--from and --fresh are for one run: a sweep makes what is not there")
    if case.run:
        raise InputError(f"{case.run} is a run: sweep its case, or its case.used.toml copied elsewhere")
    if ensemble is not None:
        drawn = tuple(ensembles.members(case, ensemble))
        sweep = sweeps.Sweep(case.file, case.preset, case.size, case.overrides, out, drawn, until)
    else:
        sweep = sweeps.planned_sweep(case, sweeps.read_table(case.sweep, vary), out, until)
    each = threads or max(1, sweep_run.cores() // len(sweep.members))
    for value, option in asked:
        print(
            sweep_jobs.write(sweep, value, each)
            if option == "--emit"
            else sweep_run.status(sweep)
            if option == "--status"
            else sweep_run.checked(sweep, each)
        )
        return 0
    print(f"sweep folder: {sweep.folder}", flush=True)
    sweep_run.links(sweep)

    def say(words: str) -> None:
        print(words, flush=True)

    if scheduler:
        failed = sweep_dask.run(sweep, each, scheduler, say)
    else:
        failed = sweep_run.Runner(sweep, each, sweep_run.side_by_side(sweep, each), say).run()
    print(f"\n{sweep_table.text(sweep_table.write(sweep, failed))}", flush=True)
    if ensemble is not None and (rows := ensembles.spread(sweep)):
        print(f"\nspread of the draws\n{ensembles.text(rows)}\n", flush=True)
        request, arguments = ensembles.measured(sweep, rows, each)
        code = run_process.as_process(arguments)
        if code != 0 and not request.run_folder.is_dir():
            return code
    print(f"\nresult: {sweep.folder}", flush=True)
    return 1 if failed else 0
