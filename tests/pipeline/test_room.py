"""What cannot fit is refused before anything is made; what a run needs on the way is counted."""

from __future__ import annotations

import pytest

from matter.errors import InputError
from pipeline.case import read
from pipeline.running import plan, prediction, room
from pipeline.running.request import Request, settings_of
from pipeline.store import folder, provenance, store


def test_a_stage_needs_its_result_and_three_of_its_checkpoints():
    rows = [
        {"memory_bytes": 5.0, "disk_bytes": 10.0, "checkpoint_bytes": 100.0},
        {"memory_bytes": 7.0, "disk_bytes": 20.0, "checkpoint_bytes": 30.0},
        {"memory_bytes": 1.0, "disk_bytes": 1.0},
    ]
    assert room.needs(rows) == (7.0, 331.0)
    assert room.needs([]) == (0.0, 0.0)


@pytest.fixture
def request_and_settings(tmp_path):
    asked = Request(read.read("cases/valhalla_980km", "quick"), tmp_path / "not" / "there")
    return asked, settings_of(asked)


def test_what_fits_runs_and_what_does_not_is_refused(request_and_settings, monkeypatch):
    asked, settings = request_and_settings
    plan.refuse_too_large(asked, settings)
    memory, disk = room.needs(prediction.predictions(asked, settings).values())
    monkeypatch.setattr(room, "free_bytes", lambda out: 0.9 * disk)
    plan.refuse_too_large(asked, settings)  # predictions are not that good: a warning of --check
    assert "WARNING" in prediction.table(asked, prediction.predictions(asked, settings), {})
    monkeypatch.setattr(room, "free_bytes", lambda out: 0.7 * disk)
    with pytest.raises(InputError, match=r"of disk are needed with checkpoints, .* left\. Fewer particles"):
        plan.refuse_too_large(asked, settings)
    monkeypatch.setattr(provenance, "memory_bytes", lambda: 0.7 * memory)
    with pytest.raises(InputError, match=r"of memory are needed, this machine has .*; .* of disk"):
        plan.refuse_too_large(asked, settings)


def test_what_a_stopped_run_has_written_needs_no_more_room(request_and_settings, monkeypatch):
    asked, settings = request_and_settings
    _, disk = room.needs(prediction.predictions(asked, settings).values())
    monkeypatch.setattr(room, "free_bytes", lambda out: 0.5 * disk)
    with pytest.raises(InputError, match="of disk are needed"):
        plan.refuse_too_large(asked, settings)
    first = store.store_of(asked.run_folder) / plan.first_to_make(asked, settings)
    first.mkdir(parents=True)
    (first / folder.BEGUN).write_text('{"stage": "begun"}')
    with (first / "result.bin").open("wb") as file:
        file.truncate(int(0.35 * disk))
    plan.refuse_too_large(asked, settings)


def test_checkpoints_are_predicted_from_flaws_too(request_and_settings):
    """What a shock stage has to keep, against what one was measured to keep: 640 bytes a particle."""
    asked, settings = request_and_settings
    row = prediction.predictions(asked, settings)["sph"]
    assert row["checkpoint_bytes"] > 600.0 * row["particles"]


def test_flaws_of_a_strongly_graded_body_do_not_fill_its_checkpoint(tmp_path):
    """Measured: 12.4 MB with 20,253 particles; it was 334 MB when all of its 80,743,058 flaws were kept."""
    file = tmp_path / "case.toml"
    file.write_text(
        '[target]\nshape = "sphere"\nlayers = [{ material = "granite", thickness = "1000 km" }]\n'
        '[impact]\nspeed = "12 km/s"\nangle_from_vertical = "45 deg"\n'
        'projectile = { material = "granite", radius = "25 km" }\n'
    )
    asked = Request(read.read(file, size="quick"), tmp_path)
    row = prediction.predictions(asked, settings_of(asked))["sph"]
    assert row["checkpoint_bytes"] == pytest.approx(12.4e6, rel=0.5)
