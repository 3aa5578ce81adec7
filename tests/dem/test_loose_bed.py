"""Loose beds: at the solid fraction of steady shear, at rest, as heavy as the ground, level, resumed bit for bit."""

import json

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dem.beds import bed_measures, loose_packing, stage
from dem.beds.flat_ground import FlatGround
from dem.beds.settling_phases import LOOSE_PHASES
from dem.collapse import ground_fraction
from dem.contact.settings import Contact, GrainLaw
from dem.trials import angle_of_friction, friction_angle
from matter.files import snapshot
from matter.geometry.ground_region import Cone, Upright
from matter.particles import Particles
from matter.points.packing import hexagonal
from tests.dem import bodies
from tests.dem.stops import interrupted, same_grains
from tests.dem.test_flat_bed import check_at_rest, settled, write_ground

LAW = Contact(static_overlap=0.05, steps_per_contact=20, shell=GrainLaw(friction=0.269))
FRACTION = 0.572
"""``friction_angle.loose_fraction`` of LAW."""
RESTS = loose_packing.at_rest(FRACTION)


@pytest.fixture(autouse=True)
def known(monkeypatch):
    monkeypatch.setattr(friction_angle, "loose_fraction", lambda contact: FRACTION)


@pytest.mark.validation
@pytest.mark.parametrize(("friction", "stiffness", "fraction"), angle_of_friction.LOOSE)
def test_the_kept_fractions_are_those_of_steady_shear(friction, stiffness, fraction):
    law = friction_angle.with_friction(LAW, friction)
    found = friction_angle.measure(law, seed=1, inertial=friction_angle.FLOWING, stiffness=stiffness)
    assert found["fraction"] == pytest.approx(fraction, abs=0.003)


def test_a_kept_fraction_is_that_of_its_law_alone(monkeypatch):
    """Softer springs, another friction, another shape: measured; the weight of the bed makes the stiffness."""
    monkeypatch.undo()
    monkeypatch.setattr(friction_angle, "measure", lambda *args, **options: {"fraction": options["stiffness"]})
    assert friction_angle.loose_fraction(LAW) == pytest.approx(FRACTION, abs=5e-4)
    deeper = LAW.model_copy(update={"static_overlap": 0.04})
    assert friction_angle.loose_fraction(deeper) == pytest.approx(1.0 / (0.03 * 0.04))
    rounder = LAW.model_copy(update={"shell": GrainLaw(friction=0.269, shape=0.3)})
    for other in (friction_angle.with_friction(LAW, 0.27), rounder):
        assert friction_angle.loose_fraction(other) == pytest.approx(1.0 / (0.03 * 0.05))


@pytest.fixture(
    scope="module",
    params=[
        "bowl",
        pytest.param("box", marks=pytest.mark.validation),
        pytest.param("cylinder", marks=pytest.mark.validation),
    ],
)
def loose(request, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction_angle, "loose_fraction", lambda contact: FRACTION)
        return settled(
            tmp_path_factory.mktemp(request.param), shape=request.param, packing="loose", contact=LAW, count=1500
        )


def test_it_rests_between_what_shear_leaves_and_a_close_packing(loose):
    """Within 0.005 in a bed of many grains; the bulk of 1,500 is some two hundred, whose fraction scatters by 0.004.
    A random close packing has 0.645."""
    _, report = loose
    check_at_rest(report)
    assert report["packing_fraction"] == pytest.approx(RESTS, abs=0.012)
    assert 4.0 < report["coordination_number_bulk"] < 5.2


def test_its_surface_is_level_at_the_datum(loose):
    """What the grains below the datum fill, of the whole from the floor up, is the bulk to a tenth of a radius less
    the layer along the walls; headroom reaches as high as it is asked to, within a radius."""
    bed, report = loose
    box, below = Upright.of_attribute(report["domain"]), bed.headroom == 0
    inside = box.side_depth(bed.position) > 3.0 * bed.radius.mean()
    high, r = bed.position[:, 2], bed.radius.mean()
    upper = below & inside & (high > -2.0 * r)
    assert -0.6 * r < high[below & inside].max() < 0.6 * r
    assert upper.sum() > 20
    head = bed.position[(bed.headroom == 1) & inside, 2]
    assert box.top - 3.0 * r < np.percentile(head, 99.0) + r < box.top + 3.0 * r


def test_headroom_lies_on_the_bed(loose):
    """Grains of the lowest layer of the headroom touch three others within half a percent of a radius. Where they were
    only moved out of the bed that had come to rest below them, a third did not."""
    bed, _ = loose
    r = bed.radius.mean()
    distance, near = cKDTree(bed.position).query(bed.position, k=13)
    gap = np.sort(distance[:, 1:] - bed.radius[:, None] - bed.radius[near[:, 1:]], axis=1)
    lowest = (bed.headroom == 1) & (bed.position[:, 2] < r)
    assert lowest.sum() > 50
    assert np.mean(gap[lowest, 2] < 0.005 * r) > 0.85


