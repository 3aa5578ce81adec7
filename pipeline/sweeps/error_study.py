"""The errors of a case (``run_case CASE --errors``): further runs that change what a run chose without a reason, and
what they say of the error of each measure.

Members, the most telling first; stages that agree are made once, whoever wants them:

``reference``                     the case as it is
``handoff_x0.5``, ``handoff_x2``  handed over half and twice as late (a shock stage that ends before is followed so
                                  far)
``alpha_x0.67``, ``alpha_x1.5``   the surface handed over by a smaller and a larger alpha
``coarser``, ``coarsest``         half and a quarter of the particles and grains
``contact_x2``                    twice the spacing at the contact, where that is at most half of what is around it
``draw_2`` to ``draw_4``          other seeds: of the grains in every draw, of the shock stage in every second one

The first two pairs share shock stage and bed, and the draws share shock stages. The reference comes first, since the
others need the time and the alpha that it took. Formulas: ``pipeline.uncertainty.chain_error``. In the end the
reference is measured once more with its errors, as a run of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from matter.errors import InputError
from matter.files import archive
from matter.wording.crater_measures import COMPARED
from pipeline.case import stages
from pipeline.case.read import Case
from pipeline.settings import expected
from pipeline.settings.compose import compose
from pipeline.store import folder
from pipeline.sweeps import ensemble, error_page, sweep_run
from pipeline.sweeps.sweep import Member, Number, Sweep
from pipeline.uncertainty import chain_error
from pipeline.uncertainty.chain_error import (
    ALPHAS,
    CONTACT,
    DRAWS_PER_SHOCK,
    EARLIER_LATER,
    REFERENCE,
    RUNGS,
    Row,
)
from pipeline.uncertainty.ladder import RATIO

DRAWS = 4
FINER = 2.0
"""Spacing at the contact of ``CONTACT`` over that of the reference."""
FILE, PAGE = "errors.json", "errors.html"


@dataclass(frozen=True)
class ErrorStudy:
    """The runs of a ``case`` in the folder of runs ``out`` that measure its errors."""

    case: Case
    out: Path

    @cached_property
    def reference(self) -> Sweep:
        """The case as it is, alone."""
        return self._sweep(Member(REFERENCE, {}))

    @property
    def run(self) -> Path:
        """The run folder of the reference."""
        return self.reference.requests[REFERENCE].run_folder

    @cached_property
    def settings(self) -> Mapping[str, Any]:
        """The settings of the reference."""
        return compose(self.reference.requests[REFERENCE].case)

    @property
    def handed_over(self) -> Mapping[str, Any]:
        """What the reference's handoff took; empty before it is there."""
        return folder.record(stages.folder(self.run, "handoff") / "handoff.json")

    def whole(self) -> Sweep:
        """All members. Before the reference is there the handoff's are those that its settings foretell, with stages
        of the same cost. Raises ``InputError`` where the case has nothing to change."""
        members = [*self._of_handoff(), *self._rungs(), *self._draws()]
        if not members:
            raise InputError(
                f"{self.case.file} has no shock stage of its own: there is nothing to change for --errors"
            )
        return self._sweep(Member(REFERENCE, {}), *members)

    def _sweep(self, *members: Member) -> Sweep:
        case = self.case
        alone = Sweep(case.file, case.preset, case.size, case.overrides, self.out, (Member(REFERENCE, {}),))
        name = f"{case.name}-errors-{alone.requests[REFERENCE].run_folder.name.rpartition('-')[2]}"
        return Sweep(case.file, case.preset, case.size, case.overrides, self.out, members, folder_name=name)

    def _of_handoff(self) -> list[Member]:
        if "handoff" not in self.case.stages:
            return []
        end, own = getattr(self.settings["sph"], "end_time", math.inf), self.settings["handoff"]
        foretold = own.time if isinstance(own.time, float) else 0.4 * end
        time, alpha = self.handed_over.get("time_s", foretold), self.handed_over.get("alpha_spacings", own.alpha)
        members = []
        for name, factor in zip(EARLIER_LATER, (0.5, 2.0), strict=True):
            at = factor * time
            longer: dict[str, Any] = {"sph.end_time": f"{at!r} s"} if at > end else {}
            members.append(Member(name, {"handoff.time": f"{at!r} s", **longer}))
        return members + [
            Member(name, {"handoff.alpha": float(f"{factor * alpha:.6g}")})
            for name, factor in zip(ALPHAS, (0.67, 1.5), strict=True)
        ]

    def _rungs(self) -> list[Member]:
        """Fewer particles and grains, step by step, as far as there is something left to resolve; then fewer at the
        contact alone, whose spacing decides the width of a crater in ground with friction."""
        if "sph" not in self.settings or "sph" in self.case.outside:
            return []
        sph, bed = self.settings["sph"], self.settings.get("bed")
        members = []
        for step, name in enumerate(RUNGS, 1):
            values: dict[str, Number] = {
                f"sph.{key}": f"{getattr(sph, key) * RATIO**step!r} m" for key in ("spacing_at_impact", "spacing_far")
            }
            if sph.projectile_particles is not None:
                values["sph.projectile_particles"] = max(1, round(sph.projectile_particles / 2**step))
            if bed is not None and "bed" not in self.case.outside:
                values["bed.count"] = round(bed.count / 2**step)
            members.append(Member(name, values))
        if sph.contact_refinement >= FINER:
            members.append(Member(CONTACT, {"sph.contact_refinement": sph.contact_refinement / FINER}))
        return members

    def _draws(self) -> list[Member]:
        seeds = {
            f"{stage}.seed": int(self.settings[stage].seed)
            for stage in ("bed", "sph")
            if stage not in self.case.outside and hasattr(self.settings.get(stage), "seed")
        }
        members = []
        for k in range(1, DRAWS if seeds else 1):
            shift = {"bed.seed": k, "sph.seed": self._group(k + 1) - 1}
            members.append(
                Member(f"draw_{k + 1}", {key: seed + shift[key] for key, seed in seeds.items() if shift[key]})
            )
        return members

    def _group(self, draw: int) -> int:
        """The number of the shock stage of a draw, from 1."""
        shared = DRAWS_PER_SHOCK if hasattr(self.settings.get("bed"), "seed") else 1
        return 1 + (draw - 1) // shared

    @property
    def shocks(self) -> int:
        """How many shock stages the draws have."""
        return self._group(DRAWS) if self._draws() else 1

    def rows(self) -> list[Row]:
        """The chain error of every measure, from the members that are measured. Raises ``InputError`` where the
        reference is not."""
        whole = self.whole()
        values = {
            member.name: expected.values(whole.requests[member.name].run_folder)
            for member in whole.members
            if sweep_run.state_of(whole, member).word == "done"
        }
        if REFERENCE not in values:
            raise InputError(f"the case itself could not be run: see {sweep_run.log_of(whole, REFERENCE)}")
        draws = {
            name: self._group(1 if name == REFERENCE else int(name.partition("_")[2]))
            for name in values
            if name == REFERENCE or name.startswith("draw_")
        }
        found = [chain_error.row(crater, name, values, draws) for crater in expected.CRATERS for name in COMPARED]
        return [row for row in found if row is not None]


