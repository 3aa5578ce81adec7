"""An ellipsoid and a body with the surface of a file as targets: particles, impact, what is refused."""

import json
import math

import numpy as np
import pytest
import trimesh

from fixtures import solids
from matter.case.body import Target
from matter.errors import InputError
from matter.files import snapshot
from matter.points import regions
from matter.solids import distance, placed
from pipeline.case import read as cases
from pipeline.settings import compose
from sph.bodies import solid_target
from sph.bodies.target import Zones
from sph.materials.rows import collect

CASE = """
[case]
title = "A shot at a small body"
[target]
{target}
latitude = "20 deg"
longitude = "130 deg"
azimuth = "60 deg"
spin_period = "11.92 h"
[[target.layers]]
material = "basalt"
[impact]
speed = "6 km/s"
angle_from_vertical = "30 deg"
[impact.projectile]
material = "aluminum"
radius = "2 m"
[sph]
particles = 1500
end_time = "4 ms"
snapshot_interval = "2 ms"
"""
ELLIPSOID = 'shape = "ellipsoid"\naxes = ["177 m", "174 m", "116 m"]'
MESH = 'shape = "mesh"\nfile = "body.obj"\nfile_unit = "1 km"'


@pytest.fixture
def folder(tmp_path):
    known = solids.dumbbell(0.08, 0.12, 0.05, rings=60, around=40)
    trimesh.Trimesh(known.vertices, known.triangles, process=False).export(tmp_path / "body.obj")
    (tmp_path / "case.toml").write_text(CASE.format(target=ELLIPSOID))
    return tmp_path


def complaint(folder, text: str) -> str:
    (folder / "case.toml").write_text(text)
    with pytest.raises(InputError) as said:
        compose.compose(cases.read(folder))
    return str(said.value)


@pytest.fixture
def shocked(folder, run_case):
    """``shocked()``: the folder of the shock stage of the case in ``folder``."""

    def run():
        code, made = run_case(folder)
        assert code == 0
        return made / "2_sph"

    return run


@pytest.mark.validation
def test_an_ellipsoid_is_hit_where_and_as_the_case_says(shocked):
    out = shocked()
    facts = json.loads((out / "target.json").read_text())
    assert facts["axes_of_inertia_m"] == pytest.approx([177.0, 174.0, 116.0], rel=1e-6)
    first = snapshot.read(out / "snap_0000.vtkhdf")
    ball, body = first.select(first.layer < 0), first.select(first.layer >= 0)
    assert body.mass.sum() == pytest.approx(facts["mass_kg"], rel=1e-9)
    velocity = ball.mass @ ball.velocity / ball.mass.sum()
    assert np.linalg.norm(velocity) == pytest.approx(6e3)
    assert -velocity @ facts["normal"] == pytest.approx(6e3 * math.cos(math.radians(30.0)))
    # all of the ball is outside, and its surface will touch the body's at the site
    away = np.asarray(ball.position) - facts["site_m"]
    assert (away @ facts["normal"]).min() > 0.0
    middle = away.mean(axis=0) - 2.0 * np.asarray(facts["normal"])
    assert np.linalg.norm(middle - (middle @ velocity) * velocity / 36e6) < 1e-6
    # the body turns as a whole
    omega = np.asarray(facts["angular_velocity_1_s"])
    assert np.linalg.norm(omega) == pytest.approx(2.0 * math.pi / (11.92 * 3600.0))
    assert body.velocity == pytest.approx(np.cross(omega, body.position), abs=1e-12)
    # and takes all momentum
    last = snapshot.read(out / "last.vtkhdf")
    before = first.mass @ first.velocity
    assert np.linalg.norm(last.mass @ last.velocity - before) < 1e-10 * np.linalg.norm(ball.mass @ ball.velocity)
    assert np.linalg.norm(last.velocity[last.layer >= 0], axis=1).max() > 10.0  # and something happened


