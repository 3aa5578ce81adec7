"""An ensemble: the same case with other draws of particles and grains, as a sweep over seeds whose spread becomes the
error of the first member.

The grains are redrawn in every member, the shock stage in every second one (``chain_error.DRAWS_PER_SHOCK``), so
that the scatter of each is known. With y the values of a measure in groups of one shock stage each,
``chain_error.variance`` gives the variance of one run whose particles and grains are both redrawn; its root is the
part ``draws`` of the chain error. The first member is measured once more with it (only the crater is recomputed): it
stands as ``sigma_parts.chain`` with its measures. What an earlier or later handoff and another size would change is
not in it (``pipeline.sweeps.error_study``).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from crater.measures.chain import PARTS
from matter.errors import InputError
from matter.wording.crater_measures import COMPARED, UNITS
from pipeline.running.request import Request
from pipeline.settings import expected
from pipeline.settings.compose import compose
from pipeline.sweeps.sweep import Member, Sweep
from pipeline.uncertainty import chain_error
from pipeline.uncertainty.chain_error import Row

LEAST = 2


def members(case: Any, count: int) -> list[Member]:
    """The members, the case as it is first. Raises ``InputError`` for fewer than two, or where the case draws
    nothing."""
    if count < LEAST:
        raise InputError(f"--ensemble {count}: at least {LEAST} members have a spread")
    settings = compose(case)
    drawn = [stage for stage in ("sph", "bed") if stage not in case.outside and hasattr(settings.get(stage), "seed")]
    seeds = {stage: int(settings[stage].model_dump()["seed"]) for stage in drawn}
    if not seeds:
        raise InputError(f"{case.file} draws neither particles nor grains: it has no seeds to vary")
    width = max(2, len(str(count)))
    draws = []
    for k in range(count):
        groups = {"bed": k, "sph": k // chain_error.DRAWS_PER_SHOCK if "bed" in seeds else k}
        draws.append(
            Member(f"m{k + 1:0{width}d}", {f"{stage}.seed": seed + groups[stage] for stage, seed in seeds.items()})
        )
    return draws


def spread(sweep: Sweep) -> list[Row]:
    """Mean, measuring error and scatter of every measure over the members that are measured; empty where fewer than
    two are."""
    values = {member.name: expected.values(sweep.requests[member.name].run_folder) for member in sweep.members}
    draws = {
        chain_error.REFERENCE if k == 0 else member.name: int(member.values.get("sph.seed", 0))
        for k, member in enumerate(sweep.members)
        if values[member.name]
    }
    if len(draws) < LEAST or chain_error.REFERENCE not in draws:
        return []
    values[chain_error.REFERENCE] = values[sweep.members[0].name]
    rows = [chain_error.row(crater, name, values, draws) for crater in expected.CRATERS for name in COMPARED]
    return [row for row in rows if row is not None and row.draws is not None]


def overrides(rows: Sequence[Row]) -> tuple[str, ...]:
    """What the rows hold as the case's own chain error, texts of ``--set``; a part counts as held where all rows have
    it."""
    held = [part for part in PARTS if all(part in row.parts for row in rows)]
    return (
        f"crater.chain.holds={json.dumps(held)}",
        *(f'crater.chain.{row.crater}.{row.measure}="{row.chain!r} {UNITS[row.measure]}"' for row in rows),
    )


def measured(sweep: Sweep, rows: Sequence[Row], threads: int) -> tuple[Request, list[str]]:
    """The request of the first member with the spread as its chain error, and what ``run_case`` is given for it."""
    first = sweep.members[0]
    with_errors = Member(first.name, first.values)
    whole = Sweep(
        sweep.where, sweep.preset, sweep.size, (*sweep.overrides, *overrides(rows)), sweep.out, (with_errors,)
    )
    return whole.requests[first.name], whole.arguments(with_errors, threads)


def text(rows: Sequence[Row]) -> str:
    """The spread as a table."""
    return chain_error.text(rows)
