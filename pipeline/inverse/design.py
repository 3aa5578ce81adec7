"""The design: what was drawn for each member of a sweep over priors, and what it came to."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from matter.case import quantity
from matter.errors import InputError
from pipeline.case import read as cases
from pipeline.case.inverse_table import InverseTable
from pipeline.case.prior_table import Prior
from pipeline.case.stages import nearest
from pipeline.inverse import scaling_members
from pipeline.settings import compose, expected
from pipeline.sweeps import sweep_table
from pipeline.sweeps.sweep import Sweep

FINAL = "final/"
"""What a measure's name begins with in a sweep's table where it is given alone."""
LEAST_EACH, WELL_EACH = 4, 10
"""Members for each parameter below which nothing is fitted, and below which the page warns (Loeppky et al. 2009,
Technometrics 51, 366)."""


class Design(NamedTuple):
    """``theta`` (n, d) [SI] of every member; ``columns``: measure -> its values (n,) and standard errors (n,), NaN
    where a member has none; ``failed``: member and reason of those that failed."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    theta: np.ndarray
    columns: Mapping[str, tuple[np.ndarray, np.ndarray]]
    failed: Sequence[tuple[str, str]]

    def members_with(self, measure: str) -> np.ndarray:
        """Which members have a positive value of it (n,)."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.columns[measure][0] > 0.0)


def of_sweep(sweep: Sweep, priors: Mapping[str, Prior], table: InverseTable) -> Design:
    """The design of a sweep, by the model that the table names. Raises ``InputError`` where there is none yet."""
    theta = np.array([[_si(member.drawn[name], prior) for name, prior in priors.items()] for member in sweep.members])
    columns, failed = _by_laws(sweep) if table.model == "pi_scaling" else _by_runs(sweep)
    return Design(tuple(priors), tuple(map(unit_of, priors.values())), theta, columns, failed)


def unit_of(prior: Prior) -> str:
    """The SI unit of what a prior draws; "1" for numbers."""
    return quantity.si_unit(f"1 {prior.unit}") if prior.unit else "1"


def _si(value: Any, prior: Prior) -> float:
    if prior.values:
        return float(prior.values.index(value))
    return quantity.parse(value) if isinstance(value, str) else float(value)


def _by_laws(sweep: Sweep) -> tuple[dict[str, Any], list[Any]]:
    sizes: list[float] = []
    for member in sweep.members:
        where = member.where or sweep.where
        case = cases.read(where, sweep.preset, [*sweep.overrides, *member.overrides], sweep.size)
        try:
            if not sizes:  # every mistake in the case: the laws ask for a part of it only
                compose.compose(case)
            sizes.append(scaling_members.diameter(case))
        except (InputError, ValueError) as reason:
            raise InputError(f"member {member.name} ({', '.join(member.overrides)}): {reason}") from None
    return {scaling_members.MEASURE: (np.array(sizes), np.zeros(len(sizes)))}, []


def has_table(sweep: Sweep) -> bool:
    """Whether a sweep has a table of what its members came to."""
    return (sweep.folder / sweep_table.CSV).is_file()


def _by_runs(sweep: Sweep) -> tuple[dict[str, Any], list[Any]]:
    file = sweep.folder / sweep_table.CSV
    if not has_table(sweep):
        raise InputError(
            f"no table of the sweep at {file}: run_case {sweep.where} --sweep makes it (--set "
            f'inverse.model="pi_scaling" asks scaling laws instead)'
        )
    with file.open(newline="") as lines:
        by_name = {row["member"]: row for row in csv.DictReader(lines)}
    rows = [by_name.get(member.name, {}) for member in sweep.members]
    measured = [name for name in next(iter(by_name.values()), {}) if "/" in name and not name.endswith("_sigma")]
    columns = {
        name.removeprefix(FINAL): (_numbers(rows, name), np.nan_to_num(_numbers(rows, f"{name}_sigma")))
        for name in measured
    }
    failed = [(row["member"], row["reason"]) for row in rows if row.get("state") == "failed"]
    return columns, failed


def _numbers(rows: Sequence[Mapping[str, str]], column: str) -> np.ndarray:
    return np.array([float(row[column]) if row.get(column) else np.nan for row in rows])


def check(design: Design, table: InverseTable, priors: Mapping[str, Prior], where: Path) -> None:
    """Raise ``InputError`` where what was observed is not among what the members came to, or too few have it."""
    known = list(design.columns)
    for name in table.observed:
        if name.removeprefix(FINAL) not in known:
            found = f" (there are {', '.join(known)})" if len(known) < 12 else f" (see {where / sweep_table.CSV})"
            by = "scaling laws give" if table.model == "pi_scaling" else "the sweep's table has"
            raise InputError(f"[inverse] observed: {by} no {name!r}{nearest(name, known) or found}")
    least = max(8, LEAST_EACH * len(design.names))
    for name in table.observed:
        count = int(design.members_with(name.removeprefix(FINAL)).sum())
        if count < least:
            raise InputError(
                f"{count} of {len(design.theta)} members have {name}, and {len(design.names)} parameters need "
                f"{least} at least ({WELL_EACH * len(design.names)} are a good number): finish the sweep, or raise "
                f"[sweep] members"
            )
        _every_choice(design, name.removeprefix(FINAL), priors)


def _every_choice(design: Design, measure: str, priors: Mapping[str, Prior]) -> None:
    """Raise ``InputError`` where no member with a measure has one of the values of "choices": nothing is known of
    it."""
    for k, (name, prior) in enumerate(priors.items()):
        drawn = design.theta[design.members_with(measure), k]
        if missing := [value for number, value in enumerate(prior.values) if number not in drawn]:
            raise InputError(f"no member with {measure} has {name} = {missing[0]!r}: raise [sweep] members")


def chain(sweep: Sweep, model: str, measure: str) -> tuple[float, float]:
    """Chain error of ln of a measure, and the part of it that other random draws of the same case would scatter by
    (``expected.toml`` of the case that is swept); 0 where it is not known there."""
    if model == "pi_scaling":
        return 0.0, 0.0
    found = expected.expected_result(next(iter(sweep.requests.values())).case)
    crater, _, name = measure.rpartition("/")
    entry = getattr(getattr(found, crater or "final", None), name, None)
    if entry is None or not entry.value:
        return 0.0, 0.0
    return (entry.chain or 0.0) / entry.value, (entry.draws or 0.0) / entry.value
