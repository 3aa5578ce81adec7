"""A forecast by a sweep over priors (``run_case CASE --forecast``): what its members came to are its draws.

Two fidelities stand side by side as columns: ``whole_chain``, of the members that ran all stages, and ``shock_stage``,
of all whose shock stage is done. Nothing observed weights a member. A class that k of n members have gets the chance

    p = (k + 1/2) / (n + K/2),        K classes (Jeffreys' prior: none is called impossible by few members)

and a further member lies within the 95 % interval of n, by interpolation between them, with the chance
0.95 (n - 1) / (n + 1) on average (order statistics): the page says it.

``forecast.toml``, ``forecast_draws.h5``, ``SHA256SUMS`` and ``forecast.html`` in the sweep's folder follow its members
as its table does. A forecast is frozen by a copy of the first three; ``bolide.score`` refuses one that was changed.
"""

from __future__ import annotations

import datetime
import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tomlkit
from scipy.special import ndtri

from crater.bodies.classes import CLASSES
from crater.drawing.figure import INK, figure, save
from matter.errors import Unsound
from matter.files import archive
from matter.wording import body_measures, crater_measures, drawing, page, readable
from pipeline.case.read import Case
from pipeline.store import provenance
from pipeline.sweeps.sweep import Sweep
from pipeline.sweeps.sweep_table import Row, axis_of
from pipeline.uncertainty import forecast_files, forecast_picture

NAME, PAGE, PICTURE = "forecast", "forecast.html", "forecast.png"
WHOLE = "whole_chain"
COLUMNS = {WHOLE: ("final", "body"), "shock_stage": ("transient", "shock")}
"""Column of the forecast -> what the sweep's table calls its measures."""
SCORES = ndtri((np.arange(199) + 0.5) / 199)
"""Normal scores: the quantiles of a normal distribution, evenly by chance."""
_SAID = {
    WHOLE: "members that ran all stages: the crater of the last snapshot, the body at the end",
    "shock_stage": "all members whose shock stage is done: the crater at its largest, what had left by the end of the "
    "shock stage",
}
_CLASS_WORDS = {
    "crater": "a hollow about the site, at least ten radii of a grain wide, on at most 14.6 % of the surface",
    "not resolved": "a hollow that is narrower, or too shallow to have a diameter",
    "reshaped": "a hollow or a change of height over more of the surface; or no hollow, and other axes or more than 5 "
    "% resurfaced",
    "no hollow": "nothing at the site is deeper than the noise of the ground, and no change is global",
}
_MEASURES = {
    **{one.name: (one.unit, one.words) for one in body_measures.TABLE if one.terminal},
    **{one.name: (one.unit, one.words) for one in crater_measures.TABLE if one.compared},
    "escaping_mass_kg": ("kg", body_measures.BY_NAME["escaping_mass_kg"].words),
}


class Quantity(NamedTuple):
    """A measure: the ``values`` (n,) of the members in each column, NaN where a member has none, and the root mean
    square of their own ``errors``."""

    name: str
    unit: str
    words: str
    values: Mapping[str, np.ndarray]
    errors: Mapping[str, float]

    def widened(self, column: str) -> np.ndarray:
        """The members of a column that have it, each with every one of ``SCORES`` times their error: few members with
        one error each could lie closer together than without."""
        found, error = self.values[column], self.errors[column]
        found = found[np.isfinite(found)]
        return np.add.outer(found, error * SCORES).ravel() if error else found


def quantities(rows: Sequence[Row]) -> list[Quantity]:
    """The measures that two members and more have in a column."""
    found = []
    for name, (unit, words) in _MEASURES.items():
        values, errors = {}, {}
        for column, owners in COLUMNS.items():
            key = next((key for owner in owners if any((key := f"{owner}/{name}") in row for row in rows)), "")
            x, sigma = (_numbers(rows, key, end) for end in ("", "_sigma"))
            if np.isfinite(x).sum() > 1:
                known = sigma[np.isfinite(x) & np.isfinite(sigma)]
                values[column], errors[column] = x, float(np.sqrt(np.mean(known**2))) if len(known) else 0.0
        if values:
            found.append(Quantity(name, unit, words, values, errors))
    return found