@pytest.mark.validation
def test_a_mesh_is_filled_in_the_unit_that_is_named(folder, shocked):
    short = CASE.replace('end_time = "4 ms"', 'end_time = "0.1 ms"')  # looked at is what it starts with
    (folder / "case.toml").write_text(short.format(target=MESH))
    out = shocked()
    facts = json.loads((out / "target.json").read_text())
    known = solids.dumbbell(80.0, 120.0, 50.0, rings=60, around=40)
    assert facts["volume_m3"] == pytest.approx(known.volume, rel=0.02)
    first = snapshot.read(out / "snap_0000.vtkhdf")
    body = first.select(first.layer >= 0)
    mass, place = np.asarray(body.mass), np.asarray(body.position)
    assert np.linalg.norm(mass @ place / mass.sum()) < 1.0
    back = place @ np.asarray(facts["from_body_frame"])  # in the frame of the file
    across = np.hypot(back[:, 0], back[:, 1])
    assert np.abs(back[:, 2]).max() < 140.0 and across.max() < 80.0 and across[np.abs(back[:, 2]) < 5.0].max() < 56.0


def test_the_surface_counts_by_its_content(folder):
    (folder / "case.toml").write_text(CASE.format(target=MESH))
    before = cases.read(folder)
    assert before.document["target"]["file"] == str(folder / "body.obj")
    first = compose.compose(before)["sph"].target.placed.solid.volume
    known = solids.dumbbell(0.09, 0.12, 0.05, rings=60, around=40)
    trimesh.Trimesh(known.vertices, known.triangles, process=False).export(folder / "body.obj")
    assert compose.compose(cases.read(folder))["sph"].target.placed.solid.volume > 1.2 * first


@pytest.mark.parametrize(
    "target,said",
    [
        (MESH.replace('file_unit = "1 km"', ""), 'file_unit: needed by shape = "mesh"'),
        (MESH.replace('file = "body.obj"', ""), 'file: needed by shape = "mesh"'),
        (MESH.replace("body.obj", "none.obj"), "none.obj: no such file"),
        (MESH.replace('"1 km"', "1000"), "unit is missing"),
        ('shape = "ellipsoid"', "axes: needed by shape"),
        (ELLIPSOID.replace('"116 m"', '"-116 m"'), "greater than 0"),
        (ELLIPSOID + '\nwidth = "1 km"', "as wide as its layers"),
        (ELLIPSOID + '\ngravity = "1 m/s^2"', "gravity"),
        ('shape = "half_space"\naxes = ["1 m", "1 m", "1 m"]', "only there"),
        ('shape = "sphere"', "of an ellipsoid or mesh only"),
    ],
)
def test_what_does_not_fit_is_said(folder, target, said):
    assert said in complaint(
        folder,
        CASE.format(target=target).replace(
            'material = "basalt"',
            'material = "basalt"' + ('\nthickness = "1 km"' if "sphere" in target or "half" in target else ""),
        ),
    )


def test_an_open_surface_is_said_with_its_place(folder):
    known = solids.box((0.1, 0.1, 0.1))
    trimesh.Trimesh(known.vertices, known.triangles[2:], process=False).export(folder / "body.obj")
    said = complaint(folder, CASE.format(target=MESH))
    assert "not watertight: 4 of 17 edges" in said and "thickness" not in said


def test_a_surface_that_cuts_itself_is_said_by_its_key(folder):
    box = solids.box((0.1, 0.1, 0.1))
    both = np.concatenate([box.vertices, box.vertices + 0.05]), np.concatenate([box.triangles, box.triangles + 8])
    trimesh.Trimesh(*both, process=False).export(folder / "body.obj")
    assert "[target] file: the surface cuts itself" in complaint(folder, CASE.format(target=MESH))


