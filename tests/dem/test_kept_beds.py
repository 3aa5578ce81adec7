"""Beds that runs share: taken where they are whole, made anew where a file was damaged, cut short or lost."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from dem import bed_stage
from matter import progress


@pytest.fixture
def make_or_take(tmp_path, monkeypatch):
    """``make_or_take("run")`` runs the stage in a run folder of that name, with a bed of a few bytes; returns its folder and how many beds were made so far."""
    made = []

    def maker(settings, target):
        def make(out):
            made.append(out)
            for name in bed_stage._FILES:
                (out / name).write_bytes(f"{name} number {len(made)}".encode())

        return make

    monkeypatch.setattr(bed_stage, "maker", maker)
    monkeypatch.setattr(bed_stage, "_key", lambda settings, target: "key")
    monkeypatch.setattr(bed_stage.friction_angle, "resolved", lambda contact: contact)
    settings = SimpleNamespace(share=True, contact=None)
    settings.model_copy = lambda update: settings

    def go(name):
        out = tmp_path / name / "3_bed"
        out.mkdir(parents=True)
        bed_stage.run(settings, tmp_path / name, out)
        return out, len(made)

    return go


def test_a_bed_is_made_once(make_or_take):
    first, _ = make_or_take("one")
    second, count = make_or_take("two")
    assert count == 1
    for name in bed_stage._FILES:
        assert (second / name).read_bytes() == (first / name).read_bytes()


@pytest.mark.parametrize("name", bed_stage._FILES)
@pytest.mark.parametrize(
    "damage",
    [
        lambda file: file.write_bytes(file.read_bytes()[:-4]),
        lambda file: file.write_bytes(b"x" + file.read_bytes()[1:]),
        lambda file: file.unlink(),
    ],
    ids=["cut short", "altered", "lost"],
)
def test_a_damaged_one_is_made_anew_and_said(make_or_take, tmp_path, damage, name):
    make_or_take("one")
    damage(tmp_path / "beds" / "key" / name)
    told = []
    progress.hear(told.append)
    try:
        out, count = make_or_take("two")
        assert count == 2 and len(told) == 1 and "is damaged" in told[0] and name in told[0]
        assert (out / "bed.vtkhdf").read_bytes() == b"bed.vtkhdf number 2"
        assert make_or_take("three")[1] == 2 and len(told) == 1
    finally:
        progress.silence()