def _numbers(rows: Sequence[Row], key: str, end: str) -> np.ndarray:
    """A column of the sweep's table as numbers, NaN where there is none."""
    return np.array([np.nan if row.get(f"{key}{end}") is None else float(row[f"{key}{end}"]) for row in rows])


def class_counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many members have each class; empty where none is classed."""
    found = [row["class"] for row in rows if row.get("class")]
    return {one: found.count(one) for one in CLASSES} if found else {}


def chances(counts: Mapping[str, int]) -> dict[str, float]:
    """Jeffreys' chance of each class."""
    total = sum(counts.values()) + 0.5 * len(counts)
    return {one: (count + 0.5) / total for one, count in counts.items()}


def coverage(count: int) -> float:
    """Chance that one more member lies in the 95 % interval of ``count``, on average."""
    return 0.95 * (count - 1) / (count + 1)


def members_of(found: Sequence[Quantity], column: str) -> int:
    """The most members that a quantity of a column has."""
    return max((int(np.isfinite(one.values[column]).sum()) for one in found if column in one.values), default=0)


def text(sweep: Sweep, case: Case, rows: Sequence[Row], found: Sequence[Quantity], made: str) -> str:
    """The forecast as TOML."""
    columns = [column for column in COLUMNS if members_of(found, column)]
    out = [
        "# What these runs forecast, before anything of it is observed; made by run_case CASE --forecast.",
        *forecast_files.pairs(_origin(sweep, case, rows) | {"headline": columns[0]}),
        f"made = {made}",
    ]
    of_column = {column: members_of(found, column) for column in columns}
    tables: dict[str, Mapping[str, Any]] = {
        "definitions": {
            "units": "SI; angles in degrees; names end in their unit",
            "draws": "members, each as likely as any other; quantiles take their own errors in (error_...)",
            "classes": "of a body at the end of the chain (crater/bodies/classes.py); (k + 1/2) / (n + K/2) of k in n",
            "coverage_95": "chance that one more member lies in the 95 % interval of so many",
        },
        "columns": {column: _SAID[column] for column in columns},
        "conditions": {column: ["the priors of [sweep], and nothing observed"] for column in columns},
        "values": of_column,
        "coverage_95": {column: round(coverage(count), 3) for column, count in of_column.items()},
        "inputs_sha256": {file.name: provenance.file_sha256(file) for file in _inputs(sweep)},
    }
    for heading, content in tables.items():
        out += ["", f"[{heading}]", *forecast_files.pairs(content)]
    for one in found:
        words = {"name": one.name, "unit": one.unit, "definition": one.words, "basis": "runs", "condition_in": []}
        out += forecast_files.quantity(words, {column: one.widened(column) for column in one.values})
        out += [f"error_{column} = {forecast_files.number(error)}" for column, error in one.errors.items() if error]
    if counts := class_counts(rows):
        out += ["", "[class]", *forecast_files.pairs({one: _CLASS_WORDS[one] for one in CLASSES})]
        out += [f"p_{WHOLE} = {forecast_files.table_of(chances(counts))}"]
        out += [f"members_{WHOLE} = {forecast_files.table_of(counts)}"]
    for row in failed_of(rows):
        out += ["", "[[member_failed]]", *forecast_files.pairs({"member": row["member"], "reason": row["reason"]})]
    out += ["", "# as it was written", tomlkit.dumps({"sweep": case.sweep}).rstrip()]
    return "\n".join(out) + "\n"


