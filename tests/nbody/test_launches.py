"""Ejecta followed from the ground of a body: against Kepler's arcs, past Jupiter and its moons, and from a file."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from matter.errors import InputError
from matter.files import archive
from nbody import launches as thrown
from nbody.launches import Launches, Site
from nbody.masses.ephemeris import Orbits
from nbody.masses.system import Body, load

DAY = 86400.0
RYUGU, CALLISTO = load("ryugu"), load("callisto")


def launched(body, speed, angle, azimuth=None, arc=None, time=None) -> Launches:
    """Launches from a body at ``speed`` [m/s] and ``angle`` [rad] above the horizontal towards ``azimuth`` [rad, 0 is
    +x], from the impact point or an ``arc`` [rad] from it towards +x."""
    speed, angle = np.atleast_1d(speed).astype(float), np.atleast_1d(angle).astype(float)
    n = max(len(speed), len(angle))
    speed, angle = np.broadcast_to(speed, n), np.broadcast_to(angle, n)
    azimuth = np.zeros(n) if azimuth is None else np.broadcast_to(azimuth, n)
    arc, time = np.zeros(n) if arc is None else np.asarray(arc), np.zeros(n) if time is None else np.asarray(time)
    nil = np.zeros(n)
    up = np.column_stack([np.sin(arc), nil, np.cos(arc)])
    level = np.column_stack([np.cos(arc), nil, -np.sin(arc)])
    side = np.cos(azimuth)[:, None] * level + np.sin(azimuth)[:, None] * np.array([0.0, 1.0, 0.0])
    v = speed[:, None] * (np.sin(angle)[:, None] * up + np.cos(angle)[:, None] * side)
    return Launches(np.arange(n), body.radius * up, time, v, np.ones(n), np.zeros(n, int), body.radius, body.gm)


def kepler(body, speed, angle) -> tuple[np.ndarray, np.ndarray]:
    """Angle about the centre [rad] and time [s] from launch to landing of an elliptic arc.

    tan(phi / 2) = L sin a cos a / (1 - L cos^2 a), L = v^2 R / GM; the time is the period less twice that from
    periapsis to the launch, Kepler's equation at the eccentric anomaly E, cos E = (1 - R / A) / e.
    """
    L = speed**2 * body.radius / body.gm
    turn = 2.0 * np.arctan2(L * np.sin(angle) * np.cos(angle), 1.0 - L * np.cos(angle) ** 2)
    A = body.radius / (2.0 - L)
    e = np.sqrt(1.0 - L * (2.0 - L) * np.cos(angle) ** 2)
    E = np.arccos((1.0 - body.radius / A) / e)
    return turn, 2.0 * np.sqrt(A**3 / body.gm) * (math.pi - E + e * np.sin(E))


def landed(fates, body) -> np.ndarray:
    """Angle about the centre [rad] from the impact point to where each fell."""
    return np.arctan2(np.hypot(fates.position[:, 0], fates.position[:, 1]), fates.position[:, 2])


@pytest.mark.parametrize(
    "body", [pytest.param(RYUGU, marks=pytest.mark.validation), CALLISTO], ids=["Ryugu", "Callisto"]
)
def test_a_throw_returns_where_two_body_mechanics_says(body):
    escape = math.sqrt(2.0 * body.gm / body.radius)
    share, angle = np.meshgrid([0.02, 0.3, 0.6, 0.8, 0.95], np.radians([20.0, 45.0, 75.0]))
    speed, angle, azimuth = escape * share.ravel(), angle.ravel(), np.linspace(0.0, 6.0, 15)
    throws = launched(body, speed, angle, azimuth)
    fates = thrown.fly(throws, thrown.field_of_body(throws), 300.0 * DAY)
    turn, time = kepler(body, speed, angle)
    assert {fates.names[k] for k in fates.fate} == {"falls back"}
    np.testing.assert_allclose(fates.time, time, rtol=1e-8)
    expected = body.radius * np.column_stack(
        [np.sin(turn) * np.cos(azimuth), np.sin(turn) * np.sin(azimuth), np.cos(turn)]
    )
    np.testing.assert_allclose(fates.position, expected, atol=1e-7 * body.radius)
    np.testing.assert_allclose(fates.speed, speed, rtol=1e-8)  # as fast as it left


def test_no_step_jumps_over_a_body_that_hardly_pulls():
    """A moon without weight, which no error control notices, in the way of throws that cross it 1 to 50 km deep."""
    far, size = 1e8, 1e5
    still = np.zeros((1, 2, 3, 6))
    still[0, 0, 0, 0], still[0, 1, 2, 0] = 1e12, far
    orbits = Orbits(still, 1e30, np.array([0.0, 1e3, 1e-9]), 0.0)
    field = thrown.FlightField(orbits, ("stone", "moon"), np.array([100.0, size]), 0, None, 1e9, np.eye(3))
    stone = Body("stone", "stone", 1e3, 100.0)
    off = size - np.array([-1e3, 1e3, 1e4, 5e4])
    throws = launched(stone, 5e3, 0.5 * math.pi - np.arctan(off / far))
    fates = thrown.fly(throws, field, 10.0 * DAY)
    assert [fates.names[k] for k in fates.fate] == ["leaves", "hits moon", "hits moon", "hits moon"]
    deep = np.sqrt(size**2 - off[1:] ** 2)  # half the chord
    np.testing.assert_allclose(fates.time[1:], (np.hypot(far, off[1:]) - deep) / 5e3, rtol=1e-4)


def test_what_is_faster_than_escape_leaves_and_a_grazing_throw_falls_at_once():
    escape = math.sqrt(2.0 * RYUGU.gm / RYUGU.radius)
    throws = launched(RYUGU, [0.999 * escape, 1.001 * escape, 0.1], [1.0, 1.0, 0.0])
    fates = thrown.fly(throws, thrown.field_of_body(throws), 100.0 * DAY)
    assert [fates.names[k] for k in fates.fate] == ["still flies", "leaves", "falls back"]
    assert fates.time[2] == 0.0 and np.isnan(fates.position[:2]).all()


def test_under_the_sun_a_slow_throw_from_ryugu_keeps_its_arc():
    """The Sun's tide at the Hill sphere's edge is as strong as Ryugu; on an arc of 200 m it is 1e-6 of it."""
    throws = launched(RYUGU, 0.2, np.radians(60.0), time=[4000.0])
    field = thrown.field_with_companions(throws, RYUGU, Site(0.4, 1.0), 30.0 * DAY, 3)
    assert field.paths.energy_error < 1e-9
    fates = thrown.fly(throws, field, 30.0 * DAY)
    turn, time = kepler(RYUGU, 0.2, np.radians(60.0))
    assert fates.names[fates.fate[0]] == "falls back"
    assert landed(fates, RYUGU)[0] == pytest.approx(turn, rel=1e-4)
    assert fates.time[0] - 4000.0 == pytest.approx(time, rel=1e-4)


def test_from_callisto_by_jupiter_a_throw_lands_within_the_tide_of_its_arc():
    """Jupiter's tide over an arc of height h is 3 GM_J r / (a^3 g) of Callisto's pull: 1.5e-4 at its surface."""
    speed, angle = np.array([300.0, 900.0]), np.radians([45.0, 60.0])
    throws = launched(CALLISTO, speed, angle)
    field = thrown.field_with_companions(throws, CALLISTO, Site(0.3, -1.2, 0.5), 20.0 * DAY, 5)
    assert field.names == ("Jupiter", "Io", "Europa", "Ganymede", "Callisto") and field.home == 4
    fates = thrown.fly(throws, field, 20.0 * DAY)
    turn, time = kepler(CALLISTO, speed, angle)
    jupiter = load("jupiter")
    tide = 3.0 * jupiter.gm * CALLISTO.radius**3 / (CALLISTO.semi_major_axis**3 * CALLISTO.gm)
    assert tide < 2e-4
    np.testing.assert_allclose(landed(fates, CALLISTO), turn, rtol=5.0 * tide)
    np.testing.assert_allclose(fates.time, time, rtol=5.0 * tide)
    assert not np.allclose(landed(fates, CALLISTO), turn, rtol=1e-7)  # and it is felt


def test_the_frame_of_the_run_lies_on_the_moon_as_the_site_says():
    throws = launched(CALLISTO, 100.0, 1.0)
    east = thrown.field_with_companions(throws, CALLISTO, Site(0.0, -0.5 * math.pi, 0.5 * math.pi), DAY, 1)
    planet, moon = (east.paths.state(k, 0.0) for k in (1, 5))
    away, motion = moon[0] - planet[0], moon[1] - planet[1]
    # 90 deg west of the sub-planet meridian: the leading side; +x to the east there: towards the planet
    assert east.axes[2] @ motion / np.linalg.norm(motion) == pytest.approx(1.0, abs=1e-12)
    assert east.axes[0] @ away / np.linalg.norm(away) == pytest.approx(-1.0, abs=1e-12)
    north = thrown.field_with_companions(throws, CALLISTO, Site(math.radians(30.0), 1.0, 0.0), DAY, 1)
    assert north.axes[2][2] == pytest.approx(0.5) and north.axes[0][2] == pytest.approx(math.cos(math.radians(30.0)))
    np.testing.assert_allclose(north.axes @ north.axes.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(north.axes) == pytest.approx(1.0)


def test_escapes_from_callisto_hit_jupiter_or_go_on_round_it():
    """Thrown back along its orbit with nearly all of its orbital speed, matter falls into Jupiter in half the period
    of the ellipse that just grazes it; thrown forward it stays outside Callisto's orbit or leaves Jupiter for good."""
    jupiter = load("jupiter")
    a = CALLISTO.semi_major_axis
    round_speed = math.sqrt((jupiter.gm + CALLISTO.gm) / a)
    own = 2.0 * CALLISTO.gm / CALLISTO.radius
    back = math.hypot(0.95 * round_speed, math.sqrt(own))
    gone = math.hypot(0.55 * round_speed, math.sqrt(own))
    kept = math.hypot(0.1 * round_speed, math.sqrt(own))
    throws = launched(CALLISTO, [back, gone, kept], 0.5 * math.pi)
    trailing, leading = (Site(0.0, sign * 0.5 * math.pi) for sign in (1.0, -1.0))
    falls = thrown.fly(throws, thrown.field_with_companions(throws, CALLISTO, trailing, 60.0 * DAY, 2), 60.0 * DAY)
    assert falls.names[falls.fate[0]] == "hits Jupiter"
    period = 2.0 * math.pi * math.sqrt((0.5 * a) ** 3 / jupiter.gm)
    assert falls.time[0] == pytest.approx(0.5 * period, rel=0.05)
    assert falls.speed[0] == pytest.approx(math.sqrt(2.0 * jupiter.gm / jupiter.radius), rel=0.03)
    leaves = thrown.fly(throws, thrown.field_with_companions(throws, CALLISTO, leading, 400.0 * DAY, 2), 400.0 * DAY)
    assert leaves.names[leaves.fate[1]] == "leaves" and np.isnan(leaves.position[1]).all()
    assert leaves.names[leaves.fate[2]] != "leaves"


