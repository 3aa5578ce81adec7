"""The energy that breaks a body in two: Benz & Asphaug (1999), and where a mirror is refused for it."""

from pathlib import Path

import pytest

from pipeline.case import read
from pipeline.settings import sense
from pipeline.settings.compose import compose
from sph.outcome import disruption

CASES = Path(__file__).parents[2] / "cases"


def test_rock_is_weakest_at_some_hundred_metres():
    """Basalt at 3 km/s: the curve falls to some 1e6 erg/g at 100 to 200 m, and rises on both sides."""
    least = min(range(10, 2000, 10), key=lambda r: disruption.energy(float(r), 2700.0))
    assert 50 < least < 300
    assert disruption.energy(float(least), 2700.0) == pytest.approx(1.2e2, rel=0.3)
    # strength alone at 3 cm, pull alone at 100 km: by hand, in erg/g
    assert disruption.energy(0.03, 2700.0) == pytest.approx(1e-4 * 3.5e7 * 3.0**-0.38, rel=1e-3)
    assert disruption.energy(1e5, 2700.0) == pytest.approx(1e-4 * 0.3 * 2.7 * 1e7**1.36, rel=1e-3)


def test_share_counts_the_energy_in_the_targets_mass():
    of_basalt = disruption.energy(0.03, 2700.0)
    mass = 2700.0 * 4.0 / 3.0 * 3.14159265 * 0.03**3
    assert disruption.energy_ratio(2e-4, 3200.0, mass, 0.03) == pytest.approx(
        0.5 * 2e-4 * 3200.0**2 / mass / of_basalt
    )


@pytest.mark.parametrize(("name", "refused"), [("nakamura_fujiwara", True), ("valhalla_980km", False)])
def test_fragments_are_not_mirrored(name, refused):
    chosen = read.read(CASES / name, "quick", ['sph.symmetry="half"'])
    errors, _ = sense.judged(compose(chosen), {}, chosen.stages)
    said = [error.path for error in errors if "mirror images" in error.message]
    assert said == ([("sph", "symmetry")] if refused else [])
