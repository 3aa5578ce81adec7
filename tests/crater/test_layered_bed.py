"""A hexagonal bed whose layers lie flat: a crater one layer deep is a crater, whole layers that lie around it are no
noise."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ground import datum, locate
from crater.measures.measure import measure
from matter.geometry import frame
from matter.particles import Particles

LAYER = np.sqrt(2.0 / 3.0)
"""Distance of layers of touching spheres of diameter 1."""


def hexagonal_bed(half: int = 30, layers: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Centres (n, 3) and layer (n,) from the top; the volume that each sphere stands for ends at z = 0."""
    i, j, k = np.meshgrid(np.arange(-half, half), np.arange(-half, half), np.arange(layers), indexing="ij")
    x, y = i + 0.5 * (j % 2) + 0.5 * (k % 2), np.sqrt(0.75) * (j + (k % 2) / 3.0)
    return np.stack([x.ravel(), y.ravel(), -LAYER * (k.ravel() + 0.5)], axis=1), k.ravel()


def grains(position: np.ndarray) -> Particles:
    return Particles(
        {"position": position, "radius": np.full(len(position), 0.5)}, {"packing_fraction": np.pi / np.sqrt(18.0)}
    )


def struck_bed(radius: float, hills: float) -> np.ndarray:
    """The bed without the top layer inside ``radius``; patches of six grains across with a layer more on a share
    ``hills`` of the ground around."""
    rng = np.random.default_rng(1)
    position, layer = hexagonal_bed()
    away = np.hypot(position[:, 0], position[:, 1])
    patch = np.floor(position[:, :2] / 6.0).astype(int) + 50
    raised = rng.random((100, 100))[patch[:, 0], patch[:, 1]] < hills
    on_top = position[(layer == 0) & (away > radius + 0.5) & raised] + np.array([0.5, np.sqrt(1.0 / 12.0), LAYER])
    return np.vstack([position[(layer > 0) | (away >= radius)], on_top])


@pytest.fixture(scope="module")
def before():
    """The undisturbed bed, measured once."""
    return locate.ground_before(grains(hexagonal_bed()[0]), datum.plane())


@pytest.mark.parametrize(("radius", "hills"), [(8.0, 0.0), (8.0, 0.5), (12.0, 0.5)])
def test_a_crater_of_one_layer_is_found(radius, hills, before):
    found = measure(grains(struck_bed(radius, hills)), frame.Plane(), before)
    # the far field is what the patches lift it to, up to half a layer and some
    assert 0.85 * LAYER < found["depth_m"].value < 1.8 * LAYER
    assert found["diameter_apparent_m"].value > 1.8 * radius
    assert np.hypot(*found.datum.centre[:2]) < 0.5 * radius
    if not hills:
        assert found["depth_m"].value == pytest.approx(LAYER, abs=0.1)
        assert found["diameter_apparent_m"].value == pytest.approx(2.0 * radius + 1.0, abs=1.0)


@pytest.mark.parametrize("shake", [0.0, 0.03])
def test_an_undisturbed_bed_has_no_hollow(shake, before):
    bed = hexagonal_bed()[0]
    now = bed + np.random.default_rng(2).normal(scale=shake, size=bed.shape)
    found = measure(grains(now), frame.Plane(), before)
    assert found["depth_m"].value is None and "no hollow" in found["depth_m"].reason
