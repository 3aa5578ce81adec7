"""What is ejecta: apex heights, the rules in their order, and inputs that cannot be handed over."""

import numpy as np
import pytest

from fixtures import clouds, flows
from handoff.domains import domain
from handoff.ledger_rows import account
from handoff.source import cloud_surface, hydrostatic
from handoff.transfer import transfer
from matter.errors import InputError
from matter.particles import Particles

G, R = 1.24, 2.1e6


@pytest.fixture(scope="module")
def column():
    return hydrostatic.from_target(clouds.target_table(), clouds.R_BODY)


def test_apex_of_free_flight(column):
    mu = G * R**2
    v = np.array([500.0, 2000.0, 3000.0, 500.0, 0.0, 1500.0])
    up = np.array([500.0, 2000.0, 3000.0, -500.0, 0.0, 300.0])
    height = np.array([0.0, 1e5, 0.0, 2e4, 5e4, 0.0])
    apex = column.apex(height, up, v)
    assert apex[0] == pytest.approx(1.0 / (1.0 / R - 500.0**2 / (2.0 * mu)) - R, rel=1e-12)  # vertical: energy alone
    assert apex[1] == pytest.approx(1.0 / (1.0 / (R + 1e5) - 2000.0**2 / (2.0 * mu)) - R, rel=1e-9)
    assert apex[2] == np.inf  # beyond escape: sqrt(2 mu / R) = 2282 m/s
    assert apex[3] == 2e4 and apex[4] == 5e4
    # oblique: r_max is where the radial speed vanishes, e = l^2 / (2 r^2) - mu / r
    r = R + apex[5]
    transverse = np.sqrt(1500.0**2 - 300.0**2) * R
    assert 0.5 * (transverse / r) ** 2 - mu / r == pytest.approx(0.5 * 1500.0**2 - mu / R, rel=1e-12)
    flat = hydrostatic.uniform(2.0, 1000.0, 100.0)
    assert flat.apex(np.array([1.0]), np.array([4.0]), np.array([9.0]))[0] == pytest.approx(5.0)
    assert column.escape_speed(np.array([0.0]))[0] == pytest.approx(np.sqrt(2 * G * R))


def test_hydrostatic_column(column):
    assert column.pressure_at(np.array([1e3, -1e5]))[0] == 0.0
    assert column.pressure_at(np.array([-1e5]))[0] == pytest.approx(930.0 * G * 1e5, rel=0.02)
    assert column.gravity_at(np.array([R]))[0] == pytest.approx(G / 4.0, rel=1e-6)


