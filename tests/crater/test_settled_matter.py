"""Where settled grains came from: a drawn crater whose zones, depths and melt are known."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ejecta import layer_order
from crater.ground import datum as datums
from crater.ground.radial_profile import Profile
from crater.measures.measure import Measures
from crater.measures.uncertainty import Quantity
from crater.pages import report_matter
from crater.shock import settled_matter
from matter.particles import Particles
from pipeline.running import result

R, MASS = 100.0, 50.0
GROUND = datums.plane()


def crater(radius, floor):
    """A crater of a flat ``floor`` [m] and ``radius`` [m], as far as these facts need one."""
    away = np.linspace(0.0, 3.0 * R, 30_001)
    height = np.where(away < radius, floor, 0.0)
    profile = Profile(away, height, height, height, np.ones(30_001), {})
    return Measures({"diameter_apparent_m": Quantity(2.0 * radius, 1.0, "m")}, profile, GROUND, None)


FINAL, TRANSIENT = crater(R, -20.0), crater(80.0, -40.0)


def drawn(turned=True, seed=5, count=30_000):
    """Grains of 1 kg below a final floor at -20 m with a blanket of 10 m: what fills the transient crater is molten
    and came from 5 m down within 30 m, the blanket is half ice of 2 GPa from 4 m to 16 m, turned over or not, all else
    lies where it was. Every fourth grain of the fill is projectile; 100 are in flight, 50 have left."""
    rng = np.random.default_rng(seed)
    away, azimuth = 2.5 * R * np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
    z = rng.uniform(-60.0, 10.0, count)
    empty = (away < R) & (z > -20.0)
    away, azimuth, z = away[~empty], azimuth[~empty], z[~empty]
    n = len(z)
    fill, blanket = (away < 80.0) & (z > -40.0), (away > R) & (z > 0.0)
    within = z / 10.0  # 0 at the bottom of the blanket, 1 at its top
    depth = np.where(blanket, 4.0 + 12.0 * (within if turned else 1.0 - within), np.where(fill, 5.0, -z))
    state = np.zeros(n)
    state[:100], state[100:150] = settled_matter.FLYING, settled_matter.REMOVED
    foreign = fill & (np.arange(n) % 4 == 0)
    peak = np.where(fill, 50e9, np.where(blanket, 2e9, 1e8))
    fields = {
        "position": np.column_stack([away * np.cos(azimuth), away * np.sin(azimuth), z]),
        "mass": np.ones(n), "radius": np.full(n, 1.0), "state": state, "material": np.zeros(n),
        "melting_fraction": fill + 0.5 * blanket, "melt_fraction": 1.0 * fill, "vapour_fraction": np.zeros(n),
        "projectile_fraction": 1.0 * foreign, "peak_pressure_mean": peak, "peak_pressure_largest": peak,
        "first_depth": np.where(foreign, np.nan, depth), "first_distance": np.where(fill, 30.0, away),
    }  # fmt: skip
    return Particles(fields, {"materials": ["ice"]}), fill, blanket


def test_zones_hold_what_was_drawn_into_them():
    grains, fill, blanket = drawn()
    facts = settled_matter.facts(grains, FINAL, TRANSIENT, MASS)
    rests, away = grains.state == 0, np.hypot(grains.position[:, 0], grains.position[:, 1])
    lens, rim, outer = (facts["zones"][name] for name in ("breccia lens", "rim", "blanket"))
    assert lens["mass_kg"] == (fill & rests).sum() and rim["mass_kg"] == (blanket & rests & (away < 1.5 * R)).sum()
    # beyond, only what stands higher than a grain radius
    assert outer["mass_kg"] == (blanket & rests & (away > 1.5 * R) & (grains.position[:, 2] > 1.0)).sum()
    assert lens["first_depth_m"] == {"low": 5.0, "half": 5.0, "high": 5.0} and lens["first_distance_half_m"] == 30.0
    assert lens["projectile_share"] == pytest.approx(0.25, abs=0.02) and rim["projectile_share"] == 0.0
    assert [rim["first_depth_m"][q] for q in ("low", "half", "high")] == pytest.approx([5.2, 10.0, 14.8], abs=0.3)
    assert (lens["melt_fraction"], rim["melt_fraction"], rim["melting_fraction"]) == (1.0, 0.0, 0.5)
    assert rim["peak_pressure_half_Pa"] == pytest.approx(2e9, rel=1e-6)


def test_melt_inside_and_outside_sums_to_all_of_it():
    grains, fill, _ = drawn()
    facts = settled_matter.facts(grains, FINAL, TRANSIENT, MASS)
    molten = facts["over_projectile_mass"]["melt_fraction"]
    inside = fill & (grains.state == 0)
    assert molten["inside"]["value"] == pytest.approx(inside.sum() / MASS)
    assert molten["inside"]["counting_error"] == pytest.approx(np.sqrt(inside.sum()) / MASS)
    assert molten["outside"]["value"] == 0.0
    for name in settled_matter.FRACTIONS:
        parts = sum(part["value"] for part in facts["over_projectile_mass"][name].values())
        assert parts == pytest.approx(float(grains.mass @ grains[name]) / MASS, rel=1e-6)
    assert facts["over_projectile_mass"]["melting_fraction"]["in flight"]["value"] > 0.0
    assert facts["not_known_of"] == [] and facts["without_vapour"] == ["ice"]


def test_first_depths_by_distance_hold_the_matter_above_the_ground():
    grains, _, _ = drawn()
    facts = settled_matter.facts(grains, FINAL, TRANSIENT, MASS)
    above = sum(facts["zones"][name]["mass_kg"] for name in ("rim", "blanket"))
    table = np.array([entry["mass_kg"] for entry in facts["by_distance"]])
    assert table.sum() == pytest.approx(above)
    # 4 to 16 m of a crater 200 m wide: classes 0 to 0.05 and 0.05 to 0.1, half above and half below 10 m
    assert table[:, 2:].sum() == 0.0 and table[0, 0] == pytest.approx(0.5 * table[0].sum(), rel=0.05)


@pytest.mark.parametrize(("turned", "word", "sign"), [(True, "turned over", -1.0), (False, "upright", 1.0)])
def test_layers_that_were_turned_over_are_found_so(turned, word, sign):
    grains, _, _ = drawn(turned)
    rim = settled_matter.facts(grains, FINAL, TRANSIENT, MASS)["rim"]
    assert rim["order"] == word and rim["correlation"] == pytest.approx(sign, abs=0.01) and rim["sigma"] < 0.01


def test_the_error_of_the_order_is_the_scatter_between_draws():
    """Ranks with a true correlation of about -0.5, drawn again and again: the jackknife error is their spread."""
    found = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        height, away, azimuth = rng.random(400), rng.uniform(1.0, 1.5, 400), rng.uniform(0.0, 2.0 * np.pi, 400)
        found.append(layer_order.order(-height + 0.5 * rng.normal(size=400), height, away, azimuth))
    spread = np.std([one["correlation"] for one in found])
    # a jackknife over 12 groups knows its error to 1 / sqrt(22), the spread of 60 draws itself to 1 / sqrt(118)
    assert np.mean([one["sigma"] for one in found]) == pytest.approx(spread, rel=0.3)
    assert {one["order"] for one in found} == {"turned over"}
    few = layer_order.order(np.zeros(5), np.zeros(5), np.ones(5), np.zeros(5))
    assert few["order"] == "undecided" and few["particles"] == 5


def test_one_side_alone_turned_over_does_not_decide():
    """A sector of thick, turned matter among upright layers: leaving it out says that nothing is clear."""
    rng = np.random.default_rng(2)
    azimuth = np.concatenate([rng.uniform(0.0, 0.5, 600), rng.uniform(0.6, 6.2, 350)])
    height = rng.random(950)
    first = np.where(azimuth < 0.55, -height, height)
    rim = layer_order.order(first, height, rng.uniform(1.0, 1.5, 950), azimuth)
    assert rim["correlation"] < -layer_order.CLEAR and rim["p"] < 0.01 and rim["order"] == "undecided"


def test_nothing_is_said_where_nothing_is_known(tmp_path):
    grains, _, _ = drawn()
    bare = Particles({name: grains[name] for name in ("position", "mass", "radius", "state")})
    assert settled_matter.facts(bare, FINAL, TRANSIENT, MASS) == {}
    assert settled_matter.facts(grains, crater(float("nan"), 0.0), TRANSIENT, MASS) == {}
    grains.attributes["materials"] = ["basalt"]
    assert "over_projectile_mass" not in settled_matter.facts(grains, FINAL, TRANSIENT, MASS)
    assert "breccia lens" not in settled_matter.facts(grains, FINAL, None, MASS)["zones"]
    assert report_matter.settled({}, tmp_path) == "" and result._settled({}) == []


def test_page_and_terminal_say_it(tmp_path):
    grains, _, _ = drawn()
    facts = settled_matter.facts(grains, FINAL, TRANSIENT, MASS)
    said = report_matter.settled(facts, tmp_path)
    assert "breccia lens" in said and "turned over" in said and "in flight" in said
    lines = result._settled(facts)
    assert len(lines) == 2 and "breccia lens" in lines[0] and "inside" in lines[1]


def test_a_zone_of_unknown_depth_is_left_out():
    """One grain of projectile alone fills a zone; a file holds null where memory holds NaN."""
    grains, _, _ = drawn()
    facts = settled_matter.facts(grains, FINAL, TRANSIENT, MASS)
    for unknown in (None, float("nan")):
        facts["zones"]["breccia lens"]["first_depth_m"] = dict.fromkeys(("low", "half", "high"), unknown)
        lines = result._settled(facts)
        assert "breccia lens" not in lines[0] and "rim" in lines[0]
