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


def misses(height, across: float) -> list[float]:
    """Depth, apparent radius, crest radius, rim height in spacings, and volume in spacings times the apparent area:
    measured minus true."""
    true = synthetic.Shape(height, 1.0, 3.5)
    d, flat = 1.0 / across, datum.plane()
    edges = np.arange(0.0, 3.5, 0.5 * d)
    middle = 0.5 * (edges[1:] + edges[:-1])
    ground = SimpleNamespace(
        columns=SimpleNamespace(distance=middle, spacing=np.full(len(middle), d), edges=edges), datum=flat
    )
    mean = surface_smoothing.smooth(height, middle, ground.columns.spacing)
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
    table = np.array([misses(height, across) for height in PROFILES.values() for across in ACROSS])
    crest = np.sqrt(
        quantities.RESOLUTION_CREST**2 - quantities.STEEP_WALL**2
    )  # which these profiles, passed through the linear map, cannot show
    stated = (quantities.RESOLUTION_HEIGHT, quantities.RESOLUTION_DIAMETER, crest, quantities.RESOLUTION_VOLUME)
    assert stated == pytest.approx(np.sqrt(np.mean(table[:, [0, 1, 2, 4]] ** 2, axis=0)), rel=0.1)


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
