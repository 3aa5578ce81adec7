"""A case that hands shaking rock over to grains is told that they do not shake."""

from pathlib import Path

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASES = Path(__file__).parents[2] / "cases"
SHAKEN = "sph.materials.granite.block_model={gamma_eta=1e-3, gamma_beta=200.0}"


def warned(case: str, preset: str | None, *sets: str) -> list[str]:
    chosen = read.read(CASES / case, preset, sets)
    return [line for line in sense.judged(compose(chosen), {}, chosen.stages)[1] if "vibration" in line]


def test_vibration_that_is_lost_at_the_handoff_is_told():
    (line,) = warned("first_crater", "tiny", SHAKEN)
    assert "grains know no vibration" in line
    assert warned("first_crater", "tiny") == []


def test_nothing_is_said_where_there_are_no_grains():
    assert warned("complex_crater", "fluidised") == []
