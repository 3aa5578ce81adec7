"""Ground without pressure at the start sinks into a quiet layer, faster the lower the late sound speed: said first."""

from pathlib import Path

import pytest

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASES = Path(__file__).parents[2] / "cases"
SLOWER = 'sph.late.slower=[{at="4 s",sound_speed="5 m/s"},{at="30 s",sound_speed="1 m/s"}]'


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ((), False),  # 0.8 mm in 8 s at 20 m/s
        (("sph.end_time=500 s",), False),  # 6.6 cm: below a hundredth of the crater
        ((SLOWER, "sph.end_time=500 s"), True),
        ((SLOWER, "sph.end_time=500 s", "target.start=relaxed"), False),
        ((SLOWER, "sph.end_time=500 s", "sph.sides=fixed"), False),
    ],
)
def test_what_sinks_in_a_quiet_layer_is_said(changes, said):
    chosen = read.read(CASES / "sci_ryugu", "quick", [*changes, "handoff.time=8 s"])
    lines = [line for line in sense.judged(compose(chosen), {}, chosen.stages)[1] if "sinks into" in line]
    assert len(lines) == said
    if said:
        assert "by up to 1.48 m" in lines[0]
