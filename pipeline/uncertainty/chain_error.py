"""The chain error of a case: the same case with other draws, a coarser size, an earlier and a later handoff, each run
and measured; kept in ``expected.toml``.

Members, in the order in which they are made (what is done is not made again, stages that agree are made once):

``reference``      the case as it is, with its preset
``handoff_x0.5``   handed over half as late        (from the handoff on)
``handoff_x2``     twice as late; a shock stage that ends before that is followed so far
``coarser``        half the particles and grains   (spacings times 2^(1/3), counts over 2)
``draw_2`` ...     other seeds: of the grains in every draw, of the shock stage in every second one

Per measure, with y the values of the draws (the reference is the first) in groups of one shock stage each:

    draws^2   = MS_within + max(0, (MS_between - MS_within) / n0)
        one-way analysis of variance: the scatter of one run whose particles and grains are
                                                                      both redrawn; n0 the mean size of a group,
                                                                      corrected for unequal ones
    handoff^2 = max(0, (half the range over the times x0.5, 1, x2)^2 - 0.913 MS_within)
    size^2    = max(0, (coarser - reference)^2 - 2 draws^2)
    chain^2   = draws^2 + handoff^2 + size^2

What is subtracted is what the scatter of draws alone would show on average (half the range of three normal numbers has
a mean square of 0.913 sigma^2), so that no error counts twice. ``size`` is the difference to a run of 1.26 times the
spacing, not an extrapolation to zero spacing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from matter.errors import InputError, Stopped
from matter.files import archive
from matter.wording.crater_measures import COMPARED
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running import run_process
from pipeline.running.request import Request
from pipeline.settings import expected
from pipeline.settings.compose import compose
from pipeline.store import folder, provenance

COARSER = 2.0 ** (1.0 / 3.0)
HALF_RANGE_OF_THREE = 0.5 + 3.0 * math.sqrt(3.0) / (4.0 * math.pi)
"""Mean square of half the range of three standard normal numbers: 1/2 + 3 sqrt(3) / (4 pi)."""
DRAWS_PER_SHOCK = 2


@dataclass(frozen=True)
class Member:
    """One run: the case with ``overrides`` (texts of ``--set``), and for a draw the number of its shock stage."""

    name: str
    overrides: tuple[str, ...] = ()
    shock: int | None = None


@dataclass(frozen=True)
class Study:
    """A case and preset whose chain error is measured in the folder ``out``, with so many draws."""

    case: Path
    preset: str | None
    out: Path
    draws: int = 8

    def read(self, member: Member) -> cases.Case:
        """The composed case of a member; raises ``InputError``."""
        return cases.read(self.case, self.preset, member.overrides)

    def run_folder(self, member: Member) -> Path:
        """Where a member's run is."""
        return Request(self.read(member), self.out).run_folder

    def done(self, member: Member) -> bool:
        """Whether a member is measured."""
        return (stages.folder(self.run_folder(member), "crater") / folder.DONE).is_file()


def reference() -> Member:
    """The case as it is."""
    return Member("reference", shock=1)


def others(study: Study) -> list[Member]:
    """All other members, the most telling first; the reference has to be done. Raises ``InputError``."""
    case = study.read(reference())
    settings = compose(case)
    members = []
    if "handoff" in case.stages:
        record = folder.record(stages.folder(study.run_folder(reference()), "handoff") / "handoff.json")
        for factor in (0.5, 2.0):
            at = factor * record["time_s"]
            longer = (f'sph.end_time="{at!r} s"',) if at > getattr(settings["sph"], "end_time", math.inf) else ()
            members.append(Member(f"handoff_x{factor:g}", (f'handoff.time="{at!r} s"', *longer)))
    members.append(Member("coarser", _coarser(settings)))
    bed = getattr(settings.get("bed"), "seed", None)
    shock = getattr(settings.get("sph"), "seed", None)
    for k in range(2, study.draws + 1):
        group = 1 + (k - 1) // (DRAWS_PER_SHOCK if bed is not None else 1)
        seeds = (() if bed is None else (f"bed.seed={bed + k - 1}",)) + (
            () if group == 1 or shock is None else (f"sph.seed={shock + group - 1}",)
        )
        members.append(Member(f"draw_{k}", seeds, group))
    return members


