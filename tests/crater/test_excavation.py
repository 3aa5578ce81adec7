"""The catalogue of ejecta and where they came from: particles whose flights and first places are known."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from crater.ejecta import catalogue as catalogues
from crater.ejecta import ejecta_flight, excavation, size_classes
from crater.ground import datum as datums
from crater.pages import report_matter
from crater.results import thrown_out
from crater.results.findings import Ejected, Setting
from matter.errors import InputError
from matter.files import archive
from matter.particles import Particles
from pipeline.running import result

G, CRATER = 10.0, 100.0
GROUND = datums.plane()
TIMES = np.arange(0.0, 21.0, 1.0)


def shots(velocity, mass, layer, start=3.0):
    """Particles that leave the origin's neighbourhood at ``start`` and fly freely; they rest before and after."""
    velocity, frames = np.asarray(velocity, float), []
    for time in TIMES:
        t = np.clip(time - start, 0.0, None)
        down = np.maximum(2.0 * velocity[:, 2] / G, 0.0)
        t = np.minimum(t, np.where(velocity[:, 2] > 0.0, down, 0.0))
        position = velocity * t[:, None] + np.array([1.0, 0.0, 0.0])
        position[:, 2] -= 0.5 * G * t**2
        flying = (t > 0.0) & (t < down)
        now = np.where(flying[:, None], velocity - np.outer(t, [0.0, 0.0, G]), 0.0)
        frames.append(Particles({"position": position, "velocity": now, "mass": mass, "layer": layer}, {"time": time}))
    return frames


VELOCITY = [[5.0, 0.0, 30.0], [60.0, 0.0, 20.0], [0.0, 0.0, -1.0], [200.0, 0.0, 200.0], [40.0, 0.0, 20.0]]
MASS, LAYER = np.array([1.0, 2.0, 4.0, 8.0, 16.0]), np.array([0, 0, 0, 0, -1])


def found(escape=250.0, **changed):
    frames = shots(VELOCITY, MASS, LAYER, **changed)
    return catalogues.ejecta_catalogue(frames, GROUND, G, 2.0, escape), frames[-1]


def test_each_particle_is_led_to_its_launch_and_its_fate():
    rows, _ = found()
    order = np.argsort(rows.number)
    assert rows.number[order].tolist() == [0, 1, 3, 4]
    assert rows.time == pytest.approx(np.full(4, 3.0)) and rows.position == pytest.approx(
        np.tile([1.0, 0.0, 0.0], (4, 1)), abs=1e-9
    )
    velocity = np.array(VELOCITY)[rows.number]
    assert rows.velocity == pytest.approx(velocity)
    assert rows.speed == pytest.approx(np.linalg.norm(velocity, axis=1))
    assert np.sin(rows.angle) == pytest.approx(velocity[:, 2] / rows.speed)
    fates = {
        name: set(rows.number[rows_of].tolist()) for name, rows_of in catalogues.where(rows, GROUND, CRATER).items()
    }
    assert fates == {"falls back inside": {0}, "lands beyond": {1, 4}, "escapes": {3}, "circles": set()}
    assert rows.landing_time[rows.number == 1] == pytest.approx(7.0)


def test_mass_by_fate_closes_and_says_so_where_it_does_not():
    rows, last = found()
    facts = catalogues.masses(rows, GROUND, CRATER, last)
    assert facts["target_kg"] == {
        "falls back inside": 1.0, "lands beyond": 2.0, "escapes": 8.0, "circles": 0.0, "not thrown out": 4.0
    }  # fmt: skip
    assert facts["projectile_kg"]["lands beyond"] == 16.0 and facts["closure"] < 1e-12
    assert facts["landed"] == {"particles": 3, "distance_over_free_flight": pytest.approx(1.0)}
    frames = shots(VELOCITY, MASS, LAYER)
    frames[-1]["mass"] = MASS + np.array([0.0, 0.0, 0.5, 0.0, 0.0])
    spoiled = catalogues.masses(catalogues.ejecta_catalogue(frames, GROUND, G, 2.0, 250.0), GROUND, CRATER, last)
    assert spoiled["closure"] == pytest.approx(0.5 / 31.0)
    with pytest.raises(InputError, match="do not hold the same particles"):
        catalogues.ejecta_catalogue([frames[0], frames[1].select(np.arange(4))], GROUND, G, 2.0, 0.0)


def test_on_a_body_the_catalogue_is_the_same_turned_about():
    """Slow ejecta on a large sphere whose impact point lies on +y."""
    radius = 1e7
    body = datums.sphere(radius, axis=(0.0, 1.0, 0.0))
    frames = shots(VELOCITY, MASS, LAYER)
    for frame in frames:
        frame["position"] = body.outside(frame.position + np.array([0.0, 0.0, radius]))
        frame["velocity"] = frame.velocity @ np.asarray(body.axes)
    rows = catalogues.ejecta_catalogue(frames, body, G, 2.0, 0.0)
    flat, _ = found(0.0)
    assert rows.number.tolist() == flat.number.tolist() and (rows.fate == ejecta_flight.FALLS).all()
    assert catalogues.distance(rows, body) == pytest.approx(catalogues.distance(flat, GROUND), rel=2e-3)
    assert rows.speed == pytest.approx(flat.speed, rel=1e-5) and rows.angle == pytest.approx(flat.angle, abs=1e-4)