def test_a_throw_from_callisto_at_ganymede_hits_it():
    """Aimed by two-body mechanics at a Ganymede that is then put in its way."""
    jupiter, ganymede = load("jupiter"), load("ganymede")
    a, b = CALLISTO.semi_major_axis, ganymede.semi_major_axis
    slow = math.sqrt(2.0 * jupiter.gm * b / (a * (a + b)))  # at the apoapsis of an ellipse that touches its orbit
    excess = math.sqrt((jupiter.gm + CALLISTO.gm) / a) - slow
    speed = math.hypot(excess, math.sqrt(2.0 * CALLISTO.gm / CALLISTO.radius))
    throws = launched(CALLISTO, speed * (1.0 + np.linspace(-0.02, 0.02, 81)), 0.5 * math.pi)
    site, until = Site(0.0, 0.5 * math.pi), 12.0 * DAY
    hit = set()
    for seed in range(400):  # seeds draw where the moons stand: take those with Ganymede near where the throw comes
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(7,)))
        rng.random()
        longitude = 2.0 * math.pi * rng.random(4)
        travel = math.pi * math.sqrt(((a + b) / 2.0) ** 3 / jupiter.gm)
        there = longitude[2] + math.sqrt(jupiter.gm / b**3) * travel
        off = (there - longitude[3] - math.pi + math.pi) % (2.0 * math.pi) - math.pi
        if abs(off) < 0.02:
            fates = thrown.fly(throws, thrown.field_with_companions(throws, CALLISTO, site, until, seed), until)
            hit |= {fates.names[k] for k in fates.fate}
    assert "hits Ganymede" in hit