def _coarser(settings: dict[str, Any]) -> tuple[str, ...]:
    """Half the particles and half the grains."""
    sph, bed = settings["sph"], settings.get("bed")
    texts = [f'sph.{name}="{getattr(sph, name) * COARSER!r} m"' for name in ("spacing_at_impact", "spacing_far")]
    if sph.projectile_particles is not None:
        texts.append(f"sph.projectile_particles={max(1, round(sph.projectile_particles / 2))}")
    if bed is not None:
        texts.append(f"bed.count={round(bed.count / 2)}")
    return tuple(texts)


def make(study: Study, threads: int | None = None, say=print) -> list[str]:
    """Run every member that is not done; names of those that could not be made. Raises ``InputError``, and ``Stopped``
    when stopped on request."""
    first = reference()
    failed: list[str] = []
    _run(study, first, threads, say)
    if not study.done(first):
        raise InputError(f"the reference run in {study.run_folder(first)} could not be made: see its run.log")
    for member in others(study):
        code = _run(study, member, threads, say)
        if not study.done(member):
            failed.append(member.name)
            say(
                f"{member.name}: could not be made (exit code {code}); why is the last line of "
                f"{study.run_folder(member) / 'run.log'}"
            )
    return failed


def _run(study: Study, member: Member, threads: int | None, say) -> int:
    if study.done(member):
        say(f"{member.name}: done before")
        return 0
    say(f"{member.name}: {', '.join(member.overrides) or 'as shipped'} ({study.run_folder(member).name})")
    arguments = [str(study.case), "--out", str(study.out)] + (["--preset", study.preset] if study.preset else [])
    arguments += [part for text in member.overrides for part in ("--set", text)] + (
        ["--threads", str(threads)] if threads else []
    )
    code = run_process.as_process(arguments)
    if code == run_process.STOPPED:
        raise Stopped(f"stopped in {member.name}; the same command continues")
    return code


@dataclass(frozen=True)
class Row:
    """One measure of one crater: values of the draws with their shock stages, mean and mean measuring error, and the
    parts of the chain error (None: not measured)."""

    crater: str
    measure: str
    values: tuple[float, ...]
    mean: float
    measuring: float
    draws: float | None
    handoff: float | None
    size: float | None

    @property
    def chain(self) -> float:
        """The chain error."""
        return math.hypot(*(part for part in (self.draws, self.handoff, self.size) if part is not None), 0.0)


def variance(values: Sequence[float], groups: Sequence[int]) -> tuple[float, float]:
    """Mean square within groups, and the variance of one value whose group is drawn too: one-way analysis of variance
    with random effects.

    One group: both are the plain variance. Groups of one value each: the variance of the values, and nothing is known
    within (0).
    """
    y, group = np.asarray(values, dtype=float), np.asarray(groups)
    names, size = np.unique(group, return_counts=True)
    means = np.array([y[group == name].mean() for name in names])
    n, g = len(y), len(names)
    within = float(sum(np.sum((y[group == name] - mean) ** 2) for name, mean in zip(names, means, strict=True)))
    ms_within = within / (n - g) if n > g else 0.0
    if g == 1:
        return ms_within, ms_within
    ms_between = float(np.sum(size * (means - y.mean()) ** 2)) / (g - 1)
    n0 = (n - float(np.sum(size**2)) / n) / (g - 1)
    return ms_within, ms_within + max(0.0, (ms_between - ms_within) / n0)


def evaluate(study: Study) -> list[Row]:
    """The chain error of every measure, from the members that are done. Raises ``InputError`` when the reference is
    not."""
    if not study.done(reference()):
        raise InputError(f"the reference run in {study.run_folder(reference())} is not done")
    members = [reference(), *others(study)]
    values = {member.name: expected.values(study.run_folder(member)) for member in members if study.done(member)}
    draws = [member for member in members if member.shock is not None and member.name in values]
    rows = [row(crater, name, values, draws) for crater in expected.CRATERS for name in COMPARED]
    return [one for one in rows if one is not None]


