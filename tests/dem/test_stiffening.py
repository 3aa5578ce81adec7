"""Springs stiffened between bed and collapse: balance, step, overlaps, resuming, what is refused."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from dem import stage
from dem.beds.flat_ground import ground_of
from dem.collapse import collapse_run as collapsing
from dem.contact.grain_solid import elastic
from dem.contact.settings import Contact
from dem.stiffness.stiffening import fastest_approach, springs_for
from matter.case import at_rest
from matter.files import snapshot
from tests.dem.stops import interrupted, same_grains
from tests.dem.test_flat_bed import settled, write_ground


@pytest.fixture(scope="module")
def small_bed(tmp_path_factory):
    return settled(tmp_path_factory.mktemp("small"), radius_spread=0.0, arc_radius=9.0, count=250)[0]


def collapse(bed, folder, name="run", **settings):
    """A collapse of the bed without its headroom, on uniform ground, made but not run."""
    out = folder / name
    out.mkdir(exist_ok=True)
    write_ground(folder / "target.json", depth=9.0)
    below = bed.select(bed.headroom == 0)
    below.tables.update(bed.tables)
    below.attributes["time"] = 0.0
    usual = dict(
        end_time=4.0,
        latest_time=4.0,
        still_interval=2.0,
        snapshot_interval=1.0,
        history_interval=0.5,
        contact=Contact(static_overlap=0.01),
    )
    return collapsing.Collapse(stage.Settings(**{**usual, **settings}), below, ground_of(folder / "target.json"), out)


def test_a_stiffened_bed_stays_in_balance(small_bed, tmp_path):
    """Springs for 2 m/s under a bed that settled in springs for its weight: the same forces, the step of the new
    springs, and it stays where it is."""
    bed = small_bed
    soft, stiff = collapse(bed, tmp_path, springs_for="bed"), collapse(bed, tmp_path, springs_for="2 m/s")
    assert soft.springs.factor == 1.0 and not soft.bed.scheme.offset
    one, two = soft.bed, stiff.bed
    wanted = two.mass * (2.0 / (0.01 * two.X[:, 3])) ** 2
    assert np.mean(two.V[:, 7] / wanted) == pytest.approx(1.0, rel=1e-3)
    q = stiff.springs.factor
    assert q > 10.0 and two.dt == pytest.approx(one.dt / math.sqrt(q)) == pytest.approx(
        Contact().time_step(two.particles({})), rel=1e-9
    )
    assert stiff.domain.damping_rate == pytest.approx(soft.domain.damping_rate * math.sqrt(q))
    before, after = stiff.springs_energy
    assert before == pytest.approx(one.elastic) and after == pytest.approx(before / q, rel=1e-9)
    for each in (one, two):  # headroom is gone, nothing else: the forces of the first step
        each.step()
    assert (
        two.contacts == one.contacts and np.abs(two.particles({}).velocity - one.particles({}).velocity).max() < 1e-4
    )  # m/s at g = 1
    assert np.percentile(np.abs(two.A[:, :3]).max(axis=1), 95) < 0.02
    before = two.particles({}).position
    while two.time < 1.0:
        two.step()
    assert np.linalg.norm(two.particles({}).position - before, axis=1).max() < 0.02 * bed.radius.mean()
    assert two.worst < 0.5 * 0.01  # 0.03 of x_max at rest


def test_the_springs_of_a_start_are_for_its_fastest_approach(small_bed, tmp_path):
    bed = small_bed
    moving = bed.select(bed.headroom == 0)
    moving.attributes["bed_grains"] = int(bed.identity.max()) + 1
    other = int(np.argmin(np.linalg.norm(moving.position - [0.0, 0.0, -4.0], axis=1)))
    moving["velocity"][other] = [0.0, 0.0, -3.0]
    speed = fastest_approach(moving)
    way = np.delete(moving.position, other, axis=0) - moving.position[other]
    distance = np.linalg.norm(way, axis=1)
    near = distance < 2.3 * moving.radius[0]
    assert speed == pytest.approx(
        3.0 * np.max(-way[near, 2] / distance[near]), abs=1e-4
    )  # along the line to the neighbour that lies most in its way
    assert 1.0 < speed < 2.99
    chosen = springs_for("auto", moving, Contact(static_overlap=0.01), sphere=False)
    assert chosen.speed == speed and chosen.factor == pytest.approx(
        float(np.mean(moving.mass * (speed / 0.01 / moving.radius) ** 2 / moving.stiffness))
    )
    assert springs_for("bed", moving, Contact(), sphere=False) == (0.0, 1.0)
    # a sphere's grains too, unless they have the springs of their solid, which a large body's weight asks for
    assert springs_for("auto", moving, Contact(static_overlap=0.01), sphere=True) == chosen
    stiff = moving.select(np.ones(len(moving), dtype=bool))
    stiff["stiffness"] = 2.0 * elastic(stiff.attributes["materials"][0])[0] * stiff.radius
    assert springs_for("auto", stiff, Contact(static_overlap=0.01), sphere=True) == (0.0, 1.0)
    assert springs_for(1e-9, moving, Contact(), sphere=False).factor == 1.0  # never softer
    assert (
        springs_for(1e9, moving, Contact(), sphere=False).factor < 1e12
    )  # nor faster than twice the sound speed of the material
    moving["identity"][other] += int(bed.identity.max()) + 1  # ejecta do not count
    assert springs_for("auto", moving, Contact(), sphere=False) == (0.0, 1.0)


def test_springs_are_bounded_by_the_sound_speed_of_the_solid_that_was_computed_with(small_bed):
    """k_n goes as the squared sound speed, K / rho0; a start that says nothing takes the material's file."""
    start = small_bed.select(small_bed.headroom == 0)
    names = start.attributes["materials"]
    plain = springs_for(1e9, start, Contact(), sphere=False).factor
    start.attributes["reference_densities_kg_m3"] = [at_rest.of_file(name).solid for name in names]
    assert springs_for(1e9, start, Contact(), sphere=False).factor == plain
    start.attributes["reference_densities_kg_m3"] = [2.0 * at_rest.of_file(name).solid for name in names]
    assert springs_for(1e9, start, Contact(), sphere=False).factor == pytest.approx(0.5 * plain, rel=1e-12)


