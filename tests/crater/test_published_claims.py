"""Claims scored against runs whose answer is known."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from crater.ground.radial_profile import Profile
from studies.winter_2017 import evidence, published, table_9, valhalla
from studies.winter_2017.evidence import Run, Value

S = np.linspace(10e3, 600e3, 60)


def profile(depth: float, radius: float) -> Profile:
    h = -depth * np.maximum(1.0 - (S / radius) ** 2, 0.0)
    return Profile(S, h, h, h, np.full(60, 9))


def run(
    name: str,
    D: float = 350e3,
    H: float = 75e3,
    t: float = 1008.0,
    end: float | None = 5e3,
    airborne: float = 100,
    annulus=None,
    **more,
) -> Run:
    def q(value, sigma):
        return {"value": value, "sigma": sigma, "unit": "m"}

    crater = {
        "diameter_apparent_m": q(D, 5e3),
        "diameter_rim_m": q(D, 5e3),
        "depth_m": q(H, 5e3),
        "time_s": q(t, 18.0),
        "depth_over_diameter": q(H / D, 0.01),
    }
    measures = {"transient": {"at_maximum_depth": crater, "at_maximum_volume": crater}}
    measures["late_sph"] = {"depth_m": q(end, 2e3), "deepest_ring_m": 3e3}
    time = np.arange(60.0, 1860.0, 60.0)
    series = {"time_s": time, "depth_m": np.full(30, H), "diameter_apparent_m": np.full(30, D)}
    series |= {f"{name}_sigma": np.full(30, 5e3) for name in ("depth_m", "diameter_apparent_m")}
    names = (
        "airborne_projectile",
        "airborne_target_kg",
        "airborne_projectile_kg",
        "projectile_deepest_m",
        "projectile_below_shell",
    )
    inside = {n: np.ones(30) for n in (*names, "interface_down_m", "interface_down_most_m", "below_risen_kg")}
    inside |= {"time_s": time, "airborne_target": np.full(30, float(airborne))}
    ring = (np.array([50e3, 150e3, 250e3]), np.array([1.0, 0.0, 1.0 if annulus else 0.0]))
    values = {
        "shell_m": 150e3,
        "end_s": 1800.0,
        "profile": profile(H, D / 2),
        "damage": ring,
        "annulus": annulus,
        "facts": {"run": name},
        **more,
    }
    return Run(name, measures, series, inside, **values)


def scores(*runs: Run) -> dict[tuple[str, str], evidence.Score]:
    found = evidence.score(valhalla.CLAIMS, {r.name: r for r in runs})
    return {(s.id, s.claim): s for s in found}


def one(found: dict, id: str, part: str = "") -> evidence.Score:
    chosen = [s for (name, claim), s in found.items() if name == id and part in claim]
    assert len(chosen) == 1, (id, part, chosen)
    return chosen[0]


def test_without_runs_only_the_arithmetic_is_scored():
    found = scores()
    told = {s.id for s in found.values() if s.verdict != "not run"}
    assert told == {"W65", "W66", "W67"}
    assert one(found, "W50").why == "missing: 350_base, 350_one"
    assert one(found, "W65").verdict == "not met" and "600 at v1: printed 47.0, right 46.09" in one(found, "W65").why
    assert one(found, "W66").verdict == "met" and one(found, "W67").verdict == "met"


def test_table_9_follows_from_equal_energy():
    for (radius, mass), v in zip(table_9.masses(53.9e3), published.SPEEDS):
        assert mass * v**2 == pytest.approx(6.015e17 * 18234.0**2, rel=1e-3)
        assert mass == pytest.approx(917.0 * 4 / 3 * math.pi * radius**3)


def test_a_run_like_the_published_one_meets_its_claims_and_others_do_not():
    good = scores(run("350_base"))
    for id, part in (
        ("W54", ""),
        ("W55", ""),
        ("W58", "350 km: transient"),
        ("W58", "350 km: the same"),
        ("W60", "350"),
    ):
        assert one(good, id, part).verdict == "met", id
    bad = scores(run("350_base", D=240e3, H=124e3, t=144.0, end=40e3))
    for id, part in (
        ("W54", ""),
        ("W55", ""),
        ("W58", "350 km: transient"),
        ("W58", "350 km: the same"),
        ("W60", "350"),
    ):
        assert one(bad, id, part).verdict == "not met", id
    assert one(scores(run("350_base", end=None)), "W60", "350").verdict == "met"  # no hollow left at all
    blank = run("350_base", D=math.nan, H=math.nan)
    assert one(scores(blank), "W55").verdict == "undecided"


def test_errors_count_in_quadrature_and_on_their_own_side():
    assert evidence.within(Value(100.0, 0.0), 90.0, plus=10.0, minus=1.0) and not evidence.within(
        Value(80.0, 0.0), 90.0, plus=20.0, minus=5.0
    )
    assert (
        evidence.within(Value(95.0, 4.0), 90.0, plus=3.0, minus=3.0)
        and evidence.within(Value(math.nan, 0.0), 1.0, 1.0, 1.0) is None
    )
    assert evidence.ratio_of(Value(2.0, 0.3), Value(4.0, 0.8)).sigma == pytest.approx(0.5 * math.hypot(0.15, 0.2))


def test_particle_numbers_of_the_projectile():
    same = scores(run("350_base", airborne=300), run("350_one", D=355e3, H=80e3, airborne=100))
    assert [one(same, id).verdict for id in ("W50", "W51", "W52")] == ["met", "met", "met"]
    other = scores(run("350_base", airborne=100), run("350_one", D=400e3, H=110e3, airborne=300))
    assert [one(other, id).verdict for id in ("W50", "W51", "W52")] == ["not met", "not met", "not met"]


def test_the_ring_is_met_only_where_there_is_one():
    assert one(scores(run("350_base", annulus=(140e3, 160e3))), "W53").verdict == "met"
    assert one(scores(run("350_base")), "W53").verdict == "not met"


def test_depth_against_shell_diameter_and_angle():
    three = scores(run("350_base"), run("600_base", D=600e3, H=225e3), run("980_base", D=980e3, H=300e3))
    for id in ("W59", "W62", "W63", "W68", "W69"):
        assert one(three, id).verdict == "met", id
    flat = scores(run("350_base", H=160e3), run("600_base", D=420e3, H=140e3), run("980_base", D=480e3, H=130e3))
    for id in ("W62", "W63", "W68", "W69"):
        assert one(flat, id).verdict == "not met", id
    assert (
        one(scores(run("350_angle15", H=90e3), run("350_base"), run("350_angle65", H=60e3)), "W64", "350").verdict
        == "met"
    )
    assert (
        one(
            scores(run("350_angle15", H=90e3, D=450e3), run("350_base"), run("350_angle65", H=60e3)), "W64", "350"
        ).verdict
        == "not met"
    )


def test_equal_energy_and_numerical_settings():
    names = ("350_v1", "350_v3", "350_v4")
    assert one(scores(run("350_base"), *(run(n, D=370e3) for n in names)), "Table 9", "350").verdict == "met"
    assert one(scores(run("350_base"), *(run(n, D=500e3) for n in names)), "Table 9", "350").verdict == "not met"
    assert one(scores(run("980_base"), run("980_courant", H=75.9e3)), "numerics", "Courant").verdict == "met"
    assert one(scores(run("980_base"), run("980_courant", H=78e3)), "numerics", "Courant").verdict == "not met"


def test_the_table_says_every_row_and_counts_the_verdicts(tmp_path):
    found = list(scores(run("350_base")).values())
    text = evidence.as_markdown(found, "A title", "a command")
    assert text.startswith("# A title\n\nMade by `a command`.") and text.count("\n| ") == len(found) + 1
    number = sum(s.verdict == "not run" for s in found)
    assert f"{number} not run" in text
    assert len(json.loads(evidence.as_json(found, "a command"))["claims"]) == len(found)
