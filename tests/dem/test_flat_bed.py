"""Beds of flat ground: containers, random and hexagonal packings at rest, their weight on the walls."""

import json
import math

import numpy as np
import pytest

from dem.beds import bed_walls, flat_settling, grain_packing
from dem.beds import stage as bed_stage
from dem.beds.flat_ground import FlatGround
from dem.contact.settings import Contact, GrainLaw
from dem.contact.walls import distance, rows
from dem.grains.assembly import Assembly
from matter import cadence
from matter.case.body import Impact, Target
from matter.errors import InputError
from matter.files import snapshot
from matter.geometry.ground_region import Upright
from matter.wording import drawing
from studies.granular import carved_bowl
from tests.dem.stops import interrupted, same_grains

TARGET = Target.model_validate(
    {"layers": [{"name": "soil", "material": "basalt", "thickness": 20.0}], "shape": "half_space", "gravity": 1.0}
)
IMPACT = Impact.model_validate(
    {
        "speed": 2000.0,
        "angle_from_vertical": 0.0,
        "projectile": {"material": "basalt", "radius": 0.1},
        "expected_transient_diameter": 8.0,
    }
)


def write_ground(path, depth=10.0, gravity=1.0, density=1500.0):
    """Uniform flat ground, as the shock stage writes it."""
    heights = [-depth, -0.001 * depth]
    content = {
        "frame": "plane", "shape": "half_space", "depth_m": depth, "half_width_m": depth,
        "surface_gravity_m_s2": gravity,
        "layers": [{"name": "soil", "material": "basalt", "bottom_m": -depth, "top_m": 0.0,
        "mass_kg_m2": density * depth}],
        "profile": {"height_m": heights, "density_kg_m3": [density] * 2,
        "pressure_Pa": [-density * gravity * h for h in heights],
                    "gravity_m_s2": [gravity] * 2, "layer": [0, 0]},
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


def settled(folder, **settings):
    write_ground(folder / "2_sph" / "target.json", depth=settings.get("arc_radius", 10.0))
    (folder / "3_bed").mkdir(exist_ok=True)
    usual = dict(
        target=TARGET,
        impact=IMPACT,
        count=1300,
        arc_radius=10.0,
        depth=settings.get("arc_radius", 10.0),
        headroom_fraction=0.2,
        growth=0.0,
        packing="rcp",
    )
    bed_stage.run(bed_stage.Settings(**{**usual, **settings}), folder, folder / "3_bed")
    return snapshot.read(folder / "3_bed" / "bed.vtkhdf"), json.loads(
        (folder / "3_bed" / "bed_report.json").read_text()
    )


@pytest.fixture(scope="module")
def random_bed(tmp_path_factory):
    return settled(tmp_path_factory.mktemp("random"), radius_spread=0.0, arc_radius=9.0, count=1200)


def test_a_bed_does_without_its_picture(tmp_path, monkeypatch):
    """Where matplotlib is missing a flat one ended in a traceback. All beds leave their files by one function."""
    monkeypatch.setattr(drawing, "has", lambda library="matplotlib": False)
    settled(tmp_path, count=200, arc_radius=9.0)
    assert (tmp_path / "3_bed" / "bed.vtkhdf").exists() and not (tmp_path / "3_bed" / "bed.png").exists()


def check_at_rest(report):
    assert report["residual_speed_over_sqrt_g_r"]["rms"] < 1e-3 and report["free_run_speed_over_sqrt_g_r"] < 1e-3
    assert report["weight_carried"] == pytest.approx(1.0, abs=1e-3)
    assert report["sideways_force_over_weight"] < 1e-3
    assert abs(report["mass_error"]) < 5e-3


def test_a_random_bed_of_equal_grains(random_bed):
    bed, report = random_bed
    check_at_rest(report)
    assert 0.60 < report["packing_fraction"] < 0.64
    assert 4.5 < report["coordination_number_bulk"] < 6.5
    assert report["overlap"]["mean"] < 0.003
    assert bed.attributes["frame"] == "plane" and bed.attributes["domain"]["shape"] == "cylinder"
    assert (
        np.array_equal(bed.headroom == 1, bed.position[:, 2] > 0.0)
        or np.mean((bed.headroom == 1) != (bed.position[:, 2] > 0.0)) < 0.02
    )


def test_the_bed_stays_as_it_is_without_its_headroom(random_bed):
    bed, _ = random_bed
    carved = bed.select(bed.headroom == 0)
    carved.tables.update(bed.tables)
    from dem.contact.gravity import Field

    run = Assembly(
        carved,
        Contact(),
        bed_walls.walls(Upright.of_attribute(bed.attributes["domain"])),
        Field.constant((0.0, 0.0, -1.0)),
    )
    before = run.particles({}).position
    for _ in range(int(2.0 / run.dt)):
        run.step()
    assert np.linalg.norm(run.particles({}).position - before, axis=1).max() < 0.02 * bed.radius.mean()


@pytest.mark.validation
def test_a_hexagonal_bed_in_a_box(tmp_path):
    bed, report = settled(tmp_path, shape="box", packing="hcp", arc_radius=8.0, radius_spread=0.0)
    check_at_rest(report)
    assert report["packing_fraction"] == pytest.approx(math.pi / math.sqrt(18.0), abs=0.01)
    assert np.ptp(bed.radius) == 0.0


@pytest.mark.validation
def test_a_tilted_lattice_has_no_level_layers(tmp_path):
    """As dense as the level one, at rest; heights of its deep grains are spread where those of the level one stand in
    layers."""
    bed, report = settled(tmp_path, shape="bowl", packing="hcp_tilted", arc_radius=8.0, radius_spread=0.0, count=900)
    check_at_rest(report)
    level, radius = grain_packing.hexagonal_in(900, Upright("bowl", 8.0, -8.0, 1.6))
    tilted, _ = grain_packing.hexagonal_in(900, Upright("bowl", 8.0, -8.0, 1.6), tilted=True)
    step = 2.0 * radius * math.sqrt(2.0 / 3.0)  # between layers

    def order(points):  # 1 where all heights are whole layers apart, about 0 where they are spread
        return abs(np.mean(np.exp(2j * np.pi * points[:, 2] / step)))

    inside = bed.position[np.linalg.norm(bed.position, axis=1) < 6.0]
    assert order(level) > 0.99 and order(tilted) < 0.1 and order(inside) < 0.2
    assert report["packing_fraction"] > 0.68


@pytest.mark.validation
def test_a_bowl_of_mixed_grains_under_weak_gravity_with_stiff_springs(tmp_path):
    """Springs for contacts faster than those at rest: the bed is settled under inflated gravity, and ends at rest
    under its own."""
    bed, report = settled(tmp_path, shape="bowl", largest_speed=2.0, count=700)
    check_at_rest(report)
    assert report["inflation_of_gravity"] > 3.0
    assert report["overlap"]["mean"] < 1e-3
    assert 0.58 < report["packing_fraction"] < 0.66
    domain = Upright.of_attribute(bed.attributes["domain"])
    assert (
        domain.side_depth(bed.position[bed.headroom == 0]).min() > 0.9 * bed.radius.min()
    )  # headroom may lean out above the walls


def test_ground_that_was_not_brought_into_balance_has_a_weight_all_the_same(tmp_path):
    """``start = "literal"`` leaves pressures of zero; the grains lie under rho g h."""
    write_ground(tmp_path / "target.json", depth=10.0, gravity=2.0)
    balanced = FlatGround.read(tmp_path / "target.json")
    content = json.loads((tmp_path / "target.json").read_text())
    content["profile"]["pressure_Pa"] = [0.0, 0.0]
    (tmp_path / "target.json").write_text(json.dumps(content))
    literal = FlatGround.read(tmp_path / "target.json")
    depths = np.array([-10.0, -6.0, -1.0, 0.0, 1.0])
    assert literal.pressure(depths) == pytest.approx(balanced.pressure(depths))
    assert literal.pressure(depths) == pytest.approx([30e3, 18e3, 3e3, 0.0, 0.0])


@pytest.mark.validation
def test_a_bed_stopped_while_gravity_is_let_down_resumes_bit_for_bit(tmp_path, monkeypatch):
    """Stops at three places of the phase ``ease``, the last two between two looks at it."""
    begins = []
    begin = flat_settling.FlatSettling._begin

    def noted(work, grains):
        begin(work, grains)
        begins.append((work.plan[work.phase].name, work.total))

    monkeypatch.setattr(flat_settling.FlatSettling, "_begin", noted)
    beds = []
    for name in ("whole", "resumed"):
        first = dict(begins).get("ease", 0)
        stops = () if name == "whole" else (first + 50, first + 53, first + 97)
        interrupted(
            monkeypatch,
            stops,
            lambda name=name: beds.append(settled(tmp_path / name, shape="bowl", largest_speed=2.0, count=300)),
        )
    assert len(beds) == 2 and "ease" in dict(begins)
    same_grains(beds[0][0], beds[1][0])


def test_a_carved_cavity_slumps_and_a_stopped_one_ends_alike(random_bed, tmp_path, monkeypatch):
    bed, _ = random_bed
    slippery = Contact(
        shell=GrainLaw(friction=0.1, shape=0.0)
    )  # with their own friction a cavity of a few grains stands as it was carved
    found = []
    monkeypatch.setattr(cadence, "pace", cadence.Pace(steps=1))
    for name in ("whole", "resumed"):
        (tmp_path / name).mkdir()
        stops = () if name == "whole" else (1, 2)

        def go(name=name):
            found.append(carved_bowl.relax(bed, slippery, 1.0, 5.0, 5.0, longest=6.0, out=tmp_path / name))

        interrupted(monkeypatch, stops, go)
    assert found[0] == found[1]
    assert found[0].slope_before_deg > 35.0 and found[0].slope_deg < found[0].slope_before_deg
    assert 0.5 < found[0].depth_m < 5.0 and found[0].moved_radii > 0.05


@pytest.mark.parametrize("shape", ["bowl", "box", "cylinder"])
def test_containers(shape):
    box = Upright(shape, 10.0, -10.0, 2.0)
    rng = np.random.default_rng(1)
    points = rng.uniform(-10.0, 10.0, (200_000, 3))
    points[:, 2] = rng.uniform(-10.0, 2.0, len(points))
    inside = box.depth_inside(points) > 0.0
    volume = 20.0 * 20.0 * 12.0
    assert inside.mean() * volume == pytest.approx(box.volume_between(-10.0, 2.0), rel=0.01)
    lower = inside & (points[:, 2] < -4.0)
    assert lower.mean() * volume == pytest.approx(box.volume_between(-10.0, -4.0), rel=0.02)
    # the nearest wall is as far as the container says
    table = rows(bed_walls.walls(box))
    for x, depth in zip(points[inside][:300], box.depth_inside(points[inside][:300])):
        nearest = min(distance(row, *x)[0] for row in table)
        assert min(nearest, 2.0 - x[2]) == pytest.approx(depth, abs=1e-9)
    assert Upright.of_attribute(box.as_attribute()) == box


def test_hexagonal_lattice_fits():
    box = Upright("bowl", 10.0, -10.0, 1.0)
    points, radius = grain_packing.hexagonal_in(2000, box)
    assert len(points) == pytest.approx(2000, rel=0.1)
    assert box.depth_inside(points).min() >= radius * (1 - 1e-6)
    from scipy.spatial import cKDTree

    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    assert nearest.min() == pytest.approx(2.0 * radius, rel=1e-9)


def test_bad_settings_for_flat_ground(tmp_path):
    write_ground(tmp_path / "2_sph" / "target.json")
    usual = dict(target=TARGET, impact=IMPACT, count=300, arc_radius=10.0)
    for change, words in (
        ({"shape": "cap"}, "is for spherical targets"),
        ({"shape": "bowl", "arc_radius": 15.0}, "reaches 15 m down"),
        ({"shape": "bowl", "depth": 5.0}, "as deep as its radius"),
    ):
        with pytest.raises(InputError, match=words):
            bed_stage.run(bed_stage.Settings(**{**usual, **change}), tmp_path, tmp_path)
    write_ground(tmp_path / "2_sph" / "target.json", gravity=0.0)
    with pytest.raises(InputError, match="without gravity"):
        bed_stage.run(bed_stage.Settings(**usual), tmp_path, tmp_path)


def test_a_body_is_filled_as_a_cap(tmp_path, bed_settings):
    from tests.dem import bodies

    bodies.write_callisto(tmp_path / "2_sph" / "target.json")
    for change, words in (
        ({"shape": "bowl"}, "is for flat ground"),
        ({"packing": "hcp_tilted"}, "hcp_tilted.* are for flat ground"),
    ):
        with pytest.raises(InputError, match=words):
            bed_stage.run(bed_settings.model_copy(update=change), tmp_path, tmp_path)


@pytest.mark.validation
def test_a_carved_flat_bed_collapses(random_bed, tmp_path):
    """Flat ground: the flanks of a steep cavity give way, a grain thrown up flies beside the contact search and comes
    back, balances hold."""
    from dem import stage
    from studies.granular import carved_bowl

    bed, _ = random_bed
    start = carved_bowl.carved(bed, 5.0, 4.0)
    start.attributes.update(bed.attributes, time=1.0)
    across = np.hypot(start.position[:, 0], start.position[:, 1])  # not in the damped layer along the side
    thrown = int(np.argmax(np.where(across < 1.3, start.position[:, 2], -np.inf)))
    start.velocity[thrown] = [0.0, 0.0, 4.9]
    write_ground(tmp_path / "2_sph" / "target.json", depth=9.0)
    (tmp_path / "4_handoff").mkdir()
    (tmp_path / "5_dem").mkdir()
    snapshot.write(start, tmp_path / "4_handoff" / "start.vtkhdf")
    settings = stage.Settings(
        end_time=13.0, latest_time=14.0, still_interval=4.0, snapshot_interval=2.0, history_interval=1.0
    )
    stage.run(settings, tmp_path, tmp_path / "5_dem")
    report = json.loads((tmp_path / "5_dem" / "stage_report.json").read_text())
    assert report["momentum_error"] < 1e-9 and abs(report["energy_error"]) < 0.05
    assert report["ballistic_at_end"] == 0 and report["left"] == 0
    states = [snapshot.read(path).state for path in snapshot.series(tmp_path / "5_dem")]
    assert max(int((state == 1).sum()) for state in states) >= 1
    last = snapshot.read(tmp_path / "5_dem" / "last.vtkhdf")
    order = np.argsort(start.identity, kind="stable")
    moved = np.linalg.norm(last.position - start.position[order], axis=1)
    moved[np.flatnonzero(order == thrown)] = 0.0
    assert moved.max() > 0.2 * start.radius.mean()  # the flanks give way,
    assert last.mass @ last.position[:, 2] < start.mass @ start.position[:, 2]  # downwards


def test_profiles_of_a_carved_plane():
    """On a fine grid of points that follow a cone the steepest slope is the cone's."""
    from matter.particles import Particles
    from studies.granular import carved_bowl

    at = np.arange(-10.0, 10.0, 0.25)
    x, y = np.meshgrid(at, at)
    across = np.hypot(x, y).ravel()
    z = np.minimum(0.0, (across - 6.0) * math.tan(math.radians(28.0)))
    points = Particles({"position": np.column_stack([x.ravel(), y.ravel(), z]), "radius": np.full(len(z), 0.1)})
    ring, height = carved_bowl.profile(points, 0.5, 9.0)
    assert carved_bowl.steepest(ring, height, 3.0) == pytest.approx(28.0, abs=1.0)
    with pytest.raises(InputError, match="frame is not 'plane'"):
        carved_bowl.carved(points, 1.0, 1.0)
