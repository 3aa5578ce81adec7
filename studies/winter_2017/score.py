"""The form in which one published claim is scored."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nbody.population.rules import Statistic
from nbody.results import census_tables

MOONS = {"ganymede": 0, "callisto": 1}


@dataclass(frozen=True)
class Score:
    """One claim: what was published, what is found, what counts as reproduced, verdict (met, not met, input,
    arithmetic) and the reason."""

    id: str
    claim: str
    published: str
    found: str
    tolerance: str
    verdict: str
    note: str = ""


@dataclass(frozen=True)
class Evidence:
    """A census and what is drawn from it once; ``literal`` the one with the published integrator, or None."""

    table: dict[str, np.ndarray]
    attributes: dict
    literal: tuple[dict[str, np.ndarray], dict] | None

    def hits(self, moon: str) -> dict[str, np.ndarray]:
        """The impacts on one moon."""
        return census_tables.hits(self.table, MOONS[moon])


def close(found: float, published: float, relative: float = 0.0, absolute: float = 0.0) -> str:
    """``met`` or ``not met``."""
    return "met" if abs(found - published) <= absolute + relative * abs(published) else "not met"


def all_met(*verdicts: str) -> str:
    """``met`` if all are."""
    return "met" if all(verdict == "met" for verdict in verdicts) else "not met"


def plain(statistic: Statistic, digits: int = 2) -> str:
    """Value and standard error as text."""
    return f"{statistic.value:.{digits}f} +- {statistic.standard_error:.{digits}f}"
