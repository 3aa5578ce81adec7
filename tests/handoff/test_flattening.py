"""A body's ground laid flat for a bed that is a patch of it: places, velocities, and the frame that is left."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fixtures import grain_bodies
from handoff import stage as handing
from handoff.domains import domain
from handoff.source import cloud_surface, flattening
from handoff.transfer import bulking, ejecta
from matter.errors import InputError
from matter.geometry.rotation import rotation
from matter.particles import Particles
from matter.points import packing
from matter.solids.placed import PATCH

RADIUS = 448.0
OMEGA = 2.0 * math.pi / 3600.0
BOWL = {"shape": "bowl", "radius_m": 15.0, "floor_m": -15.0, "datum_m": 0.0, "top_m": 2.0}
FACTS = {"gravity_m_s2": 1.5e-4, "density_kg_m3": 1200.0, "depth_m": 15.0}
BALL = grain_bodies.target((2.0 * RADIUS,) * 3, 20.0, 130.0)
CELL = 2.0 * RADIUS / 112.0
"""Cell of the grid on which heights are known (``matter.solids.distance``)."""


def cloud() -> Particles:
    """Coarse particles of the ball, and fine ones round the site, at rest."""
    coarse = packing.hexagonal(60.0, RADIUS)
    coarse = coarse[np.linalg.norm(coarse, axis=1) < RADIUS]
    rng = np.random.default_rng(2)
    across = rng.uniform(-20.0, 20.0, (2000, 2))
    depth = rng.uniform(0.0, 10.0, 2000)
    direction = np.column_stack([across, np.full(2000, RADIUS)])
    fine = direction / np.linalg.norm(direction, axis=1)[:, None] * (RADIUS - depth)[:, None]
    place, n = np.concatenate([coarse, fine]), len(coarse) + 2000
    fields = {
        "identity": np.arange(n), "position": place, "velocity": np.zeros((n, 3)),
        "mass": np.concatenate([np.full(len(coarse), 2e8), np.full(2000, 500.0)]), "layer": np.zeros(n),
        "density": np.full(n, 1200.0), "gravity": np.full((n, 3), 1e-4),
    }  # fmt: skip
    return Particles(fields, {"frame": "solid", "time": 0.0, "stage": "sph"})


@pytest.fixture(scope="module")
def patch():
    return flattening.Patch(BALL, cloud(), FACTS)


def near(particles: Particles) -> Particles:
    """The fine particles, in the order of their identity."""
    return particles.select(particles.mass < 1e3)


@pytest.mark.validation
def test_ground_of_a_large_ball_keeps_its_place_but_for_what_its_curvature_makes(patch):
    """Heights rise by the fall of the ground below its tangent plane, s^2 / 2 R, and what lies |h| deep is wider apart
    by |h| / R."""
    flattened, true = near(patch.flattened(cloud())).position, near(cloud()).position
    s, h = np.hypot(flattened[:, 0], flattened[:, 1]), flattened[:, 2]
    # heights between the points of the grid, and of triangles instead of the ball
    off, grid = flattened - (true - [0.0, 0.0, RADIUS]), CELL**2 / (8.0 * RADIUS)
    assert (np.abs(off[:, 2]) < s**2 / (2.0 * RADIUS) + 4.0 * grid).all()
    assert off[s > 15.0, 2].mean() == pytest.approx((s[s > 15.0] ** 2).mean() / (2.0 * RADIUS), rel=0.15)
    # normals of the grid are off by half a cell over the radius
    assert (np.hypot(off[:, 0], off[:, 1]) < (s + 0.5 * CELL) * np.abs(h) / RADIUS + 0.05).all()
    # and the heights are those below the ball, to what the grid knows of it
    assert h == pytest.approx(np.linalg.norm(true, axis=1) - RADIUS, abs=4.0 * grid)


def test_what_flows_in_a_turning_body_has_its_energy_and_momentum_as_flat_ground(patch):
    """The body has turned by an eighth and drifts; particles near the site flow against it."""
    still = cloud()
    flow = np.zeros_like(still.velocity)
    fine = still.mass < 1e3
    flow[fine] = np.random.default_rng(4).normal(0.0, 0.2, (fine.sum(), 3)) + 0.5 * BALL.placed.normal
    axis = OMEGA * BALL.placed.spin_axis
    turn, drift = rotation(axis * 450.0), np.array([0.3, -0.1, 0.2])
    moved = Particles(dict(still.items()), {**still.attributes, "time": 450.0})
    moved["position"] = still.position @ turn.T + 450.0 * drift
    moved["velocity"] = (np.cross(axis, still.position) + flow) @ turn.T + drift
    flattened = near(patch.flattened(moved))
    mass = flattened.mass
    known = flow[fine]
    assert flattened.position == pytest.approx(near(patch.flattened(still)).position, abs=0.05)
    energy = 0.5 * mass @ np.sum(flattened.velocity**2, axis=1)
    assert energy == pytest.approx(0.5 * mass @ np.sum(known**2, axis=1), rel=1e-5)
    # verticals part by a / R = 20 m / 448 m across the ground
    up, normal = mass @ flattened.velocity[:, 2], mass @ (known @ BALL.placed.normal)
    assert up == pytest.approx(normal, rel=5e-3)
    assert np.linalg.norm(mass @ flattened.velocity[:, :2]) < 0.05 * normal
    assert np.sum(mass) == pytest.approx(still.mass[fine].sum(), rel=1e-12)


def test_it_is_flat_ground_from_there_on(patch):
    flattened = patch.flattened(cloud())
    assert flattened.attributes["frame"] == "plane" and "gravity" not in flattened
    assert patch.column.flat and patch.column.surface_gravity == 1.5e-4
    assert patch.column.pressure_at(np.array([-15.0]))[0] == pytest.approx(1200.0 * 1.5e-4 * 15.0)
    deep = near(flattened)
    # a volume at the height h stands on an area larger by (1 + h / R)^2
    assert deep.density == pytest.approx(1200.0 * (1.0 + deep.position[:, 2] / RADIUS) ** 2, rel=0.01)


def test_ground_at_rest_is_not_loosened_by_the_curvature_of_its_body(patch):
    """10 m deep a volume is 4 % smaller on the body than below flat ground."""
    known = {"materials": ["rubble"], "reference_densities_kg_m3": [1200.0]}
    still = cloud()
    still["material"] = np.zeros(len(still), dtype=np.int32)
    still.attributes = {**still.attributes, **known}
    flattened = near(patch.flattened(still))
    fraction = flattened.density / cloud_surface.reference_density(flattened)
    assert fraction == pytest.approx(1.0, abs=1e-12) and (bulking.radius_factor(fraction) == 1.0).all()
    assert flattened.density.min() < 0.97 * 1200.0  # as its volume is counted


def test_what_flies_high_above_a_body_is_as_large_as_it_is(patch):
    """200 m above the site the flat frame counts its volume as no more than two thirds of what it is."""
    high, n = cloud(), 50
    high["material"] = np.zeros(len(high), dtype=np.int32)
    high.attributes = {**high.attributes, "materials": ["rubble"], "reference_densities_kg_m3": [1200.0]}
    fine = np.flatnonzero(high.mass < 1e3)[:n]
    high["position"][fine] *= ((RADIUS + 200.0) / np.linalg.norm(high.position[fine], axis=1))[:, None]
    flattened = near(patch.flattened(high))
    up = np.flatnonzero(flattened.position[:, 2] > 100.0)
    assert len(up) == n and flattened.density[up].min() > 1.4 * 1200.0
    region = domain.read({"domain": BOWL, "frame": "plane"})
    bed = Particles({"position": np.array([[0.0, 0.0, -5.0]]), "mass": np.ones(1), "radius": np.ones(1)}, {})
    flying = ejecta.from_source(flattened, up, bed, 0.6, region, patch.column)
    known = np.cbrt(3.0 * 0.6 * 500.0 / (4.0 * np.pi * 1200.0))
    assert flying.density == pytest.approx(np.full(n, 1200.0)) and np.median(flying.radius) == pytest.approx(known)


def test_a_bed_that_is_a_patch_needs_its_body_and_ground_laid_flat():
    bed = Particles({"position": np.zeros((1, 3))}, {PATCH: FACTS, "frame": "plane"})
    with pytest.raises(InputError, match="must say which"):
        flattening.of_bed(bed, None, None)
    with pytest.raises(InputError, match="lacks 'depth_m'"):
        flattening.Patch(BALL, cloud(), {"gravity_m_s2": 1.5e-4, "density_kg_m3": 1200.0})
    bed.attributes["domain"] = BOWL
    with pytest.raises(InputError, match="lay the source flat"):
        handing.hand_over(cloud(), bed)
