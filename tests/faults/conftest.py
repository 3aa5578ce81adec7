"""One uninterrupted run of all stages, for the campaigns."""

from __future__ import annotations

import importlib
import json
from pathlib import Path

import pytest

from pipeline.case import read, stages
from pipeline.settings import compose
from tests.faults import traps, whole_runs

LATE = (
    "matplotlib.pyplot",
    "mpl_toolkits.axes_grid1",
    "trimesh",
    "pint",
    "jinja2",
    "pipeline.cli",
    "pipeline.commands.run_command",
)


@pytest.fixture(scope="session")
def whole(tmp_path_factory) -> tuple[Path, dict[str, str]]:
    """The folder of runs of an uninterrupted run, and the places of the code that touched the disk, each with the
    stage that was made when it first did. All stages, and the libraries that they load when they first need them, are
    loaded before, so that children start warm."""
    for stage in stages.ORDER:
        stages.load(stage)
    for name in LATE:
        importlib.import_module(name)
    compose.compose(read.read(whole_runs.ROOT / "cases" / "valhalla_980km", "tiny"))  # units and models too
    out = tmp_path_factory.mktemp("whole") / "runs"
    out.mkdir()
    places = out.parent / "places.json"
    said = whole_runs.run(out, out.parent / "log", lambda: traps.Trap(out).set().written_to(places))
    assert said.code in (0, 1) and "Traceback" not in said.text, said.text
    return out, json.loads(places.read_text())
