"""What the steps from ring means to measures get wrong without any noise: the constants RESOLUTION_* of
crater/measures/quantities.py."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from crater.ground import datum, surface_smoothing
from crater.ground.shape import make_crest_finder, make_ruler, shape_of
from crater.measures import quantities
from fixtures import drawn_craters
from fixtures import synthetic_craters as synthetic

PROFILES = {
    "bowl": synthetic.bowl(1.0),
    "steep bowl": synthetic.bowl(1.0, 0.3, 0.06, 3.5, 2.5),
    "exponential": synthetic.exponential(1.0),
    "rounded": synthetic.rounded(1.0),
    "complex": synthetic.complex_crater(1.0, 0.1, 0.04, 0.5, 0.2),
    "smooth": drawn_craters.smooth(0.42, 0.74).h,
}


def _rings(height, across: float):
    """Ground of half a spacing a ring, ``across`` spacings a radius, and the heights of its colour field."""
    d = 1.0 / across
    edges = np.arange(0.0, 3.5, 0.5 * d)
    middle = 0.5 * (edges[1:] + edges[:-1])
    columns = SimpleNamespace(distance=middle, spacing=np.full(len(middle), d), edges=edges)
    return SimpleNamespace(columns=columns, datum=datum.plane()), surface_smoothing.smooth(
        height, middle, columns.spacing
    )


def misses(height, across: float) -> list[float]:
    """Depth, apparent radius, crest radius, rim height in spacings, and volume in spacings times the apparent area:
    measured minus true."""
    true, d, flat = synthetic.Shape(height, 1.0, 3.5), 1.0 / across, datum.plane()
    ground, mean = _rings(height, across)
    ruler = make_ruler(ground, true.apparent, mean)
    first = shape_of(mean, ruler, flat, None, 0.9 * true.apparent)
    found = shape_of(
        mean, ruler, flat, make_crest_finder(ruler, mean, first.apparent, first.depth), 0.9 * true.apparent
    )
    lengths = (
        found.depth - true.depth,
        found.apparent - true.apparent,
        found.rim - true.rim_found,
        found.rim_height - true.rim_height,
    )
    return [x / d for x in lengths] + [(found.volume - true.volume) / (np.pi * true.apparent**2 * d)]


ACROSS = (7.0, 10.0, 14.0, 20.0, 30.0)


def test_the_stated_resolution_is_what_noiseless_profiles_miss():
    stated = (
        quantities.RESOLUTION_HEIGHT,
        quantities.RESOLUTION_DIAMETER,
        quantities.RESOLUTION_CREST,
        quantities.RESOLUTION_VOLUME,
    )
    for across, row in zip(quantities.RESOLUTION_ACROSS, np.transpose(stated)):
        table = np.array([misses(height, across) for height in PROFILES.values()])
        rms = np.sqrt(np.mean(table[:, [0, 1, 2, 4]] ** 2, axis=0))
        assert row == pytest.approx(rms, rel=0.1, abs=6e-5), across


def test_a_crest_is_restored_but_for_a_share_of_what_was_rounded_off():
    """A corner loses 0.2 to 0.5 spacings to the colour field, a smooth crest next to nothing."""
    share = []
    for name, height in PROFILES.items():
        crest = np.array([synthetic.Shape(height, 1.0, 3.5).rim_found])
        for across in ACROSS:
            missed = misses(height, across)[3]
            if name in ("rounded", "smooth"):
                assert abs(missed) < 0.015, (name, across)
            else:
                lost = (
                    float(height(crest)[0] - surface_smoothing.smooth(height, crest, np.array([1.0 / across]))[0])
                    * across
                )
                share.append(missed / lost)
    assert quantities.RESOLUTION_RIM == pytest.approx(np.sqrt(np.mean(np.square(share))), rel=0.1)


def test_the_form_of_a_floor_that_is_no_parabola_is_in_its_error():
    """A flat floor is found too deep by 0.1 spacings; a paraboloid's has no such error, nor has noise by itself."""

    def form(height, across, noise=0.0, seed=0):
        ground, mean = _rings(height, across)
        cells = mean[:, None] + noise * np.random.default_rng(seed).standard_normal((len(mean), 24)) / across
        ruler = make_ruler(ground, 1.0, cells.mean(axis=1))
        base = shape_of(cells.mean(axis=1), ruler, datum.plane(), None, 0.9)
        hollow = SimpleNamespace(
            ruler=ruler, cells=cells, mean=cells.mean(axis=1), base=base, outermost=0.9, ground=ground
        )
        return [one * across for one in quantities._floor_errors(hollow)]

    assert form(PROFILES["rounded"], 7.0)[1] == pytest.approx(0.1, abs=0.03)
    assert form(PROFILES["bowl"], 7.0)[1] < 0.01
    for seed in range(10):
        scatter, of_form = form(PROFILES["bowl"], 7.0, 0.5, seed)
        assert of_form == 0.0 and scatter > 0.03
