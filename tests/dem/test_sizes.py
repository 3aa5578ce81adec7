"""Grains of very different sizes: the list against brute force, invariants, the same motion with either search."""

import numpy as np
import pytest

from dem.grains import pair_list, size_levels
from tests.dem.scenes import assembly, grains


def power_law(count: int, ratio: float, seed: int, exponent: float = 3.0) -> np.ndarray:
    """Radii from 1 to ``ratio`` with N(>r) ~ r^-exponent, cut at the ratio."""
    u = np.random.default_rng(seed).uniform(ratio**-exponent, 1.0, count)
    return u ** (-1.0 / exponent)


def brute(X, skin):
    d = np.linalg.norm(X[:, None, :3] - X[None, :, :3], axis=2)
    near = d < X[:, None, 3] + X[None, :, 3] + skin
    return set(zip(*np.nonzero(np.triu(near, 1))))


@pytest.mark.parametrize("ratio", [5.0, 12.0])
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.validation)])
def test_the_list_by_classes_is_that_of_brute_force(ratio, seed):
    rng = np.random.default_rng(seed)
    n = 900
    radius = power_law(n, ratio, seed)
    X = np.column_stack([rng.uniform(-1.0, 1.0, (n, 3)) * [12.0, 25.0, 12.0], radius])
    X[:3, :3] += 400.0  # a few far away
    row, _, col = size_levels.build(X, 0.3, 64)
    found = [(i, int(j)) for i in range(n) for j in col[row[i] : row[i + 1]]]
    assert len(found) == len(set(found)) and set(found) == brute(X, 0.3)
    assert all(list(col[row[i] : row[i + 1]]) == sorted(col[row[i] : row[i + 1]]) for i in range(n))
    cells = pair_list.Cells(X[:, :3], 2 * radius.max() + 0.3)
    sorted_X = X[cells.order]
    row, _, col = pair_list.build(sorted_X, cells, 0.3, 64)
    assert {(i, int(j)) for i in range(n) for j in col[row[i] : row[i + 1]]} == brute(sorted_X, 0.3)


def test_alike_grains_are_searched_in_one_grid():
    assert not size_levels.several(np.random.default_rng(1).uniform(0.85, 1.15, 100))
    assert size_levels.several(power_law(1000, 5.0, 1))


def mixture(seed: int = 4):
    """Grains of radii 1 to 6 falling together, not overlapping."""
    rng = np.random.default_rng(seed)
    radius = np.sort(power_law(400, 6.0, seed))[::-1]
    placed: list[np.ndarray] = []
    for k, r in enumerate(radius):
        while True:
            x = rng.uniform(-17.0, 17.0, 3)
            if all(np.linalg.norm(x - y) > 1.01 * (r + radius[m]) for m, y in enumerate(placed)):
                placed.append(x)
                break
        assert k < 400
    x = np.array(placed)
    return grains(
        x, radius, velocity=-0.3 * x + rng.normal(0.0, 0.5, x.shape), angular_velocity=rng.normal(0.0, 0.5, x.shape),
        mass=1000.0 * radius**3,
        stiffness=1e6 * radius, species=np.zeros(len(x)),
    )  # fmt: skip


def test_a_mixture_of_sizes_keeps_its_momenta_whatever_the_search(monkeypatch):
    scene = mixture()
    beds = []
    for worth in (1.0, np.inf):
        monkeypatch.setattr(size_levels, "WORTH_IT", worth)
        bed = assembly(scene, overlap_stop=1.5)
        p, l = bed.momentum(), bed.angular_momentum()
        scale_p = float(np.sum(bed.mass * np.linalg.norm(bed.velocity, axis=1)))
        scale_l = float(bed.mass @ np.linalg.norm(np.cross(bed.position, bed.velocity), axis=1))
        for _ in range(250):
            bed.step()
        assert bed.contacts > 60 and bed.builds > 3
        assert np.abs(bed.momentum() - p).max() < 1e-12 * scale_p
        assert np.abs(bed.angular_momentum() - l).max() < 1e-12 * scale_l
        beds.append(bed.particles({}))
    assert np.array_equal(*(bed.tables["contacts/pair"] for bed in beds))
    assert np.allclose(beds[0].position, beds[1].position, rtol=0, atol=1e-8)
