"""Flat ground: its column in balance, its particles, its boundaries, and the stage on it."""

import json
import math

import numpy as np
import pytest
from pydantic import ValidationError

from crater import stage as crater_stage
from handoff.source import hydrostatic
from matter.case.body import Impact, Layer, Projectile, Target
from matter.files import snapshot
from sph import stage
from sph.bodies import ground
from sph.bodies.target import Zones
from sph.materials.rows import collect
from sph.materials.settings import Choice
from tests.sph.stage_runs import finished_run, resumed_run

LAYERS = (Layer(name="rock", material="basalt", thickness=6e3), Layer(name="cover", material="ice", thickness=4e3))
IMPACT = Impact(
    speed=5e3,
    angle_from_vertical=0.0,
    projectile=Projectile(material="basalt", radius=700.0),
    expected_transient_diameter=8e3,
)


def flat(shape, **more):
    return Target(layers=LAYERS, shape=shape, **more)


def settings(shape="half_space", target=None, **changes):
    """A block of a few thousand particles; the pressures that tests ask for are those of ``monaghan``."""
    values = dict(
        numerics="monaghan",
        target=target or flat(shape, gravity=9.81, width=24e3), impact=IMPACT, spacing_at_impact=900.0,
        spacing_far=1500.0, fine_radius=3e3, growth=0.1,
        contact_refinement=1.0, contact_radius=2e3, relaxation_time=4.0, damping=0.5, first_step=0.01, end_time=1.5,
        snapshot_interval=0.5,
        history_interval=0.25, edge_width=3e3,
    )  # fmt: skip
    return stage.Settings(**(values | changes))


def test_the_column_carries_its_weight():
    materials = collect(("basalt", "ice"))
    column = ground.hydrostatic(flat("half_space", gravity=9.81), materials)
    assert column.mass[-1] == pytest.approx(917 * 4e3 + 2700 * 6e3, rel=1e-12)
    edge = int(np.flatnonzero(np.diff(column.layer))[0])
    assert list(np.unique(column.layer[: edge + 1])) == [1] and column.layer[-1] == 0  # ice above basalt
    assert np.interp(column.depth[edge], column.middle, column.pressure) == pytest.approx(917 * 4e3 * 9.81, rel=1e-3)
    # cold compression to second order: P = A mu + B mu^2
    mu = column.density / np.where(column.layer == 0, 2700.0, 917.0) - 1.0
    A = np.where(column.layer == 0, 26.7e9, 9.47e9)
    assert np.abs(column.pressure - A * mu - A * mu * mu).max() < 1e-5 * column.pressure.max()
    assert -column.bottom < 10e3 and column.sunk(np.array([-10e3, 0.0])) == pytest.approx([column.bottom, 0.0])


def test_literal_and_weightless_ground_is_uniform():
    materials = collect(("basalt", "ice"))
    for target in (flat("block", start="literal", gravity=9.81), flat("block")):
        column = ground.hydrostatic(target, materials)
        assert not column.pressure.any() and column.bottom == -10e3


def test_porous_ground_starts_on_its_crush_curve():
    choice = Choice(porosity="p_alpha", p_alpha={"alpha0": 1.5}, crush_quadratic={"Pe": "5 MPa", "Ps": "100 MPa"})
    materials = collect(("basalt", "ice"), {"ice": choice})
    column = ground.hydrostatic(flat("half_space", gravity=9.81), materials)
    ice = column.layer == 1
    P, alpha = column.pressure[ice], column.distention[ice]
    wanted = np.where(P > 5e6, 1 + 0.5 * ((100e6 - P) / 95e6) ** 2, 1.5)
    assert np.abs(alpha - wanted).max() < 0.01 and alpha.min() < 1.4


