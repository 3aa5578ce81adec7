"""Other codes' text files."""

from __future__ import annotations

import numpy as np
import pytest

from matter import formats
from matter.errors import InputError
from matter.particles import Particles

DUMP = """\
ITEM: TIMESTEP
0
ITEM: NUMBER OF ATOMS
1
ITEM: BOX BOUNDS ff ff ff
0 1
0 1
0 1
ITEM: ATOMS id type x y z vx vy vz radius mass c_pe
1 1 9 9 9 0 0 0 0.5 3 0
ITEM: TIMESTEP
5000
ITEM: NUMBER OF ATOMS
2
ITEM: BOX BOUNDS ff ff ff
0 1
0 1
0 1
ITEM: ATOMS id type x y z vx vy vz radius mass c_pe
2 2 1 2 3 4 5 6 0.25 7 0.1
1 1 0 0 1 0 0 0 0.50 3 0.2
"""


def test_a_header_names_columns_and_units(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(
        "# made by hand\nx [km], y [km], z [km], m, p [GPa], sxx, sxy, sxz, syy, syz, szz, "
        "mat\n1,2,3,4,5,1,2,3,4,5,6,1\n0,0,0,1,0,0,0,0,0,0,0,0\n"
    )
    found = formats.read(path, materials="ice, water")
    np.testing.assert_allclose(found.position[0], [1e3, 2e3, 3e3])
    np.testing.assert_allclose(found.pressure, [5e9, 0.0])
    np.testing.assert_allclose(found.deviatoric_stress[0], [1, 2, 3, 4, 5, 6])
    np.testing.assert_array_equal(found.identity, [0, 1])
    assert found.attributes["materials"] == ["ice", "water"]


@pytest.mark.parametrize("mark", [" ", "\t", ";", ","])
def test_columns_may_be_named_by_hand(tmp_path, mark):
    path = tmp_path / "a.txt"
    path.write_text("\n".join(mark.join(map(str, row)) for row in [[1, 2, 3, 9.5, 7], [4, 5, 6, 9.5, 8]]))
    found = formats.read(path, columns="x,y,z,-,h")
    np.testing.assert_allclose(found.position, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(found.smoothing_length, [7, 8])
    assert set(found) == {"position", "smoothing_length", "identity"}


def test_the_last_step_of_a_dump_is_read(tmp_path):
    path = tmp_path / "dump.impact"
    path.write_text(DUMP)
    found = formats.read(path)
    np.testing.assert_array_equal(found.identity, [2, 1])
    np.testing.assert_allclose(found.velocity[0], [4, 5, 6])
    np.testing.assert_allclose(found.radius, [0.25, 0.5])
    np.testing.assert_array_equal(found.material, [1, 0])  # types count from 1
    assert found.attributes == {"stage": "dem", "step": 5000}


def test_a_round_trip_through_our_own_format(tmp_path):
    cloud = Particles({"position": np.eye(3), "mass": [1.0, 2.0, 3.0]}, {"time": 3.0})
    formats.save(cloud, tmp_path / "a.vtkhdf")
    assert formats.read(tmp_path / "a.vtkhdf").attributes["time"] == 3.0


@pytest.mark.parametrize(
    ("name", "text", "columns", "words"),
    [
        ("a.csv", "x,y,z\n", None, "no data"),
        ("a.csv", "", None, "no data"),
        ("a.csv", "1,2,3\n", None, "no header"),
        ("a.csv", "1,2,3\n", "x,y", "2 column names for 3 columns"),
        ("a.csv", "1,2,3\n", "x,y,mass", "position lacks component 2"),
        ("a.csv", "1,2,3\n", "x,y,colour", "unknown column 'colour'"),
        ("a.csv", "x,y,z\n1,2,three\n", None, "three"),
        ("a.csv", "x [kg],y,z\n1,2,3\n", None, "is not a quantity in m"),
        ("a.csv", "m,rho\n1,2\n", None, "lacks position"),
        ("a.dump", "x y z\n1 2 3\n", None, "not a text dump"),
        ("a.ssf", "", None, "does not begin with"),
        ("a.h5", "", None, "not an HDF5 file"),
        ("a.xyz", "", None, "name the format with --format"),
    ],
)
def test_what_cannot_be_read_is_a_message(tmp_path, name, text, columns, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words):
        formats.read(tmp_path / name, columns=columns)


def test_values_that_are_not_finite_are_not_imported(tmp_path):
    (tmp_path / "a.csv").write_text("x,y,z,m\n1,2,nan,4\n")
    with pytest.raises(InputError, match="'position' has 1 values that are not finite"):
        formats.save(formats.read(tmp_path / "a.csv"), tmp_path / "a.vtkhdf")
    with pytest.raises(InputError, match="unknown format"):
        formats.read(tmp_path / "a.csv", "netcdf")


def test_csv_holds_every_number_and_reads_back(tmp_path):
    rng = np.random.default_rng(5)
    some = Particles(
        {
            "position": rng.normal(size=(30, 3)) * 1e6,
            "deviatoric_stress": rng.normal(size=(30, 6)) * 1e8,
            "mass": rng.random(30),
            "material": [1, 0] * 15,
        },
        {"time": 3.0},
    )
    assert formats.export(some, tmp_path / "a.csv") == "csv" == formats.export(some, tmp_path / "b.txt", "csv")
    header, *rows = (tmp_path / "a.csv").read_text().splitlines()
    assert (
        header.startswith("position_x [m],position_y [m],position_z [m],")
        and "mass [kg]" in header
        and header.endswith("material")
        and len(rows) == 30
    )
    back = formats.read(tmp_path / "a.csv")
    for name in some:
        np.testing.assert_array_equal(back[name], some[name])
    table = np.genfromtxt(tmp_path / "b.txt", delimiter=",", names=True)  # no comment lines: numpy reads it at once
    np.testing.assert_array_equal(table["mass_kg"], some.mass)


@pytest.mark.parametrize(
    ("header", "rows", "words"),
    [
        (
            "x,y,z,m",
            ["1,2,3,4", "1,2,3,-4"],
            "field 'mass' must be above 0 kg: 1 of 2 particles are not (the first is particle 2: -4)",
        ),
        ("x,y,z,m", ["1,2,3,0"], "field 'mass' must be above 0 kg"),
        ("x,y,z,rho", ["1,2,3,-1", "0,0,0,1"], "field 'density' must be above 0 kg/m^3"),
        ("x,y,z,r", ["1,2,3,0"], "field 'radius' must be above 0 m"),
        ("x,y,z,h", ["1,2,3,-1"], "field 'smoothing_length' must be above 0 m"),
        (
            "x,y,z,damage",
            ["1,2,3,1.5"],
            "field 'damage' must be at least 0 and at most 1: 1 of 1 particles are not (the first is particle 1: 1.5)",
        ),
        ("x,y,z,distention", ["1,2,3,0.5"], "field 'distention' must be at least 1"),
        ("x,y,z,mat", ["1,2,3,-1"], "field 'material' must be at least 0"),
        (
            "x,y,z,m",
            ["1,2,nan,1", "1,2,3,1"],
            "field 'position' has 1 values that are not finite (the first is particle 1: 1, 2, nan)",
        ),
    ],
)
def test_values_that_no_particle_can_have_are_refused(tmp_path, header, rows, words):
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]) + "\n")
    with pytest.raises(InputError) as caught:
        formats.save(formats.read(tmp_path / "a.csv"), tmp_path / "a.vtkhdf")
    assert words in str(caught.value)
    assert not (tmp_path / "a.vtkhdf").exists()


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "# a remark\nx,y,z\n\n1,2,3\n1,abc,3\n", "a.csv, line 5: 'abc' in column 2 is not a number"),
        ("a.csv", "x,y,z\n1,2,3\n1,2\n", "a.csv, line 3: 2 values, and 3 in line 2"),
        ("a.dump", "ITEM: ATOMS x y z\n1 2 3\n1 x 3\n", "a.dump, line 3: 'x' in column 2 is not a number"),
    ],
)
def test_a_complaint_names_the_line_of_the_file(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        formats.read(tmp_path / name)
    assert words in str(caught.value)


def test_what_is_no_text_is_said_to_be_none(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"\x89PNG\xff\xfe\x00")
    with pytest.raises(InputError, match=r"a\.csv is not a text file"):
        formats.read(tmp_path / "a.csv")


def test_names_of_materials_are_used_or_refused(tmp_path):
    (tmp_path / "plain.csv").write_text("x,y,z\n1,2,3\n4,5,6\n")
    (tmp_path / "kinds.csv").write_text("x,y,z,mat\n1,2,3,0\n4,5,6,2\n")
    one = formats.read(tmp_path / "plain.csv", materials="basalt")
    assert one.material.tolist() == [0, 0] and one.attributes["materials"] == ["basalt"]
    with pytest.raises(InputError, match=r"--materials names 2 materials .*no column of material numbers"):
        formats.read(tmp_path / "plain.csv", materials="basalt,ice")
    with pytest.raises(InputError, match="material number 2 has no name: there are 2"):
        formats.save(formats.read(tmp_path / "kinds.csv", materials="basalt,ice"), tmp_path / "a.vtkhdf")
    assert formats.plausible.unknown_materials(formats.read(tmp_path / "kinds.csv", materials="bassalt,ice,iron")) == [
        "material 'bassalt' is not one of this project's; did you mean 'basalt'?"
    ]
