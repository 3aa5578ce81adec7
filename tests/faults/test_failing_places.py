"""Every place of the code that touches the disk fails once, and once the process is killed there: no traceback,
nothing lost, and the same command ends in the same bits.

By ``pytest -m campaign tests/faults/test_failing_places.py`` (``-k nbody``: the places of one stage). What runs with
every change are the kills and full disks of ``tests/pipeline``.
"""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest

from pipeline.case import stages
from tests.faults import traps, whole_runs

HOW = ("kill", "full", "short", "input/output", "read-only")


def tried(whole: tuple[Path, dict[str, str]], folder: Path, place: str, how: str) -> str:
    """What is wrong after ``place`` failed; empty when nothing is."""
    source, places = whole
    stage = places[place] or stages.ORDER[-1]
    out = folder / "runs"
    whole_runs.begun_before(source, out, stage)
    kept = {path: path.stat().st_mtime_ns for path in out.glob(".store/*/done.json")}
    trap = traps.Trap(out, place, how)
    said = whole_runs.run(out, folder / "log", trap.set, ("--until", stage))
    faults = said.faults((0, 1, 2, 75, -9) if how == "kill" else (0, 1, 2, 75))
    if how == "kill" and said.code != -9:
        faults.append(f"was not killed (exit {said.code}: {said.text[-200:]})")
    again = whole_runs.run(out, folder / "log2", more=("--until", stage))
    faults += again.faults((0, 1))
    faults += whole_runs.differences(source, out, stage) if again.code in (0, 1) else []
    if changed := [path.parent.name for path, then in kept.items() if path.stat().st_mtime_ns != then]:
        faults.append(f"made anew: {', '.join(changed)}")
    if left := [path.name for path in out.rglob("*.part")]:
        faults.append(f"left behind: {', '.join(left[:3])}")
    shutil.rmtree(folder, ignore_errors=True)
    return "" if not faults else f"{how} at {place}: {'; '.join(faults)}\n{said.text[-400:]}\n{again.text[-400:]}"


def campaign(whole: tuple[Path, dict[str, str]], folder: Path, picked: list[tuple[str, str]]) -> None:
    wrong = [text for k, (place, how) in enumerate(picked) if (text := tried(whole, folder / str(k), place, how))]
    assert not wrong, f"{len(wrong)} of {len(picked)}:\n\n" + "\n\n".join(wrong[:20])


@pytest.mark.campaign
@pytest.mark.parametrize("stage", stages.ORDER)
def test_every_place_fails_once_and_kills_once(whole, tmp_path, stage):
    places = [place for place, made in whole[1].items() if (made or stages.ORDER[-1]) == stage]
    assert places
    draw = random.Random(stage)
    picked = [(place, "kill") for place in places]
    picked += [
        (place, draw.choice(HOW[1:] if place.startswith("write") else ("full", "input/output", "read-only")))
        for place in places
    ]
    campaign(whole, tmp_path, picked)
