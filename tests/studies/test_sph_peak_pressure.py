"""The ice ball on ice: the study runs, and says which rows were asked for."""

import json

from sph.stepping.numerics import SETS
from studies import sph_peak_pressure


def test_one_row_of_the_study_is_made(capsys):
    sph_peak_pressure.main(["--size", "2", "--only", "reconstructed", "--json"])
    *words, numbers = capsys.readouterr().out.splitlines()
    found = json.loads(numbers)
    rows = [name for name in found if name in SETS]
    assert rows == ["reconstructed"] and len(words) == 1 + len(rows)
    assert 105e9 < found["planar_Pa"] < 116e9
    for name in rows:
        assert 0.1 < found[name]["ball_median_Pa"] / found["planar_Pa"] < 1.05
