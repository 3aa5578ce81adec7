"""Frozen forecasts against what was observed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas


def score(forecast: str | Path, observed: Mapping[str, Any], column: str = "") -> pandas.DataFrame:
    """Scores of a frozen forecast (``forecasts/hera_v0.toml``), a row for each entry of ``observed``: a quantity's
    value or (value, sigma) in the unit of the file, ``class`` by its name, ``excited`` true or false.

    Columns: fair CRPS and score of the 95 % interval in the quantity's unit, PIT; of classes Brier and log score. Two
    quantities and more have a row ``jointly`` with the energy score (of lengths in standard deviations of the draws).
    Less is better but for the PIT, which is even over 0 to 1 where a forecast is honest. ``column``: the headline
    where left out. Raises ``InputError`` for a file that is not as it was frozen, and for what was a condition and no
    forecast.
    """
    import pandas

    from pipeline.uncertainty import frozen_forecast

    return pandas.DataFrame(frozen_forecast.score(forecast, observed, column)).set_index("quantity")
