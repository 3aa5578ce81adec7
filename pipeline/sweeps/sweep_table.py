"""What a sweep came to: one table (CSV, HDF5), and one page with every measure against every parameter that was
varied, errors and scaling laws beside."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crater.drawing.figure import INK, figure, grid, legend_outside, save
from crater.scaling import crater_size
from matter.case import quantity
from matter.case.body import SOLIDS
from matter.files import archive
from matter.wording import body_measures, crater_measures, drawing, page, readable
from matter.wording.crater_measures import COMPARED
from pipeline.case import overlay, stages
from pipeline.settings import expected
from pipeline.store import folder, provenance
from pipeline.sweeps.sweep import QUANTITY, Number, Sweep
from pipeline.sweeps.sweep_run import outcome_of

CSV, HDF5, PAGE = "table.csv", "table.h5", "page.html"
_SIGMA, _LAW = "_sigma", "law/"
_WORDS = {measure.name: measure.words for measure in (*body_measures.TABLE, *crater_measures.TABLE)}
_UNITS = {measure.name: measure.unit for measure in (*body_measures.TABLE, *crater_measures.TABLE)}
_OF_BODY = tuple(measure.name for measure in body_measures.TABLE if measure.terminal)
_DRAWN = (
    *(f"{crater}/{name}" for name in COMPARED for crater in ("transient", "final")),
    *(f"{stage}/{name}" for name in _OF_BODY for stage in ("shock", "body")),
)
"""Measures that pictures show, where a member has them."""
Row = dict[str, Any]


def rows_of(sweep: Sweep, failed: Mapping[str, int] | None = None) -> list[Row]:
    """A row per member: name, run folder, where it stands, why it failed, the commit of the code that made it, its
    last stage (``until``), every quantity that is drawn and key that is varied with its value, whether its last crater
    is at rest (``settled``), then measures as ``final/depth_m`` with ``..._sigma`` [SI], on a body those after the
    shock stage (``shock/beta_normal``) and at the end (``body/beta_normal``), and the transient apparent diameter by
    the scaling laws for its ground as ``law/<name>`` [m]. A member that was computed elsewhere has the row from there.
    ``failed``: exit codes of members that failed just now."""
    rows = []
    for member in sweep.members:
        if done_elsewhere := sweep.elsewhere.get(member.name):
            rows.append(done_elsewhere)
            continue
        request = sweep.requests[member.name]
        outcome = outcome_of(sweep, member, failed or {})
        made_by = folder.record(request.run_folder / "provenance.json").get("distribution")
        row: Row = {
            "member": member.name,
            "run": request.run_folder.name,
            "state": outcome.word,
            "reason": ": ".join(filter(None, (outcome.stage, outcome.reason))) if outcome.word == "failed" else "",
            "commit": provenance.commit_words(made_by),
            "until": request.wanted[-1],
            **sweep.values[member.name],
        }
        row["settled"] = (
            folder.record(stages.folder(request.run_folder, "crater") / "measures.json").get("final") or {}
        ).get("settled")
        for crater, cells in expected.values(request.run_folder).items():
            for name, cell in cells.items():
                row[f"{crater}/{name}"], row[f"{crater}/{name}{_SIGMA}"] = cell.get("value"), cell.get("sigma")
        if overlay.at(request.case.document, "target.shape") in SOLIDS:
            row |= _of_body(request.run_folder)
        rows.append(row | _laws(request.run_folder))
    return rows


def _of_body(run: Path) -> Row:
    """What left a body by the end of the shock stage, its measures at the end, and its class."""
    row: Row = {}
    report = folder.record(stages.folder(run, "sph") / "stage_report.json")
    if left := report.get("escaping"):
        row |= {"shock/escaping_mass_kg": left["mass_kg"], "shock/beta_normal": left["beta"]}
    body = folder.record(stages.folder(run, "crater") / "measures.json").get("body", {})
    if found := body.get(body.get("final", "")):
        row["class"] = found["class"]
        for name in _OF_BODY:
            cell = found["measures"].get(name, {})
            cell = cell.get("after", cell)
            row[f"body/{name}"], row[f"body/{name}{_SIGMA}"] = cell.get("value"), cell.get("sigma")
    return row


def _laws(run: Path) -> dict[str, float]:
    """Diameters by the laws that are usual for the ground of a measured run; empty where there is no weight, or
    nothing was measured."""
    compared = folder.record(stages.folder(run, "crater") / "compare.json").get("scaling") or {}
    return {f"{_LAW}{name}": float(compared["diameter_m"][name]) for name in compared.get("range_of", ())}


def columns_of(rows: Sequence[Row]) -> list[str]:
    """All columns, in the order in which they first come."""
    return list(dict.fromkeys(name for row in rows for name in row))


def unit_of(column: str) -> str:
    """SI unit of a column of measures or laws; empty for others."""
    name = column.rpartition("/")[2].removesuffix(_SIGMA)
    return "m" if column.startswith(_LAW) else _UNITS.get(name, "") if "/" in column else ""


def write(sweep: Sweep, failed: Mapping[str, int] | None = None) -> list[Row]:
    """Write table, pictures and page into the sweep's folder; the rows. ``failed``: as for ``rows_of``."""
    rows = rows_of(sweep, failed)
    columns = columns_of(rows)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([["" if row.get(name) is None else row[name] for name in columns] for row in rows])
    archive.write_text(sweep.folder / CSV, text.getvalue())
    _write_hdf5(sweep.folder / HDF5, rows, columns, sweep.values[sweep.members[0].name])
    archive.write_text(sweep.folder / PAGE, _page(sweep, rows))
    return rows