def test_the_file_holds_the_catalogue_with_material_and_shock(tmp_path):
    rows, last = found()
    last["material"], last["peak_pressure"] = np.array([0, 1, 0, 1, 0]), np.arange(5.0) * 1e9
    last.attributes["materials"] = ["ice", "basalt"]
    catalogues.write(rows, last, GROUND, G, tmp_path / "ejecta.h5")
    arrays, facts = archive.read(tmp_path / "ejecta.h5")
    assert arrays["material"].tolist() == last.material[rows.number].tolist()
    assert arrays["peak_pressure"].tolist() == last.peak_pressure[rows.number].tolist()
    assert [str(name) for name in facts["fates"]] == list(ejecta_flight.FATES) and list(facts["materials"]) == [
        "ice",
        "basalt",
    ]
    assert arrays["speed"].tolist() == rows.speed.tolist()
    assert facts["frame"] == "plane" and facts["gravity_m_s2"] == G and "radius_m" not in facts
    catalogues.write(rows, last, datums.sphere(9.0, axis=(0.0, 1.0, 0.0)), G, tmp_path / "body.h5")
    assert archive.read(tmp_path / "body.h5")[1]["radius_m"] == 9.0


# --- where it came from ---


def thrown(seed=3, count=4000):
    """Ejecta of a crater of radius 100 m: each from a depth up to 20 m at a distance up to 90 m, the deeper the nearer
    it lands; one in ten falls back inside, and 50 leave late, from 150 m down."""
    rng = np.random.default_rng(seed)
    depth, away, mass = rng.uniform(0.0, 20.0, count), rng.uniform(0.0, 90.0, count), rng.uniform(1.0, 2.0, count)
    depth[:50] = 150.0
    first = np.column_stack([away, np.zeros(count), -depth])
    landing = np.column_stack([CRATER * (1.2 + 4.0 * (1.0 - np.minimum(depth, 20.0) / 20.0)), np.zeros((count, 2))])
    landing[::10, 0] = 50.0
    fate = np.zeros(count, dtype=np.int8)
    fate[1::10] = ejecta_flight.ESCAPES
    time = np.where(np.arange(count) < 50, 20.0, 1.0)
    rows = catalogues.Catalogue(
        np.arange(count), first * 0.0, time, first * 0.0, mass, mass, mass, np.zeros(count, int), fate, landing,
        time + 5.0, (float(mass.sum()), 0.0), (0.0, 0.0),
    )  # fmt: skip
    fields = {"position": landing, "initial_position": first, "mass": mass, "layer": np.zeros(count)}
    return rows, Particles(fields | {"peak_pressure": 1e9 * (1.0 + depth)}, {"time": 10.0})


def test_depth_and_radius_of_excavation_are_quantiles_of_what_left_in_time():
    rows, last = thrown()
    facts = excavation.facts(rows, last, GROUND, GROUND, CRATER, 10.0)
    assert facts["depth_m"] == pytest.approx(19.0, abs=0.3) and facts["depth_half_m"] == pytest.approx(10.0, abs=0.6)
    assert facts["depth_greatest_m"] <= 20.0 and facts["radius_m"] == pytest.approx(85.5, abs=1.0)
    assert facts["depth_over_transient_diameter"] == pytest.approx(facts["depth_m"] / 200.0)
    assert facts["peak_pressure_Pa"]["share"] == pytest.approx(20e9, rel=0.02)
    inside = np.arange(len(rows.mass)) % 10 == 0
    late = rows.time > 10.0
    assert facts["mass_kg"] == pytest.approx(rows.mass[~inside & ~late].sum())
    assert facts["later_kg"] == pytest.approx(rows.mass[~inside & late].sum())
    with pytest.raises(InputError, match="nothing of the target"):
        excavation.facts(rows, last, GROUND, GROUND, 1e9, 0.5)


def test_the_blanket_says_which_depth_lies_where():
    """Deep matter next to the rim, shallow matter far out; the classes hold all that was thrown out."""
    rows, last = thrown()
    facts = excavation.facts(rows, last, GROUND, GROUND, CRATER, 10.0)
    mass = np.array([entry["mass_kg"] for entry in facts["blanket"]])
    assert mass.sum() == pytest.approx(facts["mass_kg"], rel=1e-12)
    assert len(mass) == len(excavation.RANGES) + 1 and facts["blanket"][-1]["escapes"]
    near, far = mass[0], mass[3]  # 1 to 1.5 R: first depths of 18.5 to 20 m; 3 to 5 R: 1 to 11 m
    assert near[1] > 0.0 and near[0] == near[2] == 0.0 and far[0] > 9.0 * far[1] > 0.0
    escaped = (rows.fate == ejecta_flight.ESCAPES) & (rows.time <= 10.0) & (np.arange(len(rows.mass)) % 10 != 0)
    assert mass[-1].sum() == pytest.approx(rows.mass[escaped].sum())
    assert facts["blanket"][0]["peak_pressure_half_Pa"] > facts["blanket"][3]["peak_pressure_half_Pa"]


