"""One and two threads, a first run and later ones: the same bits in every stage below 10,000 grains. From there on bed
and collapse depend on the number of threads (each has sums of its own), and on nothing else.

By ``pytest -m campaign tests/faults/test_threads.py``.
"""

from __future__ import annotations

import pytest

from tests.faults import whole_runs

pytestmark = pytest.mark.campaign


def contents(folder, threads: int, monkeypatch, more: str = "") -> dict[str, object]:
    folder.mkdir()
    few = whole_runs.SMALLEST.replace("--threads 1", f"--threads {threads}") + more
    monkeypatch.setattr(whole_runs, "SMALLEST", few)
    said = whole_runs.run(folder, folder.parent / f"{folder.name}.log")
    monkeypatch.undo()
    assert said.code in (0, 1), said.text[-500:]
    return whole_runs.contents(whole_runs.folder_of(folder))


def test_one_and_two_threads_and_again(tmp_path, monkeypatch):
    one = contents(tmp_path / "one", 1, monkeypatch)
    assert len(one) > 20
    for name, threads in (("two", 2), ("again", 2), ("once more", 1)):
        other = contents(tmp_path / name, threads, monkeypatch)
        assert [key for key in one if one[key] != other.get(key)] == [] and one.keys() == other.keys()
    changed = contents(tmp_path / "changed", 1, monkeypatch, " --set bed.seed=2")
    assert any(one[key] != changed.get(key) for key in one)  # what is compared can differ