def _write_hdf5(path: Path, rows: Sequence[Row], columns: Sequence[str], given: Collection[str]) -> None:
    """Numbers as such, and so what is drawn or varied (``given``) in one unit; all else as texts."""
    arrays: dict[str, Any] = {}
    for name in columns:
        values = [row.get(name) for row in rows]
        key = name.replace("/", ".")
        if all(value is None or (isinstance(value, int | float) and not isinstance(value, bool)) for value in values):
            arrays[key] = (
                np.array([np.nan if value is None else float(value) for value in values]),
                unit_of(name) or "1",
                _meaning(name),
            )
        elif name in given and (found := axis_of([str(value) for value in values]))[1] not in ("", "SI"):
            arrays[key] = (found[0], found[1], name)
        else:
            arrays[key] = np.array(["" if value is None else str(value) for value in values], dtype="S")
    archive.write(path, arrays)


def _meaning(column: str) -> str:
    crater, _, name = column.rpartition("/")
    if column.startswith(_LAW):
        return f"transient apparent diameter by {crater_size.NAMES.get(name, name)}"
    words = _WORDS.get(name.removesuffix(_SIGMA), name)
    return f"{'standard error of ' if name.endswith(_SIGMA) else ''}{crater.replace('_', ' ')} {words}".strip()


def axis_of(values: Sequence[Number]) -> tuple[np.ndarray, str, list[str]]:
    """Places on an axis of values as they were given, their unit, and labels where they are words: numbers in a common
    unit stay, in several they become SI."""
    parts = [
        match.groups() if isinstance(value, str) and (match := QUANTITY.match(value)) else None for value in values
    ]
    if all(parts):
        units = {part[1].strip() for part in parts if part}
        if len(units) == 1:
            return np.array([float(part[0]) for part in parts if part]), units.pop(), []
        try:
            return np.array([quantity.parse(str(value)) for value in values]), "SI", []
        except ValueError:
            pass
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array([float(value) for value in values]), "", []
    words = list(dict.fromkeys(map(str, values)))
    return np.array([float(words.index(str(value))) for value in values]), "", words


