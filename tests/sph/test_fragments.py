"""Fragments of a broken body."""

import json

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from matter.files import snapshot
from matter.geometry.connected import LINK, NONE, groups
from matter.particles import Particles
from matter.points import packing
from pipeline.running import result
from sph.outcome import fragments


def broken_ball():
    """A ball cut by a broken layer into a third and two thirds, and one lone whole particle far off."""
    x = np.concatenate([packing.hexagonal(0.1, 1.0), [[5.0, 0.0, 0.0]]])
    n = len(x)
    damage = ((x[:, 2] > 0.2) & (x[:, 2] < 0.5)).astype(float)
    velocity = np.where(x[:, 2:] > 0.5, [[0.0, 0.0, 3.0]], [[0.0, 0.0, -1.0]])
    fields = {
        "position": x,
        "velocity": velocity,
        "mass": np.full(n, 2.0),
        "damage": damage,
        "smoothing_length": np.full(n, 0.2),
    }
    return Particles(fields, {"time": 1.0, "materials": ["basalt"]})


def test_a_cut_ball_falls_into_its_pieces():
    ball = broken_ball()
    found = fragments.find(ball)
    below, above = (ball.position[:, 2] <= 0.2) & (ball.position[:, 0] < 2), ball.position[:, 2] >= 0.5
    assert [piece.particles for piece in found] == [below.sum(), above.sum(), 1]
    assert found[1].velocity == pytest.approx((0.0, 0.0, 3.0)) and found[0].mass == 2.0 * below.sum()
    assert fragments.largest_fraction(ball) == pytest.approx(below.mean())


def test_the_projectile_is_no_fragment_and_dust_is_none():
    ball = broken_ball()
    layer = np.where(ball.position[:, 2] <= 0.2, -1, 0)
    with_projectile = Particles({**ball, "layer": layer}, ball.attributes)
    assert fragments.find(with_projectile)[0].particles == (ball.position[:, 2] >= 0.5).sum()
    assert fragments.largest_fraction(Particles({**ball, "damage": np.ones(len(ball))}, ball.attributes)) == 0.0


def test_the_command(tmp_path, capsys):
    snapshot.write(broken_ball(), tmp_path / "last.vtkhdf")
    assert fragments.main([str(tmp_path / "last.vtkhdf")]) == 0
    assert "3 fragments" in capsys.readouterr().out
    assert fragments.main([str(tmp_path / "none.vtkhdf")]) == 2


def test_a_chain_that_ends_with_the_shock_stage_says_what_is_left_of_the_body(tmp_path):
    """The last word of the run: a ball whose lower part is whole, with a fifth of its mass on its way; flat ground."""
    ball = broken_ball()
    layer, folder = np.where(ball.position[:, 0] > 2.0, -1, 0), tmp_path / "2_sph"
    body = float(ball.mass[layer >= 0].sum())
    folder.mkdir()
    (folder / "stage_report.json").write_text(json.dumps({"escaping": {"mass_kg": 0.2 * body}}))
    for frame in ("sphere", "plane"):
        snapshot.write(
            Particles({**ball, "layer": layer}, {**ball.attributes, "frame": frame}), folder / "last.vtkhdf"
        )
        text = result.table(tmp_path)
        largest = (ball.position[:, 2] <= 0.2)[layer >= 0].mean()
        assert (text == "") if frame == "plane" else ("80.0% of the body's mass stay bound" in text), text
        assert frame == "plane" or f"2 pieces hang together, the largest with {largest:.1%} of it" in text


def test_supports_that_differ_link_what_half_their_sum_reaches():
    # fine and coarse matter and debris whose support has grown tenfold: the same groups as from all pairs
    random = np.random.default_rng(4)
    x = random.uniform(-1.0, 1.0, (400, 3)) * [3.0, 1.0, 1.0]
    support = np.where(x[:, 0] < 0.0, 0.12, 0.3)
    support[:4] = 1.5
    damage = (random.uniform(size=400) < 0.3).astype(float)
    cloud = Particles({"position": x, "damage": damage, "support_radius": support}, {})
    among = np.arange(400) != 7
    number = groups(cloud, among)
    whole = np.flatnonzero(among & (damage < 0.5))
    assert (np.delete(number, whole) == NONE).all()
    separation = np.linalg.norm(x[whole, None] - x[whole], axis=2)
    linked = separation < 0.5 * LINK * (support[whole, None] + support[whole])
    count, expected = connected_components(linked)
    assert 20 < count < 250 and (number[whole] == expected).all()
