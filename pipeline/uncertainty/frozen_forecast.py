"""A forecast, ``NAME.toml`` with ``NAME_draws.h5`` beside it (``pipeline.uncertainty.forecast_files``), against what
was observed, and against other forecasts of the same: references."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from matter import scores
from matter.errors import InputError
from matter.files import archive, toml_input
from pipeline.store import provenance
from pipeline.uncertainty import forecast_files

JOINT = "jointly"
"""The row of all observed quantities together: how they hang together is forecast as well."""
KINDS = {"class": "class", "excited": "rotation"}
"""What has chances and no draws, and its table."""


class Seen(NamedTuple):
    """An observed quantity with its standard error."""

    value: float
    sigma: float

    @classmethod
    def parsed(cls, name: str, given: Any) -> Seen:
        """A value or (value, sigma). Raises ``InputError`` where it is neither."""
        value, sigma = given if isinstance(given, tuple | list) else (given, 0.0)
        if not (math.isfinite(value) and 0.0 <= sigma < math.inf):
            raise InputError(f"observed {name}: {value} +- {sigma} is no value with an error of 0 or more")
        return cls(float(value), float(sigma))


class Column(NamedTuple):
    """One column of a forecast: where that lies, its table, its draws by their paths, the column's name."""

    path: Path
    content: Mapping[str, Any]
    arrays: Mapping[str, np.ndarray]
    name: str

    def entry(self, quantity: str) -> Mapping[str, Any]:
        """What the table says of a quantity. Raises ``InputError`` where the column does not forecast it."""
        of_name = {entry["name"]: entry for entry in self.content["quantity"]}
        if quantity not in of_name:
            known = ", ".join([*of_name, *(name for name, table in KINDS.items() if table in self.content)])
            raise InputError(f"{self.path} forecasts no {quantity!r} (it has {known})")
        entry = of_name[quantity]
        if self.name in entry["condition_in"]:
            raise InputError(
                f"{quantity} is a condition of the column {self.name!r} of {self.path}: it was known, and not forecast"
            )
        if self.name not in entry:
            having = ", ".join(name for name in self.content["columns"] if name in entry)
            raise InputError(f"the column {self.name!r} of {self.path} does not forecast {quantity} (but {having})")
        return entry

    def draws(self, quantity: str, sigma: float) -> np.ndarray:
        """The draws (n,) of a quantity, NaN where one has none, with the error ``sigma`` of what is observed and the
        draws' own, which the table may give."""
        own = float(self.entry(quantity).get(f"error_{self.name}", 0.0))
        return scores.blurred(self.arrays[f"{self.name}/{quantity}"], math.hypot(sigma, own))

    def chances(self, kind: str) -> Mapping[str, float]:
        """The chances of the classes, or of the rotation. Raises ``InputError`` where the column gives none."""
        found = self.content.get(KINDS[kind], {}).get(f"p_{self.name}")
        if found is None:
            raise InputError(f"the column {self.name!r} of {self.path} gives no chances of {kind!r}")
        return found if isinstance(found, Mapping) else {"True": found, "False": 1.0 - found}

    def has(self, observed: str) -> bool:
        """Whether the column forecasts this."""
        try:
            self.chances(observed) if observed in KINDS else self.entry(observed)
        except InputError:
            return False
        return True


def score(
    forecast: str | Path, observed: Mapping[str, Any], column: str = "", against: str | Path | None = None
) -> list[dict[str, Any]]:
    """A row of scores (``matter.scores``) for each entry of ``observed``: a quantity's value, or (value, sigma), in
    the unit of the file; ``class`` by its name; ``excited`` true or false; of two quantities and more the row
    ``JOINT``. ``column``: the headline where left out.

    ``against``: another forecast, each column of which is a reference. ``skill_<column>`` is 1 - S / S_ref, S the CRPS
    or the Brier score, of ``JOINT`` the energy score with lengths in the standard deviations of the forecast that is
    scored: 1 is perfect, 0 as good as the reference, NaN where that does not forecast it.

    Raises ``InputError`` where a file is missing, damaged or not as it was frozen (``SHA256SUMS``), where a name is
    not in the forecast, or is no forecast in that column but a condition of it.
    """
    content, arrays = read(forecast)
    column = column or str(content["headline"])
    if column not in content["columns"]:
        raise InputError(f"{forecast} has no column {column!r} (it has {', '.join(content['columns'])})")
    ours = Column(Path(forecast), content, arrays, column)
    rows = rows_of(ours, observed)
    if against is None:
        return rows
    content, arrays = read(against)
    size = spread(ours, observed)
    for name in content["columns"]:
        reference = Column(Path(against), content, arrays, name)
        known = {key: value for key, value in observed.items() if reference.has(key)}
        theirs = {row["quantity"]: row for row in rows_of(reference, known, size)}
        if set(size) - set(known):
            theirs.pop(JOINT, None)  # of other quantities than ours
        for row in rows:
            row[f"skill_{name}"] = skill(row, theirs.get(row["quantity"]))
    return rows