def _origin(sweep: Sweep, case: Case, rows: Sequence[Row]) -> dict[str, Any]:
    """Where a forecast comes from: case, command, commits, seed, how many members are done and failed."""
    states, first = [row["state"] for row in rows], next(iter(sweep.requests.values()))
    made_by = sorted({row["commit"] for row in rows if row.get("commit")})
    return {
        "name": sweep.folder.name, "case": first.case.title, "command": command(sweep),
        "commit": provenance.commit_words(provenance.commit()), "runs_commit": made_by,
        "seed": case.sweep.get("seed", 1),
        "members": len(rows), "done": states.count("done"), "failed": states.count("failed"),
        "levels": list(forecast_files.LEVELS),
    }  # fmt: skip


def failed_of(rows: Sequence[Row]) -> list[Row]:
    """The members that failed."""
    return [row for row in rows if row["state"] == "failed"]


def command(sweep: Sweep) -> str:
    """What makes the forecast again."""
    options = (("--preset", sweep.preset), ("--size", sweep.size), ("--until", sweep.until))
    given = [part for option, value in options if value for part in (option, value)]
    changed = [part for text in sweep.overrides for part in ("--set", text)]
    return shlex.join(["run_case", str(sweep.where), *given, *changed, "--forecast"])


def _inputs(sweep: Sweep) -> list[Path]:
    """The files of the case, and of those that its members name."""
    named = [sweep.where, *(member.where for member in sweep.members if member.where)]
    return list(dict.fromkeys(path / "case.toml" if path.is_dir() else path for path in named))


def arrays(rows: Sequence[Row], drawn: Sequence[str], found: Sequence[Quantity]) -> dict[str, Any]:
    """The draws by the paths of the file, a number per member and NaN where it has none; what was drawn of it as
    ``drawn/NAME``, its name as ``member``."""
    made: dict[str, Any] = {"member": np.array([row["member"] for row in rows], dtype="S")}
    for name in drawn:
        values, unit, words = axis_of([row[name] for row in rows])
        made[f"drawn/{name}"] = (values, unit or "1", ", ".join(words) or name)
    for one in found:
        for column, values in one.values.items():
            made[f"{column}/{one.name}"] = (values, one.unit, one.words)
    if class_counts(rows):
        made[f"{WHOLE}/class"] = np.array([row.get("class") or "" for row in rows], dtype="S")
    return made


def write(sweep: Sweep, case: Case, rows: Sequence[Row]) -> dict[str, str]:
    """Write the forecast of the sweep's table into its folder: the SHA-256 of its files by name. Raises ``Unsound``
    where fewer than two members have a measure in common."""
    found = quantities(rows)
    if not found:
        raise Unsound("no forecast: fewer than two members have a measure in common")
    new = text(sweep, case, rows, found, str(datetime.date.today()))
    drawn = list(sweep.members[0].drawn)
    attributes = {"name": sweep.folder.name, "seed": case.sweep.get("seed", 1)}
    new = _dated(sweep.folder / forecast_files.names(NAME)[0], new)
    sums = forecast_files.write(sweep.folder, NAME, new, arrays(rows, drawn, found), attributes, frozen=False)
    forecast_files.write_sums(sweep.folder, sums)
    archive.write_text(sweep.folder / PAGE, _page(sweep, case, rows, found, sums))
    return sums


def _dated(path: Path, new: str) -> str:
    """A text with the date of the file that is there, where nothing else has changed."""
    old = path.read_text() if path.is_file() else ""
    date = re.compile(r"^made = .*$", re.MULTILINE)
    return old if date.sub("", old) == date.sub("", new) else new


