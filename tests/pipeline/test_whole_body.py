"""A shot into a small ellipsoid, from the shock to the grains of the whole body: what each stage leaves, the ledger
without a waiver, beta of both stages."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from dem import stage as collapse
from handoff import stage as handing
from handoff.domains import domain
from handoff.source import cloud_surface
from matter.errors import InputError
from matter.files import snapshot
from matter.geometry.rotation import rotation
from matter.solids.body_datum import Datum
from pipeline.case import read as cases
from pipeline.settings import compose

CASE = """
[case]
title = "A shot that throws out much of a small body"
stages = ["sph", "bed", "handoff", "dem"]
[target]
shape = "ellipsoid"
axes = ["120 m", "110 m", "90 m"]
latitude = "20 deg"
longitude = "130 deg"
azimuth = "60 deg"
spin_period = "6 h"
layers = [{ material = "basalt" }]
[impact]
speed = "6 km/s"
angle_from_vertical = "20 deg"
expected_transient_diameter = "30 m"
projectile = { material = "aluminum", radius = "0.4 m" }
[sph]
spacing_at_impact = "1.5 m"
spacing_far = "8 m"
fine_radius = "8 m"
growth = 0.15
contact_refinement = 1.0
projectile_particles = 1
end_time = "12 s"
snapshot_interval = "2 s"
[sph.late]
at = "50 ms"
sound_speed = "30 m/s"
alpha = 0.1
[sph.materials.basalt]
strength = "drucker_prager"
predamaged = true
porosity = "p_alpha"
p_alpha = { alpha0 = 1.4 }
crush_quadratic = { Pe = "0.1 MPa", Ps = "1.5 GPa" }
tension = { cut = "0 Pa" }
[bed]
count = 4000
[handoff]
time = "last"
[dem]
end_time = "5 min"
latest_time = "5 min"
still_interval = "2 min"
snapshot_interval = "2 min"
"""


def written(folder: Path, text: str = CASE) -> Path:
    (folder / "case.toml").write_text(text)
    return folder


def test_the_handoff_knows_how_long_the_collapse_is(tmp_path):
    assert compose.compose(cases.read(written(tmp_path)))["handoff"].until == 300.0
    longer = CASE.replace('time = "last"', 'time = "last"\nuntil = "1 h"')
    with pytest.raises(InputError, match=r"handoff.until: there is no such key any more: \[dem\] latest_time says it"):
        compose.compose(cases.read(written(tmp_path, longer)))
    open_end = CASE.replace('end_time = "5 min"\nlatest_time = "5 min"\n', "")
    settings = compose.compose(cases.read(written(tmp_path, open_end)))
    assert settings["handoff"].until == pytest.approx(settings["dem"].latest_time, rel=0.02)


@pytest.fixture(scope="module")
def run(tmp_path_factory, run_case):
    code, folder = run_case(written(tmp_path_factory.mktemp("body")))
    assert code == 0
    return folder


def report_of(run: Path, stage: str) -> dict:
    return json.loads((run / stage / "stage_report.json").read_text())


@pytest.mark.validation
def test_every_row_of_the_ledger_holds_without_a_waiver(run):
    rows = {row["name"]: row for row in json.loads((run / "4_handoff" / "ledger.json").read_text())}
    assert not [name for name, row in rows.items() if row["verdict"] in ("fail", "waived")]
    for name in ("whole_mass_rel", "whole_momentum_rel", "whole_angular_momentum_rel", "cavity_volume_rel"):
        assert rows[name]["verdict"] == "pass"


@pytest.mark.validation
def test_the_list_and_the_start_hold_all_matter_of_the_snapshot(run):
    last = snapshot.series(run / "2_sph")[-1]
    source, start = snapshot.read(last), snapshot.read(run / "4_handoff" / "start.vtkhdf")
    listed = snapshot.read(run / "4_handoff" / "away.vtkhdf")
    at = np.searchsorted(np.sort(source.identity), listed.identity)
    order = np.argsort(source.identity)
    assert np.array_equal(listed.velocity, source.velocity[order[at]])
    mine = start.state == 2
    assert listed.mass.sum() == pytest.approx(start.mass[mine].sum(), rel=1e-12) and mine.any()
    assert listed.mass @ listed.velocity == pytest.approx(start.mass[mine] @ start.velocity[mine], rel=1e-9)
    assert set(listed.tables["fate"]) <= {1, 2, 3} and len(listed.tables["fate"]) == len(listed)
    assert start.mass.sum() == pytest.approx(source.mass.sum(), rel=1e-12)


@pytest.mark.validation
def test_the_surface_is_left_and_the_grains_lie_in_it(run):
    from handoff.pages import handoff_report as report

    files = report.gather(run, run / "4_handoff", json.loads((run / "4_handoff" / "handoff.json").read_text()))
    kept = files["start"].identity < files["start"].attributes["bed_grains"]
    datum: Datum = files["region"].shape
    assert datum.height(files["start"].position[kept]).max() < 0.0
    assert (run / "4_handoff" / "cut.png").stat().st_size > 20_000


@pytest.mark.validation
def test_what_leaves_is_the_same_before_and_after_the_handoff(run):
    shock, grains = report_of(run, "2_sph")["escaping"], report_of(run, "5_dem")
    begun, end = grains["escaping_at_start"], grains["escaping"]
    assert begun["mass_kg"] == pytest.approx(shock["mass_kg"], rel=0.05)
    assert begun["beta"] == pytest.approx(shock["beta"], rel=0.05)
    assert begun["beta_vector"] == pytest.approx(shock["beta_vector"], abs=0.05 * shock["beta"])
    # momentum is kept from the impact on: what stays is found in the grains that stay
    assert end["beta_of_the_body"] == pytest.approx(end["beta"], rel=0.01)
    # the crater goes on growing in the grains, and throws out more
    assert end["mass_kg"] > begun["mass_kg"] and 1.0 < end["beta"] / begun["beta"] < 1.3
    assert grains["momentum_error"] < 1e-12 and grains["angular_momentum_error"] < 1e-10
    assert abs(grains["energy_error"]) < 0.05


@pytest.mark.validation
def test_a_turning_body_that_nothing_hit_stays_as_it_is_in_the_grains(run, tmp_path):
    """The particles of the start without the projectile, turned by the time of the handoff: in ten minutes no grain
    moves against the body as a whole."""
    settings = compose.compose(cases.read(written(tmp_path)))
    target = settings["dem"].target
    omega = np.array(json.loads((run / "2_sph" / "target.json").read_text())["angular_velocity_1_s"])
    first = snapshot.read(snapshot.series(run / "2_sph")[0])
    body, turn = first.select(first.layer >= 0), rotation(12.0 * omega)
    body["position"], body["velocity"] = body.position @ turn.T, body.velocity @ turn.T
    body.attributes["time"] = 12.0
    bed = snapshot.read(run / "3_bed" / "bed.vtkhdf")
    column = handing.column_for(run, domain.read(bed.attributes, target))
    start, ledger = handing.hand_over(body, bed, cloud_surface.Rules(crater="any"), column, target=target)
    # rows that count against a flow have none to count against
    for name in ("whole_mass_rel", "whole_momentum_rel", "whole_angular_momentum_rel", "mass_raw_rel"):
        assert ledger[name]["verdict"] == "pass"
    assert len(start) == len(bed)
    for name in ("2_sph", "4_handoff", "5_dem"):
        (tmp_path / name).mkdir()
    shutil.copy(run / "2_sph" / "target.json", tmp_path / "2_sph")
    snapshot.write(start, tmp_path / "4_handoff" / "start.vtkhdf")
    times = {"end_time": 600.0, "latest_time": 600.0, "still_interval": 200.0, "snapshot_interval": 600.0}
    collapse.run(settings["dem"].model_copy(update=times), tmp_path, tmp_path / "5_dem")
    last, report = snapshot.read(tmp_path / "5_dem" / "last.vtkhdf"), report_of(tmp_path, "5_dem")
    centre = last.mass @ last.position / last.mass.sum()
    back = (last.position - centre) @ np.array(report["turned"])
    middle = start.mass @ start.position / start.mass.sum()
    moved = np.linalg.norm(back - (start.position - middle), axis=1)
    assert moved.max() < 0.05 * start.radius.mean()
    assert report["angular_velocity_1_s"] == pytest.approx(omega, abs=0.02 * np.linalg.norm(omega))
    assert report["left"] == 0


@pytest.mark.validation
def test_a_body_of_a_file_goes_the_same_way(tmp_path, run_case):
    """A lumpy mesh in kilometres, coarse and short: whatever the cavity, the whole of it is handed over."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    x, y, z = np.asarray(ball.vertices).T
    r = 0.05 * (1.0 + 0.12 * x * y + 0.1 * z**3 - 0.08 * x**2)
    trimesh.Trimesh(r[:, None] * ball.vertices, ball.faces, process=False).export(tmp_path / "body.ply")
    text = CASE.replace("ellipsoid", "mesh").replace(
        'axes = ["120 m", "110 m", "90 m"]', 'file = "body.ply"\nfile_unit = "1 km"'
    )
    for old, new in (
        ('"8 m"', '"12 m"'), ('end_time = "12 s"', 'end_time = "3 s"'), ("count = 4000", "count = 600"),
        ('time = "last"', 'time = "last"\ncrater = "any"'), ('"5 min"', '"2 min"'),
    ):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    code, out = run_case(written(tmp_path, text))
    assert code in (0, 1)
    rows = {row["name"]: row for row in json.loads((out / "4_handoff" / "ledger.json").read_text())}
    for name in ("whole_mass_rel", "whole_momentum_rel", "whole_angular_momentum_rel"):
        assert rows[name]["verdict"] == "pass"
    found = report_of(out, "5_dem")
    assert found["escaping_at_start"]["beta"] == pytest.approx(report_of(out, "2_sph")["escaping"]["beta"], rel=0.1)
    assert found["momentum_error"] < 1e-12
