"""A movie is as many frames as there are snapshots, the grains after the shock stage."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from crater import movie
from matter import snapshot
from matter.errors import InputError
from matter.particles import Particles


def write(folder, times, grains=False):
    folder.mkdir(parents=True)
    p = synthetic.fill(np.random.default_rng(1), 0.3, (-3, -3, -1), (3, 3, 0), "jitter")
    for number, time in enumerate(times):
        fields = synthetic.as_fields(p, 0.3) | {"damage": np.linspace(0, 1, len(p))}
        if grains:
            fields = {"position": p, "radius": np.full(len(p), 0.15)}
        snapshot.write(Particles(fields, {"time": time}), folder / f"snap_{number:04d}.vtkhdf")
    snapshot.write_series(folder, {f"snap_{k:04d}.vtkhdf": t for k, t in enumerate(times)}, "snap")


def test_frames_of_both_stages_in_order(tmp_path):
    from PIL import Image

    write(tmp_path / "2_sph", (0.0, 1.0, 2.0, 3.0))
    write(tmp_path / "5_dem", (1.5, 4.0), grains=True)
    assert [path.parent.name for path in movie.shots(tmp_path)] == ["2_sph", "2_sph", "5_dem", "5_dem"]
    assert movie.write(tmp_path, tmp_path / "movie.gif", 2.0, "damage") == 4
    with Image.open(tmp_path / "movie.gif") as film:
        assert film.n_frames == 4 and film.size == (960, 540)


def test_what_cannot_be_filmed_says_why(tmp_path):
    with pytest.raises(InputError, match="no snapshots"):
        movie.write(tmp_path, tmp_path / "movie.gif")
    write(tmp_path / "2_sph", (0.0,))
    with pytest.raises(InputError, match="taste"):
        movie.write(tmp_path, tmp_path / "movie.gif", 2.0, "taste")
    with pytest.raises(InputError, match=r"movie\.avi"):
        movie.write(tmp_path, tmp_path / "movie.avi", 2.0)
