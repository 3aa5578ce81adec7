"""What an inversion leaves: ``posterior.h5`` (draws), ``inverse.toml`` (what went in and came out), page."""

from __future__ import annotations

import datetime
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from matter.files import archive
from matter.wording import drawing, page, readable
from pipeline.inverse import corner_picture, posterior, verdict
from pipeline.inverse.inversion import Inversion, words_of
from pipeline.inverse.posterior import LEVELS, Observed
from pipeline.store import provenance

DRAWS, TABLE, PAGE = "posterior.h5", "inverse.toml", "inverse.html"
COUNT = 4000


def write(found: Inversion) -> Path:
    """Write the files of an inversion into its folder: the folder."""
    archive.write(found.folder / DRAWS, _arrays(found), {"seed": found.seed, "sampler": found.posterior.sampler})
    archive.write_text(found.folder / TABLE, tomlkit.dumps(_table(found)))
    if drawing.possible("the posterior", print):
        corner_picture.write(found, found.folder)
    archive.write_text(found.folder / PAGE, _page(found))
    return found.folder


def command(found: Inversion) -> str:
    """What makes it again."""
    case = found.case
    named = [part for option, value in (("--preset", case.preset), ("--size", case.size)) if value
             for part in (option, value)]  # fmt: skip
    changed = [part for text in case.overrides for part in ("--set", text)]
    model = ["--set", f'inverse.model="{found.table.model}"']
    return shlex.join(["run_case", str(case.file), *named, *changed, *model, "--invert"])


def _arrays(found: Inversion) -> dict[str, Any]:
    """Equally likely draws of the posterior and of the prior, and what the posterior predicts."""
    after = found.posterior.drawn(COUNT, found.seed)
    before = posterior.prior_draws(found.priors, COUNT, found.seed)
    made: dict[str, Any] = {}
    for k, (name, unit) in enumerate(zip(found.design.names, found.design.units)):
        made[f"posterior/{name}"] = (after[:, k], unit, f"{name}, drawn from the posterior")
        made[f"prior/{name}"] = (before[:, k], unit, f"{name}, drawn from the prior")
    for one in found.observed:
        made[f"predicted/{one.name}"] = (found.predicted(one.name, COUNT), one.unit, words_of(one.name))
    return made


def _table(found: Inversion) -> dict[str, Any]:
    result = found.posterior
    return {
        "verdict": verdict.sentence(found), "not_identified": verdict.not_identified(found),
        "cautions": verdict.cautions(found), "command": command(found), "made": datetime.date.today(),
        "commit": str(provenance.commit().get("commit", provenance.version())), "units": "SI, angles in rad",
        "members": len(found.design.theta), "failed": len(found.design.failed), "sampler": result.sampler,
        "independent_points": round(result.effective),
        **({} if np.isnan(result.evidence) else {"log_evidence": round(result.evidence, 3)}),
        "levels": list(LEVELS),
        "parameter": [
            {"name": name, "unit": unit, "mean": _digits(one.mean), "sd": _digits(one.sd),
             "quantiles": [_digits(value) for value in one.quantiles],
             "posterior_over_prior_width": round(one.width, 3), "identified": one.identified}
            for (name, one), unit in zip(found.told.items(), found.design.units)
        ],
        "observed": [_observed(found, one) for one in found.observed],
        "inverse": found.table.model_dump(mode="json"), "sweep": found.case.sweep,
    }  # fmt: skip


def _observed(found: Inversion, one: Observed) -> dict[str, Any]:
    members = found.emulator(one.name).left_out()
    return {
        "name": one.name, "unit": one.unit, "value": one.value, "sigma": one.sigma,
        "chain_fraction": _digits(one.chain), "discrepancy_fraction": one.discrepancy,
        "predicted": [_digits(value) for value in np.quantile(found.predicted(one.name), (0.16, 0.5, 0.84))],
        "members": len(members.z), "left_out_rms_fraction": _digits(members.rms),
        "left_out_z_mean": round(float(members.z.mean()), 3), "left_out_z_sd": round(float(members.z.std()), 3),
    }  # fmt: skip


def _digits(value: float) -> float:
    return float(f"{value:.5g}")


def rows(found: Inversion) -> list[list[str]]:
    """A row for each parameter: median, 68 and 95 %, width over that of the prior, whether it is identified."""
    made = []
    for (name, one), unit in zip(found.told.items(), found.design.units):
        low, _, less, middle, more, _, high = (verdict.amount(value, unit, 3) for value in one.quantiles)
        state = "yes" if one.identified else "no"
        made.append([name, middle, f"{less} to {more}", f"{low} to {high}", f"{one.width:.2f}", state])
    return made


def _page(found: Inversion) -> str:
    observed = []
    for one in found.observed:
        less, middle, more = np.quantile(found.predicted(one.name), (0.16, 0.5, 0.84))
        observed.append([
            page.Cell(words_of(one.name), key=one.name), readable.measured(one.value, one.sigma, one.unit),
            f"{readable.amount(middle, one.unit, 3)} ({readable.amount(less, one.unit, 3)} to "
            f"{readable.amount(more, one.unit, 3)})",
            f"{verdict.surprise(found, one.name):+.1f} σ", f"{one.chain:.1%}", f"{one.discrepancy:.0%}",
        ])  # fmt: skip
    emulators = []
    for one in found.observed:
        z = (members := found.emulator(one.name).left_out()).z
        beyond = int((np.abs(z) > 3.0).sum())
        deviations = (f"{z.mean():+.2f}", f"{z.std():.2f}", f"{beyond}")
        emulators.append([one.name, f"{len(z)}", f"{members.rms:.2%}", *deviations])
    laws = found.table.model == "pi_scaling"
    return page.render(
        "pipeline/inverse/templates/inverse.html.j2", headline=verdict.sentence(found),
        title=f"What made it: {found.case.name}", corner=found.folder / corner_picture.CORNER,
        left_out=found.folder / corner_picture.LEFT_OUT, without_pictures=drawing.note(),
        cautions=verdict.cautions(found),
        parameters=rows(found), observed=observed, emulators=emulators, members=len(found.design.theta),
        failed=[list(one) for one in found.design.failed],
        model="scaling laws (a geometric mean of those for this ground), no runs" if laws else "members of the sweep",
        sampler=found.posterior.sampler, effective=readable.number(round(found.posterior.effective)),
        command=command(found), inputs=tomlkit.dumps(
            {"inverse": found.table.model_dump(mode="json"), "sweep": found.case.sweep}).strip(),
    )  # fmt: skip


def terminal(found: Inversion) -> str:
    """The answer as a terminal shows it."""
    head = ["parameter", "median", "68 %", "95 %", "posterior/prior", "identified"]
    cells = [head, *([readable.terminal(cell) for cell in row] for row in rows(found))]
    widths = [max(map(len, column)) + 2 for column in zip(*cells)]
    lines = ["".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip() for row in cells]
    cautions = [readable.terminal(one) for one in verdict.cautions(found)]
    said = ["", readable.terminal(verdict.sentence(found)), "", *lines, "", *cautions]
    return "\n".join([*said, f"page: {found.folder / PAGE}", f"result: {found.folder}"])