@pytest.mark.parametrize("shape", ["half_space", "half_sphere", "block"])
@pytest.mark.parametrize("uniform", [True, False])
def test_particles_carry_the_layer_masses(shape, uniform):
    target = flat(shape, gravity=9.81)
    materials = collect(target.materials)
    zones = Zones(900.0, 1.0, 900.0, 1.0, 900.0, 0.1) if uniform else Zones(500.0, 1e3, 700.0, 2e3, 1400.0, 0.1)
    column = ground.hydrostatic(target, materials)
    body = ground.build(target, column, materials, zones, seed=1)
    rho0 = [materials.bulk_density[materials.index(piece.material)] for piece in LAYERS]
    for l, slab in enumerate(ground.slabs_of(target)):
        assert body.mass[body.layer == l].sum() == pytest.approx(rho0[l] * slab.volume, rel=1e-12)
    assert body.position[:, 2].max() < 0.0 and body.position[:, 2].min() > column.bottom
    depth = -body.position[:, 2]
    rock = (body.layer == 0) & (depth > column.depth[column.layer == 1][-1] + 20.0)  # tables jump at the interface
    assert np.interp(depth[rock], column.middle, column.density) == pytest.approx(body.density[rock], rel=1e-4)
    top = np.linalg.norm(body.position, axis=1) < 1e3
    assert top.any() and (body.layer[top] == 1).all()
    if not uniform:
        assert body.h[top].mean() < 0.6 * body.h.max()
    assert (ground.depth_from_sides(target, body.position) > -1.0).all()


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return finished_run(settings(), tmp_path_factory.mktemp("ground")).parent


def test_the_stage_on_flat_ground(finished):
    out = finished / "2_sph"
    target = json.loads((out / "target.json").read_text())
    assert target["frame"] == "plane" and [layer["material"] for layer in target["layers"]] == ["basalt", "ice"]
    column = hydrostatic.read(out / "target.json", 0.0)
    assert (
        column.flat
        and column.surface_gravity == 9.81
        and column.pressure_at(np.array([-2e3]))[0] == pytest.approx(917 * 9.81 * 2e3, rel=1e-2)
    )
    first, last = snapshot.read(snapshot.series(out)[0]), snapshot.read(out / "last.vtkhdf")
    assert first.attributes["frame"] == "plane" and "target_radius_m" not in first.attributes
    # the impact point is the origin: the projectile hangs above it, the ground lies below
    assert (
        first.position[first.layer < 0].mean(axis=0)[:2] == pytest.approx([0.0, 0.0], abs=1.0)
        and first.position[first.layer < 0, 2].min() > 0.0
    )
    assert first.position[first.layer >= 0, 2].max() < 300.0
    # in balance: pressures are the weight above, away from the interface, the edges and the surface
    mid = (
        (first.layer == 0)
        & (first.position[:, 2] < -5e3)
        & (first.position[:, 2] > -8e3)
        & (np.hypot(*first.position[:, :2].T) < 8e3)
    )
    weight = np.interp(-first.position[mid, 2], -column.height[::-1], column.pressure[::-1])
    assert mid.sum() > 20 and np.abs(first.pressure[mid] / weight - 1.0).mean() < 0.15
    # the rim stays where it is
    rim = np.flatnonzero((first.layer >= 0) & (np.hypot(*first.initial_position[:, :2].T) > 12e3 - 1000.0))
    assert np.array_equal(first.position[rim], last.position[rim]) and len(rim) > 10
    assert last.peak_pressure[last.layer == 1].max() > 3e9
    report = json.loads((out / "stage_report.json").read_text())
    assert report["drift_over_projectile"]["energy_J"] < 1e-3
    # what the particles lost went into the edges
    moved = [(shot.mass[:, None] * shot.velocity).sum(axis=0) for shot in (first, last)]
    edges = report["edges"]
    assert (edges["sides"], edges["floor"]) == ("quiet", "quiet")
    assert np.array(edges["momentum_taken_kg_m_s"]) == pytest.approx(
        moved[0] - moved[1], abs=1e-9 * report["projectile"]["momentum_kg_m_s"]
    )
    assert last.attributes["measuring"]["datum"]["kind"] == "plane"


def test_the_crater_stage_measures_a_flat_run(finished):
    out = finished / "6_crater"
    out.mkdir(exist_ok=True)
    crater_stage.run(crater_stage.Settings(target=settings().target, impact=IMPACT, escape_speed=1.0), finished, out)
    measures = json.loads((out / "measures.json").read_text())
    late = measures["late_sph"] if "late_sph" in measures else measures["final"]
    assert late["depth_m"]["value"] is not None and 300.0 < late["depth_m"]["value"] < 8e3
    assert measures["leaving"]["target_mass_kg"] >= 0.0 and "escapes" in measures["fates"]["target_kg"]
    assert "Momentum enhancement" in (out / "report.html").read_text()
    assert "# datum = plane" in (out / "profile.csv").read_text()