def make(study: ErrorStudy, threads: int, say: Callable[[str], None]) -> dict[str, int]:
    """Run the members that are not there, the reference first; exit codes of those that could not be made. Raises
    ``InputError`` where the reference could not, ``Stopped`` when stopped on request."""
    sweep_run.links(study.reference)
    if failed := sweep_run.Runner(study.reference, threads, 1, say).run():
        raise InputError(
            f"the case itself could not be run, exit code {failed[REFERENCE]}: see "
            f"{sweep_run.log_of(study.reference, REFERENCE)}"
        )
    whole = study.whole()
    sweep_run.links(whole)
    return sweep_run.Runner(whole, threads, sweep_run.side_by_side(whole, threads), say).run()


def measured(study: ErrorStudy, rows: Sequence[Row], threads: int) -> tuple[Path, list[str]]:
    """The run folder of the reference with its errors, and what ``run_case`` is given to measure it so."""
    request, arguments = ensemble.measured(study.reference, rows, threads)
    return request.run_folder, arguments


def write(study: ErrorStudy, rows: Sequence[Row], failed: Mapping[str, int], run: Path) -> str:
    """Write ``errors.json`` and ``errors.html`` into the study's folder; what the terminal says of them. ``run``: the
    run folder of the reference with its errors."""
    whole = study.whole()
    where = whole.folder
    archive.write_json(where / FILE, {"rows": [_entry(row) for row in rows], "could_not_be_made": sorted(failed)})
    archive.write_text(where / PAGE, error_page.page_of(whole, rows, failed, run))
    return f"{chain_error.text(rows)}\n\n{error_page.sentence(whole, rows)}\n\npage: {where / PAGE}\nresult: {run}"


def _entry(row: Row) -> dict[str, Any]:
    ladder = row.ladder
    return {
        "crater": row.crater, "measure": row.measure, "draws": list(row.values), "mean": row.mean,
        "measuring": row.measuring, "parts": row.parts, "chain": row.chain,
        "order": None if ladder is None else ladder.order,
        "extrapolated": None if ladder is None else ladder.extrapolated,
    }  # fmt: skip
