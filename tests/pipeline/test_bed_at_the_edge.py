"""A bed that reaches the edge of flat ground is said before the run: the surface to carve is rounded off there."""

from pathlib import Path

import pytest

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASES = Path(__file__).parents[2] / "cases"


@pytest.mark.parametrize(
    ("case", "preset", "changes", "said"),
    [
        ("sci_ryugu", "quick", (), None),
        ("sci_ryugu", "quick", ("bed.arc_radius=22 m",), None),  # its rows on the cavity are met
        ("sci_ryugu", "quick", ("bed.arc_radius=26 m",), "26 m"),  # three of them are not
        ("sci_ryugu", "quick", ("bed.arc_radius=25 m",), "25 m"),
        ("first_crater", None, (), None),
        ("first_crater", None, ("bed.arc_radius=178 m",), "178 m"),
        ("valhalla_980km", "quick", ("bed.arc_radius=2700 km",), None),  # a body has no such edge
    ],
)
def test_a_bed_at_the_edge_of_the_ground_is_said(case, preset, changes, said):
    chosen = read.read(CASES / case, preset, changes)
    lines = [line for line in sense.judged(compose(chosen), {}, chosen.stages)[1] if "the edge of the ground" in line]
    assert len(lines) == (said is not None)
    assert said is None or lines[0].startswith(f"[bed] arc_radius = {said} reaches")
