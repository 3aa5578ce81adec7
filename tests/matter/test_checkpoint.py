"""Checkpoints: two kept, the newest readable one counts, floats survive to the bit."""

from __future__ import annotations

import numpy as np
import pytest

from matter import checkpoint
from matter.errors import InputError


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
    with pytest.raises(InputError, match=r"checkpoint_0000000003\.h5 was written by another version of the program \(it has no 'wake'"):
        scalars["wake"]
    with pytest.raises(InputError, match="has no 'hist'"):
        arrays["hist"]
    assert "wake" not in scalars and scalars.get("wake") is None
