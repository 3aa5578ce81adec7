"""Grains in free flight: those that meet collide, and what comes down on a wall's upper edge brings no energy in."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dem.beds import bed_walls
from dem.collapse import flight, flight_collisions
from dem.collapse.collapse_run import COLUMNS
from dem.contact.gravity import Field
from dem.contact.settings import Contact, GrainLaw
from dem.grains.assembly import ACTIVE, BALLISTIC, LEFT, REASONS, Assembly, Extras
from matter.geometry.ground_region import Cone, Upright
from tests.dem.scenes import grains

LAW = Contact(shell=GrainLaw(restitution=0.6, friction=0.4))


def flying(position, velocity, g=0.0, walls=(), dt=0.02, **fields) -> Assembly:
    """Ballistic grains under gravity ``g`` downwards."""
    start = grains(position, velocity=np.asarray(velocity, dtype=float), **fields)
    start["state"] = np.full(len(start), BALLISTIC)
    return Assembly(start, LAW, walls, Field.constant((0.0, 0.0, -g)), dt=dt)


def total(bed: Assembly) -> float:
    return sum(bed.energies().values()) + float(bed.report[:4].sum()) + float(bed.booked[:, 8].sum())


def test_two_that_meet_head_on_part_with_their_restitution():
    """Gap 0.3 m, closing at 3 m/s: they touch after 0.1 s, of which the look comes 0.1 s and more before; then they
    part at 1.8 m/s, mass 1 against 3."""
    bed = flying([[0, 0, 0], [2.3, 0, 0]], [[2.0, 0, 0], [-1.0, 0, 0]], g=0.5, mass=np.array([1.0, 3.0]))
    heavy = int(np.argmax(bed.mass))
    assert flight_collisions.collide(bed, 0.09) == 0
    assert flight_collisions.collide(bed, 0.2) == 1
    assert flight_collisions.collide(bed, 0.2) == 0  # they part now
    for _ in range(25):
        bed.step()
    # centre of mass: -0.25 m/s; relative 1.8 m/s in shares 3 : 1; 0.5 s of which 0.4 after the contact at x = 0.2, 2.2
    x, v = bed.X[heavy], bed.W[heavy]
    assert v[0] == pytest.approx(-0.25 + 0.45) and bed.W[1 - heavy, 0] == pytest.approx(-0.25 - 1.35)
    assert x[0] == pytest.approx(2.2 + 0.4 * 0.2) and bed.X[1 - heavy, 0] == pytest.approx(0.2 - 0.4 * 1.6)
    assert x[2] == pytest.approx(-0.5 * 0.5 * 0.5**2)
    assert bed.report[0] == pytest.approx(0.5 * 0.75 * 3.0**2 * (1.0 - 0.36))


def test_a_glancing_hit_slides_or_sticks():
    """Contact at once, closing at 1, slip 2 across, reduced mass 0.5: sliding gives mu 1.6 x 0.5 x 1 across, rough
    grains stick (2/7 of m u_t)."""
    for friction, expected in ((0.1, 0.1 * 1.6 * 0.5), (0.4, 2.0 / 7.0 * 0.5 * 2.0)):
        bed = flying([[0, 0, 0], [2.0 - 1e-12, 0, 0]], [[0.5, 1.0, 0], [-0.5, -1.0, 0]])
        bed.contact = Contact(shell=GrainLaw(restitution=0.6, friction=friction))
        assert flight_collisions.collide(bed, 0.1) == 1
        first = int(np.argmin(bed.X[:, 0]))
        assert bed.W[first, 1] == pytest.approx(1.0 - expected)
        assert bed.W[first, 5] == pytest.approx(-expected / 0.4) == pytest.approx(bed.W[1 - first, 5])


def test_a_crossing_cloud_keeps_its_sums_and_shares_no_places():
    """Three hundred grains that fly through one another: momentum, angular momentum and energy to rounding, and no two
    in one place."""
    rng = np.random.default_rng(1)
    n = 300
    x = np.stack(np.meshgrid(*[np.arange(7)] * 3), -1).reshape(-1, 3)[:n] * 1.5 - 4.5
    radius = rng.uniform(0.3, 0.6, n)
    speed = rng.normal(0.0, 0.3, (n, 3)) - 0.5 * np.sign(x[:, :1]) * [1.0, 0.0, 0.0]  # two halves through each other
    bed = flying(
        x,
        speed,
        g=0.01,
        dt=0.005,
        radius=radius,
        mass=rng.uniform(0.5, 2.0, n),
        angular_velocity=rng.normal(0.0, 0.3, (n, 3)),
    )
    energy, p, l = total(bed), bed.momentum(), bed.angular_momentum()
    hits, deepest = 0, 0.0
    for step in range(400):
        if step % flight.EVERY == 0:
            hits += flight_collisions.collide(bed, flight.EVERY * bed.dt)
        bed.step()
        pairs = cKDTree(bed.position).query_pairs(1.2, output_type="ndarray")
        gap = (
            np.linalg.norm(bed.position[pairs[:, 0]] - bed.position[pairs[:, 1]], axis=1)
            - bed.X[pairs[:, 0], 3]
            - bed.X[pairs[:, 1], 3]
        )
        deepest = max(deepest, float(-gap.min(initial=0.0)))
    assert hits > 150
    assert total(bed) == pytest.approx(energy, rel=1e-12) and bed.report[0] == bed.lost_in_flight > 0.2 * energy
    assert np.abs(bed.momentum() - bed.report[4:7] - p).max() < 1e-10
    assert np.abs(bed.angular_momentum() - bed.report[7:10] - l).max() < 1e-9
    assert deepest < 0.1  # what a second hit within one look leaves


@pytest.mark.parametrize("shape", ["cylinder", "bowl", "box"])
def test_a_grain_that_comes_down_on_the_upper_edge_of_a_wall_is_booked(shape):
    """Its centre half a radius inside: in the wall it would be by half a radius at once, with 1250 J. Another comes
    back into the search."""
    box = Upright(shape, 9.0, -9.0, 1.0)
    bed = flying([[8.5, 0, 6.0], [-7.0, 0, 6.0]], [[0, 0, -1.0], [0, 0, -1.0]], g=1.0, walls=bed_walls.walls(box))
    before = total(bed)
    for step in range(150):
        if step % flight.EVERY == 0:
            flight.look(bed, box)
        bed.step()
        assert total(bed) == pytest.approx(before, abs=1e-6)
    assert bed.booked[REASONS.index("landed_outside"), 0] == 1
    assert bed.state[bed.X[:, 0] > 0.0] == LEFT and bed.state[bed.X[:, 0] < 0.0] == ACTIVE


def test_the_side_of_a_cone_is_as_far_as_its_wall_says():
    cone = Cone(5.0, 9.0, 10.0, 0.3, 0.0, 0.0, 0)
    from dem.contact.walls import distance

    x = np.array([[1.0, 0.5, 8.0], [0.2, 0.0, 6.0]])
    row = bed_walls.walls(cone)[1].row()
    assert cone.side_depth(x) == pytest.approx([distance(row, *p)[0] for p in x])


def test_what_sinks_past_the_edge_of_a_wall_begins_unloaded():
    """In the contact search, as the outermost grain of a heap: springs with an offset begin at zero force there, and
    push when it goes on outwards."""
    box = Upright("cylinder", 9.0, -9.0, 1.0)
    start = grains([[8.5, 0, 1.5]], velocity=np.array([[0.0, 0, 0]]))
    bed = Assembly(
        start, LAW, bed_walls.walls(box), Field.constant((0.0, 0.0, -1.0)), dt=0.002, extras=Extras(offset=True)
    )
    before = total(bed)
    for _ in range(1000):
        bed.step()
        assert total(bed) == pytest.approx(before, abs=1e-3)
    assert bed.X[0, 2] == pytest.approx(-0.5, abs=0.01) and bed.X[0, 0] == pytest.approx(8.5, abs=1e-9)
    bed.W[0, 0] = 0.3
    before = total(bed)
    for _ in range(1000):
        bed.step()
    assert bed.X[0, 0] < 8.5 and total(bed) == pytest.approx(before, rel=1e-3)  # turned back by the wall


def test_the_stage_lets_what_flies_collide(tmp_path):
    """Two grains on their way to one place above a bed part as their restitution says, and stay apart by their
    radii."""
    from tests.dem.test_stiffening import collapse, settled

    bed = settled(tmp_path, radius_spread=0.0, arc_radius=9.0, count=220)[0]
    pair = np.argsort(np.where(bed.headroom == 0, bed.position[:, 2], -np.inf))[-2:]
    bed["position"][pair] = [[-3.0, 0.0, 30.0], [3.0, 0.0, 30.0]]
    bed["velocity"][pair] = [[2.0, 0.0, 2.0], [-2.0, 0.0, 2.0]]
    bed["state"] = np.zeros(len(bed), dtype=np.int8)
    bed["state"][pair] = BALLISTIC
    who = bed.identity[pair]
    made = collapse(bed, tmp_path, springs_for="bed", end_time=2.5, latest_time=2.5)
    made.advance()
    here = np.isin(made.bed.identity, who)
    closing = np.ptp(made.bed.W[here, 0])
    assert np.ptp(made.bed.X[here, 0]) > 2.0 * bed.radius[pair].min() and closing == pytest.approx(
        0.55 * 4.0, rel=1e-6
    )
    row = dict(zip(COLUMNS, made._row()))
    assert row["dissipated_flight_J"] == pytest.approx(0.25 * bed.mass[pair[0]] * 4.0**2 * (1.0 - 0.55**2), rel=1e-6)
    assert abs(row["energy_error"]) < 0.01
