"""What an inversion leaves: ``posterior.h5`` (draws), ``emulator.h5`` (what predicts), ``inverse.toml`` (what went in
and came out), page."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from matter.files import archive
from matter.wording import drawing, page, readable
from pipeline.inverse import corner_picture, emulator_file, expected_gain, posterior, verdict
from pipeline.inverse.expected_gain import Gain
from pipeline.inverse.inversion import Inversion, words_of
from pipeline.inverse.posterior import LEVELS, Observed, Told
from pipeline.store import provenance

DRAWS, TABLE, PAGE = "posterior.h5", emulator_file.TABLE, "inverse.html"
COUNT = 4000
_GAIN_HEADS = ("measure", "error")


def write(found: Inversion) -> Path:
    """Write the files of an inversion into its folder: the folder."""
    archive.write(found.folder / DRAWS, _arrays(found), {"seed": found.seed, "sampler": found.posterior.sampler})
    emulator_file.write(found)
    gains = expected_gain.of_every(found)
    archive.write_text(found.folder / TABLE, tomlkit.dumps(_table(found, gains)))
    if drawing.possible("the posterior", print):
        corner_picture.write(found, found.folder)
    archive.write_text(found.folder / PAGE, _page(found, gains))
    return found.folder


def _arrays(found: Inversion) -> dict[str, Any]:
    """Equally likely draws of the posterior and of the prior, and what the posterior predicts."""
    after = found.posterior.drawn(COUNT, found.seed)
    before = posterior.prior_draws(found.priors, COUNT, found.seed)
    made: dict[str, Any] = {}
    for k, (name, unit) in enumerate(zip(found.design.names, found.design.units)):
        values = found.priors[name].values
        number = f", the number of one of {', '.join(map(str, values))}, from 0" if values else ""
        made[f"posterior/{name}"] = (after[:, k], unit, f"{name}, drawn from the posterior{number}")
        made[f"prior/{name}"] = (before[:, k], unit, f"{name}, drawn from the prior{number}")
    for one in found.observed:
        made[f"predicted/{one.name}"] = (found.predicted(one.name, COUNT), one.unit, words_of(one.name))
    return made


def _table(found: Inversion, gains: list[Gain]) -> dict[str, Any]:
    result, made = found.posterior, found.directions
    return {
        "verdict": verdict.sentence(found), "not_identified": verdict.not_identified(found),
        "cautions": verdict.cautions(found), "made": datetime.date.today(),
        "commit": str(provenance.commit().get("commit", provenance.version())), "units": "SI, angles in rad",
        "members": len(found.design.theta), "failed": len(found.design.failed), "sampler": result.sampler,
        "independent_points": round(result.effective),
        **({} if np.isnan(result.evidence) else {"log_evidence": round(result.evidence, 3)}),
        "levels": list(LEVELS),
        "parameter": [
            {"name": name, "unit": unit, **_told(found, name, one),
             "posterior_over_prior_width": round(one.width, 3), "identified": one.identified}
            for (name, one), unit in zip(found.told.items(), found.design.units)
        ],
        "observed": [_observed(found, one) for one in found.observed],
        "direction": [
            {"parameters": list(made.names), "weights": [_digits(one) for one in made.vectors[:, k]],
             "singular_value": _digits(made.singular[k]), "posterior_over_prior_width": round(float(width), 3)}
            for k, width in enumerate(made.widths)
        ],
        "gain": [
            {"measure": one.measure, "error_fraction": _digits(one.error), "observed_already": one.again,
             "expected_width_over_now": {name: round(width, 3) for name, width in one.widths.items()}}
            for one in gains
        ], **emulator_file.table(found),
    }  # fmt: skip


def _told(found: Inversion, name: str, one: Told) -> dict[str, Any]:
    if one.chances:
        return {"values": list(found.priors[name].values), "chances": [round(chance, 4) for chance in one.chances]}
    return {"mean": _digits(one.mean), "sd": _digits(one.sd), "quantiles": [_digits(value) for value in one.quantiles]}


def _observed(found: Inversion, one: Observed) -> dict[str, Any]:
    members = found.emulator(one.name).left_out()
    return {
        "name": one.name, "unit": one.unit, "value": one.value, "minus": one.minus, "plus": one.plus,
        "chain_fraction": one.chain, "discrepancy_fraction": one.discrepancy,
        "predicted": [_digits(value) for value in np.quantile(found.predicted(one.name), (0.16, 0.5, 0.84))],
        "members": len(members.z), "left_out_rms_fraction": _digits(members.rms),
        "left_out_z_mean": round(float(members.z.mean()), 3), "left_out_z_sd": round(float(members.z.std()), 3),
    }  # fmt: skip


def _digits(value: float) -> float:
    return float(f"{value:.5g}")


def rows(found: Inversion) -> list[list[str]]:
    """A row for each parameter: median, 68 and 95 %, width over that of the prior, whether it is identified; of
    "choices" the likeliest value, and the likeliest that hold 68 and 95 % together."""
    made = []
    for (name, one), unit in zip(found.told.items(), found.design.units):
        if one.chances:
            cells = [verdict.likeliest(found.priors[name], one, part) for part in (0.0, 0.68, 0.95)]
        else:
            low, _, less, middle, more, _, high = (verdict.amount(value, unit, 3) for value in one.quantiles)
            cells = [middle, f"{less} to {more}", f"{low} to {high}"]
        made.append([name, *cells, f"{one.width:.2f}", "yes" if one.identified else "no"])
    return made


def _page(found: Inversion, gains: list[Gain]) -> str:
    observed = []
    for one in found.observed:
        less, middle, more = np.quantile(found.predicted(one.name), (0.16, 0.5, 0.84))
        observed.append([
            page.Cell(words_of(one.name), key=one.name), readable.between(one.value, one.plus, one.minus, one.unit),
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
        title=f"What made it: {found.name}", corner=found.folder / corner_picture.CORNER,
        left_out=found.folder / corner_picture.LEFT_OUT, without_pictures=drawing.note(),
        cautions=verdict.cautions(found),
        parameters=rows(found), directions=verdict.direction_rows(found), told=verdict.directions(found),
        gain_heads=[*_GAIN_HEADS, *map(verdict.name_of, found.priors)], gains=verdict.gain_rows(found, gains),
        observed=observed, emulators=emulators, members=len(found.design.theta),
        failed=[list(one) for one in found.design.failed],
        model="scaling laws (a geometric mean of those for this ground), no runs" if laws else "members of the sweep",
        sampler=found.posterior.sampler, effective=readable.number(round(found.posterior.effective)),
        command=found.command, inputs=tomlkit.dumps(
            {"inverse": found.table.model_dump(mode="json"), "sweep": found.sweep}).strip(),
    )  # fmt: skip


def terminal(found: Inversion) -> str:
    """The answer as a terminal shows it."""
    lines = _columns([["parameter", "median", "68 %", "95 %", "posterior/prior", "identified"], *rows(found)])
    cautions = [readable.terminal(one) for one in verdict.cautions(found)]
    said = ["", readable.terminal(verdict.sentence(found)), "", *lines, "", *cautions]
    return "\n".join([*said, f"page: {found.folder / PAGE}", f"result: {found.folder}"])


def planned(found: Inversion | None, stands: list[str]) -> str:
    """What the data can tell apart, as a terminal shows it, and what that stands on."""
    if found is None:
        return "\n".join([*stands, "What the data can tell apart is known when some members are done."])
    lines = _columns([["direction", "singular value", "posterior/prior"], *verdict.direction_rows(found)])
    return "\n".join([*stands, "", *map(readable.terminal, verdict.directions(found)), "", *lines])


def _columns(rows: list[list[str]]) -> list[str]:
    cells = [[readable.terminal(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) + 2 for column in zip(*cells)]
    return ["".join(f"{cell:<{width}}" for cell, width in zip(row, widths)).rstrip() for row in cells]