def test_rules_of_ejecta(sphere_cloud, column):
    """Single particles changed in an otherwise resting body."""
    source = clouds.sphere_source(sphere_cloud, velocity=lambda p: np.zeros_like(p), curtain=40)
    region = domain.Cone(clouds.R_CORE, R, R + clouds.HEADROOM, clouds.ARC / R)
    height = region.frame.height(source.position)
    up = region.frame.up(source.position)
    body = np.flatnonzero(source.neighbours > 10)
    top = body[np.argsort(-height[body])[:6]]
    deep = body[np.argmin(np.abs(height[body] + 250e3))]
    limit = np.sqrt(2.0 * G * clouds.HEADROOM)
    side = np.cross(up[top], [0.0, 1.0, 0.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    source.velocity[top[0]] = (
        0.98 * limit * up[top[0]]
    )  # within the limit, but it starts above the datum: rises beyond the headroom
    source.velocity[top[1]] = 1.5 * limit * side[1] + 10.0 * up[top[1]]  # fast along the ground and rising
    source.velocity[top[2]] = -1.5 * limit * up[top[2]]  # fast downwards
    source.velocity[deep] = 1.2 * limit * up[deep]  # fast upwards, but 250 km deep: it would not come out
    source.neighbours[top[3]] = 3
    source.density[top[4]] = 400.0
    source.velocity[top[4]] = 1.0 * up[top[4]]  # expanded, and leaves the ground
    split, shape, _ = cloud_surface.classify(source, region, column, cloud_surface.Rules())
    assert height[top[0]] > 0.1 * clouds.HEADROOM
    names = [cloud_surface.REASONS[code] for code in split.reason[np.r_[top, deep]]]
    assert names == ["high", "fast", "compact", "sparse", "expanded", "compact", "compact"]
    assert split.speed_limit == pytest.approx(limit)
    assert np.all(split.reason[source.neighbours == 2] != cloud_surface.COMPACT)  # the curtain
    assert sum(split.counts().values()) == len(source)
    given = cloud_surface.by_motion(source, region, column, cloud_surface.Rules(speed_limit=2.0 * limit))
    assert cloud_surface.REASONS[given.reason[top[1]]] == "compact"
    assert shape.component_volume.size == 1


def test_a_detached_block_is_ejecta(column):
    points = clouds.lattice((12.0, 12.0, 12.0), 1.0)
    points = np.concatenate([points[points[:, 2] < 0.0], clouds.lattice((2.0, 2.0, 2.0), 1.0) + [0.0, 0.0, 6.0]])
    source = clouds.source_of(points, np.ones(len(points)), np.zeros((len(points), 3)), 1000.0)
    split, _, _ = cloud_surface.classify(
        source,
        domain.Upright("cylinder", 8.0, -8.0, 9.0),
        hydrostatic.uniform(1.0, 1000.0, 9.0),
        cloud_surface.Rules(),
    )
    block = points[:, 2] > 2.0
    assert np.all(split.reason[block] == cloud_surface.DETACHED)
    assert np.mean(split.reason[~block] == cloud_surface.COMPACT) > 0.99


def changed(source: Particles, **fields) -> Particles:
    return Particles({name: fields.get(name, source[name]) for name in source}, source.attributes)


@pytest.fixture(scope="module")
def bowl():
    return clouds.flat_source(
        2.2, 21.0, 12.0, lambda p: np.where(np.hypot(p[:, 0], p[:, 1]) < 10.0, -6.0, 0.0), lambda p: np.zeros_like(p)
    )


@pytest.fixture(scope="module")
def bed():
    return clouds.flat_bed(1.2, 21.0, 12.0, 4.0)


def hand(source, bed, **rules):
    return transfer.hand_over(source, bed, cloud_surface.Rules(**rules), hydrostatic.uniform(1.0, 1000.0, 20.0))


def test_inputs_that_cannot_be_handed_over(bowl, bed):
    n = len(bowl)
    with pytest.raises(InputError, match=r"all .* ejecta"):
        hand(changed(bowl, velocity=np.tile([0.0, 0.0, 1e3], (n, 1))), bed)
    velocity = np.zeros((n, 3))
    velocity[7, 1] = np.nan
    with pytest.raises(InputError, match=r"'velocity' is not finite for 1 of .* particle 7"):
        hand(changed(bowl, velocity=velocity), bed)
    mass = bowl.mass.copy()
    mass[3] = 0.0
    with pytest.raises(InputError, match="'mass' is not positive"):
        hand(changed(bowl, mass=mass), bed)
    layer = np.zeros(n)
    above = np.argsort(-bowl.position[:, 2])[:20]
    layer[above] = -1
    position, velocity = bowl.position.copy(), np.zeros((n, 3))
    position[above, 2] += 30.0
    velocity[above, 2] = -100.0
    with pytest.raises(InputError, match="still above the surface"):
        hand(changed(bowl, layer=layer, position=position, velocity=velocity), bed)
    with pytest.raises(InputError, match="share a frame"):
        hand(changed(bowl, position=bowl.position - [0.0, 0.0, 500.0]), bed)
    with pytest.raises(InputError, match="lacks"):
        hand(Particles({name: bowl[name] for name in bowl if name != "velocity"}, bowl.attributes), bed)


@pytest.mark.validation
def test_surfaces_that_cannot_be_handed_over(bed):
    with pytest.raises(InputError, match="no crater"):
        flat = clouds.flat_source(3.3, 21.0, 12.0, lambda p: np.zeros(len(p)), lambda p: np.zeros_like(p))
        hand(flat, bed)
    assert hand(flat, bed, crater="any").carving.size.radius == 0.0
    with pytest.raises(InputError, match="wider than"):
        hand(clouds.flat_source(3.3, 21.0, 12.0, lambda p: np.full(len(p), -6.0), lambda p: np.zeros_like(p)), bed)
    with pytest.raises(InputError, match="headroom"):
        hand(
            clouds.flat_source(
                3.3,
                21.0,
                12.0,
                lambda p: np.where(np.hypot(p[:, 0], p[:, 1]) < 10.0, -6.0, 8.0),
                lambda p: np.zeros_like(p),
            ),
            bed,
        )


def test_beds_that_cannot_be_used(bowl, bed):
    with pytest.raises(InputError, match="domain"):
        hand(bowl, Particles(dict(bed), {k: v for k, v in bed.attributes.items() if k != "domain"}))
    with pytest.raises(InputError, match="lacks top_m"):
        table = {k: v for k, v in bed.attributes["domain"].items() if k != "top_m"}
        hand(bowl, Particles(dict(bed), {**bed.attributes, "domain": table}))
    with pytest.raises(InputError, match="bounds no volume"):
        hand(bowl, Particles(dict(bed), {**bed.attributes, "domain": {**bed.attributes["domain"], "floor_m": 50.0}}))
    position = bed.position.copy()
    position[0, 0] = np.inf
    with pytest.raises(InputError, match="'position' is not finite"):
        hand(bowl, changed(bed, position=position))


def test_reference_density_is_that_with_pores():
    """Basalt of distention 1.5 at its rest density is not expanded."""
    fields = {"position": np.zeros((2, 3)), "material": [0, 1], "density": [1800.0, 917.0], "distention": [1.5, 1.0]}
    source = Particles(fields, {"materials": ["basalt", "ice"]})
    assert cloud_surface.reference_density(source) == pytest.approx([1800.0, 917.0])
    plain = Particles(
        {name: value for name, value in fields.items() if name != "distention"},
        {"materials": ["basalt", "unheard_of"]},
    )
    assert cloud_surface.reference_density(plain) == pytest.approx([2700.0, 0.0])


def test_reference_density_is_the_one_that_the_shock_stage_computed_with():
    """A case may give its own density of the solid: 3,500 kg/m^3 where the library's basalt has 2,700."""
    source = Particles(
        {"position": np.zeros((2, 3)), "material": np.array([0, 1]), "distention": np.array([1.4583, 1.0])},
        {"materials": ["basalt", "ice"], "reference_densities_kg_m3": [3500.0, 917.0]},
    )
    assert cloud_surface.reference_density(source) == pytest.approx([2400.0, 917.0], rel=1e-4)


def test_solid_densities_are_of_the_source_where_it_knows_the_material():
    source = Particles(
        {"position": np.zeros((1, 3)), "material": np.array([0])},
        {"materials": ["basalt"], "reference_densities_kg_m3": [3500.0]},
    )
    assert cloud_surface.solid_densities(source, ["ice", "basalt", "unknown"]) == [917.0, 3500.0, 0.0]


EXPANDED = 0.3
"""Of its reference density."""


def lined_bowl(upward: float, height: float = 0.0) -> tuple[Particles, np.ndarray]:
    """A bowl in ice at rest, and which of its particles line its floor: at ``EXPANDED`` of the density of ice, raised
    by ``height`` [m], moving up at ``upward`` [m/s]."""
    source = clouds.flat_source(1.7, clouds.ARC_FLAT, clouds.DEPTH, flows.hemisphere, np.zeros_like, density=917.0)
    x, y, z = source.position.T
    lining = (np.hypot(x, y) < 5.0) & (np.linalg.norm(source.position, axis=1) < clouds.CAVITY + 1.7) & (z < 0.0)
    share = np.where(lining, EXPANDED, 1.0)
    source["density"], source["mass"] = source.density * share, source.mass * share
    source["position"], source["velocity"] = source.position.copy(), source.velocity.copy()
    source["position"][lining, 2] += height
    source["velocity"][lining, 2] = upward
    assert np.count_nonzero(lining) > 15
    return source, lining


@pytest.mark.parametrize(
    ("upward", "height", "neighbours", "expected"),
    [
        (-11.0, 0.0, 33, cloud_surface.COMPACT),  # sinks with the floor
        (2.0, 0.0, 33, cloud_surface.EXPANDED),  # rises: a plume
        (-11.0, 20.0, 33, cloud_surface.EXPANDED),  # falls from above the ground: in flight
        (-11.0, 0.0, 3, cloud_surface.SPARSE),
        (2.0, 0.0, 3, cloud_surface.SPARSE),
    ],
)
def test_expanded_matter_is_ejecta_where_it_leaves_the_ground(upward, height, neighbours, expected):
    source, lining = lined_bowl(upward, height)
    source["neighbours"] = np.where(lining, neighbours, 33)
    region = domain.Upright("cylinder", clouds.ARC_FLAT, -clouds.DEPTH, 9.0)
    split = cloud_surface.by_motion(source, region, hydrostatic.uniform(1.0, 917.0, 20.0), cloud_surface.Rules())
    assert np.all(split.reason[lining] == expected)
    assert np.all(split.reason[~lining] == cloud_surface.COMPACT)


def test_expanded_matter_of_the_floor_is_counted_at_half_its_density(flat_bed, ground):
    """It fills no more room than that, no grain is made smaller than for it, mass and momentum are the source's."""
    source, lining = lined_bowl(-11.0)
    deep = np.linalg.norm(source.position, axis=1) - clouds.CAVITY
    source["velocity"][~lining, 2] = -8.0 * np.exp(-deep[~lining] / 6.0)
    handed = transfer.hand_over(source, flat_bed, cloud_surface.Rules(), ground)
    assert np.all(handed.split.compact[lining]) and len(handed.ejecta.mass) == 0
    ratio = handed.start.radius / flat_bed.radius[handed.carving.stays]
    assert ratio.min() == pytest.approx(cloud_surface.SPARSEST ** (1.0 / 3.0), rel=0.05)
    assert np.all(ratio >= cloud_surface.SPARSEST ** (1.0 / 3.0) * (1.0 - 1e-12))
    book = account.ledger_of(handed, source, flat_bed, ground, {})
    assert not book.failures
    inside = handed.compact.fraction * source.mass[handed.compact.indices]
    own = source.density[handed.compact.indices]
    counted, whole = (
        float(np.sum(inside / np.maximum(own, least * 917.0))) for least in (cloud_surface.SPARSEST, 0.0)
    )
    assert abs(handed.carving.volume.sum() - counted) < 0.3 * (whole - counted)
    assert abs(book["layer_volume_rel_ice"]["value"]) < 0.01


def test_mixed_units_are_told(bowl, bed):
    for name, factor in (("position", 1e-3), ("position", 100.0), ("density", 1e-3), ("mass", 1e3)):
        with pytest.raises(InputError, match="mixed units"):
            hand(changed(bowl, **{name: factor * bowl[name]}), bed)
    with pytest.raises(InputError, match=r"spheres take .* of the volume of its domain"):
        hand(bowl, changed(bed, radius=1e-3 * bed.radius))


def test_units_are_told_by_the_mass_and_not_by_the_finest_particles():
    """A body of 448 m whose particles are nine tenths within some metres of the impact."""
    rng = np.random.default_rng(1)
    body, near = rng.uniform(-360.0, 360.0, (200, 3)), rng.normal(0.0, 3.0, (1800, 3)) + [0.0, 0.0, 440.0]
    spacing = np.concatenate([np.full(200, 720.0 / 200 ** (1.0 / 3.0)), np.full(1800, 0.3)])
    source = Particles(
        {
            "position": np.concatenate([body, near]),
            "velocity": np.zeros((2000, 3)),
            "mass": 1227.0 * spacing**3,
            "density": np.full(2000, 1227.0),
            "material": np.zeros(2000),
        }
    )
    cloud_surface.check(source)
    with pytest.raises(InputError, match="mixed units"):
        cloud_surface.check(changed(source, density=1e-3 * source.density))


def test_any_field_that_is_not_finite_is_told(bowl, bed):
    pressure = np.zeros(len(bowl))
    pressure[11] = np.inf
    broken = Particles({**{name: bowl[name] for name in bowl}, "pressure": pressure}, bowl.attributes)
    with pytest.raises(InputError, match=r"'pressure' is not finite for 1 of .* particle 11"):
        hand(broken, bed)


def test_a_projectile_that_no_field_names_is_seen_by_its_fall(bowl, bed):
    velocity, position = np.zeros((len(bowl), 3)), bowl.position.copy()
    above = np.argsort(-bowl.position[:, 2])[:20]
    position[above, 2] += 30.0
    velocity[above, 2] = -100.0
    plain = Particles(
        {name: bowl[name] for name in bowl if name != "layer"} | {"position": position, "velocity": velocity},
        bowl.attributes,
    )
    with pytest.raises(InputError, match=r"100% of the kinetic energy falls .* still above the surface"):
        hand(plain, bed)