def rows_of(
    column: Column, observed: Mapping[str, Any], size: Mapping[str, float] | None = None
) -> list[dict[str, Any]]:
    """The rows of scores of one column; ``size``: the lengths of the energy score, its own spread where left out."""
    seen = seen_of(observed)
    rows = [
        of_kind(column, name, given) if name in KINDS else of_quantity(column, name, seen[name])
        for name, given in observed.items()
    ]
    if len(seen) > 1:
        x, y = together(column, seen), np.array([one.value for one in seen.values()])
        lengths = x.std(axis=0) if size is None else np.array([size[name] for name in seen])
        rows.append({"quantity": JOINT, "energy": scores.energy(x, y, lengths)})
    return rows


def seen_of(observed: Mapping[str, Any]) -> dict[str, Seen]:
    """The quantities among what was observed."""
    return {name: Seen.parsed(name, given) for name, given in observed.items() if name not in KINDS}


def together(column: Column, seen: Mapping[str, Seen]) -> np.ndarray:
    """The joint draws (n, d) that have all quantities."""
    x = np.column_stack([column.draws(name, one.sigma) for name, one in seen.items()])
    return x[np.isfinite(x).all(axis=1)]


def spread(column: Column, observed: Mapping[str, Any]) -> dict[str, float]:
    """The standard deviation of the joint draws of each observed quantity; empty where there is none."""
    seen = seen_of(observed)
    return dict(zip(seen, together(column, seen).std(axis=0))) if seen else {}


def skill(row: Mapping[str, Any], reference: Mapping[str, Any] | None) -> float:
    """1 - S / S_ref; NaN where there is no reference, or it is perfect."""
    key = next(key for key in ("crps", "brier", "energy") if key in row)
    worth = (reference or {}).get(key, 0.0)
    return 1.0 - row[key] / worth if worth > 0.0 else math.nan


def of_quantity(column: Column, name: str, seen: Seen) -> dict[str, Any]:
    """The row of a quantity."""
    entry, x = column.entry(name), column.draws(name, seen.sigma)
    x = x[np.isfinite(x)]
    return {
        "quantity": name, "unit": entry["unit"], "observed": seen.value, "median": entry[column.name][2],
        "crps": scores.crps(x, seen.value), "interval_95": scores.interval(x, seen.value),
        "pit": scores.pit(x, seen.value),
    }  # fmt: skip


def of_kind(column: Column, name: str, given: Any) -> dict[str, Any]:
    """The row of a class, or of the rotation."""
    chances, found = column.chances(name), str(given)
    if found not in chances:
        raise InputError(f"observed {name}: {given!r} is none of {', '.join(chances)}")
    return {
        "quantity": name, "observed": given, "chance": chances[found], "brier": scores.brier(chances, found),
        "log": scores.log_score(chances, found),
    }  # fmt: skip


def read(path: str | Path) -> tuple[Mapping[str, Any], Mapping[str, np.ndarray]]:
    """Table and draws of a forecast. Raises ``InputError`` where a file is missing, damaged, not as it was frozen, or
    no forecast."""
    path = Path(path)
    draws = path.with_name(forecast_files.names(path.stem)[1])
    checked(path)
    checked(draws)
    try:
        content = toml_input.loads(path.read_text())
    except ValueError as reason:
        raise InputError(f"{path} cannot be read: {reason}") from None
    if lacking := [name for name in ("headline", "columns", "quantity") if name not in content]:
        raise InputError(f"{path} is no forecast: it lacks {', '.join(lacking)}")
    return content, archive.read(draws)[0]


def checked(path: Path) -> None:
    """Raises ``InputError`` where a file is missing, or differs from what ``SHA256SUMS`` beside it says."""
    if not path.is_file():
        raise InputError(f"{path} is missing: a forecast is NAME.toml with NAME_draws.h5 beside it")
    sums = path.with_name(forecast_files.SUMS)
    for line in sums.read_text().splitlines() if sums.is_file() else ():
        code, _, name = line.partition("  ")
        if name == path.name and code != provenance.file_sha256(path):
            raise InputError(f"{path} is not what was frozen: its SHA-256 differs from that in {sums}")
