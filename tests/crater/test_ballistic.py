"""The balance of free flight, on flights that are known."""

import json

import numpy as np
import pytest

from crater import stage
from crater.ejecta import ballistic
from matter.case.body import Impact, Layer, Projectile, Target
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles

G, DENSITY, SPACING = 1.2e-4, 1230.0, 0.25


def ground(reach=12.0, depth=2.0):
    """A level lattice whose topmost layer is half a spacing deep."""
    edge = np.arange(-reach, reach, SPACING) + 0.5 * SPACING
    place = np.stack(np.meshgrid(edge, edge, -edge[(edge > 0.0) & (edge < depth)], indexing="ij"), axis=-1).reshape(
        -1, 3
    )
    return place[np.hypot(place[:, 0], place[:, 1]) < reach]


def shot(place, velocity, **more):
    n = len(place)
    mass = np.full(n, DENSITY * SPACING**3)
    fields = {
        "position": place,
        "initial_position": place,
        "velocity": velocity,
        "mass": mass,
        "density": np.full(n, DENSITY),
        "layer": np.zeros(n),
    }
    return Particles(fields | more, {"time": 4.0})


def test_places_where_single_particles_land():
    place = np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 3.0], [5.0, 0.0, -0.5], [5.0, 0.0, -0.5], [5.0, 0.0, -0.5]])
    velocity = np.array(
        [[0.03, 0.04, 0.05], [0.1, 0.0, -0.02], [1.0, 0.0, 0.02], [1.0, 0.0, 0.005], [1.0, 0.0, -0.02]]
    )
    found, flies = ballistic.landing(place, velocity, G)
    assert flies.tolist() == [True, True, True, False, False]  # 5 mm/s lift by 0.1 m only
    assert found[0] == pytest.approx([1.0 + 2.0 * 0.03 * 0.05 / G, 2.0 + 2.0 * 0.04 * 0.05 / G])  # range 2 u w / g
    time = (-0.02 + np.sqrt(0.02**2 + 2.0 * G * 3.0)) / G
    assert found[1] == pytest.approx([0.1 * time, 0.0])
    assert 3.0 + velocity[1, 2] * time - 0.5 * G * time**2 == pytest.approx(0.0, abs=1e-9)
    rises = (0.02 + np.sqrt(0.02**2 - 2.0 * G * 0.5)) / G
    assert found[2] == pytest.approx([5.0 + rises, 0.0]) and np.all(found[3:] == place[3:, :2])


def pit(place, radius, depth):
    """Velocities (n, 3) that carry all matter within ``radius`` and down to ``depth`` from r to radius + r / 2."""
    r = np.hypot(place[:, 0], place[:, 1])
    rise = np.sqrt(2.0 * G * -place[:, 2]) + 0.05
    time = (rise + np.sqrt(rise**2 + 2.0 * G * place[:, 2])) / G
    velocity = np.column_stack([place[:, :2] * ((radius / r - 0.5) / time)[:, None], rise])
    return np.where(((r < radius) & (place[:, 2] > -depth))[:, None], velocity, 0.0)


def test_a_pit_that_is_thrown_into_a_ring():
    """All within 3 m and 1 m deep goes to 3 m + r / 2: diameter, depth and volume of the pit, its matter in the ring,
    4 (L - 3) / L high."""
    place = ground()
    velocity = pit(place, 3.0, 1.0)
    source = shot(place, velocity)
    profile, left = ballistic.profile_of(source, G, DENSITY, 11.0)
    found = ballistic.measure_profile(profile)
    assert left == 0.0
    assert found["diameter_apparent_m"].value == pytest.approx(6.0, rel=0.04)
    assert found["depth_m"].value == pytest.approx(1.0, rel=0.06)
    assert found["volume_m3"].value == pytest.approx(np.pi * 9.0, rel=0.05)
    assert found["diameter_rim_m"].value == pytest.approx(9.0, abs=0.6)
    assert found["rim_height_m"].value == pytest.approx(4.0 / 3.0, rel=0.15)
    area = np.pi * np.diff(np.linspace(0.0, 11.0, len(profile.radius) + 1) ** 2)
    assert profile.height @ area == pytest.approx(0.0, abs=1e-9)  # nothing is lost
    beyond = profile.radius > 5.1
    assert np.abs(profile.height[beyond]).max() < 1e-12  # ground that has not moved leaves no trace, coarse or not
    # the escape speed takes matter away, and its mass is said
    fast = np.linalg.norm(velocity, axis=1) > 0.055
    profile, left = ballistic.profile_of(source, G, DENSITY, 11.0, escape_speed=0.055)
    assert 0.0 < left == pytest.approx(source.mass[fast].sum())
    assert profile.height @ area == pytest.approx(-left / DENSITY, rel=1e-6)


