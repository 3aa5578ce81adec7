"""Bowls of known size in a half space and on a sphere, twenty grains per cavity radius."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from fixtures import clouds
from handoff import ledger as ledgers
from handoff.domains import domain
from handoff.ledger import Ledger
from handoff.ledger_rows import account
from handoff.ledger_rows import cavity_rows as account_cavity
from handoff.source import cavity, cloud_surface, heights, hydrostatic
from handoff.transfer import compare_clouds, transfer

RADIUS, BOWL, RIM = 20.0, 9.0, 3.0


def bowl_in_a_plane(points):
    """A paraboloid with a rim that falls as the cube of the distance."""
    rho = np.hypot(points[:, 0], points[:, 1])
    return np.where(
        rho < RADIUS, -BOWL + (BOWL + RIM) * (rho / RADIUS) ** 2, RIM * (RADIUS / np.maximum(rho, 1e-9)) ** 3
    )


# particle spacing, and the error of the volume that it allows: a source this coarse rounds off the crest of the rim
@pytest.fixture(
    scope="module",
    params=[
        pytest.param((1.8, 0.02), id="fine source", marks=pytest.mark.validation),
        pytest.param((2.5, 0.06), id="coarse source"),
    ],
)
def in_a_plane(request):
    spacing, allowed = request.param
    bed = clouds.flat_bed(1.0, 29.0, 13.0, 5.0)
    source = clouds.flat_source(spacing, 29.0, 13.0, bowl_in_a_plane, lambda p: np.tile([0.0, 0.0, 1.0], (len(p), 1)))
    column = hydrostatic.uniform(1e3, 1000.0, 30.0)
    made = transfer.hand_over(source, bed, cloud_surface.Rules(), column)
    return made, account.ledger_of(made, source, bed, column, {}), allowed, bed


def test_bowl_in_a_plane(in_a_plane):
    made, ledger, allowed, _ = in_a_plane
    rho0 = RADIUS * np.sqrt(BOWL / (BOWL + RIM))  # where the bowl crosses the datum
    truth = np.pi * BOWL * rho0**2 / 2.0
    assert made.carving.size.depth == pytest.approx(BOWL, rel=0.05)
    assert made.carving.size.radius == pytest.approx(rho0, rel=0.05)
    assert made.carving.size.volume == pytest.approx(truth, rel=allowed)
    samples = made.carving.samples
    removed = (
        ~made.carving.stays[samples.grain]
        & (samples.position[:, 2] < 0.0)
        & (np.hypot(*samples.position[:, :2].T) < RADIUS)
    )
    assert samples.weight[removed].sum() * samples.volume == pytest.approx(truth, rel=allowed)
    assert ledger["cavity_volume_rel"]["value"] < 0.02
    assert ledger["cavity_hausdorff_over_r"]["value"] < 1.0
    assert ledger["mass_raw_rel"]["value"] < 3e-3
    assert made.carving.solid.mesh.is_watertight


def test_depth_and_rim_before_and_after(in_a_plane):
    """The rows hold for the bed as it was carved, not with a layer more on the floor, nor without its rim."""
    made, ledger, _, bed = in_a_plane
    x, y, z = bed.position.T
    away, above = np.hypot(x, y), z - bowl_in_a_plane(bed.position)
    filled = made.carving.stays | ((away < 0.5 * RADIUS) & (above < 2.0))
    flat = made.carving.stays & (z < 0.0)
    books = {}
    for name, stays in (("filled", filled), ("flat", flat)):
        books[name] = Ledger()
        account_cavity._heights(books[name], replace(made, carving=replace(made.carving, stays=stays)), 1.6, 1.0)
    rows = ("cavity_depth_rel", "cavity_rim_over_r")
    assert [ledger[name]["verdict"] for name in rows] == ["pass", "pass"]
    assert [books["filled"][name]["verdict"] for name in rows] == ["fail", "pass"]
    assert [books["flat"][name]["verdict"] for name in rows] == ["pass", "fail"]
    assert ledgers.height_scatter(2.0, 3.0) == pytest.approx(1.25 * 4.0 / 6.0)


def test_carved_bed_against_the_true_bowl(in_a_plane):
    made = in_a_plane[0]
    for vertices, limit in ((np.asarray(made.carving.solid.mesh.vertices), 1.5), (made.start.position, 1.5)):
        near = (np.hypot(vertices[:, 0], vertices[:, 1]) < 0.9 * RADIUS) & (vertices[:, 2] > -12.0)
        height = vertices[near, 2] - bowl_in_a_plane(vertices[near])
        assert height.max() < limit  # nothing stands further above the bowl


def test_a_floor_two_radii_too_high_is_too_far_from_the_source(in_a_plane):
    """A part of the surface that is large fails the partial distance; one grain too many does not."""
    made, _, _, bed = in_a_plane
    x, y, z = bed.position.T
    above = z - bowl_in_a_plane(bed.position)
    floor = (np.hypot(x, y) < 0.5 * RADIUS) & (above < 3.0)
    lone = np.zeros(len(bed), dtype=bool)
    lone[np.argmin(np.hypot(x, y) + np.abs(above - 1.0))] = True
    volume = np.where(
        made.carving.volume > 0.0, made.carving.volume, np.median(made.carving.volume[made.carving.stays])
    )
    verdicts = []
    for extra in (floor, lone):
        book, changed = Ledger(), replace(made.carving, stays=made.carving.stays | extra, volume=volume)
        account_cavity.enter(book, replace(made, carving=changed), bed, made.region)
        verdicts.append(book["cavity_hausdorff_over_r"]["verdict"])
    assert verdicts == ["fail", "pass"]


@pytest.mark.validation
def test_bowl_on_a_sphere():
    radius, depth, rim = 500e3, 180e3, 40e3
    sphere_cloud, sphere_bed = clouds.sphere_cloud(fine=70e3), clouds.sphere_bed(grain=30e3)
    source = clouds.sphere_source(sphere_cloud, radius, depth, rim, velocity=lambda p: np.zeros_like(p), curtain=40)
    column = hydrostatic.from_target(clouds.target_table(), clouds.R_BODY)
    made = transfer.hand_over(source, sphere_bed, cloud_surface.Rules(), column)
    ledger = account.ledger_of(made, source, sphere_bed, column, {})
    arc = radius * np.sqrt(depth / (depth + rim))
    angle = np.linspace(0.0, arc / clouds.R_BODY, 4001)
    floor = clouds.R_BODY - depth + (depth + rim) * (angle * clouds.R_BODY / radius) ** 2
    truth = np.trapezoid(2.0 * np.pi * np.sin(angle) * (clouds.R_BODY**3 - floor**3) / 3.0, angle)
    assert made.carving.size.depth == pytest.approx(depth, rel=0.08)
    assert made.carving.size.radius == pytest.approx(arc, rel=0.08)
    assert made.carving.size.volume == pytest.approx(truth, rel=0.12)  # a coarse source: 7 particles per radius
    assert ledger["cavity_volume_rel"]["value"] < 0.02  # fifteen grains per radius
    assert ledger["cavity_hausdorff_over_r"]["value"] < 1.0
    assert made.carving.solid.mesh.is_watertight
    # the curtain became ejecta, and the surface does not reach up to it
    assert len(made.ejecta.mass) >= 40
    assert np.linalg.norm(made.carving.solid.mesh.vertices, axis=1).max() < clouds.R_BODY + 2.5 * rim


@pytest.mark.parametrize(
    "region",
    [domain.Cone(1800e3, 2100e3, 2250e3, 0.7), domain.Upright("cylinder", 1500e3, -300e3, 150e3)],
    ids=["sphere", "plane"],
)
@pytest.mark.parametrize("shift", [0.0, 150e3, 300e3])
def test_a_cavity_off_the_axis_is_measured_about_its_own_centre(region, shift):
    """A paraboloid of radius 400 km and depth 150 km, its centre downrange of the impact point, in a rough level
    surface."""
    foot, _, _ = region.feet(4000)
    angle = shift / 2100e3
    centre = (
        2100e3 * np.array([np.sin(angle), 0.0, np.cos(angle)])
        if isinstance(region, domain.Cone)
        else np.array([shift, 0.0, 0.0])
    )
    along = region.polar(foot, centre)[0]
    height = np.minimum(0.0, -150e3 * (1.0 - (along / 400e3) ** 2)) + np.random.default_rng(1).normal(
        0.0, 5e3, len(foot)
    )
    found = cavity.measure(foot, height, region, 20e3)
    truth = np.pi * 400e3**2 * 150e3 / 2.0
    if isinstance(region, domain.Cone):
        angle, floor = (
            np.linspace(0.0, 400e3 / 2100e3, 2001),
            2100e3 - 150e3 * (1.0 - np.linspace(0.0, 1.0, 2001) ** 2),
        )
        truth = np.trapezoid(2.0 * np.pi * np.sin(angle) * (2100e3**3 - floor**3) / 3.0, angle)
    assert np.linalg.norm(found.centre - centre) < 8e3
    assert (
        found.radius == pytest.approx(400e3, rel=0.02)
        and found.depth == pytest.approx(150e3, rel=0.05)
        and found.volume == pytest.approx(truth, rel=0.01)
    )


def test_surface_heights_of_a_known_solid():
    region = domain.Cone(1.0, 2.0, 2.4, 0.5)
    foot, distance, height = heights.surface_heights(
        lambda p: np.linalg.norm(p, axis=1) < 1.8 + 0.3 * p[:, 0], region, 500
    )
    direction = foot / 2.0
    exact = 1.8 / (1.0 - 0.3 * direction[:, 0]) - 2.0
    np.testing.assert_allclose(height, exact, atol=0.002)
    np.testing.assert_allclose(distance, 2.0 * np.arccos(direction[:, 2]), atol=1e-12)
    assert np.mean(direction[:, 2]) == pytest.approx((1 + np.cos(0.5)) / 2, abs=1e-3)  # even over the cap


def test_finer_triangles_give_a_place_no_more_weight():
    """A step that takes 0.6 % of the area is beyond the 99 % that the row asks for, however finely it is cut."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0.0, 20.0, 81), np.linspace(0.0, 20.0, 81)))
    index = np.arange(6561).reshape(81, 81)
    a, b, c, d = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, :-1].ravel(), index[1:, 1:].ravel()
    faces = np.r_[np.c_[a, b, c], np.c_[b, d, c]]
    step = np.where((abs(x - 10.0) < 0.3) & (abs(y - 10.0) < 0.3), -1.0, 0.0)
    flat, stepped = (trimesh.Trimesh(np.c_[x, y, z], faces, process=False) for z in (0.0 * x, step))
    here = np.flatnonzero((abs(stepped.triangles_center[:, :2] - 10.0) < 0.6).all(axis=1))
    for _ in range(3):
        stepped = stepped.subdivide(here)
        here = np.flatnonzero((abs(stepped.triangles_center[:, :2] - 10.0) < 0.6).all(axis=1))
        distance, area, _, _ = compare_clouds.surface_distance(stepped, flat, lambda p: np.ones(len(p), dtype=bool))
        assert account_cavity.nearly_all(distance, area) < 0.1
        assert distance.max() == pytest.approx(1.0)
    assert np.quantile(distance, account_cavity.NEARLY_ALL) > 0.5