def test_flat_ground_is_laid_round_the_body(tmp_path):
    """A launch 10 km out on flat ground is one at an arc of 10 km, its vertical turned with it."""
    arrays = {
        "number": [4, 9], "place": [[0.0, 1e4, 0.0], [0.0, 0.0, 0.0]], "time": [5.0, 6.0],
        "velocity": [[0.0, 0.0, 200.0], [30.0, 40.0, 0.0]], "mass": [2.0, 3.0], "layer": [0, -1],
    }  # fmt: skip
    ground = {"frame": "plane", "centre_m": np.zeros(3), "axes": np.eye(3), "gravity_m_s2": 1.2}
    archive.write(tmp_path / "ejecta.h5", arrays, ground)
    read = thrown.read(tmp_path / "ejecta.h5", CALLISTO)
    arc = 1e4 / CALLISTO.radius
    np.testing.assert_allclose(read.position[0], CALLISTO.radius * np.array([0.0, math.sin(arc), math.cos(arc)]))
    np.testing.assert_allclose(read.velocity[0], 200.0 * np.array([0.0, math.sin(arc), math.cos(arc)]), atol=1e-9)
    np.testing.assert_allclose(read.velocity[1], [30.0, 40.0, 0.0], atol=1e-9)
    with pytest.raises(InputError, match="--body"):
        thrown.read(tmp_path / "ejecta.h5", None)
    archive.write(tmp_path / "old.h5", arrays, {})
    with pytest.raises(InputError, match="run the crater stage again"):
        thrown.read(tmp_path / "old.h5", CALLISTO)
    archive.write(tmp_path / "less.h5", {name: arrays[name] for name in ("number", "mass")}, ground)
    with pytest.raises(InputError, match="no catalogue of ejecta: it lacks place"):
        thrown.read(tmp_path / "less.h5", CALLISTO)
    archive.write(tmp_path / "bad.h5", {**arrays, "mass": [np.nan, 1.0]}, ground)
    with pytest.raises(InputError, match="mass not finite"):
        thrown.read(tmp_path / "bad.h5", CALLISTO)


