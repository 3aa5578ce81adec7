"""A cohesion that counts for nothing is told; one that counts is not."""

from pathlib import Path

import pytest

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASE = Path(__file__).parents[2] / "cases" / "momentum_transfer"
COHESION = 'sph.materials.basalt.drucker_prager.cohesion="10 MPa"'


def warned(*sets: str) -> list[str]:
    chosen = read.read(CASE, None, sets)
    return [line for line in sense.judged(compose(chosen), {}, chosen.stages)[1] if "cohesion" in line]


def test_cohesion_of_what_is_broken_from_the_start_counts_for_nothing():
    (line,) = warned(COHESION)
    assert "[sph.materials.basalt] cohesion = 10 MPa counts for nothing" in line and "predamaged = false" in line


@pytest.mark.parametrize(
    "sets",
    [
        (),
        (COHESION, "sph.materials.basalt.predamaged=false", "sph.damage=false"),
        ('sph.materials.basalt.drucker_prager.cohesion="0 Pa"',),
    ],
)
def test_nothing_is_said_where_it_counts_or_there_is_none(sets):
    assert warned(*sets) == []
