"""What people install: wheel and sdist hold the rooms with their data and nothing else, neither needs a compiler, and
the recipes for conda and docker ask for what pyproject.toml asks for."""

import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
ROOMS = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline", "bolide")
PICTURES = {"matplotlib", "pyvista", "imageio-ffmpeg"}


def tracked(*folders: str) -> set[str]:
    """Files of the checkout that git knows."""
    done = subprocess.run(["git", "ls-files", *folders], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        pytest.skip("not a git checkout")
    return {name for name in done.stdout.splitlines() if (ROOT / name).is_file()}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Wheel and sdist, made by the build backend itself: no network, no isolated environment."""
    pytest.importorskip("hatchling", reason="hatchling, the build backend, is not installed")
    out = tmp_path_factory.mktemp("dist")
    subprocess.run([sys.executable, "-m", "hatchling", "build", "-d", str(out)], cwd=ROOT, check=True)
    return next(out.glob("*.whl")), next(out.glob("*.tar.gz"))


def test_the_wheel_holds_the_rooms_with_their_data_and_nothing_else(built):
    names = {name for name in zipfile.ZipFile(built[0]).namelist() if ".dist-info/" not in name}
    wanted = tracked(*ROOMS) | {f"bolide/{name}" for name in tracked("cases")}
    assert wanted <= names, sorted(wanted - names)[:5]
    assert {name.partition("/")[0] for name in names} == set(ROOMS)
    assert not [name for name in names if "__pycache__" in name or "/tests/" in name]


def test_the_wheel_is_pure_python_with_every_command(built):
    assert built[0].name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(built[0]) as wheel:
        folder = next(name for name in wheel.namelist() if name.endswith(".dist-info/METADATA")).rpartition("/")[0]
        commands = wheel.read(f"{folder}/entry_points.txt").decode()
        about = Parser().parsestr(wheel.read(f"{folder}/METADATA").decode())
        assert f"{folder}/licenses/LICENSE" in wheel.namelist()
    for name, place in PROJECT["scripts"].items():
        assert f"{name} = {place}" in commands
    required = [Requirement(line) for line in about.get_all("Requires-Dist")]
    plain = {one.name for one in required if one.marker is None or "extra" not in str(one.marker)}
    assert not PICTURES & plain and "numba" in plain
    assert {one.name for one in required if 'extra == "pictures"' in str(one.marker)} == PICTURES


def test_the_sdist_builds_the_same_wheel(built, tmp_path):
    with tarfile.open(built[1]) as sdist:
        sdist.extractall(tmp_path, filter="data")
    source = next(tmp_path.glob("bolide-*"))
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)], cwd=source, check=True
    )
    one, other = (zipfile.ZipFile(path) for path in (built[0], next(tmp_path.glob("*.whl"))))
    assert {i.filename: i.CRC for i in one.infolist()} == {i.filename: i.CRC for i in other.infolist()}


def test_the_conda_recipe_asks_for_what_the_project_asks_for():
    yaml = pytest.importorskip("yaml")
    recipe = yaml.safe_load((ROOT / "conda" / "meta.yaml").read_text())
    assert recipe["package"] == {"name": PROJECT["name"], "version": PROJECT["version"]}
    wanted = [Requirement(line) for line in (*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["pictures"])]
    called = {"matplotlib": "matplotlib-base"}  # conda-forge's, without a window system
    needed = {called.get(one.name, one.name): str(one.specifier) for one in wanted} | {
        "python": PROJECT["requires-python"]
    }
    assert dict(line.split(" ", 1) for line in recipe["requirements"]["run"]) == needed
    assert set(recipe["build"]["entry_points"]) == {f"{name} = {place}" for name, place in PROJECT["scripts"].items()}
    assert (ROOT / recipe["about"]["license_file"]).is_file() and recipe["build"]["noarch"] == "python"


def test_the_images_folder_of_kernels_is_one_that_is_taken():
    """A folder that others may write to is refused when kernels are compiled: nothing in the image would run."""
    text = (ROOT / "Dockerfile").read_text()
    cache = re.search(r"^ENV BOLIDE_CACHE=(\S+)$", text, re.M)[1]
    opened = [name for names in re.findall(r"chmod \S*[267]\S* ([^&\n]+)", text) for name in names.split()]
    assert f"mkdir -p {cache} " in text and cache not in opened and "/runs" in opened


def test_the_dockerfile_copies_what_the_wheel_is_made_of():
    text = (ROOT / "Dockerfile").read_text()
    copied = {name for line in re.findall(r"^COPY (.+)$", text, re.M) for name in line.split()[:-1]}
    assert copied == {*ROOMS, "cases", "pyproject.toml", PROJECT["readme"], *PROJECT["license-files"]}
    let_in = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    assert let_in == copied