@pytest.mark.parametrize(
    ("ground", "speed", "known"), [("plane", 0.0, False), ("plane", 250.0, True), ("sphere", 0.0, True)]
)
def test_who_knows_no_escape_speed_has_no_row_for_what_escapes(monkeypatch, ground, speed, known):
    """Flat ground does not say of which body it is; of a body the speed follows."""
    rows, last = thrown()
    if not known:
        rows = rows._replace(fate=np.zeros_like(rows.fate))
    datum = GROUND if ground == "plane" else datums.sphere(1e4)
    setting = Setting(SimpleNamespace(escape_speed=speed), Path(), datum, G, (1.0, 1.0))
    moment = SimpleNamespace(value=lambda name: 2.0 * CRATER, measures=SimpleNamespace(datum=GROUND), time=10.0)
    monkeypatch.setattr(catalogues, "ejecta_catalogue", lambda *_: rows)
    monkeypatch.setattr(size_classes, "sizes", lambda *_: np.zeros(len(rows.mass)))
    monkeypatch.setattr(size_classes, "masses", lambda *_: {"dust": dict.fromkeys(("lands beyond", "escapes"), 1.0)})
    found, reasons = thrown_out.of_run(setting, Ejected(), moment, False, [], last)
    assert setting.escape_known == known and not reasons
    tables = [found.fates["target_kg"], found.fates["projectile_kg"], found.fates["size_classes_kg"]["dust"]]
    assert [("escapes" in table) for table in tables] == [known] * 3
    assert [part["escapes"] for part in found.excavation["blanket"]].count(True) == known
    assert ("<td>escapes" in report_matter.fates(found.fates)) == known


def rim(turned):
    """A block of ground 300 m wide, its upper 20 m between 100 and 150 m from the axis raised, in order or upside
    down."""
    step = 5.0
    x = np.arange(-175.0, 176.0, step)
    first = np.stack(np.meshgrid(x, x, np.arange(-2.5, -40.0, -step), indexing="ij"), axis=-1).reshape(-1, 3)
    away = np.hypot(first[:, 0], first[:, 1])
    now, top = first.copy(), (away > 100.0) & (away < 150.0) & (first[:, 2] > -20.0)
    now[top, 2] = -first[top, 2] + 0.0 if turned else first[top, 2] + 20.0
    now[(away < 100.0), 2] -= 15.0
    fields = {"position": now, "initial_position": first, "velocity": now * 0.0, "mass": np.full(len(now), 1e5)}
    fields |= {"density": np.full(len(now), 1e5 / step**3), "layer": np.zeros(len(now))}
    return Particles(fields)


@pytest.mark.parametrize("turned,order,sign", [(True, "turned over", -1), (False, "upright", 1)])
def test_layers_at_the_rim_are_seen_turned_over_or_upright(turned, order, sign):
    facts = excavation.turned(rim(turned), GROUND, GROUND, CRATER)
    assert facts["order"] == order and sign * facts["correlation"] > 0.9 and facts["particles"] > 500


def test_a_rim_of_few_particles_or_without_order_is_undecided():
    few = rim(True)
    assert excavation.turned(few.select(few.position[:, 2] < 0.0), GROUND, GROUND, CRATER)["order"] == "undecided"
    mixed, rng = rim(True), np.random.default_rng(1)
    mixed["initial_position"] = rng.permutation(mixed.initial_position)
    assert excavation.turned(mixed, GROUND, GROUND, CRATER)["order"] == "undecided"


def test_the_page_says_it_in_words(tmp_path):
    rows, last = thrown()
    facts = excavation.facts(rows, last, GROUND, GROUND, CRATER, 10.0)
    text = report_matter.excavated(facts, 1e3, tmp_path)
    assert "0.09" in text and "of the transient apparent diameter" in text and "undecided" in text
    assert "still grew" not in text and "still grew" in report_matter.excavated(
        {**facts, "growing": True}, 1.0, tmp_path
    )
    assert (
        result._excavated(facts)[0].startswith("excavated: ")
        and "0.09 of the transient" in result._excavated(facts)[0]
    )
    words = report_matter.fates(catalogues.masses(*found()[:1], GROUND, CRATER, found()[1]))
    assert "lands beyond" in words and "16 kg" in words and report_matter.fates({}) == ""
    assert report_matter.excavated({}, 1.0, tmp_path) == ""
