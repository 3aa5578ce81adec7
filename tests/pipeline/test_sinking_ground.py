"""Ground without pressure at the start sinks into a quiet layer, faster the lower the late sound speed: said first."""

from pathlib import Path

import pytest

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose

CASES = Path(__file__).parents[2] / "cases"
ONCE = 'sph.late={at="15 ms",sound_speed="20 m/s"}'
SLOWER = (ONCE, 'sph.late.slower=[{at="4 s",sound_speed="5 m/s"},{at="30 s",sound_speed="1 m/s"}]')


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ((), None),
        ((ONCE,), None),  # 0.8 mm in 8 s at 20 m/s
        ((ONCE, "sph.end_time=500 s"), None),  # 6.6 cm: below a hundredth of the crater
        ((*SLOWER, "sph.end_time=500 s"), "1.48 m"),
        (("sph.end_time=500 s",), "5.03 m"),  # the late stage that follows from the crater
        ((*SLOWER, "sph.end_time=500 s", "target.start=relaxed"), None),
        ((*SLOWER, "sph.end_time=500 s", "sph.sides=fixed"), None),
    ],
)
def test_what_sinks_in_a_quiet_layer_is_said(changes, said):
    chosen = read.read(CASES / "sci_ryugu", "quick", [*changes, "handoff.time=8 s"])
    lines = [line for line in sense.judged(compose(chosen), {}, chosen.stages)[1] if "sinks into" in line]
    assert len(lines) == (said is not None)
    assert said is None or f"by up to {said}" in lines[0]
