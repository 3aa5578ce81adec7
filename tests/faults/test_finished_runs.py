"""A run that is killed at any instant, and the files of one that is there: bytes flipped, JSON spoiled.

By ``pytest -m campaign tests/faults/test_finished_runs.py``. What runs with every change: ``test_stop`` and
``test_damage`` of ``tests/pipeline``, and ``tests/matter/test_checkpoint``.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest

from matter.errors import InputError
from pipeline.case import stages
from pipeline.store import folder, intact
from tests.faults import mutations, whole_runs
from tests.faults.calls import call

pytestmark = pytest.mark.campaign


def _killed_after(seconds: float):
    """What a child does first: it will be gone after so many seconds, wherever it is then."""

    def set_up() -> None:
        def end() -> None:
            time.sleep(seconds)
            os.kill(os.getpid(), signal.SIGKILL)

        threading.Thread(target=end, daemon=True).start()

    return set_up


@pytest.mark.parametrize("stage", stages.ORDER)
def test_killed_at_ten_random_instants(whole, tmp_path, stage):
    """Each draw: the stage is killed at one to three instants, and every resume continues; the end has the bits of the
    uninterrupted run. The kill may come after the end."""
    source, wrong, kills, draw = whole[0], [], 0, random.Random(f"kills {stage}")
    before = tmp_path / "timed"
    whole_runs.begun_before(source, before, stage)
    began = time.monotonic()
    whole_runs.run(before, tmp_path / "log", more=("--until", stage))
    lasts = time.monotonic() - began
    for number in range(40):
        if kills >= 10:
            break
        out = tmp_path / str(number)
        whole_runs.begun_before(source, out, stage)
        instants = [draw.uniform(0.0, lasts) for _ in range(draw.randint(1, 3))]
        for instant in instants:
            said = whole_runs.run(out, tmp_path / "log", _killed_after(instant), ("--until", stage))
            kills += said.code == -signal.SIGKILL
            if faults := said.faults((0, 1, -signal.SIGKILL)):
                wrong.append(f"{number}: {faults}: {said.text[-300:]}")
        again = whole_runs.run(out, tmp_path / "log", more=("--until", stage))
        faults = again.faults((0, 1)) + whole_runs.differences(source, out, stage)
        faults += [f"left behind: {path.name}" for path in out.rglob("*.part")]
        if faults:
            wrong.append(f"{number}, killed after {instants} s: {faults}: {again.text[-300:]}")
        shutil.rmtree(out)
    print(f"{stage}: {kills} kills, {len(wrong)} wrong")
    assert kills >= 10 and not wrong, "\n\n".join(wrong)


def _files(run: Path) -> list[Path]:
    """The files of a run and of its stages in the store that anything reads again."""
    kinds = (".vtkhdf", ".h5", ".csv", ".json", ".toml", ".ply")
    return sorted(path for place in (run, run.parent / ".store") for path in place.rglob("*") if path.suffix in kinds)


def _refused(path: Path) -> bool:
    place = next(above for above in path.parents if (above / folder.DONE).is_file())
    try:
        intact.check(place, place.name.partition("-")[0], folder.mark(place / folder.DONE)["files"], content=True)
    except InputError as refusal:
        return path.name in str(refusal)
    return False


def test_a_flipped_byte_is_found_in_every_kind_of_file(whole, tmp_path):
    """By the stages that read it, and by ``run_case RUN`` where it belongs to the run. Marks and records that only
    tell of the run (status, provenance, the facts in done.json) may be read as they stand, but never with a traceback,
    and never so that a result changes."""
    source, wrong, found = whole[0], [], 0
    out = tmp_path / "runs"
    shutil.copytree(source, out, symlinks=True)
    run, draw = whole_runs.folder_of(out), random.Random(5)
    before = whole_runs.contents(run)
    for path in _files(run):
        if path.is_symlink() or not path.stat().st_size:
            continue
        content, place = path.read_bytes(), draw.randrange(path.stat().st_size)
        path.chmod(0o644)
        path.write_bytes(content[:place] + bytes([content[place] ^ (1 << draw.randrange(8))]) + content[place + 1 :])
        told = path.name in ("status.json", "provenance.json", "done.json")
        if path.parent == run or told:
            said = call("run_case", [str(run)], tmp_path / "said", tmp_path)
            faults = said.faults((0, 1, 2) if told else (2,))
            found += said.code == 2
        else:  # what every stage asks of those that it reads
            faults = [] if _refused(path) else ["taken as it is"]
            found += not faults
        path.write_bytes(content)
        if told and whole_runs.contents(run) != before:
            faults.append("a result changed")
        if faults:
            wrong.append(f"{path.relative_to(out)}, byte {place}: {faults}")
    print(f"{found} refused, {len(wrong)} wrong")
    assert found > 15 and not wrong, "\n\n".join(wrong)


@pytest.mark.parametrize("number", range(5))
def test_spoiled_json_of_every_kind(whole, tmp_path, number):
    """100 mutations in each of five parts, spread over all JSON and TOML files of a run and its store."""
    out = tmp_path / "runs"
    shutil.copytree(whole[0], out, symlinks=True)
    run, wrong = whole_runs.folder_of(out), []
    files = [path for path in _files(run) if path.suffix in (".json", ".toml") and not path.is_symlink()]
    for k in range(100):
        rng = random.Random(1000 * number + k)
        path = files[k % len(files)]
        text = path.read_text()
        path.chmod(0o644)
        path.write_text(mutations.json_text(text, rng), errors="surrogateescape")
        name, words = rng.choice(
            [
                ("run_case", [str(run), "--check"]),
                ("run_case", [str(run), "--until", "nbody"]),
                ("inspect_handoff", [str(run)]),
                ("compare_profiles", [str(run), "thesis_980km", "--out", str(tmp_path / "compared")]),
            ]
        )
        said = call(name, words, tmp_path / "said", tmp_path)
        if faults := said.faults((0, 1, 2)):
            wrong.append(f"{k}: {name} with {path.relative_to(out)}: {faults}: {said.text[-400:]}")
        shutil.rmtree(out)
        shutil.copytree(whole[0], out, symlinks=True)
    assert not wrong, f"{len(wrong)}:\n\n" + "\n\n".join(wrong[:10])