def _page(sweep: Sweep, rows: Sequence[Row]) -> str:
    done = [row for row in rows if row["state"] == "done"]
    given = list(sweep.values[sweep.members[0].name])
    keys = [key for key in sweep.members[0].drawn or given if len({str(row[key]) for row in rows}) > 1]
    files = {}
    for key in keys if drawing.possible("the sweep", print) else ():
        file = sweep.folder / f"against_{key.replace('.', '_')}.png"
        shown = _about(sweep, done, key)
        if len({str(row[key]) for row in shown}) > 1 and _draw(shown, key, file):
            files[key] = file
    measured = [
        name
        for name in columns_of(rows)
        if "/" in name and not name.endswith(_SIGMA) and not name.startswith(_LAW) and not _deep(name)
    ]
    case = next(iter(sweep.requests.values())).case
    title = f"Sweep {sweep.name}" if "case" in given else f"Sweep of {case.title}"
    return page.render(
        "pipeline/sweeps/templates/sweep_table.html.j2", headline=_headline(rows, done), fidelity=_fidelity(rows),
        failed=[[row["member"], row["reason"]] for row in rows if row["state"] == "failed"], title=title,
        without_pictures=drawing.note(), pictures=files, named=sweep.named,
        head=["member", "state", *given, *map(_meaning, measured)],
        rows=[
            [row["member"], row["state"], *("–" if row[key] is None else _short(row[key]) for key in given)]
            + [_measured(row, name) or "–" for name in measured]
            for row in rows
        ],
    )  # fmt: skip


def _headline(rows: Sequence[Row], done: Sequence[Row]) -> str:
    """How many members are done, failed and missing, between which diameters and depths the last craters lie, how many
    are settled."""
    said = [_states(rows)]
    for name, symbol in (("diameter_apparent_m", "D ="), ("depth_m", "depth")):
        if sizes := [float(row[f"final/{name}"]) for row in done if row.get(f"final/{name}") is not None]:
            ends = dict.fromkeys(readable.amount(size, "m", 3) for size in (min(sizes), max(sizes)))
            said.append(f"{symbol} {' to '.join(ends)}")
    return ", ".join([*said, f"{sum(row['settled'] is True for row in done)} settled"])


def _states(rows: Sequence[Row]) -> str:
    states = [row["state"] for row in rows]
    others = "".join(f", {states.count(word)} {word}" for word in dict.fromkeys(states) if word != "done")
    return f"{states.count('done')} of {len(rows)} members are done{others}"


def _fidelity(rows: Sequence[Row]) -> str:
    """How many members run the whole chain, where some do not."""
    until = [row["until"] for row in rows]
    whole = len(until) - until.count("sph")
    return f"{whole} run all stages, the others end with the shock stage." if 0 < whole < len(until) else ""


def _short(value: Number) -> str:
    """A value for reading: derived numbers have all their digits in the table."""
    number, unit = match.groups() if (match := QUANTITY.match(str(value))) else (str(value), "")
    if isinstance(value, float) or unit:
        return f"{float(number):.6g} {unit}".strip()
    return str(value)


def _deep(name: str) -> bool:
    return name.startswith("transient_at_maximum_depth/")


def _measured(row: Row, name: str) -> str:
    """A measure with its error; empty where there is none."""
    value = row.get(name)
    return "" if value is None else readable.measured(float(value), row.get(f"{name}{_SIGMA}"), unit_of(name))


def _about(sweep: Sweep, rows: Sequence[Row], key: str) -> list[Row]:
    """The members that a picture against ``key`` shows: all, or, where each names its own keys (``points``), the
    plainest of each case (which says least itself) and those that differ from it in this key. What is left to the
    default is called so."""
    chosen = list(rows)
    if sweep.named:
        plain: dict[str, str] = {}
        for member in sorted(sweep.members, key=lambda one: len(one.values)):
            plain.setdefault(sweep.requests[member.name].case.name, member.name)
        least = {name: sweep.values[member] for name, member in plain.items()}
        of_case = {member.name: sweep.requests[member.name].case.name for member in sweep.members}
        chosen = [
            row
            for row in rows
            if row["member"] in plain.values() or str(row[key]) != str(least[of_case[row["member"]]][key])
        ]
    return [row | {key: "default"} if row[key] is None else row for row in chosen]


