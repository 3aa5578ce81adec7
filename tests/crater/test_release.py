"""Melt and vapour by entropy and temperature: masses of drawn particles."""

from __future__ import annotations

import numpy as np
import pytest

from crater.pages import report_matter
from crater.shock import release
from matter.particles import Particles
from pipeline.running import result

ROCK = {
    "melting_temperature_K": 1900.0, "melting_begins": 2700.0, "boiling_temperature_K": 3300.0,
    "boiling_begins": 3400.0, "vapour": 7400.0, "shock_boiling_begins_Pa": 1.8e11, "table": "dunite.txt.xz",
}  # fmt: skip
METAL = {"melting_temperature_K": 925.0}


def heated():
    """Five particles of rock (the last the projectile's), two of metal."""
    fields = {
        "mass": [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0],
        "material": [0, 0, 0, 0, 0, 1, 1],
        "layer": [0, 0, 0, 0, -1, 0, 0],
        "entropy": [2000.0, 3000.0, 4400.0, 9000.0, 8000.0, 0.0, 0.0],
        "peak_pressure": [1e11, 1.7e11, 1.9e11, 9e11, 9e11, 9e11, 9e11],
        "temperature": [1000.0, 2000.0, 1800.0, 5000.0, 3000.0, 900.0, 930.0],
    }
    known = {"basalt": ROCK, "aluminum_6061": METAL}
    return Particles(fields, {"materials": ["basalt", "aluminum_6061"], "release": known})


def test_masses_above_each_critical_entropy_and_the_melting_temperature():
    rock, ball, metal = release.masses(heated(), 2.0)
    assert (rock["material"], rock["body"], ball["body"], metal["material"]) == (
        "basalt", "target", "projectile", "aluminum_6061"
    )  # fmt: skip
    # 4400 J/(kg K) is a quarter of the way from liquid to gas
    assert rock["over_projectile_mass"] == pytest.approx(
        {
            "melting_begins": 7.0,
            "boiling_begins": 6.0,
            "vapour": 4.0,
            "boiled": 4.5,
            "hotter": 5.0,
            "shock_boiling_begins": 6.0,
        }
    )
    assert ball["over_projectile_mass"] == pytest.approx(
        dict.fromkeys(("melting_begins", "boiling_begins", "vapour", "boiled", "hotter", "shock_boiling_begins"), 8.0)
    )
    assert metal["over_projectile_mass"] == {"hotter": 32.0}


def test_the_errors_are_those_of_counting():
    """Of N particles of one mass, n counted: sqrt(n (1 - n / N)) of them, as of a binomial draw."""
    n, N = 30, 400
    entropy = np.where(np.arange(N) < n, 9000.0, 0.0)
    some = Particles(
        {"mass": np.full(N, 0.5), "material": np.zeros(N), "entropy": entropy},
        {"materials": ["basalt"], "release": {"basalt": ROCK}},
    )
    part = release.masses(some, 1.0)[0]
    assert part["counting_error"]["vapour"] == pytest.approx(0.5 * np.sqrt(n * (1.0 - n / N)))
    assert part["counting_error"]["boiled"] == pytest.approx(part["counting_error"]["vapour"])
    assert "hotter" not in part["over_projectile_mass"]  # no temperature in the snapshot


def test_a_snapshot_that_knows_nothing_says_nothing(tmp_path):
    bare = heated()
    bare.attributes = {"materials": ["basalt", "aluminum_6061"]}
    assert release.masses(bare, 2.0) == [] and release.masses(heated(), 0.0) == []
    assert report_matter.heated([]) == "" and result._heated([]) == []


def test_page_and_terminal_say_it():
    facts = release.masses(heated(), 2.0)
    page = report_matter.heated(facts)
    assert "by dunite.txt.xz; its Hugoniot reaches them at 180 GPa (boils)" in page
    assert "aluminum_6061 melts at 925 K." in page and "not known" in page
    assert len(result._heated(facts)) == 3 and "begins to boil: 6" in result._heated(facts)[0]