def test_an_approach_at_the_speed_of_the_springs_overlaps_by_the_share_they_are_for(small_bed, tmp_path):
    bed = small_bed
    made = collapse(bed, tmp_path, springs_for="2 m/s")
    box = made.bed
    top = int(np.argmax(np.where(np.hypot(box.X[:, 0], box.X[:, 1]) < 4.0, box.X[:, 2], -np.inf)))
    box.W[top, 2] = -2.0
    deepest = 0.0
    for _ in range(60):
        box.step()
        deepest = max(deepest, box.worst)
    assert 0.3 * 0.01 < deepest < 1.2 * 0.01


def test_a_stiffened_run_resumes_bit_for_bit(small_bed, tmp_path, monkeypatch):
    bed = small_bed
    ends = []
    for name, stops in (("whole", ()), ("resumed", (5, 61, 300))):

        def go(name=name):
            made = collapse(
                bed,
                tmp_path,
                name,
                springs_for="1 m/s",
                end_time=0.3,
                latest_time=0.3,
                stiffness="following",
                history_interval=0.01,
            )
            saved = stage.checkpoint.newest(tmp_path / name)
            if saved is not None:
                made.restore(*saved)
            made.advance()
            made.finish()

        interrupted(monkeypatch, stops, go)
        ends.append((snapshot.read(tmp_path / name / "last.vtkhdf"), (tmp_path / name / "history.csv").read_text()))
    same_grains(ends[0][0], ends[1][0])
    assert ends[0][1] == ends[1][1]
    assert ends[0][0].tables["contacts/history"].shape[1] == 8 and np.any(
        ends[0][0].tables["contacts/history"][:, 7] != 0.0
    )


def test_another_engine_has_no_offsets():
    with pytest.raises(ValidationError, match="needs contacts with offsets, which lammps has not"):
        stage.Settings(engine="lammps", springs_for="0.025 m/s")
    stage.Settings(engine="lammps")
