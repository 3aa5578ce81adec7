"""Without the extra ``pictures``: everything imports, pictures are left out with one line, and what is a picture by
name is refused with one."""

import subprocess
import sys
from pathlib import Path

import pytest

from matter.errors import InputError
from matter.wording import drawing

ROOT = Path(__file__).resolve().parents[2]
LAW = "the picture of a law"
BLOCKED = """
import importlib, pkgutil, sys
for library in ("matplotlib", "pyvista", "vtk", "vtkmodules", "imageio_ffmpeg", "PIL"):
    sys.modules[library] = None
rooms = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline", "bolide")
names = [one.name for room in rooms for one in pkgutil.walk_packages([room], room + ".")]
assert len(names) > 200, names
for name in names:
    if not name.endswith("__main__"):
        importlib.import_module(name)
from pipeline.cli import run_case
sys.argv = ["run_case", "valhalla_980km", "--preset", "tiny", "--movie", "--out", "/nowhere"]
try:
    run_case()
except SystemExit as end:
    assert end.code == 2, end.code
from sph.shock_states import law_figure as figure
sys.exit(figure.command("eos", "x", ("tillotson",), None, ["tillotson", "basalt"]))
"""


@pytest.fixture
def without(monkeypatch):
    for library in ("matplotlib", "pyvista", "imageio_ffmpeg"):
        monkeypatch.setitem(sys.modules, library, None)
    drawing.has.cache_clear()
    yield
    drawing.has.cache_clear()


def test_every_module_imports_and_a_picture_asked_for_is_refused_in_one_line():
    done = subprocess.run([sys.executable, "-c", BLOCKED], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2, done.stderr
    said = [line for line in done.stderr.splitlines() if line]
    assert said == [f"{what} needs matplotlib: pip install 'bolide[pictures]'" for what in ("a movie", LAW)]


def test_what_is_left_out_is_said_once(without):
    said: list[str] = []
    assert not drawing.possible("the bed", said.append)
    assert said == ["no pictures of the bed: matplotlib is not installed (pip install 'bolide[pictures]')"]
    assert "Without pictures" in drawing.note()


def test_what_needs_a_library_names_it(without, tmp_path):
    from crater.drawing import movie

    with pytest.raises(InputError, match=r"a movie needs matplotlib: pip install 'bolide\[pictures\]'"):
        movie.write(tmp_path, tmp_path / "movie.gif")
    with pytest.raises(InputError, match="a mesh needs pyvista"):
        drawing.require("a mesh", "pyvista")
    assert movie.movie_formats() == (".gif",)


def test_with_the_libraries_nothing_is_said():
    said: list[str] = []
    assert drawing.possible("the bed", said.append) and said == [] and drawing.note() == ""
