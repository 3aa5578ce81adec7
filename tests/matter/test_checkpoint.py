"""Checkpoints: two kept, the newest readable one counts, floats survive to the bit."""

from __future__ import annotations

import numpy as np
import pytest

from matter import progress
from matter.errors import InputError
from matter.files import checkpoint


def test_the_newest_comes_back_to_the_bit(tmp_path):
    x = np.random.default_rng(1).normal(size=(7, 3))
    for step in (5, 10, 15):
        checkpoint.save(tmp_path, step, {"x": x * step}, {"dt": 0.1 + step, "phase": "impact"})
    arrays, scalars = checkpoint.newest(tmp_path)
    np.testing.assert_array_equal(arrays["x"], x * 15)
    assert scalars == {"step": 15, "dt": 15.1, "phase": "impact"}
    assert len(list(tmp_path.glob("checkpoint_*.h5"))) == 2


def test_one_cut_short_falls_back_to_the_one_before(tmp_path):
    for step in (5, 10):
        path = checkpoint.save(tmp_path, step, {"x": np.full(1000, step)}, {})
    path.write_bytes(path.read_bytes()[:700])
    arrays, scalars = checkpoint.newest(tmp_path)
    assert scalars["step"] == 5 and arrays["x"][0] == 5


def test_none_and_cleared(tmp_path):
    assert checkpoint.newest(tmp_path) is None
    checkpoint.save(tmp_path, 1, {"x": np.zeros(1)}, {})
    checkpoint.clear(tmp_path)
    assert checkpoint.newest(tmp_path) is None and not list(tmp_path.iterdir())


def test_a_checkpoint_of_another_version_is_named(tmp_path):
    checkpoint.save(tmp_path, 3, {"x": np.zeros(2)}, {"dt": 0.1})
    arrays, scalars = checkpoint.newest(tmp_path)
    with pytest.raises(
        InputError, match=r"checkpoint_0000000003\.h5 was written by another version of the program \(it has no 'wake'"
    ):
        scalars["wake"]
    with pytest.raises(InputError, match="has no 'hist'"):
        arrays["hist"]
    assert "wake" not in scalars and scalars.get("wake") is None


def state(step: int) -> tuple[dict, dict]:
    rng = np.random.default_rng(step)
    arrays = {
        "x": rng.normal(size=(40, 3)), "state": rng.integers(0, 2, 40).astype(np.int8), "none": np.zeros((0, 3)),
        "group/flag": np.array([True, False]),
        "single": np.array(2.5),
    }  # fmt: skip
    return arrays, {
        "dt": np.float64(0.1),
        "phase": "impact",
        "count": np.int64(3),
        "on": True,
        "empty": "",
        "list": [1.5, 2.5],
    }


def test_every_kind_of_value_comes_back_sound(tmp_path):
    told = []
    progress.hear(told.append)
    arrays, scalars = state(1)
    checkpoint.save(tmp_path, 1, arrays, scalars)
    found, numbers = checkpoint.newest(tmp_path)
    progress.silence()
    assert set(found) == set(arrays) and numbers["dt"] == 0.1 and numbers["list"].tolist() == [1.5, 2.5] and told == []


def test_no_flipped_bit_is_read_as_good(tmp_path):
    """One bit at 300 places all over the newest file: what is read is what was written, or the checkpoint before it,
    and then somebody is told."""
    for step in (5, 10):
        path = checkpoint.save(tmp_path, step, *state(step))
    whole, rng, told, fell_back = path.read_bytes(), np.random.default_rng(2), [], 0
    progress.hear(told.append)
    try:
        for place in rng.integers(0, len(whole), 300):
            bad = bytearray(whole)
            bad[place] ^= 1 << rng.integers(0, 8)
            path.write_bytes(bad)
            told.clear()
            arrays, scalars = checkpoint.newest(tmp_path)
            right, numbers = state(int(scalars["step"]))
            assert all(np.array_equal(arrays[name], right[name]) for name in right) and scalars["dt"] == numbers["dt"]
            assert ["is damaged" in text for text in told] == [True] * (scalars["step"] == 5)
            fell_back += scalars["step"] == 5
    finally:
        progress.silence()
    assert fell_back > 30
