"""Which particles carry a surface: where sizes differ, of the projectile, of expanded matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from crater.ground import cloud, datum, locate
from crater.measures.measure import measure
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.geometry import frame
from matter.particles import Particles


def _grains(position: np.ndarray, radius: np.ndarray) -> Particles:
    return Particles({"position": position, "radius": radius}, {"packing_fraction": 0.6})


def _ground(rng: np.random.Generator) -> np.ndarray:
    """A slab of 12 x 12 x 5 grains of radius 0.5, three of whose upper layers lack a block in the middle."""
    places = np.stack(np.meshgrid(np.arange(12.0), np.arange(12.0), np.arange(5.0), indexing="ij"), axis=-1)
    places = places.reshape(-1, 3)
    hollow = (np.abs(places[:, 0] - 5.5) < 2.0) & (np.abs(places[:, 1] - 5.5) < 2.0) & (places[:, 2] > 3.0)
    return places[~hollow] + rng.uniform(-0.02, 0.02, (np.count_nonzero(~hollow), 3))


def test_small_grains_in_the_pores_take_no_large_one_from_the_ground() -> None:
    rng = np.random.default_rng(3)
    large = _ground(rng)
    floor = large[(np.abs(large[:, :2] - 5.5) < 2.0).all(axis=1) & (large[:, 2] > 2.5)]
    # thirty small ones about each grain of the floor: more than the dozen neighbours that are asked for
    way = rng.normal(size=(len(floor), 30, 3))
    fines = (floor[:, None] + 0.58 * way / np.linalg.norm(way, axis=2)[:, :, None]).reshape(-1, 3)
    alone = cloud.supported(cloud.particle_cloud(_grains(large, np.full(len(large), 0.5))))
    radius = np.concatenate([np.full(len(large), 0.5), np.full(len(fines), 0.06)])
    among = cloud.supported(cloud.particle_cloud(_grains(np.vstack([large, fines]), radius)))
    assert alone.all()
    assert np.array_equal(among[: len(large)], alone)


def test_a_large_grain_above_the_ground_is_not_held_by_small_ones() -> None:
    rng = np.random.default_rng(4)
    large = np.vstack([_ground(rng), [[5.5, 5.5, 9.0]]])
    fines = np.array([5.5, 5.5, 9.0]) + 0.3 * rng.normal(size=(200, 3))
    radius = np.concatenate([np.full(len(large), 0.5), np.full(len(fines), 0.06)])
    held = cloud.supported(cloud.particle_cloud(_grains(np.vstack([large, fines]), radius)))
    assert held[: len(large) - 1].all()
    assert not held[len(large) - 1 :].any()


RIM, SPACING = 1000.0, 90.0
SEARCH = locate.Search(gravity=1.6, rise_limit=300.0)


def _crater(extra: np.ndarray, up: float) -> Particles:
    """A bowl of shock-stage matter at rest, and ``extra`` matter of the projectile that moves up at ``up`` [m/s]."""
    shape = synthetic.Shape(synthetic.bowl(RIM), RIM, 3.3 * RIM)
    ground = synthetic.cloud_on_plane(shape, SPACING, np.random.default_rng(6), "jitter")
    fields = synthetic.as_fields(np.vstack([ground, extra]), SPACING)
    fields["velocity"] = np.zeros((len(ground) + len(extra), 3))
    fields["velocity"][len(ground) :, 2] = up
    fields["layer"] = np.r_[np.zeros(len(ground)), np.full(len(extra), -1)]
    return Particles(fields)


def _block(low: float, high: float) -> np.ndarray:
    """Matter over the axis between two heights [m]."""
    return synthetic.fill(np.random.default_rng(7), SPACING, (-450, -450, low), (450, 450, high), "jitter")


def _depth(particles: Particles) -> tuple[float, float]:
    found = measure(particles, frame.Plane(0.0), None, SEARCH)
    return found["depth_m"].value, found["volume_m3"].value


def test_the_projectile_that_lines_the_floor_is_ground() -> None:
    """The same cloud, told and not told which of its matter the projectile brought."""
    bare = _crater(np.empty((0, 3)), 0.0)
    floor = float(np.quantile(bare.position[np.hypot(*bare.position.T[:2]) < 450.0, 2], 0.99))
    lined = _crater(_block(floor - 100.0, floor + 180.0), -1.0)
    plain = Particles({name: lined[name] for name in lined if name != "layer"})
    assert _depth(lined) == _depth(plain)
    assert _depth(lined)[0] < _depth(bare)[0] - 100.0


@pytest.mark.parametrize(("up", "flies"), [(-2000.0, True), (200.0, True), (-1.0, False)])
def test_a_projectile_in_flight_is_no_ground(up: float, flies: bool) -> None:
    """On its way in, its foot in the hollow that it makes, and on its way out: what is above the datum flies. Slower
    than a fall from the limit it settles."""
    block = _block(-500.0, 250.0)
    body = locate.prepare(_crater(block, up), datum.plane(), None, SEARCH).body
    above = np.count_nonzero(block[:, 2] > 0.5 * SPACING)
    held = np.count_nonzero(body.projectile & (body.position[:, 2] > 0.5 * SPACING))
    assert held == 0 if flies else held > 0.95 * above > 100
    assert np.count_nonzero(body.projectile) - held > 0.95 * (len(block) - above)


def test_the_ground_before_the_impact_is_without_the_projectile() -> None:
    """It touches the ground in the first snapshot, at rest even."""
    low, high = (-3000.0, -3000.0, -1000.0), (3000.0, 3000.0, 0.0)
    ground = synthetic.fill(np.random.default_rng(8), SPACING, low, high, "jitter")
    ball = _block(0.0, 500.0)
    fields = synthetic.as_fields(np.vstack([ground, ball]), SPACING)
    fields["velocity"] = np.zeros((len(ground) + len(ball), 3))
    layer = np.r_[np.zeros(len(ground)), np.full(len(ball), -1)]
    seen = locate.ground_before(Particles({**fields, "layer": layer}), datum.plane())
    alone = locate.ground_before(Particles(synthetic.as_fields(ground, SPACING)), datum.plane())
    assert all(np.array_equal(seen.excess[name], alone.excess[name], equal_nan=True) for name in alone.excess)


def test_headroom_that_fell_below_the_datum_is_ground_before_the_impact() -> None:
    """The carve keeps it. What lies above the datum is no ground."""
    low, high = (-3000.0, -3000.0, -1000.0), (3000.0, 3000.0, 600.0)
    bed = synthetic.as_fields(synthetic.fill(np.random.default_rng(8), SPACING, low, high, "jitter"), SPACING)
    height = bed["position"][:, 2]
    seen, alone = (
        locate.ground_before(Particles({**bed, "headroom": height > top * SPACING}), datum.plane())
        for top in (0.0, -0.5)
    )
    assert all(np.array_equal(seen.excess[name], alone.excess[name], equal_nan=True) for name in seen.excess)
    assert abs(np.nanmean(seen.excess["column"])) < 0.05 * SPACING


@pytest.mark.parametrize(("up", "counts"), [(-1.0, True), (1.0, False)])
def test_expanded_matter_is_ground_where_it_sinks_with_the_floor(up: float, counts: bool) -> None:
    """At 0.4 of its density at rest, which the snapshot says; as in the handoff."""
    rng = np.random.default_rng(9)
    points = synthetic.fill(rng, SPACING, (-800, -800, -900), (800, 800, -100), "jitter")
    top = points[:, 2] > -250.0
    fields = synthetic.as_fields(points, SPACING)
    solid = 2.0 * float(fields["density"][0])
    fields["velocity"] = np.where(top[:, None], [0.0, 0.0, up], 0.0)
    fields["density"] = np.where(top, 0.4 * fields["density"], fields["density"])
    fields |= {"distention": np.full(len(points), 2.0), "material": np.zeros(len(points))}
    cloudy = cloud.particle_cloud(Particles(fields, {"reference_densities_kg_m3": [solid]}))
    assert np.array_equal(cloudy.low_density, top)
    height, speed = points[:, 2], fields["velocity"][:, 2]
    held = cloud.supported(cloudy, height, speed, 1.6, 300.0)
    assert held[~top].mean() > 0.99 and held[top].mean() == pytest.approx(1.0 if counts else 0.0, abs=0.02)
    assert not cloud.supported(cloudy)[top].any()


def test_where_no_ray_meets_ground_it_is_said() -> None:
    """An impact may tear away all that lay about the site: no hollow can be looked for, and that is no crash."""
    scene = locate.prepare(_crater(np.empty((0, 3)), 0.0), datum.plane(), None, SEARCH)
    ground = locate.look(scene, scene.datum, SEARCH.sectors)
    assert locate.depression(ground)[2] > 0.0
    with pytest.raises(InputError, match="no ray about the site meets any ground"):
        locate.depression(replace(ground, rays=np.full_like(ground.rays, np.nan)))
