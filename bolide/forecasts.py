"""Frozen forecasts against what was observed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas


def score(
    forecast: str | Path, observed: Mapping[str, Any], column: str = "", against: str | Path | None = None
) -> pandas.DataFrame:
    """Scores of a forecast (``forecasts/hera_v0.toml``, or ``forecast.toml`` of ``run_case CASE --forecast``), a row
    for each entry of ``observed``: a quantity's value or (value, sigma) in the unit of the file, ``class`` by name,
    ``excited`` true or false.

    Columns: fair CRPS and score of the 95 % interval in the quantity's unit, PIT; of classes Brier and log score. Two
    quantities and more have a row ``jointly`` with the energy score (of lengths in standard deviations of the draws).
    Less is better but for the PIT, which is even over 0 to 1 where a forecast is honest. ``column``: the headline
    where left out. ``against``: another forecast, each column of which is a reference: ``skill_<column>`` is 1 less
    the ratio of the scores (CRPS, Brier, energy), 1 where the forecast is perfect, 0 where it is as good as that.

    Raises ``InputError`` for a file that is not as it was frozen, and for what was a condition and no forecast.
    """
    import pandas

    from pipeline.uncertainty import frozen_forecast

    return pandas.DataFrame(frozen_forecast.score(forecast, observed, column, against)).set_index("quantity")
