"""Pieces of ejecta: drawn groups of whole and broken particles."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ejecta import catalogue as catalogues
from crater.ejecta import ejecta_flight, size_classes
from crater.ground import datum as datums
from crater.pages import report_matter
from matter.files import archive
from matter.particles import Particles

GROUND = datums.plane()


def thrown():
    """A block of 3 x 3 x 3 whole particles 1 m apart, a pair, a loner, four broken ones between them, two of the
    projectile beside the loner; on the ground 50 whole and 5 broken ones that were not thrown."""
    block = np.stack(np.meshgrid(*3 * [np.arange(3.0)], indexing="ij"), axis=-1).reshape(-1, 3) + [0.0, 0.0, 50.0]
    pair = np.array([[20.0, 0.0, 50.0], [21.0, 0.0, 50.0]])
    alone, broken = np.array([[40.0, 0.0, 50.0]]), np.array([[3.0, 0, 50], [3.0, 1, 50], [22.0, 0, 50], [41.0, 0, 50]])
    foreign = np.array([[40.0, 1.0, 50.0], [40.0, 2.0, 50.0]])
    ground = np.column_stack([np.arange(55.0), np.zeros((55, 2))])
    place = np.concatenate([block, pair, alone, broken, foreign, ground])
    n = len(place)
    damage, layer = np.zeros(n), np.zeros(n)
    damage[30:34], layer[34:36], damage[-5:] = 1.0, -1, 0.6
    fields = {
        "position": place, "mass": np.full(n, 2.0), "density": np.full(n, 1000.0), "damage": damage,
        "layer": layer, "support_radius": np.full(n, 2.0), "velocity": np.zeros((n, 3)),
    }  # fmt: skip
    number = np.arange(36)
    fate = np.where(number < 27, ejecta_flight.ESCAPES, ejecta_flight.FALLS)
    nil, landing = (
        np.zeros(36),
        np.where((fate == ejecta_flight.ESCAPES)[:, None], np.nan, np.array([[500.0, 0.0, 0.0]])),
    )
    rows = catalogues.Catalogue(
        number, np.zeros((36, 3)), nil, np.zeros((36, 3)), nil, nil, np.full(36, 2.0), layer[:36], fate, landing, nil,
        (0.0, 0.0), (0.0, 0.0),
    )  # fmt: skip
    return rows, Particles(fields, {"time": 1.0})


def test_whole_particles_that_hang_together_are_a_piece():
    rows, last = thrown()
    sizes = size_classes.sizes(rows, last)
    assert sizes.number[:27].tolist() == [size_classes.SEVERAL] * 27
    assert sizes.number[27:].tolist() == [2, 2, 1, 0, 0, 0, 0, 2, 2]
    assert sizes.fragment_mass[:30] == pytest.approx([54.0] * 27 + [4.0, 4.0, 2.0])
    # the projectile's two touch the loner, and are another body
    assert sizes.fragment_mass[34:] == pytest.approx([4.0, 4.0]) and np.isnan(sizes.fragment_mass[30:34]).all()
    ball = np.cbrt(6.0 * 0.002 / np.pi)
    assert sizes.size[0] == pytest.approx(3.0 * ball) and sizes.size[29:34] == pytest.approx(np.full(5, ball))


def test_masses_by_class_and_fate_hold_all_that_was_thrown():
    rows, last = thrown()
    sizes = size_classes.sizes(rows, last)
    table = size_classes.masses(rows, sizes, GROUND, 100.0)
    assert table["several particles"]["escapes"] == 54.0 and table["several particles"]["lands beyond"] == 4.0
    assert table["one particle"]["lands beyond"] == 2.0 and table["smaller than a particle"]["lands beyond"] == 8.0
    assert sum(sum(part.values()) for part in table.values()) == rows.mass[rows.layer >= 0].sum()
    assert "several particles" in report_matter._by_size(table) and report_matter._by_size({}) == ""


def test_without_damage_there_are_no_classes():
    rows, last = thrown()
    assert size_classes.sizes(rows, Particles({**last, "damage": np.zeros(len(last))})) is None
    assert size_classes.sizes(rows, Particles({name: last[name] for name in last if name != "damage"})) is None
    assert size_classes.columns(None) == {}
    # loose ground, broken from the start: nothing in the run says how large its pieces are
    assert size_classes.sizes(rows, Particles({**last, "damage": np.ones(len(last))})) is None


def test_the_file_of_the_catalogue_holds_them(tmp_path):
    rows, last = thrown()
    sizes = size_classes.sizes(rows, last)
    words = {"size_classes": list(size_classes.CLASSES)}
    catalogues.write(rows, last, GROUND, 1.0, tmp_path / "ejecta.h5", size_classes.columns(sizes), words)
    arrays, facts = archive.read(tmp_path / "ejecta.h5")
    assert arrays["size_class"].tolist() == sizes.number.tolist()
    assert [str(name) for name in facts["size_classes"]] == list(size_classes.CLASSES)
