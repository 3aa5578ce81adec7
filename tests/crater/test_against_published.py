"""The two late stages beside each other."""

from types import SimpleNamespace

import numpy as np

from crater.comparison import against_published
from crater.ground.radial_profile import Profile
from crater.measures.measure import Quantity


class Late(SimpleNamespace):
    """A late stage whose profile begins at ``first`` [m], 20 m wide."""

    def __init__(self, first: float, last: float):
        s = np.linspace(first, last, 40)
        h = -np.maximum(1.0 - (s / 10.0) ** 2, 0.0)
        super().__init__(measures=self, profile=Profile(s, h, h, h, np.full(40, 9)))

    def __getitem__(self, name: str) -> Quantity:
        return Quantity(20.0 if "diameter" in name else 1.0, 0.1, "m")


def compared(grains: Late) -> against_published.Compared:
    return against_published.compared(
        SimpleNamespace(
            setting=SimpleNamespace(shape="ellipsoid", gravity=0.0),
            settings=SimpleNamespace(reference=()),
            late_sph=Late(0.5, 40.0),
            settled_grains=grains,
        )  # type: ignore[arg-type]
    )


def test_profiles_with_nothing_in_common_are_a_reason_not_the_end():
    apart = compared(Late(50.0, 80.0))
    assert apart.late_difference is None and "fewer than three radii" in apart.reasons["late_difference"]


def test_profiles_that_overlap_are_compared():
    found = compared(Late(1.0, 40.0))
    assert found.late_difference is not None and found.late_difference["depth_m"]["sph_over_dem"] == 1.0
    assert "late_difference" not in found.reasons
