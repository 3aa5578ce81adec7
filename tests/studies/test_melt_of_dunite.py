"""The study of what dunite melts: the way to no spacing."""

import numpy as np
import pytest

from studies import melt_of_dunite


@pytest.mark.parametrize("order", [0.7, 1.0, 2.5])
def test_a_power_of_the_spacing_is_taken_off(order):
    spacing = 1.0 / np.array([10.0, 14.0, 20.0, 30.0])
    end, found = melt_of_dunite.extrapolated(spacing, 17.0 - 5.0 * spacing**order)
    assert (end, found) == (pytest.approx(17.0, rel=1e-9), pytest.approx(order, rel=1e-9))


def test_what_does_not_come_together_has_no_end():
    spacing = 1.0 / np.array([10.0, 14.0, 20.0])
    assert melt_of_dunite.extrapolated(spacing, np.array([1.0, 2.0, 5.0])) is None
    assert melt_of_dunite.extrapolated(spacing, np.array([1.0, 2.0, 1.5])) is None