def _page(sweep: Sweep, case: Case, rows: Sequence[Row], found: Sequence[Quantity], sums: Mapping[str, str]) -> str:
    columns = [column for column in COLUMNS if members_of(found, column)]
    counts = class_counts(rows)
    picture = sweep.folder / PICTURE
    if drawing.possible("the forecast", print):
        _draw(found, picture)
    states = [row["state"] for row in rows]
    return page.render(
        "pipeline/sweeps/templates/forecast.html.j2", headline=headline(found, counts),
        title=f"Forecast of {next(iter(sweep.requests.values())).case.title}", picture_file=picture,
        without_pictures=drawing.note(), columns=[[_plain(one), _SAID[one], str(members_of(found, one)),
        f"{coverage(members_of(found, one)):.2f}"] for one in columns], head=["", *map(_plain, columns)],
        rows=[[page.Cell(one.words, key=one.name), *(_cell(one, column) for column in columns)] for one in found],
        classes=[[one, f"{p:.2f}", str(counts[one]), _CLASS_WORDS[one]] for one, p in chances(counts).items()],
        done=states.count("done"), members=len(rows),
        failed=[[row["member"], row["reason"]] for row in failed_of(rows)],
        sums=[[file, code] for file, code in sums.items()], command=command(sweep),
        priors=tomlkit.dumps({"sweep": case.sweep}).strip(), file=str(sweep.folder / forecast_files.names(NAME)[0]),
        example=found[0].name,
    )  # fmt: skip


def _plain(column: str) -> str:
    return column.replace("_", " ")


def _cell(one: Quantity, column: str) -> str:
    """Median (68 %; 95 %) of a column; empty where it has none."""
    if column not in one.values:
        return "–"
    values = np.quantile(one.widened(column), forecast_files.LEVELS)
    factor, symbol = readable.scale(float(np.abs(values).max()), one.unit)
    words = forecast_files.range_words(values, lambda value: readable.number(factor * value, 3))
    return f"{words} {symbol}".rstrip()


def headline(found: Sequence[Quantity], counts: Mapping[str, int]) -> str:
    """The likeliest class, and the first two quantities, of the finer column that has them."""
    said = []
    if counts:
        likely, p = max(chances(counts).items(), key=lambda one: one[1])
        said.append(f"{likely} with a chance of {p:.2f}")
    best = next(column for column in COLUMNS if members_of(found, column))
    shown = [one for one in found if best in one.values][:2]
    return "; ".join([*said, *(f"{one.words}: {_cell(one, best)}" for one in shown)])


def _draw(found: Sequence[Quantity], path: Path) -> None:
    """The quantities as bars, a panel each."""
    rows = -(-len(found) // 3)
    fig = figure(9.6, 1.3 * rows + 0.4)
    colours = dict(zip(COLUMNS, INK[1::-1]))
    for number, one in enumerate(found):
        axes = fig.add_subplot(rows, 3, number + 1)
        values = {column: np.quantile(one.widened(column), forecast_files.LEVELS) for column in one.values}
        factor, symbol = readable.scale(max(float(np.abs(x).max()) for x in values.values()), one.unit)
        title = f"{one.words}{f' [{symbol}]' if symbol else ''}"
        bars = {colours[column]: factor * x for column, x in values.items()}
        forecast_picture.panel(axes, title if len(title) < 40 else one.name, bars)
    save(fig, path)


def terminal(sweep: Sweep, rows: Sequence[Row], sums: Mapping[str, str]) -> str:
    """The forecast as a terminal shows it."""
    found = quantities(rows)
    columns = [column for column in COLUMNS if members_of(found, column)]
    cells = [[one.words, *(_cell(one, column) for column in columns)] for one in found]
    table = [["forecast", *map(_plain, columns)], *([readable.terminal(cell) for cell in line] for line in cells)]
    widths = [max(map(len, column)) + 2 for column in zip(*table)]
    lines = ["".join(f"{cell:<{width}}" for cell, width in zip(line, widths)).rstrip() for line in table]
    if counts := class_counts(rows):
        lines += ["", "chances: " + ", ".join(f"{one} {p:.2f}" for one, p in chances(counts).items())]
    lines += ["", *(f"{code}  {sweep.folder / file}" for file, code in sums.items()), f"page: {sweep.folder / PAGE}"]
    return "\n".join(lines)
