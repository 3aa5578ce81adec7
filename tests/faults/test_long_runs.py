"""An hour of the shock stage and an hour of grains, each stopped ten times: memory stays, balances hold, and a resumed
run is as fast as before. By ``pytest -s -m campaign tests/faults/test_long_runs.py`` (``-k sph``, ``-k dem``).
"""

from __future__ import annotations

import csv
import os
from pathlib import Path
from statistics import median

import pytest

from tests.faults import long_runs

pytestmark = pytest.mark.campaign

SETTLE_S = 2400.0
"""The grains run so long before they are watched: while a bed comes to rest, the list of its pairs is made shorter on
purpose (its skin from 0.5 to 0.05 radii), and memory falls with it."""
SESSION_S = 350.0
WINDOW_S = 300.0
STOPS = 10
COMMON = ["--threads", "1"]
RUNS = {
    # 29,529 particles to 100 s after a small shot, long after the shock has gone
    "sph": [
        "cases/sci_ryugu", "--preset", "coarse29", "--until", "sph", "--set", "sph.end_time=100 s",
        "--set", "sph.snapshot_interval=2 s", "--set", "sph.history_interval=0.2 s",
    ],
    # 64,000 grains that slumped and ring on: more than a day
    "dem": [
        "cases/valhalla_980km", "--preset", "quick", "--until", "dem", "--set", "bed.count=100000",
        "--set", "dem.end_time=34 hours", "--set", "dem.latest_time=35 hours",
    ],
}  # fmt: skip
BEFORE = {"sph": "nbody", "dem": "handoff"}


def _rows(place: Path, stage: str) -> list[dict[str, float]]:
    file = next(place.glob(f".store/{stage}-*/history.csv"))
    return [
        {key: float(value) for key, value in row.items() if _is_number(value)} for row in csv.DictReader(file.open())
    ]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("stage", ["sph", "dem"])
def test_an_hour_stopped_ten_times(stage, tmp_path):
    tmp_path = Path(os.environ.get("BOLIDE_LONG_RUNS", tmp_path)) / stage  # where a run is to be kept
    tmp_path.mkdir(parents=True, exist_ok=True)
    words = [*RUNS[stage], *COMMON, "--out", str(tmp_path)]
    if stage == "dem":  # the stages before it are not what is watched
        earlier = [BEFORE[stage] if word == "dem" else word for word in words]
        before = long_runs.watched(earlier, tmp_path, ".nothing", 7200.0, 0, tmp_path / "before.log")
        assert before.codes[-1] in (0, 1), before.text[-500:]
        settled = long_runs.watched(words, tmp_path, ".nothing", SETTLE_S, 0, tmp_path / "settle.log")
        assert settled.codes == [75], settled.text[-500:]
    seen = long_runs.watched(words, tmp_path, f".store/{stage}-*/checkpoint_*.h5", SESSION_S, STOPS, tmp_path / "log")
    assert "Traceback" not in seen.text, seen.text[-2000:]
    assert seen.codes[:STOPS] == [75] * STOPS, (seen.codes, seen.text[-500:])
    pairs = seen.rates(WINDOW_S)
    ratio = median(after / before for before, after in pairs)
    memory = seen.memory_of(0.75, 1.0) / seen.memory_of(0.25, 0.5)
    last = _rows(tmp_path, stage)[-1]
    print(f"\n{stage}: {seen.memory[-1][0] / 60:.0f} min, {len(pairs)} pairs, after / before {ratio:.3f} "
          f"({', '.join(f'{after / before:.3f}' for before, after in pairs)}), memory {memory:.4f} "
          f"of {seen.memory_of(0.25, 0.5) / 2**20:.0f} MB")  # fmt: skip
    if stage == "dem":
        print({name: last[name] for name in ("momentum_error", "angular_momentum_error", "energy_error")})
        assert abs(last["energy_error"]) < 0.01 and abs(last["momentum_error"]) < 1e-10
    else:
        rows = _rows(tmp_path, stage)
        start = rows[0]["kinetic_J"]
        drift = (last["total_J"] - rows[0]["total_J"]) / start
        print(f"energy drift {drift:.2e} of the projectile's, {last['steps']:.0f} steps")
        assert abs(drift) < 0.02
    assert len(pairs) >= 8 and abs(ratio - 1.0) < 0.05
    assert abs(memory - 1.0) < 0.02
