"""Control runs on a small settled bed: carved at the datum it stays, carved by a bowl at rest it moves by slope
failure alone and gains no energy."""

import csv
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from dem import stage
from dem.beds import stage as bed_stage
from handoff.domains import domain
from handoff.transfer import carve, control
from matter.files import snapshot
from matter.particles import Particles
from tests.dem import bodies

SETTINGS = stage.Settings(end_time=500.0, latest_time=500.0)
START, BOWL, DEPTH = 100.0, 500e3, 150e3


@pytest.fixture(scope="module")
def frictional(tmp_path_factory):
    """A settled bed of ice on a core, without an ocean: grains of an ocean have no friction, and no slope of theirs
    stands."""
    run = tmp_path_factory.mktemp("frictional")
    density = {0: lambda p: 2700.0 * (1 + p / 26.7e9), 1: lambda p: 917.0 * (1 + p / 9.6e9)}
    bodies.write_layered(
        run / "2_sph" / "target.json",
        [("core", "basalt", 0.0, 1700e3), ("shell", "ice", 1700e3, 2100e3)],
        density,
        core_density=3006.0,
    )
    (run / "3_bed").mkdir()
    layers = [
        {"name": "core", "material": "basalt", "thickness": 1700e3},
        {"name": "shell", "material": "ice", "thickness": 400e3},
    ]
    impact = {
        "speed": 18234.0, "angle_from_vertical": 0.698, "projectile": {"material": "ice", "radius": 53.9e3},
        "expected_transient_diameter": 980e3,
    }  # fmt: skip
    target = bed_stage.Settings.model_fields["target"].annotation.model_validate({"layers": layers})
    made = bed_stage.Settings.model_fields["impact"].annotation.model_validate(impact)
    bed_stage.run(
        bed_stage.Settings(target=target, impact=made, count=4000, arc_radius=0.9e6, packing="rcp"), run, run / "3_bed"
    )
    return run, snapshot.read(run / "3_bed" / "bed.vtkhdf")


def collapsed(run, start, folder) -> tuple[Particles, dict[str, np.ndarray]]:
    """The grains after the control run, and its history."""
    shutil.copytree(run / "2_sph", folder / "2_sph")
    (folder / "4_handoff").mkdir()
    (folder / "5_dem").mkdir()
    snapshot.write(start, folder / "4_handoff" / "start.vtkhdf")
    stage.run(SETTINGS, folder, folder / "5_dem")
    with open(folder / "5_dem" / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return snapshot.read(folder / "5_dem" / "last.vtkhdf"), {
        name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]
    }


def mechanical(history) -> np.ndarray:
    return sum(history[name] for name in ("kinetic_J", "rotational_J", "gravitational_J", "elastic_J"))


def test_the_bed_carved_at_the_datum_does_not_move(frictional, tmp_path):
    run, bed = frictional
    region = domain.read(bed.attributes)
    handoff = SimpleNamespace(start=SimpleNamespace(attributes={"time": START}), region=region)
    start = control.start("uncarved", handoff, bed)
    height = np.linalg.norm(start.position, axis=1) - start.attributes["domain"]["datum_radius_m"]
    assert height.max() <= 0.0 and not start.velocity.any() and start.attributes["control"] == "uncarved"
    last, history = collapsed(run, start, tmp_path)
    way = control.moved(start, last) / start.radius.mean()
    assert np.isfinite(way).all() and way.max() < 0.05
    energy = mechanical(history)
    assert energy.max() - energy[0] <= 1e-9 * abs(energy[0])  # history.csv holds ten digits


def test_the_carved_bed_at_rest_moves_by_slope_failure_alone(frictional, tmp_path):
    run, bed = frictional
    datum = bed.attributes["domain"]["datum_radius_m"]
    distance = np.linalg.norm(bed.position, axis=1)
    arc = datum * np.arctan2(np.hypot(bed.position[:, 0], bed.position[:, 1]), bed.position[:, 2])
    stays = distance - datum < np.where(arc < BOWL, -DEPTH * (1.0 - (arc / BOWL) ** 2), 0.0)
    carved = bed.select(stays)
    carved.tables = carve.surviving_tables(bed, stays)
    carved.attributes["time"] = START
    carving, region = SimpleNamespace(stays=stays), domain.read(bed.attributes)
    start = control.start("at_rest", SimpleNamespace(start=carved, carving=carving, region=region), bed)
    assert len(start.tables["contacts/pair"]) > 1000
    last, history = collapsed(run, start, tmp_path)
    way = control.moved(start, last) / start.radius.mean()
    deep = control.depth_below_surface(start) > 5.0 * start.radius.mean()
    assert deep.sum() > 300 and np.nanmax(way[deep]) < 0.1
    energy = mechanical(history)
    assert energy.max() - energy[0] <= 1e-9 * abs(energy[0])  # history.csv holds ten digits
    assert np.nanmax(way) > np.nanmax(way[deep])  # what moves lies at the surface


def test_depth_below_the_surface_of_a_known_heap():
    rng = np.random.default_rng(1)
    points = (
        np.stack(
            np.meshgrid(np.arange(-20, 20), np.arange(-20, 20), np.arange(-15, 0), indexing="ij"), axis=-1
        ).reshape(-1, 3)
        + 0.5
    )
    points = points + rng.uniform(-0.1, 0.1, points.shape)
    hole = (np.abs(points[:, 0]) < 6.0) & (np.abs(points[:, 1]) < 6.0)
    points = points[~hole | (points[:, 2] < -9.0)]
    heap = Particles({"position": points, "radius": np.full(len(points), 0.5)},
                     {"frame": "plane", "domain": {"radius_m": 30.0, "floor_m": -15.0, "datum_m": 0.0,
                     "top_m": 1.0}})  # fmt: skip
    found = control.depth_below_surface(heap)
    aside = np.maximum(np.abs(points[:, 0]), np.abs(points[:, 1])) - 6.0
    truth = np.where(
        aside < 0.0,
        -9.0 - points[:, 2],
        np.minimum(-points[:, 2], np.where(points[:, 2] > -9.0, aside, np.hypot(aside, points[:, 2] + 9.0))),
    )
    seen = (np.abs(points[:, 0]) < 15.0) & (
        np.abs(points[:, 1]) < 4.0
    )  # away from the hole's corners and the heap's own edge
    assert (
        np.abs(found - truth)[seen].max() < 1.5 and np.abs(found - truth)[seen].mean() < 0.7
    )  # in diameters: centres lie half of one inside


def test_moved_finds_grains_by_their_identity():
    one = Particles({"identity": [5, 2, 9], "position": np.zeros((3, 3))})
    other = Particles({"identity": [9, 5], "position": [[0, 3, 4], [1, 0, 0]]})
    np.testing.assert_allclose(control.moved(one, other), [1.0, np.nan, 5.0])
