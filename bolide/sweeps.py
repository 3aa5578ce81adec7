"""A sweep as a table: one case with some of its keys varied, each combination a run of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    import pandas

Value = bool | int | float | str


def sweep(
    case: str | Path,
    vary: Mapping[str, Sequence[Value]] | None = None,
    preset: str | None = None,
    *,
    kind: Literal["grid", "list", "lhs", "sobol"] | None = None,
    members: int | None = None,
    seed: int | None = None,
    out: str | Path = "runs",
    until: str | None = None,
    threads: int | None = None,
    quiet: bool = False,
    **settings: Any,
) -> pandas.DataFrame:
    """Run every member of a sweep as ``run_case CASE --sweep`` does, side by side; a row per member.

    ``vary``: key of the case -> its values, ``{"dem.contact.shell.friction": [0.3, 0.5]}``, laid over ``[sweep]`` of
    the case; ``kind``, ``members`` and ``seed`` as there. ``settings`` are keys that all members share, as for
    ``bolide.run``. What is done is not made again.

    Columns: the keys that were varied, the run folder and where it stands, measures as ``final/depth_m`` with
    ``final/depth_m_sigma`` [SI]; ``attrs`` holds ``units``, the sweep's ``folder`` (table, page, links to the runs)
    and the exit codes of members that ``failed``. Raises ``InputError``, ``Stopped``.
    """
    import pandas

    from pipeline.case import read as cases
    from pipeline.case.overlay import toml
    from pipeline.sweeps import sweep as sweeps
    from pipeline.sweeps import sweep_run, sweep_table

    overrides = tuple(f"{key}={toml(value)}" for key, value in settings.items())
    read = cases.read(Path(case), preset, overrides)
    given = {
        name: value for name, value in (("kind", kind), ("members", members), ("seed", seed)) if value is not None
    }
    varied = {key: list(values) for key, values in (vary or {}).items()}
    table = sweeps.read_table(sweeps.merged_sweep(read.sweep, given, varied), ())
    sweep = sweeps.planned_sweep(read, table, Path(out), until)
    each = threads or max(1, sweep_run.cores() // len(sweep.members))
    sweep_run.links(sweep)
    failed = sweep_run.Runner(
        sweep, each, sweep_run.side_by_side(sweep, each), lambda words: None if quiet else print(words, flush=True)
    ).run()
    rows = sweep_table.write(sweep, failed)
    frame = pandas.DataFrame(rows, columns=sweep_table.columns_of(rows)).set_index("member")
    frame.attrs = {
        "units": {name: sweep_table.unit_of(name) for name in frame.columns},
        "folder": str(sweep.folder),
        "failed": failed,
    }
    return frame
