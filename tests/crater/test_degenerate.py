"""Clouds that cannot be measured end in one clear message; ground without a crater is a result, not an error."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ground import cloud
from crater.measures.measure import measure
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.geometry import frame
from matter.particles import Particles


def box(rng, kind="jitter", spacing=0.2):
    return synthetic.fill(rng, spacing, (-3, -3, -1.5), (3, 3, 0), kind)


def test_fewer_than_a_hundred_particles():
    p = np.random.default_rng(1).uniform(-1, 1, (60, 3))
    with pytest.raises(InputError, match=r"60 particles.*at least 100"):
        measure(Particles(synthetic.as_fields(p, 0.3)), "plane")


def test_only_a_projectile():
    p = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    with pytest.raises(InputError, match="no compact material: all 500"):
        measure(Particles({**synthetic.as_fields(p, 0.3), "layer": np.full(500, -1)}), "plane")


def test_a_position_that_is_not_finite_is_named():
    p = box(np.random.default_rng(1))
    p[17, 2] = np.nan
    with pytest.raises(InputError, match="particle 17"):
        measure(Particles(synthetic.as_fields(p, 0.2)), "plane")


@pytest.mark.parametrize("field", ["mass", "density"])
def test_a_mass_or_density_that_is_no_number(field):
    p = box(np.random.default_rng(1))
    fields = synthetic.as_fields(p, 0.2)
    fields[field] = fields[field].copy()
    fields[field][3] = np.nan
    with pytest.raises(InputError, match="positive"):
        measure(Particles(fields), "plane")


def test_all_ejecta():
    p = np.random.default_rng(1).uniform(-100, 100, (3000, 3))
    with pytest.raises(InputError, match="ejecta"):
        measure(Particles(synthetic.as_fields(p, 1.0)), "plane")


def test_scattered_clumps_are_no_body():
    rng = np.random.default_rng(1)
    clumps = [
        rng.uniform(-100, 100, 3) + synthetic.fill(rng, 1.0, (-1.5, -1.5, -1.5), (1.5, 1.5, 1.5), "jitter")
        for _ in range(40)
    ]
    with pytest.raises(InputError, match="ejecta"):
        measure(Particles(synthetic.as_fields(np.vstack(clumps), 1.0)), "plane")


@pytest.mark.parametrize("kind", ["lattice", "jitter"])
def test_flat_ground_has_no_crater(kind):
    found = measure(Particles(synthetic.as_fields(box(np.random.default_rng(1), kind), 0.2)), "plane")
    for name in ("diameter_rim_m", "diameter_apparent_m", "volume_m3"):
        assert found[name].value is None and found[name].reason
    assert found.notes["rms_relief_m"] < 0.2 * 0.3


def test_unknown_datum():
    p = box(np.random.default_rng(1))
    with pytest.raises(InputError, match="'plane' or 'sphere'"):
        measure(Particles(synthetic.as_fields(p, 0.2)), "ellipsoid")
    with pytest.raises(InputError, match=r"matter\.geometry\.frame"):
        measure(Particles(synthetic.as_fields(p, 0.2)), 3.0)


def test_datum_that_misses_the_cloud():
    p = box(np.random.default_rng(1)) + np.array([0.0, 0.0, 1e4])
    with pytest.raises(InputError, match="datum"):
        measure(Particles(synthetic.as_fields(p, 0.2)), frame.Sphere(1.0, (1e6, 0.0, 0.0)))


def test_a_bed_too_small_for_a_packing_fraction_is_taken_as_randomly_packed():
    """A bed without grains away from its walls says NaN for its packing fraction."""
    p = box(np.random.default_rng(1))
    fields = {"position": p, "radius": np.full(len(p), 0.1)}
    found, usual = (
        cloud.particle_cloud(Particles(fields, {"packing_fraction": value}), "bed")
        for value in (np.nan, cloud.RANDOM_PACKING)
    )
    assert np.array_equal(found.volume, usual.volume)