@pytest.mark.validation
def test_a_loose_bed_that_was_stopped_resumes_bit_for_bit(tmp_path, monkeypatch):
    beds = []
    for name in ("whole", "resumed"):
        stops = () if name == "whole" else (150, 900, 1000, 2500)
        interrupted(
            monkeypatch,
            stops,
            lambda name=name: beds.append(settled(tmp_path / name, packing="loose", contact=LAW, count=300)),
        )
    same_grains(beds[0][0], beds[1][0])


@pytest.mark.validation
def test_a_cap_is_loose_where_it_is_solid(tmp_path, bed_settings):
    """The ocean of an icy body has no friction: its grains rest closely packed, the ice on it loosely."""
    bodies.write_callisto(tmp_path / "2_sph" / "target.json")
    (tmp_path / "3_bed").mkdir()
    settings = bed_settings.model_copy(update={"packing": "loose", "count": 2500, "contact": LAW})
    stage.run(settings, tmp_path, tmp_path / "3_bed")
    report = json.loads((tmp_path / "3_bed" / "bed_report.json").read_text())
    assert report["residual_speed_over_sqrt_g_r"]["rms"] < 1e-3 and report["free_run_speed_over_sqrt_g_r"] < 1e-3
    assert abs(report["mass_error"]) < 0.01
    assert report["floor_pressure_Pa"] == pytest.approx(report["floor_pressure_target_Pa"], rel=0.05)
    bed = snapshot.read(tmp_path / "3_bed" / "bed.vtkhdf")
    domain = Cone.of_attribute(bed.attributes["domain"])
    height, r = domain.height(bed.position), bed.radius.mean()
    inner = domain.side_depth(bed.position) > 3.0 * r
    solid = inner & (height > 1946.9e3 + r) & (height < 2101.8e3 - r)
    liquid = inner & (height > 1802.8e3 + r) & (height < 1946.9e3 - r)
    found = [bed_measures.bulk_fraction_where(bed.position, bed.radius, mask) for mask in (liquid, solid)]
    assert found[0] > 0.64 and found[1] < 0.61 and found[0] - found[1] > 0.05


def test_a_liquid_alone_is_close(tmp_path, monkeypatch):
    """Nothing is measured where nothing has friction."""
    monkeypatch.setattr("dem.contact.settings.LIQUIDS", ("basalt",))
    write_ground(tmp_path / "target.json")
    ground, contact = FlatGround.read(tmp_path / "target.json"), Contact()
    box = Upright("box", 10.0, -10.0, 2.0)
    loose = loose_packing.LooseBed.of_law(ground, box, contact)
    assert loose.fraction.tolist() == [loose_packing.CLOSE]
    assert [phase.name for phase in loose.phases(1.0)] == [phase.name for phase in LOOSE_PHASES]


def test_radii_and_height_at_the_start_follow_from_the_fraction(tmp_path):
    """All grains, grown, make the wanted part of what the box holds without its walls' layer, first higher up."""
    write_ground(tmp_path / "target.json")
    box = Upright("box", 10.0, -10.0, 2.0)
    loose = loose_packing.LooseBed(FlatGround.read(tmp_path / "target.json"), box, np.array([0.57]))
    radius = loose.radii(np.random.default_rng(1).uniform(0.85, 1.15, 1000))
    volume = 4.0 / 3.0 * np.pi * float(np.sum((loose_packing.GROWN * radius) ** 3))
    empty = loose_packing.ALONG_WALLS * radius.mean()
    assert volume == pytest.approx(0.57 * 4.0 * (10.0 - empty) ** 2 * (12.0 - empty), rel=0.01)
    begins = float(loose_packing.begins(np.array([0.57]))[0])
    assert begins < 0.57
    higher = loose.raised(radius).top - box.top
    assert higher == pytest.approx((0.57 / begins - 1.0) * (12.0 - empty) + empty, abs=0.03)


def test_the_fraction_round_a_cavity_is_that_of_the_packing():
    """A hexagonal packing with a hole: pi / sqrt(18) in the ring, whatever flies above it; nothing is said where the
    ring holds few grains."""
    radius = 0.5
    points = hexagonal(2.0 * radius / 2.0 ** (1.0 / 6.0), 27.0, rotate=True)
    box = Upright("box", 15.0, -15.0, 2.0)
    points = points[(points[:, 2] < 0.0) & (np.abs(points).max(axis=1) < 15.0)]
    points = points[np.linalg.norm(points, axis=1) > 6.0]
    grains = Particles(
        {"position": points, "radius": np.full(len(points), radius), "state": np.zeros(len(points))}, {"time": 1.0}
    )
    found = ground_fraction.measured(grains, box, 7.0)
    assert found == pytest.approx(np.pi / np.sqrt(18.0), abs=0.006)
    here = ground_fraction.in_ring(points, box, 7.0)
    grains["state"] = np.where(here & (np.arange(len(points)) % 4 == 0), 1.0, 0.0)
    assert ground_fraction.measured(grains, box, 7.0) < found
    assert ground_fraction.measured(grains, box, 1.5) is None
