"""Scaling laws in the place of runs: what each member of a sweep would come to by them."""

from __future__ import annotations

from pipeline.case import left_open
from pipeline.case.read import Case

MEASURE = "diameter_apparent_m"
"""What the laws give."""


def diameter(case: Case) -> float:
    """The apparent diameter [m] of a case's crater by the scaling laws for its ground, whatever it says itself of the
    diameter to expect (``pipeline.case.expected_crater``; density, strength, gravity and the impact count, friction
    does not). Raises ``ValueError`` where the case has mistakes, or nothing ends the crater's growth."""
    impact = {key: value for key, value in case.document["impact"].items() if key != left_open.DIAMETER[1]}
    return float(left_open.expected({**case.document, "impact": impact}).diameter)
