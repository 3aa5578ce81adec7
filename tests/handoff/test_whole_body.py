"""A handoff onto a whole body: its surface as the datum, a turning body with a hollow and a known flow, what becomes
of ejecta by two-body flight, what the files hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from scipy.integrate import solve_ivp
from scipy.spatial import cKDTree

from fixtures import clouds
from fixtures import solids as solids_of
from handoff import stage
from handoff.domains import domain, turning, whole_body
from handoff.ledger import Ledger
from handoff.ledger_rows import whole_body_rows as whole_rows
from handoff.source import cloud_surface, hydrostatic, two_body
from handoff.transfer import control, correction, transfer
from matter.case.body import Target
from matter.constants import G
from matter.errors import InputError
from matter.geometry.frame import Sphere
from matter.geometry.rotation import rotation
from matter.particles import Particles
from matter.solids import solid as solids
from matter.solids.body_datum import Datum

AXES, PERIOD, DENSITY, TIME = (160.0, 140.0, 100.0), 5.0 * 3600.0, 2000.0, 40.0
SPACING, GRAIN = 7.0, 5.0
HOLLOW, DEEP = 36.0, 14.0
"""Radius at the datum and depth of the hollow [m]."""


def target(**changes) -> Target:
    given = {
        "shape": "ellipsoid", "axes": list(AXES), "spin_period": PERIOD, "latitude": 0.3, "longitude": 2.0,
        "layers": [{"name": "body", "material": "ice"}],
    }  # fmt: skip
    return Target.model_validate(given | changes)


BODY = target()
OMEGA = 2.0 * math.pi / PERIOD * BODY.placed.spin_axis
DATUM = Datum(BODY.placed.solid)


def bed(count: int = 1500, seed: int = 3) -> Particles:
    """Grains packed into the body, moving with its rotation."""
    vertices = BODY.placed.solid.vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    radius = float(np.cbrt(0.6 * BODY.placed.solid.volume / count * 0.75 / math.pi))

    def sample(rng, n):
        points = np.empty((0, 3))
        while len(points) < n:
            trial = low + (high - low) * rng.random((4 * n, 3))
            points = np.concatenate([points, trial[DATUM.height(trial) < -radius]])
        return points[:n]

    def clip(points, radii):
        height, up = DATUM.height(points), DATUM.up(points)
        return points - np.maximum(height + 0.7 * radii, 0.0)[:, None] * up

    points, radii = clouds.packed(count, radius, sample, clip, seed)
    made = clouds.bed_of(points, radii, "plane", {"datum_m": 1e9}, 0.6, DENSITY)
    made.attributes |= {
        "frame": "solid",
        "mean_radius_m": radius,
        "domain": {"shape": "whole", "radius_m": DATUM.radius, "angular_velocity_1_s": OMEGA.tolist()},
    }
    made.tables = {name: table for name, table in made.tables.items() if "wall" not in name}
    made["velocity"] = np.cross(OMEGA, points)
    return made


def column() -> hydrostatic.Column:
    mass = DENSITY * BODY.placed.solid.volume
    return hydrostatic.from_target(
        {
            "frame": "solid", "mass_kg": mass, "volume_m3": BODY.placed.solid.volume,
            "surface_gravity_m_s2": G * mass / DATUM.radius**2,
        },
        DATUM.radius,
    )  # fmt: skip


def hollow(points: np.ndarray) -> np.ndarray:
    """Height of the ground (n,) [m] above the datum: a paraboloid about the site."""
    return np.where(
        DATUM.distance(points) < HOLLOW, -DEEP * (1.0 - (DATUM.distance(points) / HOLLOW) ** 2), 0.0
    )  # fmt: skip


def flow(points: np.ndarray) -> np.ndarray:
    """Motion (n, 3) [m/s] against the ground, along the axes of the bed: away from the site, dying off with distance,
    and of the whole body."""
    away = points - (DATUM.site - 30.0 * DATUM.normal)
    r = np.linalg.norm(away, axis=1)
    return 0.4 * np.exp(-((r / 45.0) ** 2))[:, None] * away / 45.0 + np.array([0.01, -0.005, -0.03])


def source(dug: bool = True, moving: bool = True, thrown: Particles | None = None) -> Particles:
    """The body as particles in the inertial frame at TIME; ``thrown`` ones besides (along the axes of the bed)."""
    rng = np.random.default_rng(1)
    points = clouds.lattice((90.0, 90.0, 90.0), SPACING)
    points = points + rng.normal(0.0, 0.1 * SPACING, points.shape)
    points = points[DATUM.height(points) < (hollow(points) if dug else 0.0)]
    velocity = np.cross(OMEGA, points) + (flow(points) if moving else 0.0)
    made = clouds.source_of(points, np.full(len(points), SPACING**3), velocity, DENSITY, time=TIME, frame="solid")
    if thrown is not None:
        made = Particles(
            {name: np.concatenate([made[name], thrown[name]]) for name in made}, made.attributes
        )  # fmt: skip
    made["identity"] = np.arange(len(made))
    turn = rotation(OMEGA * TIME)
    made["position"], made["velocity"] = made.position @ turn.T, made.velocity @ turn.T
    return made


@pytest.fixture(scope="module")
def grains():
    return bed()


@pytest.fixture(scope="module")
def handed(grains):
    """Source and start in the inertial frame, the ledger, and what the transfer made, of a body with a hollow and a
    flow. First places are those of the moment of the impact, when bed and run share their axes: matter has only turned
    since."""
    cloud, made, hand_over = source(), [], transfer.hand_over
    cloud["initial_position"] = cloud.position @ rotation(OMEGA * TIME)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(transfer, "hand_over", lambda *given: made.append(hand_over(*given)) or made[-1])
        start, ledger = stage.hand_over(
            cloud, grains, cloud_surface.Rules(speed_limit=5.0), column(), target=BODY, until=2.0 * 3600.0
        )
    return cloud, start, ledger, made[0]


@pytest.mark.validation
def test_mass_momentum_and_angular_momentum_of_the_whole_are_kept(handed):
    cloud, start, ledger, _ = handed
    before = correction.sums(cloud.mass, cloud.position, cloud.velocity)
    after = correction.sums(start.mass, start.position, start.velocity, start.radius, start.angular_velocity)
    assert after.mass == pytest.approx(before.mass, rel=1e-13)
    flowing = cloud.velocity - np.cross(OMEGA, cloud.position)
    scale = float(cloud.mass @ np.linalg.norm(flowing, axis=1))
    assert np.linalg.norm(after.momentum - before.momentum) < 1e-12 * scale
    assert np.linalg.norm(after.angular - before.angular) < 1e-12 * scale * DATUM.radius
    for name in ("whole_mass_rel", "whole_momentum_rel", "whole_angular_momentum_rel"):
        assert ledger[name]["verdict"] == "pass" and "grains kept" in ledger[name]["note"]
    # averaged over grains a flow loses energy, and never gains any
    assert -0.02 < ledger["whole_kinetic_energy_rel"]["value"] < 1e-3
    assert ledger["mass_outside_domain"]["value"] == 0.0
    for name in (
        "mass_raw_rel", "momentum_linear_raw_rel", "momentum_angular_raw_rel", "velocity_field_L2",
        "velocity_direction_deg_mean", "kinetic_energy_compact_change", "cavity_hausdorff_over_r",
    ):  # fmt: skip
        assert ledger[name]["verdict"] == "pass", ledger[name]


@pytest.mark.validation
def test_grains_take_over_the_flow_where_they_are_in_the_turned_body(handed, grains):
    _, start, _, _ = handed
    order = np.argsort(grains.identity)
    rows = order[np.searchsorted(grains.identity, start.identity, sorter=order)]
    turn = rotation(OMEGA * TIME)
    assert start.position == pytest.approx(grains.position[rows] @ turn.T, abs=1e-9)
    wanted = (np.cross(OMEGA, grains.position[rows]) + flow(grains.position[rows])) @ turn.T
    deep = DATUM.height(grains.position[rows]) < -2.0 * GRAIN
    off = np.linalg.norm(start.velocity - wanted, axis=1)[deep]
    moving = np.linalg.norm(flow(grains.position[rows]), axis=1)[deep]
    assert np.sqrt(np.mean(off**2)) < 0.06 * np.sqrt(np.mean(moving**2))
    assert start.attributes["time"] == TIME


@pytest.mark.validation
def test_grains_know_the_first_depth_of_their_matter_in_the_body_as_it_was_then(handed):
    """Of matter that has only turned since, first depth and distance are those of the grain in the bed."""
    _, start, ledger, _ = handed
    place = start.position @ rotation(OMEGA * TIME)
    deep = DATUM.height(place) < -2.0 * GRAIN
    assert np.sqrt(np.mean((start.first_depth + DATUM.height(place))[deep] ** 2)) < 0.3 * SPACING
    assert np.median(np.abs(start.first_distance - DATUM.distance(place))[deep]) < 0.3 * SPACING
    assert abs(ledger["origin_first_depth_rel"]["value"]) < 0.02


@pytest.mark.validation
def test_the_springs_of_contacts_are_turned_with_the_body(handed, grains):
    _, start, _, _ = handed
    turn = rotation(OMEGA * TIME)
    pair, history = start.tables["contacts/pair"], start.tables["contacts/history"]
    known = {tuple(p): h for p, h in zip(grains.tables["contacts/pair"], grains.tables["contacts/history"])}
    wanted = np.array([known[tuple(p)] for p in pair])
    for columns in (slice(0, 3), slice(3, 6)):
        assert history[:, columns] == pytest.approx(wanted[:, columns] @ turn.T, abs=1e-12)
    assert np.array_equal(history[:, 6:], wanted[:, 6:])


@pytest.mark.validation
def test_the_hollow_is_carved_where_it_is(handed, grains):
    _, start, ledger, _ = handed
    back = start.position @ rotation(OMEGA * TIME)
    above = DATUM.height(back) - hollow(back)
    assert above.max() < 1.0 * GRAIN  # no grain's centre stands further out of the hollow
    gone = np.setdiff1d(grains.identity, start.identity)
    place = grains.position[np.isin(grains.identity, gone)]
    assert (DATUM.distance(place) < HOLLOW + GRAIN).all()
    assert ledger["cavity_radius"]["value"] == pytest.approx(HOLLOW, rel=0.08)
    assert ledger["cavity_depth"]["value"] == pytest.approx(DEEP, rel=0.15)
    assert ledger["cavity_off_axis"]["value"] < GRAIN


@pytest.mark.validation
def test_a_body_that_nothing_hit_goes_on_turning(grains):
    cloud = source(dug=False, moving=False)
    start, ledger = stage.hand_over(cloud, grains, cloud_surface.Rules(crater="any"), column(), target=BODY)
    assert len(start) == len(grains) and (start.state == 0).all()
    extra = start.velocity - np.cross(OMEGA, start.position)
    # particles and grains are centred and spread a little otherwise, so the same momenta are another rigid motion
    basis = [np.tile(axis, (len(start), 1)) for axis in np.eye(3)] + [
        np.cross(axis, start.position) for axis in np.eye(3)
    ]
    motions = np.array([motion.ravel() for motion in basis]).T
    rest = extra.ravel() - motions @ np.linalg.lstsq(motions, extra.ravel(), rcond=None)[0]
    ground = np.linalg.norm(OMEGA) * DATUM.radius
    assert np.abs(rest).max() < 1e-9 * ground and np.abs(extra).max() < 0.01 * ground
    assert np.abs(start.angular_velocity - OMEGA).max() < 1e-9 * np.linalg.norm(OMEGA)
    assert ledger["whole_momentum_rel"]["verdict"] == "pass"


@pytest.mark.validation
def test_a_control_run_begins_at_rest_on_the_turning_body(handed, grains):
    made = handed[-1]
    for kind in ("at_rest", "uncarved"):
        begun = control.start(kind, made, grains)
        assert begun.velocity == pytest.approx(np.cross(OMEGA, begun.position), abs=1e-15)
        assert begun.angular_velocity == pytest.approx(np.tile(OMEGA, (len(begun), 1)), abs=1e-18)
    assert len(begun) == len(grains)
    depth = control.depth_below_surface(begun)
    # from the outermost grains, whose centres lie most of a radius inside
    assert np.abs(depth + DATUM.height(begun.position) + 0.8 * GRAIN).mean() < 0.5 * GRAIN


@pytest.mark.validation
def test_what_flies_is_a_grain_only_where_it_comes_back_in_time(grains):
    site, up = DATUM.site + 10.0 * DATUM.normal, DATUM.normal
    place = site + np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 9.0], [-20.0, 0.0, 9.0], [0.0, 25.0, 12.0]])
    mu = G * DENSITY * BODY.placed.solid.volume
    escape = np.sqrt(2.0 * mu / np.linalg.norm(place, axis=1))[:, None]
    velocity = np.array([[0.5], [0.97], [1.1], [500.0]]) * escape * up
    thrown = clouds.source_of(place, np.full(4, SPACING**3), velocity, DENSITY)
    cloud = source(dug=False, moving=False, thrown=thrown)
    region = domain.read(grains.attributes, BODY)
    made = transfer.hand_over(
        turning.to_bed(cloud, region), grains, cloud_surface.Rules(crater="any"), column(), region, 2.0 * 3600.0
    )
    fates = made.ejecta.fate[np.searchsorted(made.ejecta.source, np.arange(len(cloud) - 4, len(cloud)))]
    names = [two_body.FATES[code] for code in fates]
    assert names == ["returns", "later", "escapes", "escapes"]
    listed = made.ejecta.fate != two_body.RETURNS
    assert ((made.ejecta.state == 2) == listed).all()
    book = Ledger()
    whole_rows.enter(book, made, cloud, turning.to_run(made.start, region))
    for name in ("whole_mass_rel", "whole_momentum_rel", "whole_angular_momentum_rel"):
        assert book[name]["verdict"] == "pass"
    assert abs(book["whole_kinetic_energy_rel"]["value"]) < 1e-5  # nearly all of it flies


def test_fates_are_those_of_orbits_followed_in_time():
    rng = np.random.default_rng(8)
    mu, surface_at, within = 5.0, 10.0, 80.0
    place = rng.normal(size=(60, 3))
    place *= (rng.uniform(10.5, 16.0, 60) / np.linalg.norm(place, axis=1))[:, None]
    velocity = rng.normal(size=(60, 3)) * 0.55
    found = two_body.fate(mu, place, velocity, np.full(60, surface_at), within)

    def pull(_, y):
        return np.r_[y[3:], -mu * y[:3] / np.linalg.norm(y[:3]) ** 3]

    def low(_, y):
        return np.linalg.norm(y[:3]) - surface_at

    low.terminal = True
    for k in range(60):
        energy = 0.5 * velocity[k] @ velocity[k] - mu / np.linalg.norm(place[k])
        span = within if energy >= 0.0 else 3.0 * 2.0 * math.pi * math.sqrt((-0.5 * mu / energy) ** 3 / mu)
        end = solve_ivp(pull, (0.0, max(span, within)), np.r_[place[k], velocity[k]], events=low, rtol=1e-9, atol=1e-9)
        down = float(end.t_events[0][0]) if len(end.t_events[0]) else math.inf
        if energy >= 0.0:
            wanted = "returns" if velocity[k] @ place[k] < 0.0 else "escapes"
        else:
            wanted = "returns" if down <= within else "later" if math.isfinite(down) else "orbits"
        assert two_body.FATES[found[k]] == wanted, (k, down)
    assert set(found) == {0, 1, 2, 3}  # every kind was there
    back = two_body.time_back(mu, place, velocity, np.full(60, surface_at))
    assert np.isfinite(back[found == two_body.RETURNS]).sum() > 5


@pytest.mark.validation
def test_a_round_solid_has_the_frame_of_a_sphere():
    datum, ball = Datum(solids.ellipsoid((100.0, 100.0, 100.0))), Sphere(50.0)
    rng = np.random.default_rng(2)
    place = rng.normal(size=(500, 3))
    place *= (rng.uniform(25.0, 400.0, 500) / np.linalg.norm(place, axis=1))[:, None]
    assert datum.height(place) == pytest.approx(ball.height(place), abs=0.05)
    assert np.einsum("ij,ij->i", datum.up(place), ball.up(place)).min() > 0.999
    assert datum.distance(place) == pytest.approx(ball.distance(place), abs=1.0)
    apart = np.angle(np.exp(1j * (datum.azimuth(place) - ball.azimuth(place))))
    near = ball.distance(place) < 120.0
    assert np.abs(apart[near]).max() < 0.05


def in_box(p):
    return np.all(np.abs(p) < [45.0, 30.0, 25.0], axis=1)


def in_dumbbell(p):
    across, up = np.hypot(p[:, 0], p[:, 1]), np.abs(p[:, 2])
    return (np.hypot(across, up - 45.0) < 40.0) | ((across < 20.0) & (up < 45.0))


@pytest.mark.parametrize(
    ("known", "within"),
    [(solids_of.box((90.0, 60.0, 50.0)), in_box), (solids_of.dumbbell(40.0, 90.0, 20.0, 120, 90), in_dumbbell)],
)
def test_heights_and_feet_of_a_body_with_edges_or_a_neck(known, within):
    body = solids.checked(known.vertices, known.triangles, 1.0, "body")
    datum = Datum(body)
    rng = np.random.default_rng(4)
    place = rng.uniform(-1.0, 1.0, (300, 3)) * 1.6 * body.extent
    corners = body.vertices[body.triangles]
    foot = np.empty_like(place)
    for k, point in enumerate(place):
        every = trimesh.triangles.closest_point(corners, np.tile(point, (len(corners), 1)))
        foot[k] = every[np.argmin(np.linalg.norm(every - point, axis=1))]
    distance = np.linalg.norm(place - foot, axis=1)
    wanted = np.where(within(place), -distance, distance)
    cell = datum.depths.cell
    assert datum.height(place) == pytest.approx(wanted, abs=0.5 * cell)
    # where one point of the surface is nearest by far, away from edges and from the middle
    near = np.abs(wanted) < 0.15 * body.extent
    assert np.median(np.linalg.norm(datum.foot(place) - foot, axis=1)[near]) < 0.5 * cell
    assert np.abs(datum.height(datum.foot(place))[near]).max() < cell


def test_columns_and_samples_cover_the_body_evenly(grains):
    region = domain.read(grains.attributes, BODY)
    whole = region.shape.solid
    points = region.even_points(np.random.default_rng(0).random((60_000, 3)))
    inside = region.frame.height(points) < 0.0
    assert inside.mean() * region.volume == pytest.approx(whole.volume, rel=0.01)
    corner = whole.vertices[whole.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum()
    assert region.area == pytest.approx(area, rel=1e-6)
    part = region.part(20.0)
    foot, along, up = part.feet(2000)
    assert along.max() <= 20.0 and len(foot) == 2000 and np.abs(DATUM.height(foot)).max() < 0.1
    assert part.area == pytest.approx(math.pi * 20.0**2, rel=0.05)  # hardly curved
    assert (up @ DATUM.normal).min() > 0.8
    spacing = cKDTree(foot).query(foot, k=2)[0][:, 1]
    assert spacing.mean() == pytest.approx(0.5 * math.sqrt(part.area / 2000), rel=0.25)


def test_another_body_and_a_missing_one_are_refused(grains):
    with pytest.raises(InputError, match="must say which"):
        domain.read(grains.attributes, None)
    with pytest.raises(InputError, match="they are two"):
        domain.read(grains.attributes, target(axes=[100.0, 100.0, 100.0]))
    lacking = {name: value for name, value in grains.attributes.items() if name != "mean_radius_m"}
    with pytest.raises(InputError, match="mean_radius_m"):
        domain.read(lacking, BODY)


def test_the_surface_is_read_back_from_its_file(grains, tmp_path):
    region = domain.read(grains.attributes, BODY)
    solids.surface_of(region.shape.solid).export(str(tmp_path / "datum.ply"), file_type="ply")
    again = whole_body.of_file(grains.attributes, tmp_path / "datum.ply")
    assert again.shape.height(grains.position) == pytest.approx(region.shape.height(grains.position), abs=0.02)
