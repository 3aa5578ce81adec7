"""A small case and six small stages: these tests are about the runner, not about physics."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pipeline import warm

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
    from pipeline.case import stages

    monkeypatch.syspath_prepend(str(FAKES))
    monkeypatch.setattr(stages, "MODULES", {stage: f"fake_{stage}" for stage in stages.ORDER})


@pytest.fixture
def drive():
    """``drive(*arguments)`` runs run_case with the fake stages in a child of this process (``warm``): exit code and
    what it printed; ``wait=False`` starts a process of its own and returns it while it runs."""

    def start(*arguments: object, wait: bool = True):
        environment = {"PYTHONPATH": os.pathsep.join([str(ROOT), str(FAKES)]), "COLUMNS": "200"}
        words = list(map(str, arguments))
        if not wait:
            command = [sys.executable, str(FAKES / "drive.py"), *words]
            own = {**os.environ, **environment}
            return subprocess.Popen(command, env=own, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def work() -> None:
            sys.path.insert(0, str(FAKES))
            sys.argv = [str(FAKES / "drive.py"), *words]
            importlib.import_module("drive").cli.run_case()

        done = warm.run(work, environment)
        return done.returncode, done.stdout, done.stderr

    return start


@pytest.fixture
def call():
    """``call(name, *arguments)`` runs one of the commands, with the real stages, in a child of this process
    (``warm``)."""

    def start(name: str, *arguments: object, cwd: Path | None = None, **more: str) -> subprocess.CompletedProcess:
        def work() -> None:
            from pipeline import cli

            sys.argv = [name, *map(str, arguments)]
            getattr(cli, name)()

        return warm.run(work, {"PYTHONPATH": str(ROOT), "COLUMNS": "200", **more}, cwd)

    return start
