"""The axes of the series in time end where what is measured does."""

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from crater.pictures import plot


def moment(value, sigma):
    return SimpleNamespace(value=lambda _: value, sigma=lambda _: sigma)


@pytest.mark.parametrize(
    "moments,band,top",
    [
        ([moment(570.0, 10.0), moment(4750.0, 1640.0), moment(np.nan, np.nan)], None, 580.0),
        ([moment(570.0, 10.0)], (700.0, 980.0), 980.0),
        ([moment(-20.0, 1.0)], None, 0.0),
        ([moment(100.0, 80.0)], None, 0.0),
    ],
    ids=["unsure", "band", "mound", "nothing"],
)
def test_what_is_not_known_does_not_stretch_the_axis(moments, band, top):
    axis = Figure().subplots()
    axis.plot([0.0, 1.0], [0.0, 5000.0])
    if band:
        axis.axhspan(*band)
    found = plot._top(axis, SimpleNamespace(moments=moments), "diameter_apparent_m", 1.0)
    assert found == pytest.approx(1.08 * top)