def test_the_projectile_and_downward_flow_are_no_part_of_it():
    place = ground()
    down = np.zeros_like(place)
    down[:, 2] = -1.0
    profile, _ = ballistic.profile_of(shot(place, down), G, DENSITY, 10.0)
    assert np.abs(profile.height).max() < 1e-12
    ball = shot(
        np.vstack([place, [[0.0, 0.0, 5.0]]]),
        np.vstack([down, [[0.0, 0.0, 0.0]]]),
        layer=np.r_[np.zeros(len(place)), -1.0],
    )
    assert np.abs(ballistic.profile_of(ball, G, DENSITY, 10.0)[0].height).max() < 1e-12


def test_of_a_run_it_is_that_of_the_snapshot_handed_over(tmp_path):
    place = ground(6.0, 1.0)
    (tmp_path / "2_sph").mkdir()
    assert ballistic.of_run(tmp_path, G, DENSITY, 5.0, 0.0) is None
    for number, part in enumerate((0.0, 2.0, 3.0)):
        particles = shot(place, pit(place, part, 0.6) if part > 0.0 else np.zeros_like(place))
        particles.attributes["time"] = float(number)
        snapshot.write(particles, tmp_path / "2_sph" / f"snap_{number:04d}.vtkhdf")
    last = ballistic.of_run(tmp_path, G, DENSITY, 5.0, 0.0)
    (tmp_path / "4_handoff").mkdir()
    (tmp_path / "4_handoff" / "handoff.json").write_text(json.dumps({"time_s": 1.0}))
    handed = ballistic.of_run(tmp_path, G, DENSITY, 5.0, 0.0)
    assert (last.time, handed.time) == (2.0, 1.0) and handed.file == "2_sph/snap_0001.vtkhdf"
    assert last.measures["diameter_apparent_m"].value == pytest.approx(6.0, abs=0.3)
    assert handed.measures["diameter_apparent_m"].value == pytest.approx(4.0, abs=0.3)
    assert handed.as_dict()["diameter_apparent_m"]["value"] == handed.measures["diameter_apparent_m"].value
    assert "1.05 of the ballistic one, within 10%" in ballistic.words(
        handed, 1.05 * handed.measures["diameter_apparent_m"].value, "the grains"
    )
    assert "NOT within" in ballistic.words(handed, 1.2 * handed.measures["diameter_apparent_m"].value, "the grains")
    (tmp_path / "4_handoff" / "handoff.json").write_text(json.dumps({"time_s": 0.0}))
    with pytest.raises(InputError, match="takes nothing away"):
        ballistic.of_run(tmp_path, G, DENSITY, 5.0, 0.0)


@pytest.mark.validation
def test_the_page_the_files_and_the_picture_of_a_flat_case_have_it(tmp_path):
    place = ground(8.0, 4.0)
    for name in ("2_sph", "4_handoff", "6_crater"):
        (tmp_path / name).mkdir()
    hollow = place[np.hypot(place[:, 0], place[:, 1]) ** 2 / 4.0 - 1.0 > place[:, 2]]
    for number, points in enumerate((place, hollow, hollow)):
        particles = shot(points, pit(points, 3.0, 1.0) if number else np.zeros_like(points))
        particles.attributes["time"] = float(number)
        particles["material"] = np.zeros(len(points))
        snapshot.write(particles, tmp_path / "2_sph" / f"snap_{number:04d}.vtkhdf")
    (tmp_path / "4_handoff" / "handoff.json").write_text(json.dumps({"time_s": 1.0}))
    soil = Layer(name="soil", material="basalt", thickness=8.0)
    impact = Impact(
        speed=2000.0,
        angle_from_vertical=0.0,
        projectile=Projectile(material="basalt", radius=0.05),
        expected_transient_diameter=6.0,
    )
    stage.run(
        stage.Settings(target=Target(layers=(soil,), shape="half_sphere", gravity=G), impact=impact),
        tmp_path,
        tmp_path / "6_crater",
    )
    own = json.loads((tmp_path / "6_crater" / "measures.json").read_text())["ballistic"]
    assert own["snapshot"] == "2_sph/snap_0001.vtkhdf" and own["handed_over_s"] == 1.0
    assert own["diameter_apparent_m"]["value"] == pytest.approx(6.0, abs=0.6)  # a ring and a particle on either side
    assert "Ballistic crater" in (tmp_path / "6_crater" / "report.html").read_text()
    assert (tmp_path / "6_crater" / "profile_ballistic.csv").is_file()
