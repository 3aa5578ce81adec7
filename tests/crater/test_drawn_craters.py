"""Craters of an independent generator (drawn_craters.py), on planes and on spheres: no bias, and errors that are
neither small nor padded.

The datum is fitted to the far field, nothing is told. ``pytest -m validation`` draws 200 of each.
"""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from crater.measures.measure import measure
from fixtures import drawn_craters
from matter.particles import Particles

NAMES = ("diameter_apparent_m", "diameter_rim_m", "depth_m", "depth_rim_to_floor_m", "rim_height_m", "volume_m3")


def table(seeds, sphere: bool, **how) -> dict[str, np.ndarray]:
    """Rows (found, sigma, true, spacing) of every draw, per measure; NaN where none was stated."""
    rows: dict[str, list] = {name: [] for name in NAMES}
    for seed in seeds:
        drawn = drawn_craters.drawn_crater(seed, sphere, **how)
        found = measure(Particles(drawn_craters.fields(drawn)), "sphere" if sphere else "plane")
        for name in NAMES:
            value, sigma = found[name].value, found[name].sigma
            rows[name].append(
                (
                    np.nan if value is None else value,
                    np.nan if sigma is None else sigma,
                    drawn.truth[name],
                    drawn.spacing,
                )
            )
    return {name: np.array(values) for name, values in rows.items()}


def assert_no_bias(rows: dict[str, np.ndarray]) -> None:
    """The mean over draws of rim diameter and depth within 2 % or 0.3 spacings, whichever is more, and of volume
    within 3 %."""
    for name in ("diameter_rim_m", "depth_m", "diameter_apparent_m"):
        found, _, true, spacing = rows[name].T
        assert abs(np.nanmean(found - true)) < max(0.02 * np.mean(true), 0.3 * np.mean(spacing)), name
    found, _, true, _ = rows["volume_m3"].T
    assert abs(np.nanmean(found / true - 1.0)) < 0.03


def pulls(rows: dict[str, np.ndarray], name: str) -> np.ndarray:
    """(found - true) / sigma of the draws in which the measure is stated."""
    found, sigma, true, _ = rows[name].T
    off = (found - true) / sigma
    return off[np.isfinite(off)]


@pytest.mark.validation
@pytest.mark.parametrize("sphere", [False, True], ids=["plane", "sphere"])
def test_a_few_draws_are_measured_right(sphere):
    rows = table(range(900, 904), sphere, reach=3.0)
    assert_no_bias(rows)
    every = np.concatenate([pulls(rows, name) for name in NAMES])
    assert len(every) >= 22
    assert np.abs(every).max() < 4.0
    assert 0.4 < np.sqrt(np.mean(every**2)) < 1.6


@pytest.mark.validation
@pytest.mark.parametrize("sphere", [False, True], ids=["plane", "sphere"])
def test_two_hundred_draws(sphere):
    """For each measure the truth lies within two sigma in 90 to 99 %, and the RMS of (found - true) / sigma is between
    0.7 and 1.3."""
    rows = table(range(5000, 5200), sphere)
    assert_no_bias(rows)
    for name in NAMES:
        off = pulls(rows, name)
        assert len(off) >= 190, name
        assert 0.90 <= np.mean(np.abs(off) < 2.0) <= 0.99, (name, np.mean(np.abs(off) < 2.0))
        assert 0.7 < np.sqrt(np.mean(off**2)) < 1.3, (name, np.sqrt(np.mean(off**2)))


def test_the_generator_shares_no_code_with_the_measuring():
    tree = ast.parse(Path(drawn_craters.__file__).read_text())
    names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert {name.split(".")[0] for name in names} <= {
        "__future__",
        "collections",
        "dataclasses",
        "functools",
        "numpy",
        "scipy",
    }


@pytest.mark.parametrize("packing", drawn_craters.PACKINGS)
def test_every_packing_has_one_particle_per_unit_volume(packing):
    rng = np.random.default_rng(5)
    counts = [len(drawn_craters.fill(packing, (-9, -9, -5), (9, 9, 5), rng)) / 3240 for _ in range(4)]
    assert np.mean(counts) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("sphere", [False, True], ids=["plane", "sphere"])
@pytest.mark.parametrize("shape", drawn_craters.SHAPES)
def test_the_stated_truth_is_that_of_the_ground(shape, sphere):
    """The ground itself on a fine grid: crest, floor, where it meets the datum; the volume by counting random points
    below the datum."""
    ground = drawn_craters.sharp(0.4, 0.09, 3.0) if shape == "sharp" else drawn_craters.smooth(0.4, 0.74)
    body = 6.0 if sphere else None
    truth = drawn_craters.truth_of(ground, 1.0, body)
    s = np.linspace(0.0, 3.0, 300001)
    h = ground.h(s)
    assert truth["depth_m"] == pytest.approx(-h.min()) and truth["rim_height_m"] == pytest.approx(h.max(), rel=1e-6)
    assert truth["diameter_rim_m"] == pytest.approx(2.0 * s[np.argmax(h)], abs=1e-4)
    assert truth["diameter_apparent_m"] == pytest.approx(2.0 * s[(h < 0.0) & (s < 1.0)].max(), abs=1e-4)
    points = np.random.default_rng(3).uniform((-1, -1, -0.6), (1, 1, 0), (1_000_000, 3))
    if sphere:
        place = points + np.array([0.0, 0.0, body])
        along, height = body * np.arctan2(np.hypot(*place[:, :2].T), place[:, 2]), np.linalg.norm(place, axis=1) - body
    else:
        along, height = np.hypot(*points[:, :2].T), points[:, 2]
    inside = (height < 0.0) & (height > ground.h(along)) & (along < ground.apparent)
    assert truth["volume_m3"] == pytest.approx(2.4 * inside.mean(), rel=0.01)
