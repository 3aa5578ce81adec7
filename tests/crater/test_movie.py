"""A movie is as many frames as there are snapshots, the grains after the shock stage."""

from __future__ import annotations

import numpy as np
import pytest

from crater.drawing import movie, sections
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles


def write(folder, times, grains=False):
    folder.mkdir(parents=True)
    p = synthetic.fill(np.random.default_rng(1), 0.3, (-3, -3, -1), (3, 3, 0), "jitter")
    for number, time in enumerate(times):
        fields = synthetic.as_fields(p, 0.3) | {
            "damage": np.linspace(0, 1, len(p)),
            "velocity": p,
            "initial_position": p,
            "pressure": np.full(len(p), 1e9),
        }
        if grains:
            fields = {"position": p, "radius": np.full(len(p), 0.15)}
        snapshot.write(Particles(fields, {"time": time}), folder / f"snap_{number:04d}.vtkhdf")
    snapshot.write_series(folder, {f"snap_{k:04d}.vtkhdf": t for k, t in enumerate(times)})


def test_frames_of_both_stages_in_order(tmp_path):
    from PIL import Image

    write(tmp_path / "2_sph", (0.0, 1.0, 2.0, 3.0))
    write(tmp_path / "5_dem", (1.5, 4.0), grains=True)
    assert [path.parent.name for path in movie.shots(tmp_path)] == ["2_sph", "2_sph", "5_dem", "5_dem"]
    assert movie.write(tmp_path, tmp_path / "movie.gif", 2.0, "damage") == 4
    with Image.open(tmp_path / "movie.gif") as film:
        assert film.n_frames == 4 and film.size == (960, 540)


def test_the_last_state_is_the_last_frame_however_many_there_are(tmp_path, monkeypatch):
    write(tmp_path / "2_sph", (0.0, 1.0, 2.0, 3.0))
    write(tmp_path / "5_dem", (2.0, 4.0, 5.0), grains=True)
    snapshot.write(
        Particles({"position": np.zeros((3, 3)), "radius": np.ones(3)}, {"time": 5.5}),
        tmp_path / "5_dem" / "last.vtkhdf",
    )
    assert [path.name for path in movie.shots(tmp_path)][-2:] == ["snap_0002.vtkhdf", "last.vtkhdf"]
    monkeypatch.setattr(movie, "MOST_FRAMES", 3)
    chosen = movie.shots(tmp_path)
    assert len(chosen) == 3 and chosen[0].name == "snap_0000.vtkhdf" and chosen[-1].name == "last.vtkhdf"


def test_one_drawing_goes_to_both_files(tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    write(tmp_path / "2_sph", (0.0, 1.0, 2.0))
    assert movie.movie_formats() == (".gif", ".mp4")
    assert movie.write(tmp_path, [tmp_path / "m.gif", tmp_path / "m.mp4"], 2.0) == 3
    count, _ = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "m.mp4"))
    assert count == 3 and (tmp_path / "m.gif").stat().st_size > 0
    with pytest.raises(InputError, match="taste"):
        movie.write(tmp_path, [tmp_path / "n.gif", tmp_path / "n.mp4"], 2.0, "taste")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["2_sph", "m.gif", "m.mp4"]  # nothing half written


def test_what_lies_outside_the_grains_stays_in_sight(tmp_path):
    """Matter of the shock stage below the floor and beside the side of the grains, at the time when they began."""
    write(tmp_path / "2_sph", (0.0, 1.0, 2.0))
    write(tmp_path / "5_dem", (1.1,), grains=True)
    shock, grains = snapshot.series(tmp_path / "2_sph"), snapshot.series(tmp_path / "5_dem")
    assert movie._surroundings(shock, grains[0]) is None  # no domain is known
    first = snapshot.read(grains[0])
    first.attributes["domain"] = {"shape": "cylinder", "radius_m": 2.0, "floor_m": -0.6, "datum_m": 0.0, "top_m": 1.0}
    snapshot.write(first, grains[0])
    around = movie._surroundings(shock, grains[0])
    x = snapshot.read(shock[1]).position
    outside = (x[:, 2] < -0.6) | ((np.hypot(x[:, 0], x[:, 1]) > 2.0) & (x[:, 2] < 0.0))
    assert around.attributes["time"] == 1.0 and 0 < len(around) < len(x)
    np.testing.assert_array_equal(around.position, x[outside])


def test_colours_of_the_legend_survive_in_the_gif(tmp_path):
    """The projectile may be a dot in the legend alone: its red is still red."""
    from PIL import Image

    write(tmp_path / "2_sph", (0.0,))
    path = tmp_path / "2_sph" / "snap_0000.vtkhdf"
    some = snapshot.read(path)
    some["layer"] = np.where(
        np.arange(len(some)) == np.argmax(some.position[:, 1]), -1, 0
    )  # far off the plane of the picture
    some.attributes["materials"] = ["basalt", "water"]
    some["material"] = np.ones(len(some))
    snapshot.write(some, path)
    movie.write(tmp_path, tmp_path / "m.gif", 2.0)
    with Image.open(tmp_path / "m.gif") as film:
        seen = np.asarray(film.convert("RGB")).reshape(-1, 3).astype(int)
    for colour in (sections.PROJECTILE_COLOUR, sections.MATERIAL_COLOURS["basalt"]):
        wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        assert np.abs(seen - wanted).max(axis=1).min() < 12, colour


@pytest.mark.parametrize("field", movie.FIELDS)
def test_frames_of_every_field_differ_from_blank_and_name_their_colours(tmp_path, field):
    write(tmp_path / "2_sph", (0.0, 1.0))
    first, _ = movie.frames(tmp_path, 2.0, field)
    plot = first[80:460, 90:830]
    assert (plot < 250).any(axis=2).mean() > 0.2  # particles
    words = first[:60, 400:]
    assert (words < 128).any(axis=2).sum() > 200  # a legend


def test_what_cannot_be_filmed_says_why(tmp_path):
    with pytest.raises(InputError, match="no snapshots"):
        movie.write(tmp_path, tmp_path / "movie.gif")
    write(tmp_path / "2_sph", (0.0,))
    with pytest.raises(InputError, match="taste"):
        movie.write(tmp_path, tmp_path / "movie.gif", 2.0, "taste")
    with pytest.raises(InputError, match=r"movie\.avi"):
        movie.write(tmp_path, tmp_path / "movie.avi", 2.0)
