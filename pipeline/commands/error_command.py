"""``run_case CASE --errors``: the errors of a case by further runs, and a run that carries them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matter.errors import InputError
from pipeline.running import run_process
from pipeline.sweeps import error_study, sweep_run
from pipeline.sweeps.error_study import ErrorStudy


def with_errors(
    case: Any, out: Path, threads: int | None, check: bool, status: bool, others: list[tuple[Any, str]]
) -> int:
    """Make the runs that are missing, write the page of errors, measure the case once more with them; with ``check``
    or ``status`` only say what would be made, or where it stands. Exit code 1 where a run could not be made. Raises
    ``InputError`` for options that do not go with it (``others``)."""
    if refused := [option for given, option in others if given]:
        raise InputError(f"--errors makes runs of its own: leave out {' and '.join(refused)}")
    if case.run:
        raise InputError(f"{case.run} is a run: give its case, run_case CASE --errors, which takes over what is done")
    if "crater" not in case.stages:
        raise InputError(f"{case.file} measures no crater ([case] stages): there is nothing to give errors to")
    study = ErrorStudy(case, out)
    whole = study.whole()
    each = threads or max(1, sweep_run.cores() // len(whole.members))
    if check or status:
        print(sweep_run.checked(whole, each) if check else sweep_run.status(whole))
        return 0
    print(f"folder of the errors: {whole.folder}", flush=True)
    failed = error_study.make(study, each, lambda words: print(words, flush=True))
    rows = study.rows()
    run, arguments = error_study.measured(study, rows, each)
    code = run_process.as_process(arguments)
    if not run.is_dir():
        return code
    print(f"\n{error_study.write(study, rows, failed, run)}", flush=True)
    return 1 if failed else 0