def test_two_layers_a_thickness_and_a_latitude_beyond_the_pole_are_refused(folder):
    text = CASE.format(target=ELLIPSOID)
    assert "one material" in complaint(
        folder, text.replace("[impact]", '[[target.layers]]\nmaterial = "ice"\nthickness = "1 m"\n[impact]', 1)
    )
    assert "leave it out; the ellipsoid makes it 76.4358 m" in complaint(
        folder, text.replace('material = "basalt"', 'material = "basalt"\nthickness = "80 m"')
    )
    assert "latitude" in complaint(folder, text.replace('"20 deg"', '"120 deg"'))


@pytest.mark.parametrize(
    ("axes", "zones", "fewest"),
    [
        pytest.param(
            [1004.0, 1004.0, 876.0],
            Zones(0.5, 1.0, 0.5, 1.0, 100.0, 0.3),
            (20, 200, 300, 300),
            marks=pytest.mark.validation,
        ),
        pytest.param(
            [177.0, 174.0, 116.0],
            Zones(0.25, 1.0, 0.75, 5.0, 20.0, 0.3),
            (200, 500, 200, 30),
            marks=pytest.mark.validation,
        ),
    ],
    ids=["kilometre", "dimorphos"],
)
def test_a_large_body_is_full_where_a_small_ball_hits_it(monkeypatch, axes, zones, fewest):
    """Half a metre at the site of a kilometre, a quarter on Dimorphos: places are not tried all over the body. (Where
    they were, the first try after the samples that find the volume would end the test.)"""
    body = Target.model_validate(
        {"shape": "ellipsoid", "axes": axes, "layers": [{"name": "soil", "material": "basalt"}]}
    )
    draws = []
    drawn = regions.Interior.random_points

    def counted(self, rng, count):
        draws.append(count)
        assert len(draws) < 4, "places are tried all over the body"
        return drawn(self, rng, count)

    monkeypatch.setattr(regions.Interior, "random_points", counted)
    built = solid_target.build(body, collect(("basalt",)), zones, 1)
    away = np.linalg.norm(built.position - np.array(body.impact_point), axis=1)
    size = np.cbrt(built.mass / built.density)
    for inner, outer, least in zip((0.0, 1.5, 10.0, 100.0), (1.5, 10.0, 100.0, 1000.0), fewest, strict=True):
        here = (away >= inner) & (away < outer)
        assert here.sum() > least
        assert size[here].mean() == pytest.approx(zones.spacing(away[here]).mean(), rel=0.08)
    assert built.mass.sum() == pytest.approx(body.placed.solid.volume * built.density[0], rel=1e-9)


def test_the_particles_of_a_body_are_counted_without_the_seconds_of_its_distances(monkeypatch):
    monkeypatch.setattr(distance, "_passed_on", None)
    body = placed.of_axes((31.0, 29.0, 23.0), 0.1, 0.2, 0.3)
    across = np.linspace(0.5, solid_target.reach(body), 400)
    middle = 0.5 * (across[1:] + across[:-1])
    volume = float(np.sum(solid_target.area(body, middle) * np.diff(across)))
    assert volume == pytest.approx(body.solid.volume, rel=0.02)


@pytest.mark.validation
def test_ground_at_the_site_of_a_large_body_is_as_full_as_flat_ground():
    """Particles of 12 cm on a kilometre whose surface is known on a grid of 9 m: where depths lay between its points,
    0.84 of the mass was there."""
    body = Target.model_validate(
        {"shape": "ellipsoid", "axes": [1004.0, 1004.0, 876.0], "layers": [{"name": "soil", "material": "basalt"}]}
    )
    built = solid_target.build(body, collect(("basalt",)), Zones(0.12, 0.5, 0.12, 0.8, 100.0, 0.3), 1)
    away = np.linalg.norm(built.position - np.array(body.impact_point), axis=1)
    half_ball = 2.0 / 3.0 * math.pi * 0.5**3
    assert built.mass[away < 0.5].sum() == pytest.approx(half_ball * built.density[0], rel=0.05)
