"""Rock that shakes is handed over to grains of our own engine alone."""

from pathlib import Path

import pytest

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASES = Path(__file__).parents[2] / "cases"
SHAKEN = "sph.materials.granite.block_model={gamma_eta=1e-3, gamma_beta=200.0}"


def judged(*sets: str) -> tuple[list[str], list[str]]:
    chosen = read.read(CASES / "first_crater", "tiny", sets)
    errors, warnings = sense.judged(compose(chosen), {}, chosen.stages)
    return [one.message for one in errors], [line for line in warnings if "vibration" in line]


@pytest.mark.parametrize("engine", ["lammps", "liggghts"])
def test_engines_that_know_no_vibration_are_refused_before_a_run(engine):
    (said,) = judged(SHAKEN, f"dem.engine='{engine}'")[0]
    assert said.startswith(engine) and 'engine = "native"' in said
    assert judged(f"dem.engine='{engine}'") == ([], [])


def test_our_own_grains_take_it_without_a_word():
    assert judged(SHAKEN) == ([], [])
