"""``run_case`` with ``--sweep``, ``--vary``, ``--forecast`` or ``--ensemble``: many runs of a case, or what was asked
for instead of running them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matter.errors import InputError, Stopped
from pipeline.running import run_process
from pipeline.sweeps import ensemble as ensembles
from pipeline.sweeps import sweep as sweeps
from pipeline.sweeps import sweep_dask, sweep_forecast, sweep_jobs, sweep_run, sweep_table


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
    forecast: bool = False,
) -> int:
    """Run a sweep or an ensemble, with ``forecast`` also write what the sweep forecasts; or what was asked for
    ``instead``."""
    if forecast:
        _check_priors(case, vary, ensemble)
    asked = [(value, option) for value, option in instead if value]
    _check(case, vary, ensemble, " and ".join(option for _, option in asked) or "--sweep", recompute)
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

    try:
        if scheduler:
            failed = sweep_dask.run(sweep, each, scheduler, say)
        else:
            failed = sweep_run.Runner(sweep, each, sweep_run.side_by_side(sweep, each), say).run()
    except Stopped:
        sweep_table.write(sweep)
        raise
    rows = sweep_table.write(sweep, failed)
    print(f"\n{sweep_table.text(rows)}", flush=True)
    if forecast:
        made = sweep_forecast.write(sweep, case, rows)
        print(f"\n{sweep_forecast.terminal(sweep, rows, made)}", flush=True)
    if ensemble is not None and (spread := ensembles.spread(sweep)):
        print(f"\nspread of the draws\n{ensembles.text(spread)}\n", flush=True)
        request, arguments = ensembles.measured(sweep, spread, each)
        code = run_process.as_process(arguments)
        if code != 0 and not request.run_folder.is_dir():
            return code
    print(f"\nresult: {sweep.folder}", flush=True)
    return 1 if failed else 0


def _check(case: Any, vary: list[str], ensemble: int | None, options: str, recompute: Any) -> None:
    """Raise ``InputError`` where nothing is varied, or what cannot be swept."""
    if ensemble is not None and vary:
        raise InputError("--ensemble varies the seeds alone: leave out --vary")
    if ensemble is None and not vary and not case.sweep:
        raise InputError(f"{options} goes with [sweep] in the case or with --vary: nothing is varied")
    if recompute:
        raise InputError("--from and --fresh are for one run: a sweep makes what is not there")
    if case.run:
        raise InputError(f"{case.run} is a run: sweep its case, or its case.used.toml copied elsewhere")


def _check_priors(case: Any, vary: list[str], ensemble: int | None) -> None:
    """Raise ``InputError`` where there are no priors to forecast from."""
    if vary or ensemble is not None:
        other = "--vary" if vary else "--ensemble"
        raise InputError(f"--forecast draws from the priors of [sweep]: leave out {other}")
    kind = case.sweep.get("kind", "grid" if case.sweep else "")
    if kind != "prior":
        found = f'kind = "{kind}"' if kind else "no [sweep]"
        raise InputError(
            f'--forecast goes with [sweep] kind = "prior", and {case.file} has {found}: only distributions give '
            f"chances (run_case --describe sweep)"
        )