def test_the_command_writes_fates_whose_mass_is_the_catalogues(tmp_path, capsys):
    rng = np.random.default_rng(1)
    radius, g, n = 448.0, 1.5e-4, 200
    escape = math.sqrt(2.0 * g * radius)
    throws = launched(RYUGU, escape * rng.uniform(0.1, 1.5, n), rng.uniform(0.2, 1.5, n), rng.uniform(0.0, 6.0, n))
    mass = rng.uniform(1.0, 2.0, n)
    arrays = {
        "number": np.arange(n) + 7, "place": throws.position + [0.0, 0.0, 5.0], "time": rng.uniform(0.0, 9.0, n),
        "velocity": throws.velocity, "mass": mass, "layer": np.where(np.arange(n) % 10, 0, -1),
    }  # fmt: skip
    (tmp_path / "6_crater").mkdir()
    ground = {"frame": "sphere", "centre_m": np.array([0.0, 0.0, 5.0]), "axes": np.eye(3), "gravity_m_s2": g}
    archive.write(tmp_path / "6_crater" / "ejecta.h5", arrays, {**ground, "radius_m": radius})
    assert thrown.command(tmp_path, None, Site(), 50.0 * DAY, 1, tmp_path / "out") == 0
    said = json.loads((tmp_path / "out" / "ejecta_fates.json").read_text())
    assert said["closure"] < 1e-12 and said["particles"] == n and said["flown"]["gm_m3_s2"] == g * radius**2
    fast = np.linalg.norm(throws.velocity, axis=1) > escape
    foreign = np.arange(n) % 10 == 0
    assert said["target_kg"]["leaves"] == pytest.approx(mass[fast & ~foreign].sum(), rel=1e-12)
    assert said["projectile_kg"]["leaves"] == pytest.approx(mass[fast & foreign].sum(), rel=1e-12)
    found, facts = archive.read(tmp_path / "out" / "ejecta_fates.h5")
    back = np.array([str(name) for name in facts["fates"]])[found["fate"]] == "falls back"
    np.testing.assert_allclose(np.linalg.norm(found["landing"][back], axis=1), radius, rtol=1e-9)
    assert np.isnan(found["landing"][~back]).all() and (found["number"] == arrays["number"]).all()
    assert "launches from the body" in capsys.readouterr().out
    assert set(said["ends"]) == {"falls back"}  # nothing else is there to be hit
    ends, order = said["ends"]["falls back"], np.argsort(found["distance"][back])
    below = np.cumsum(mass[back][order]) / mass[back].sum()
    for share, *values in zip((0.1, 0.5, 0.9), ends["distance_m"], ends["time_s"], ends["speed_m_s"]):
        assert values[0] == found["distance"][back][order][below >= share][0]
        assert mass[back & (found["time"] <= values[1])].sum() >= share * mass[back].sum()
        assert mass[back & (found["speed"] < values[2])].sum() < share * mass[back].sum()
    with pytest.raises(InputError, match="did you mean 'ryugu'"):
        thrown.command(tmp_path, "ryuga", Site(), DAY, 1, tmp_path / "out")
    with pytest.raises(InputError, match="take a moon of Jupiter"):
        thrown.command(tmp_path, "sun", Site(), DAY, 1, tmp_path / "out")
    with pytest.raises(InputError, match="--duration"):
        thrown.command(tmp_path, None, Site(), 0.0, 1, tmp_path / "out")