def row(crater: str, name: str, measured: dict[str, Any], draws: list[Member]) -> Row | None:
    """The chain error of one measure of one crater; ``measured``: member -> crater -> measure -> entry, ``draws``: the
    members that are draws, the reference among them. None where the reference has not measured it."""

    def value(member: str) -> float | None:
        return measured.get(member, {}).get(crater, {}).get(name, {}).get("value")

    mine = [member for member in draws if value(member.name) is not None]
    origin = value("reference")
    if origin is None:
        return None
    values = [float(value(member.name) or 0.0) for member in mine]
    within, total = variance(values, [member.shock or 0 for member in mine]) if len(mine) > 1 else (0.0, 0.0)
    times = [each for each in (value("handoff_x0.5"), value("handoff_x2")) if each is not None]
    coarser = value("coarser")
    spread = 0.5 * (max(*times, origin) - min(*times, origin)) if times else None
    return Row(
        crater, name, tuple(values), float(np.mean(values)),
        _measuring([measured[member.name][crater][name] for member in mine]),
        draws=math.sqrt(total) if len(mine) > 1 else None,
        handoff=None if spread is None else math.sqrt(max(0.0, spread**2 - HALF_RANGE_OF_THREE * within)),
        size=None if coarser is None else math.sqrt(max(0.0, (coarser - origin) ** 2 - 2.0 * total)),
    )  # fmt: skip


def _measuring(entries: list[dict[str, Any]]) -> float:
    """Root mean square of the measuring errors of the draws, without a chain error that they may carry; of a run that
    is not resolved by their parts, since it states no error."""
    squares = []
    for entry in entries:
        parts = entry.get("sigma_parts") or {}
        whole = math.hypot(*parts.values()) if entry.get("sigma") is None else entry["sigma"]
        squares.append(whole**2 - (parts.get("chain") or 0.0) ** 2)
    return math.sqrt(max(0.0, float(np.mean(squares))))


def text(rows: Sequence[Row]) -> str:
    """The rows as a table, each with its unit."""
    columns = ("mean", "measuring", "draws", "handoff", "size", "chain")
    lines = [f"{'':<30}{'':<22}{''.join(f'{column:>12}' for column in columns)}"]
    for row in rows:
        factor, unit = expected.scale(row.measure, row.mean)
        cells = (row.mean, row.measuring, row.draws, row.handoff, row.size, row.chain)
        shown = "".join(f"{'--' if cell is None else f'{cell * factor:.4g}':>12}" for cell in cells)
        lines.append(f"{row.crater:<30}{row.measure:<22}{shown}  {unit}")
    return "\n".join(lines)


def write(study: Study, rows: list[Row], command: str, file: Path) -> None:
    """Write the rows as the preset's table of an ``expected.toml``; the other presets' tables stay as they are."""
    case = study.read(reference())
    content = tomlkit.parse(file.read_text()) if file.is_file() else tomlkit.document()
    if not file.is_file():
        content.add(
            tomlkit.comment(
                f"What the presets of {case.name} come to, with errors; written by studies/chain_error.py (the "
                f"formulas stand in"
            )
        )
        content.add(
            tomlkit.comment(
                "pipeline/uncertainty/chain_error.py). A run is held against it, and its measures carry the chain "
                "error (draws, handoff, size in quadrature)."
            )
        )
    done = [member for member in [reference(), *others(study)] if member.shock is not None and study.done(member)]
    made_by = provenance.commit()
    table = tomlkit.table()
    table.add("command", command)
    table.add(
        "commit", made_by.get("commit", "unknown") + (" with changes" if made_by.get("uncommitted_changes") else "")
    )
    table.add("measured", time.strftime("%Y-%m-%d"))
    table.add("members", len(done))
    table.add("shocks", len({member.shock for member in done}))
    for crater in expected.CRATERS:
        mine = [row for row in rows if row.crater == crater]
        if mine:
            table.add(crater, {row.measure: _entry(row) for row in mine})
    content[case.preset or expected.NO_PRESET] = table
    archive.write_text(file, tomlkit.dumps(content))
    expected.read(file.parent)


def _entry(row: Row) -> dict[str, str]:
    factor, unit = expected.scale(row.measure, row.mean)
    cells = {
        "value": row.mean,
        "measuring": row.measuring,
        "draws": row.draws,
        "handoff": row.handoff,
        "size": row.size,
    }
    return {name: f"{cell * factor:.4g} {unit}" for name, cell in cells.items() if cell is not None}


def keep(rows: list[Row], failed: list[str], out: Path) -> None:
    """Every value behind the table, as ``chain_error.json`` in the folder of the runs."""
    content = [{**{name: getattr(row, name) for name in Row.__dataclass_fields__}, "chain": row.chain} for row in rows]
    archive.write_json(out / "chain_error.json", {"rows": content, "could_not_be_made": failed})
