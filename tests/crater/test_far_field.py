"""Ground that carries a known blanket and ends at so many rim radii: with the ground before the impact known, and
without it.

``pytest -m validation`` draws 100 craters of each.
"""

from __future__ import annotations

import numpy as np
import pytest

from crater.measures.measure import Measures, measure
from fixtures import drawn_craters
from matter.geometry import frame
from matter.particles import Particles

NAMES = ("diameter_apparent_m", "depth_m", "volume_m3", "rim_height_m")
KNOWN = (1.5, 1.8, 2.2, 2.6, 3.0, 4.0)
UNKNOWN = (2.2, 2.6, 3.0, 4.0)


def measured(seed: int, ends: float, known: bool) -> tuple[Measures, dict[str, float]]:
    """The crater of a seed in ground that ``ends`` at so many rim radii, and its true measures."""
    drawn = drawn_craters.drawn_crater(seed, False, reach=ends, level=known, central=True)
    now = Particles(drawn_craters.fields(drawn))
    if not known:
        return measure(now, "plane"), drawn.truth
    return measure(now, frame.Plane(), Particles(drawn_craters.fields(drawn, before=True))), drawn.truth


def errors(seeds, ends: float, known: bool) -> dict[str, np.ndarray]:
    """Rows (found / true - 1, sigma / true) of each measure, of the draws in which it is stated."""
    rows: dict[str, list[tuple[float, float]]] = {name: [] for name in NAMES}
    for seed in seeds:
        found, truth = measured(seed, ends, known)
        for name in NAMES:
            value, sigma, true = found[name].value, found[name].sigma, truth[name]
            if value is not None and sigma is not None:
                rows[name].append((value / true - 1.0, sigma / true))
    return {name: np.array(values) for name, values in rows.items()}


@pytest.mark.parametrize("ends", [1.5, pytest.param(2.2, marks=pytest.mark.validation)])
def test_the_blanket_is_no_datum_where_the_ground_before_is_known(ends):
    """At 1.5 rim radii the blanket stands at 0.03 radii: taken for the far field it makes depths 9 %, volumes 15 % too
    large and rims 40 % too low."""
    rows = errors(range(300, 304), ends, known=True)
    for name, limit in (("diameter_apparent_m", 0.015), ("depth_m", 0.025), ("volume_m3", 0.025)):
        off, sigma = rows[name].T
        assert len(off) == 4 and abs(off.mean()) < limit, name
        assert np.abs(off / sigma).max() < 3.5, name


def test_ground_under_its_blanket_has_no_datum_of_its_own():
    found, _ = measured(300, 1.6, known=False)
    assert all(quantity.value is None for quantity in found.quantities.values())
    assert "inside its blanket" in found["depth_m"].reason


def test_ground_that_ends_at_twice_the_rim_holds_what_it_cannot_tell_in_its_error():
    rows = errors(range(300, 303), 2.3, known=False)
    for name in NAMES:
        off, sigma = rows[name].T
        assert np.abs(off / sigma).max() < 3.5, name


@pytest.mark.validation
@pytest.mark.parametrize("known, ends", [*((True, ends) for ends in KNOWN), *((False, ends) for ends in UNKNOWN)])
def test_bias_and_coverage(known, ends):
    """Diameter and depth without a bias of 1 %, the truth within two sigma in 92 % of 100 draws at least; errors that
    are at most two and a half times what is found."""
    rows = errors(range(7000, 7100), ends, known)
    for name in ("diameter_apparent_m", "depth_m"):
        off, sigma = rows[name].T
        assert abs(off.mean()) < 0.01, (name, off.mean())
        assert np.mean(np.abs(off) < 2.0 * sigma) >= 0.92, (name, np.mean(np.abs(off) < 2.0 * sigma))
        assert np.sqrt(np.mean((off / sigma) ** 2)) > 0.4, name
