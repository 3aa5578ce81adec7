"""A frozen forecast, ``forecasts/NAME.toml`` with ``NAME_draws.h5`` beside it, against what was observed."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from matter import scores
from matter.errors import InputError
from matter.files import archive
from pipeline.store import provenance

JOINT = "jointly"
"""The row of all observed quantities together: how they hang together is forecast as well."""


def score(forecast: str | Path, observed: Mapping[str, Any], column: str = "") -> list[dict[str, Any]]:
    """A row of scores (``matter.scores``) for each entry of ``observed``: a quantity's value, or (value, sigma), in
    the unit of the file; ``class`` by its name; ``excited`` true or false; of two quantities and more the row
    ``JOINT``. ``column``: the headline where left out.

    Raises ``InputError`` where a file is missing, damaged or not as it was frozen (``SHA256SUMS``), where a name is
    not in the forecast, or is no forecast in that column but a condition of it.
    """
    path = Path(forecast)
    draws = path.with_name(f"{path.stem}_draws.h5")
    checked(path)
    checked(draws)
    content = tomllib.loads(path.read_text())
    column = column or content["headline"]
    if column not in content["columns"]:
        raise InputError(f"{path} has no column {column!r} (it has {', '.join(content['columns'])})")
    quantities = {entry["name"]: entry for entry in content["quantity"]}
    arrays, _ = archive.read(draws)
    rows: list[dict[str, Any]] = []
    drawn, seen = [], []
    for name, given in observed.items():
        if name in ("class", "excited"):
            rows.append(of_kind(name, given, content, column))
            continue
        if name not in quantities:
            known = ", ".join([*quantities, "class", "excited"])
            raise InputError(f"{path} forecasts no {name!r} (it has {known})")
        if column in quantities[name]["condition_in"]:
            raise InputError(
                f"{name} is a condition of the column {column!r} of {path}: it was known, and not forecast"
            )
        value, sigma = given if isinstance(given, tuple | list) else (given, 0.0)
        if not (math.isfinite(value) and 0.0 <= sigma < math.inf):
            raise InputError(f"observed {name}: {value} +- {sigma} is no value with an error of 0 or more")
        x = scores.blurred(arrays[f"{column}/{name}"], sigma)
        drawn.append(x)
        seen.append(float(value))
        rows.append(
            {
                "quantity": name, "unit": quantities[name]["unit"], "observed": float(value),
                "median": quantities[name][column][2], "crps": scores.crps(x, value),
                "interval_95": scores.interval(x, value), "pit": scores.pit(x, value),
            }
        )  # fmt: skip
    if len(drawn) > 1:
        rows.append({"quantity": JOINT, "energy": scores.energy(np.column_stack(drawn), np.array(seen))})
    return rows


def of_kind(name: str, given: Any, content: Mapping[str, Any], column: str) -> dict[str, Any]:
    """The row of a class, or of the rotation."""
    if name == "class":
        chances, found = content["class"][f"p_{column}"], given
    else:
        chance = content["rotation"][f"p_{column}"]
        chances, found = {"True": chance, "False": 1.0 - chance}, str(given)
    if found not in chances:
        raise InputError(f"observed {name}: {given!r} is none of {', '.join(chances)}")
    return {
        "quantity": name, "observed": given, "chance": chances[found], "brier": scores.brier(chances, found),
        "log": scores.log_score(chances, found),
    }  # fmt: skip


def checked(path: Path) -> None:
    """Raises ``InputError`` where a file is missing, or differs from what ``SHA256SUMS`` beside it says."""
    if not path.is_file():
        raise InputError(f"{path} is missing: a forecast is NAME.toml with NAME_draws.h5 beside it")
    sums = path.with_name("SHA256SUMS")
    for line in sums.read_text().splitlines() if sums.is_file() else ():
        code, _, name = line.partition("  ")
        if name == path.name and code != provenance.file_sha256(path):
            raise InputError(f"{path} is not what was frozen: its SHA-256 differs from that in {sums}")