def _draw(rows: Sequence[Row], key: str, file: Path) -> bool:
    """One picture: every measure that a member has, against one key; whether there was anything to draw. Members of
    several cases differ in colour."""
    shown = [name for name in _DRAWN if len({row[key] for row in rows if row.get(name) is not None}) > 1]
    if not shown:
        return False
    positions, unit, words = axis_of([row[key] for row in rows])
    of_case = sorted({str(row.get("case", "")) for row in rows})
    order = np.argsort(positions, kind="stable")
    fig = figure(11.0, 2.9 * -(-len(shown) // 3))
    for number, name in enumerate(shown):
        axis = fig.add_subplot(-(-len(shown) // 3), 3, number + 1)
        factor, symbol = readable.scale(
            max(abs(float(row[name])) for row in rows if row.get(name) is not None), unit_of(name)
        )
        value, error = (
            np.array([np.nan if row.get(column) is None else factor * float(row[column]) for row in rows])
            for column in (name, f"{name}{_SIGMA}")
        )
        final = name.startswith("final")
        at_rest = np.array([not final or row.get("settled") is not False for row in rows])
        for k, case in enumerate(of_case):
            colour = INK[k % len(INK) if case else final]
            for rests in (True, False):
                mine = (at_rest == rests) & np.array([row.get("case", "") == case for row in rows])
                look = {"color": colour, "markersize": 4, "capsize": 2, "linewidth": 1.0}
                axis.errorbar(
                    positions[mine], value[mine], np.nan_to_num(error)[mine], fmt="o",
                    markerfacecolor=colour if rests else "white",
                    label=case if rests and key != "case" else None, **look,
                )  # fmt: skip
        if name == "transient/diameter_apparent_m":
            for k, law in enumerate(sorted({column for row in rows for column in row if column.startswith(_LAW)})):
                sizes = np.array([factor * float(row.get(law, np.nan)) for row in rows])
                for case in of_case:
                    mine = [i for i in order if rows[i].get("case", "") == case]
                    axis.plot(
                        positions[mine], sizes[mine], "--", marker="_", color=INK[2 + k % 4], linewidth=1.0,
                        label=crater_size.NAMES.get(law.removeprefix(_LAW), law) if case == of_case[0] else None,
                    )  # fmt: skip
        axis.set(xlabel=f"{key}{f' [{unit}]' if unit else ''}", title=f"{_meaning(name)} [{symbol}]")
        axis.title.set_fontsize(8)
        if words:
            axis.set_xticks(range(len(words)), words, fontsize=6 if max(map(len, words)) > 8 else None)
        grid(axis)
    told = {label: handle for axis in fig.axes for handle, label in zip(*axis.get_legend_handles_labels())}
    if any(told):
        legend_outside(fig, list(told.values()), list(told), side="lower")
    save(fig, file)
    return True


def text(rows: Sequence[Row]) -> str:
    """The main measures of every member as a table for a terminal."""
    names = [f"{crater}/{name}" for crater in ("transient", "final") for name in ("diameter_apparent_m", "depth_m")]
    names = [
        name
        for name in (*names, "shock/beta_normal", "body/beta_normal")
        if any(row.get(name) is not None for row in rows)
    ]
    width = max(8, *(len(row["member"]) + 2 for row in rows))
    column = max((len(_meaning(name)) + 3 for name in names), default=0)
    lines = [f"{'member':<{width}}{'state':<10}" + "".join(f"{_meaning(name):>{column}}" for name in names)]
    for row in rows:
        cells = [readable.terminal(_measured(row, name)) or "--" for name in names]
        lines.append(f"{row['member']:<{width}}{row['state']:<10}" + "".join(f"{cell:>{column}}" for cell in cells))
    lines += ["", f"{_states(rows)}. {_fidelity(rows)}".strip()]
    lines += [f"  {row['member']} failed: {row['reason']}" for row in rows if row["state"] == "failed"]
    return "\n".join(lines)
