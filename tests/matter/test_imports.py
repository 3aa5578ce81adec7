"""What other codes' files say about themselves: counts, units, times, groups, identities. Each is met, used or
refused, and what is left out is said."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from matter import formats
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles

HEAD = "ITEM: BOX BOUNDS ff ff ff\n-1 1\n-1 1\n0 2\nITEM: ATOMS id type x y z vx vy vz radius mass\n"
ROWS = "".join(f"{k} 1 {k / 10} 0.2 0.3 0 0 0 0.05 1.3\n" for k in range(1, 7))


def frame(step: int, rows: str = ROWS, count: int = 6, head: str = HEAD) -> str:
    return f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\n{head}{rows}"


def refused(path, words: str, **options) -> None:
    with pytest.raises(InputError, match=words):
        formats.read(path, **options)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            frame(0) + frame(100, ROWS[:87]),
            "last step, 100, says 6 atoms and holds 3. Whole steps reach up to line 15",
        ),
        (frame(100, ROWS[:87]), "says 6 atoms and holds 3. There is no whole step"),
        (frame(0) + "ITEM: TIMESTEP\n100\nITEM: NUMBER OF", "line 16 begins a further step, and no atoms follow"),
        (frame(0, ROWS + "7 1 0 0 0 0 0 0 1 1\n"), "says it holds 6 particles, and 7 are there"),
        (frame(0)[:-1], "its last line has no end"),
        (frame(0, count=10**30), "line 4: .* is not the number that 'ITEM: NUMBER OF ATOMS' asks for"),
        ("ITEM: TIMESTEP\nsoon\n" + HEAD + ROWS, "line 2: 'soon' is not the number that 'ITEM: TIMESTEP' asks for"),
        (frame(7, "", 0), "its last step, 7, holds no atoms"),
    ],
)
def test_a_dump_holds_as_many_atoms_as_it_says(tmp_path, text, words):
    (tmp_path / "a.dump").write_text(text)
    refused(tmp_path / "a.dump", words)


@pytest.mark.parametrize(
    ("name", "length", "mass", "time"),
    [("si", 1.0, 1.0, 1.0), ("cgs", 1e-2, 1e-3, 1.0), ("micro", 1e-6, 1e-15, 1e-6), ("nano", 1e-9, 1e-21, 1e-9)],
)
def test_a_dump_is_read_in_the_units_and_at_the_time_that_it_says(tmp_path, name, length, mass, time):
    """docs.lammps.org/units.html: what one of each unit is in SI."""
    head = HEAD.replace("mass", "mass density")
    rows = "".join(line + " 2\n" for line in ROWS.replace(" 0 0 0 ", " 7 0 0 ").splitlines())
    text = f"ITEM: UNITS\n{name}\nITEM: TIME\n1\n{frame(0)}ITEM: TIME\n12.5\n{frame(250, rows, head=head)}"
    (tmp_path / "a.dump").write_text(text)
    found = formats.read(tmp_path / "a.dump")
    np.testing.assert_allclose(found.position[0], np.array([0.1, 0.2, 0.3]) * length, rtol=1e-14)
    np.testing.assert_allclose(found.velocity[0], [7.0 * length / time, 0.0, 0.0], rtol=1e-14)
    np.testing.assert_allclose(found.mass, 1.3 * mass, rtol=1e-14)
    np.testing.assert_allclose(found.density, 2.0 * mass / length**3, rtol=1e-14)
    assert found.attributes["time"] == pytest.approx(12.5 * time, rel=1e-14)
    # a unit given by hand goes before the file's
    by_hand = formats.read(tmp_path / "a.dump", columns="id,type,x [km],y,z,vx,vy,vz,radius,mass,-")
    assert by_hand.position[0, 0] == 100.0 and by_hand.position[0, 1] == pytest.approx(0.2 * length)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "ITEM: UNITS\nlj\n" + frame(0),
            "line 2: its units are those of the style 'lj'; read are si, cgs, micro",
        ),
        ("ITEM: UNITS\nmetal\n" + frame(0), "style 'metal'"),
        ("ITEM: TIME\nnan\n" + frame(0), "its time, 'ITEM: TIME', is not finite"),
        ("ITEM: TIME\nlate\n" + frame(0), "line 2: the time 'late' is not a number"),
        (frame(0).replace("x y z", "xs ys zs"), r"scaled coordinates \(xs\), fractions of the box, and no x"),
        (frame(0).replace("vx vy", "x mat"), "position is given twice, by 'x' and by 'x'"),
        (frame(0).replace("vx", "mat"), "material is given twice, by 'type' and by 'mat'"),
    ],
)
def test_what_a_dump_says_and_cannot_be_used_is_refused(tmp_path, text, words):
    (tmp_path / "a.dump").write_text(text)
    refused(tmp_path / "a.dump", words)


def test_unwrapped_coordinates_and_diameters_stand_in(tmp_path):
    text = frame(0).replace("x y z", "xu yu zu").replace("radius", "diameter")
    (tmp_path / "a.dump").write_text(text)
    found = formats.found(tmp_path / "a.dump")
    np.testing.assert_allclose(found.particles.position[0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(found.particles.radius, 0.025)
    assert found.remarks == ["xu stands for x", "yu stands for y", "zu stands for z", "diameter stands for radius"]
    (tmp_path / "b.dump").write_text(frame(0).replace("vx vy vz", "xu diameter c_pe"))
    both = formats.found(tmp_path / "b.dump")
    assert both.left_out == ["xu", "diameter", "c_pe"] and both.particles.radius[0] == 0.05


def two_groups(path) -> None:
    with h5py.File(path, "w") as file:
        for name, z in (("projectile", 100.0), ("target", 0.0)):
            group = file.create_group(name)
            group["x"], group["y"], group["z"], group["m"] = np.arange(5.0), np.zeros(5), np.full(5, z), np.ones(5)


def test_several_groups_of_particles_are_named(tmp_path):
    two_groups(tmp_path / "two.h5")
    refused(tmp_path / "two.h5", r"2 groups hold particles \(projectile, target\)")
    columns = "x=target/x,y=target/y,z=target/z,m=target/m"
    one = formats.found(tmp_path / "two.h5", columns=columns)
    assert len(one.particles) == 5 and one.left_out == [f"projectile/{name}" for name in "mxyz"]
    refused(
        tmp_path / "two.h5",
        "mass is given twice, by 'target/m' and by 'projectile/m'",
        columns=columns + ",mass=projectile/m",
    )
    with h5py.File(tmp_path / "two.h5", "a") as file:  # a group without positions is no second one
        for name in "xyz":
            del file[f"projectile/{name}"]
    found = formats.found(tmp_path / "two.h5")
    assert found.left_out == ["projectile/m"] and set(found.particles) == {"position", "mass", "identity"}


def gadget(path, counts=(6, 0), files=1, units=None, place="Header", time=2.0) -> None:
    with h5py.File(path, "w") as file:
        file.create_group("Header").attrs["Time"] = [time]
        file["Header"].attrs["NumPart_ThisFile"], file["Header"].attrs["NumFilesPerSnapshot"] = counts, files
        file.require_group(place).attrs.update(units or {})
        file["PartType0/Coordinates"], file["PartType0/Masses"] = np.ones((6, 3)), np.full(6, 3.0)
        file["PartType0/Density"], file["PartType0/ParticleIDs"] = np.full(6, 5.0), np.arange(6, dtype=np.uint64)
        file["PartType1/Coordinates"] = np.ones((2, 3))


MAPPED = "position=PartType0/Coordinates,m=PartType0/Masses,rho=PartType0/Density,id=PartType0/ParticleIDs"
UNITS = [
    ("Units", ("Unit length in cgs (U_L)", "Unit mass in cgs (U_M)", "Unit time in cgs (U_t)"), (1e5, 1e6, 50.0)),
    ("Parameters", ("UnitLength_in_cm", "UnitMass_in_g", "UnitVelocity_in_cm_per_s"), (1e5, 1e6, 2e3)),
    ("Header", ("UnitLength_In_CGS", "UnitMass_In_CGS", "UnitVelocity_In_CGS"), (1e5, 1e6, 2e3)),
]


@pytest.mark.parametrize(("place", "names", "values"), UNITS)
def test_units_and_time_of_a_header_are_used(tmp_path, place, names, values):
    """1e5 cm, 1e6 g and 50 s: a kilometre, a tonne."""
    gadget(tmp_path / "a.hdf5", units=dict(zip(names, values)), place=place)
    found = formats.found(tmp_path / "a.hdf5", columns=MAPPED)
    np.testing.assert_allclose(found.particles.position, 1e3, rtol=1e-14)
    np.testing.assert_allclose(found.particles.mass, 3e3, rtol=1e-14)
    np.testing.assert_allclose(found.particles.density, 5.0 * 1e3 / 1e9, rtol=1e-14)
    assert found.particles.attributes["time"] == pytest.approx(100.0)
    assert found.particles.identity.tolist() == list(range(6))
    assert found.left_out == ["PartType1/Coordinates"] and "turned into SI" in found.remarks[0]
    by_hand = formats.read(tmp_path / "a.hdf5", columns=MAPPED.replace("Masses", "Masses [g]"))
    np.testing.assert_allclose(by_hand.mass, 3e-3)
    gadget(tmp_path / "b.hdf5", units=dict(zip(names, (0.0, *values[1:]))), place=place)
    refused(tmp_path / "b.hdf5", f"{place}/.* must be above 0", columns=MAPPED)


def test_counts_and_files_of_a_header_are_met(tmp_path):
    gadget(tmp_path / "a.hdf5", counts=(7, 2))
    refused(tmp_path / "a.hdf5", "says it holds 7 particles, and 6 are there", columns=MAPPED)
    gadget(tmp_path / "a.hdf5", files=4)
    refused(tmp_path / "a.hdf5", "one of 4 files of its snapshot", columns=MAPPED)
    gadget(tmp_path / "a.hdf5", time=np.nan)
    refused(tmp_path / "a.hdf5", "Header/Time is no finite number", columns=MAPPED)


def test_a_time_without_a_unit_is_no_number_of_seconds(tmp_path):
    """Where nobody names units they are SI, and so is the time; where they are named by hand, the time has none."""
    gadget(tmp_path / "a.hdf5")
    assert formats.read(tmp_path / "a.hdf5", columns=MAPPED).attributes["time"] == 2.0
    found = formats.found(tmp_path / "a.hdf5", columns=MAPPED.replace("Coordinates", "Coordinates [km]"))
    assert "time" not in found.particles.attributes
    assert "Header/Time = 2 (it has no unit)" in found.left_out


def test_the_unit_of_a_dataset_is_used_or_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["position"], file["mass"] = np.ones((3, 3)), np.full(3, 2.0)
        file["position"].attrs["unit"], file["mass"].attrs["units"] = "km", "kg"
    assert formats.read(tmp_path / "a.h5").position[0, 0] == 1e3
    with h5py.File(tmp_path / "a.h5", "a") as file:
        file["mass"].attrs["units"] = "code_mass"
    refused(tmp_path / "a.h5", "code_mass")
    columns = "position=position,m=mass [g]"
    assert formats.read(tmp_path / "a.h5", columns=columns).mass[0] == pytest.approx(2e-3)


def test_a_snapshot_in_other_units_is_refused(tmp_path):
    snapshot.write(Particles({"position": np.eye(3), "mass": np.ones(3)}, {"time": 0.0}), tmp_path / "a.vtkhdf")
    with h5py.File(tmp_path / "a.vtkhdf", "a") as file:
        file["particles/mass"].attrs["unit"] = "g"
    refused(tmp_path / "a.vtkhdf", "field 'mass' says it is in 'g'; snapshots are in SI")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x,y,z,mat\n1,2,3,0.7\n4,5,6,1.2\n", "column 'mat', line 2: '0.7' is not a whole number"),
        ("x,y,z,mat\n1,2,3,3e9\n", "field 'material' holds whole numbers from -2147483648 to 2147483647"),
        ("id,x,y,z\n7,1,2,3\n8,0,0,0\n7,4,5,6\n", "the first, 7, for the particles 1 and 3"),
        ("id,x,y,z\n9223372036854775808,1,2,3\n", "is more than 64 bits can hold"),
        ("id,x,y,z\n1e300,1,2,3\n", "'1e300' is not a whole number"),
        ("id,x,y,z\nnan,1,2,3\n", "'nan' is not a whole number"),
        ("x,y,z,m,mass\n1,2,3,4,5\n", "mass is given twice, by 'm' and by 'mass'"),
        ("x,y,z,position_x [km]\n1,2,3,4\n", "position is given twice, by 'x' and by 'position_x"),
        ("x,y,z,r,diameter\n1,2,3,4,8\n", "radius is given twice, by 'r' and by 'diameter'"),
        ("x,y,z\n1_0,2,3\n", "'1_0' in column 1 is not a number"),
    ],
)
def test_numbers_of_a_text_are_exact_and_unique(tmp_path, text, words):
    (tmp_path / "a.csv").write_text(text)
    refused(tmp_path / "a.csv", words)


def test_whole_numbers_are_read_to_the_last_digit(tmp_path):
    (tmp_path / "a.csv").write_text("id,x,y,z,mat\n9007199254740993,1,2,3,1.0\n9007199254740992,4,5,6,0\n")
    found = formats.read(tmp_path / "a.csv")
    assert found.identity.tolist() == [9007199254740993, 9007199254740992] and found.material.tolist() == [1, 0]
    for kind, numbers, words in (
        (
            "uint64",
            [2**63 + 5, 1],
            "1 of 2 are beyond what is stored .*particle 1: 9223372036854775813",
        ),
        ("float64", [2.0**53 + 2, 1.0], "not whole, or not exact"),
        ("float32", [2.0**24 + 2, 1.0], "not whole, or not exact"),
    ):
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["x"], file["y"], file["z"] = np.eye(3)[:, :2]
            file["id"] = np.array(numbers, dtype=kind)
        refused(tmp_path / "a.h5", words)


def test_the_import_says_what_it_took_and_what_it_left(tmp_path):
    (tmp_path / "a.dump").write_text(frame(3).replace("vx vy vz", "xs c_pe q"))
    out = tmp_path / "a.vtkhdf"
    first, left, *others = formats.convert(tmp_path / "a.dump", out)
    assert first == (
        "6 particles, material, identity, position, radius, mass; no time was read, 0 s is taken (--time)"
    )
    assert left == "left out: xs, c_pe, q"
    assert others[0].startswith("cannot be used by handoff: missing velocity")
    (tmp_path / "b.dump").write_text("ITEM: TIME\n12.5\n" + frame(3))
    assert formats.convert(tmp_path / "b.dump", out)[0].endswith("; time 12.5 s")
    assert formats.convert(tmp_path / "b.dump", out, time=7.0)[0].endswith("; time 7 s in place of the file's 12.5 s")
    assert snapshot.read(out).attributes["time"] == 7.0
    (tmp_path / "wide.csv").write_text(",".join(["x", "y", "z", *["-"] * 40]) + "\n" + ",".join(["1"] * 43) + "\n")
    wide = formats.convert(tmp_path / "wide.csv", out)[1]
    assert wide.startswith("left out: column 4, column 5") and wide.endswith(" and 28 more")


def test_what_is_undefined_by_design_is_handed_on(tmp_path):
    """Grains of projectile alone have no first depth: NaN there, and nowhere else."""
    grains = Particles({"position": np.eye(3), "first_depth": [1.0, np.nan, 2.0]}, {"time": 0.0})
    formats.export(grains, tmp_path / "a.csv")
    assert "nan" in (tmp_path / "a.csv").read_text()
    formats.save(grains, tmp_path / "a.vtkhdf")
    grains["first_depth"] = [1.0, np.inf, 2.0]
    with pytest.raises(InputError, match="'first_depth' has 1 values that are not finite"):
        formats.export(grains, tmp_path / "b.csv")
