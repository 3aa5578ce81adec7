"""``fly_ejecta RUN`` puts what it found on the page of that run, and leaves the store alone."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from crater.pages import ejecta_fates
from matter.files import archive
from pipeline import cli
from tests import pages


def catalogue(path):
    rng, n = np.random.default_rng(1), 60
    speed, radius, g = 0.36 * rng.uniform(0.1, 1.5, n), 448.0, 1.5e-4
    angle, azimuth = rng.uniform(0.2, 1.5, n), rng.uniform(0.0, 6.0, n)
    level = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(n)])
    arrays = {
        "number": np.arange(n), "place": np.tile([0.0, 0.0, radius], (n, 1)), "time": np.zeros(n),
        "velocity": speed[:, None] * (np.cos(angle)[:, None] * level + np.sin(angle)[:, None] * [0.0, 0.0, 1.0]),
        "mass": np.ones(n), "layer": np.zeros(n, int),
    }  # fmt: skip
    ground = {"frame": "sphere", "centre_m": np.zeros(3), "axes": np.eye(3), "gravity_m_s2": g, "radius_m": radius}
    archive.write(path, arrays, ground)


def fly(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["fly_ejecta", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        cli.fly_ejecta()
    return ended.value.code or 0


def test_the_page_of_the_run_shows_the_fates_and_that_of_the_store_does_not(tmp_path, monkeypatch, capsys):
    stored, run, out = tmp_path / ".store" / "crater-1", tmp_path / "run", tmp_path / "out"
    stored.mkdir(parents=True), run.mkdir()
    catalogue(stored / "ejecta.h5")
    (stored / "done.json").write_text('{"stage": "crater"}')
    (stored / "report.html").write_text(pages.document("A", ["before", ejecta_fates.slot(), "behind"]))
    (run / "6_crater").symlink_to("../.store/crater-1")
    assert fly(monkeypatch, run, "--out", out, "--duration", "50 day") == 0
    text = (run / "6_crater" / "report.html").read_text()
    mine = text[text.index("before") : text.index("behind")]
    assert "falls back" in mine and "leaves" in mine and "60 launches from the body, followed for 50 days" in mine
    assert "among other bodies" not in (stored / "report.html").read_text()
    assert "what became of the ejecta" in capsys.readouterr().out
    found = archive.read_json(out / "ejecta_fates.json")
    assert found["target_kg"]["falls back"] + found["target_kg"]["leaves"] == 60.0


def test_a_run_without_a_page_is_flown_and_told(tmp_path, monkeypatch, capsys):
    (tmp_path / "6_crater").mkdir()
    catalogue(tmp_path / "6_crater" / "ejecta.h5")
    assert fly(monkeypatch, tmp_path, "--out", tmp_path / "out") == 0
    assert "report.html is missing" in capsys.readouterr().out and (tmp_path / "out" / "ejecta_fates.h5").is_file()
    assert fly(monkeypatch, tmp_path / "6_crater" / "ejecta.h5", "--out", tmp_path / "again") == 0
    assert "report.html" not in capsys.readouterr().out
