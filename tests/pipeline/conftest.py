"""A small case and six small stages: these tests are about the runner, not about physics."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FAKES = Path(__file__).resolve().parent / "fake_rooms"

CASE = """\
[case]
title = "A small impact"
source = "Winter 2017"

[[target.layers]]
name = "core"
material = "basalt"
thickness = "1842 km"

[[target.layers]]
name = "shell"
material = "ice"
thickness = "150 km"

[impact]
speed = "18.234 km/s"
angle_from_vertical = "40 deg"
expected_transient_diameter = "980 km"

[impact.projectile]
material = "ice"
radius = "53.9 km"

[sph]
spacing = "52 km"

[dem.contact]
friction = 0.7

[preset.quick.sph]
steps = 20

[nbody]
"""


@pytest.fixture
def case_folder(tmp_path: Path) -> Path:
    """A folder with a valid case.toml."""
    place = tmp_path / "small"
    place.mkdir()
    (place / "case.toml").write_text(CASE)
    return place


@pytest.fixture
def fake_stages(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fake stages in this process."""
    from pipeline import stages

    monkeypatch.syspath_prepend(str(FAKES))
    monkeypatch.setattr(stages, "MODULES", {stage: f"fake_{stage}" for stage in stages.ORDER})


@pytest.fixture
def drive():
    """``drive(*arguments)`` starts run_case with the fake stages as a process; ``wait=False`` returns the running
    process."""

    def start(*arguments: object, wait: bool = True):
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(FAKES)]), "COLUMNS": "200"}
        command = [sys.executable, str(FAKES / "drive.py"), *map(str, arguments)]
        process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        if not wait:
            return process
        out, err = process.communicate(timeout=120)
        return process.returncode, out, err

    return start


@pytest.fixture
def call():
    """``call(name, *arguments)`` runs one of the commands, with the real stages, in a process of its own."""

    def start(name: str, *arguments: object, cwd: Path | None = None, **more: str) -> subprocess.CompletedProcess:
        code = f"import sys; from pipeline import cli; sys.argv[0] = {name!r}; cli.{name}()"
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", **more}
        command = [sys.executable, "-P", "-c", code, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120, cwd=cwd)

    return start