def test_nothing_is_said_of_escape_where_the_escape_speed_is_not_known(finished, tmp_path, capsys):
    """Flat ground does not say of which body it is: all that rises would escape."""
    crater_stage.run(crater_stage.Settings(target=settings().target, impact=IMPACT), finished, tmp_path)
    measures = json.loads((tmp_path / "measures.json").read_text())
    assert "leaving" not in measures and "beta" not in json.dumps(measures)
    assert "lands beyond" in measures["fates"]["target_kg"]
    assert "escapes" not in measures["fates"]["target_kg"] and "escapes" not in measures["fates"]["projectile_kg"]
    page = (tmp_path / "report.html").read_text()
    assert "Momentum enhancement" not in page and "Mass that escapes" not in page and "<td>escapes" not in page
    assert "escape" not in capsys.readouterr().out


def test_stopped_and_resumed_ground_is_the_same_to_the_last_bit(finished, tmp_path, monkeypatch):
    assert resumed_run(monkeypatch, settings(), tmp_path, 4.7, finished / "2_sph") == "impact"


def test_a_periodic_block_on_a_wall_resumes_to_the_last_bit(tmp_path, monkeypatch):
    layers = (Layer(name="rock", material="basalt", thickness=6e3),)
    block = Target(layers=layers, shape="block", width=6e3, gravity=9.81)
    chosen = settings(
        target=block,
        sides="periodic",
        floor="wall",
        spacing_at_impact=900.0,
        spacing_far=900.0,
        end_time=0.4,
        relaxation_time=0.5,
        control=True,
    )
    whole = finished_run(chosen, tmp_path / "a")
    assert resumed_run(monkeypatch, chosen, tmp_path / "b", 0.7, whole) == "impact"
    a = snapshot.read(whole / "last.vtkhdf")
    assert a.position[:, 2].min() > -6.3e3 and np.abs(a.velocity).max() < 30.0


@pytest.mark.validation
def test_a_metre_size_sphere_neither_attracts_nor_relaxes(tmp_path):
    ball = Target(layers=(Layer(name="ball", material="basalt", thickness=0.03),), self_gravity=False)
    impact = Impact(
        speed=3200.0,
        angle_from_vertical=math.radians(30),
        projectile=Projectile(material="nylon", radius=3.43e-3),
        expected_transient_diameter=0.03,
    )
    chosen = stage.Settings(
        target=ball, impact=impact, spacing_at_impact=5e-3, spacing_far=5e-3, contact_refinement=1.0,
        contact_radius=5e-3, fine_radius=1e-2,
        first_step=1e-9, end_time=4e-6, snapshot_interval=2e-6, history_interval=1e-6,
    )  # fmt: skip
    stage.run(chosen, tmp_path, tmp_path)
    last = snapshot.read(tmp_path / "last.vtkhdf")
    assert not last.gravity.any() and last.attributes["frame"] == "sphere"
    assert json.loads((tmp_path / "target.json").read_text())["surface_gravity_m_s2"] == 0.0
    report = json.loads((tmp_path / "stage_report.json").read_text())
    assert (
        report["drift_over_projectile"]["energy_J"] < 0.05
        and report["drift_over_projectile"]["momentum_kg_m_s"] < 1e-9
    )


@pytest.mark.parametrize(
    "target,changes,message",
    [
        (flat("half_sphere"), {"floor": "wall"}, "has no floor"),
        (flat("half_space"), {"sides": "periodic"}, "needs the flat sides of a block"),
        (flat("block", gravity=1.0), {"floor": "free"}, "something to stand on"),
        (flat("half_space", gravity=1.0), {"edge_width": 20e3}, "leaves no ground"),
        (Target(layers=LAYERS), {"sides": "quiet"}, "a sphere has neither"),
    ],
)
def test_boundaries_that_make_no_sense_are_refused(target, changes, message):
    with pytest.raises(ValidationError, match=message):
        settings(target=target, **changes)


@pytest.mark.parametrize(
    "more,message", [({"gravity": 1.0}, "a sphere has its own"), ({"width": 1e3}, "as wide as its layers")]
)
def test_a_sphere_has_neither_uniform_gravity_nor_width(more, message):
    with pytest.raises(ValidationError, match=message):
        Target(layers=LAYERS, **more)
