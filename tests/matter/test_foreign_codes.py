"""Files of OpenSPH and miluphcuda, HDF5 of any code, and other codes' frames."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from matter import formats
from matter.errors import InputError
from matter.files import snapshot
from matter.formats import miluphcuda, opensph, turned_frame
from matter.particles import Particles
from tests.matter import foreign_files as foreign


@pytest.fixture
def two_bodies(tmp_path):
    bodies = [foreign.body(7, 1, "basalt"), foreign.body(4, 2, "ice")]
    foreign.ssf(tmp_path / "state_0003.ssf", bodies)
    return tmp_path / "state_0003.ssf", bodies


def test_opensph_state(two_bodies):
    path, bodies = two_bodies
    found = formats.read(path)
    assert found.attributes["materials"] == ["basalt", "ice"]
    assert (found.attributes["time"], found.attributes["step_s"], found.attributes["stage"]) == (12.5, 0.25, "sph")

    def both(name):
        return np.concatenate([body[name] for body in bodies])

    np.testing.assert_array_equal(found.position, both("position")[:, :3])
    np.testing.assert_array_equal(found.velocity, both("velocity")[:, :3])
    np.testing.assert_array_equal(
        found.smoothing_length, 2.0 * both("position")[:, 3]
    )  # the support of the cubic spline
    for name, theirs in {
        "mass": "mass",
        "density": "density",
        "specific_energy": "energy",
        "pressure": "pressure",
    }.items():
        np.testing.assert_array_equal(found[name], both(theirs))
    np.testing.assert_allclose(found.damage, both("damage") ** 3)
    xx, yy, xy, xz, yz = both("stress").T
    np.testing.assert_allclose(found.deviatoric_stress, np.stack([xx, xy, xz, yy, yz, -xx - yy], axis=1))
    np.testing.assert_array_equal(found.material, [0] * 7 + [1] * 4)
    assert not formats.lacking(found)


def test_opensph_spheres_and_attractors(tmp_path):
    body = foreign.body(5, 3)
    foreign.ssf(tmp_path / "a.ssf", [body], kind=b"nbody", attractors=2)
    found = formats.read(tmp_path / "a.ssf")
    np.testing.assert_array_equal(found.radius, body["position"][:, 3])
    assert "smoothing_length" not in found
    assert found.attributes["stage"] == "dem" and found.attributes["attractors"] == 2
    foreign.ssf(tmp_path / "b.ssf", [body], version=20181024)
    assert len(opensph.read(tmp_path / "b.ssf", support=3.0).particles()) == 5


def test_broken_opensph_files_are_told(two_bodies, tmp_path):
    path, _ = two_bodies
    data = path.read_bytes()
    for content, words in {
        data[:-8]: "in the middle of a value",
        data + b"\0" * 8: "8 bytes after its last value",
        b"CSPH" + data[4:]: "does not begin with 'SPH'",
        data[:300]: "in the middle of",
        data[:44] + b"\xff\xff\xff\x7f" + data[48:]: "versions up to 20210808 can be read",
        data.replace(b"MAT\0", b"MUT\0", 1): "material 0 was expected",
    }.items():
        (tmp_path / "c.ssf").write_bytes(content)
        with pytest.raises(InputError, match=words):
            formats.read(tmp_path / "c.ssf")


@pytest.fixture
def impact_0012(tmp_path):
    values = foreign.miluphcuda_values(9, 5)
    values["material_type"][4] = -1  # deactivated
    with h5py.File(tmp_path / "impact.0012.h5", "w") as file:
        for name, array in values.items():
            file[name] = array
    return tmp_path / "impact.0012.h5", values, np.arange(9) != 4


def test_miluphcuda_hdf5(impact_0012):
    path, values, alive = impact_0012
    found = formats.read(path, materials="ice,water,basalt")
    assert len(found) == 8 and found.attributes["time"] == 33.0
    for name, theirs in {"position": "x", "velocity": "v", "mass": "m", "density": "rho", "specific_energy": "e",
    "smoothing_length": "sml",
                         "pressure": "p", "gravity": "a_grav", "distention": "alpha_jutzi",
                         "neighbours": "number_of_interactions"}.items():  # fmt: skip
        np.testing.assert_array_equal(found[name], values[theirs][alive])
    np.testing.assert_array_equal(found.identity, np.flatnonzero(alive))
    np.testing.assert_allclose(found.damage, values["DIM_root_of_damage_tensile"][alive] ** 3)
    tensor = values["deviatoric_stress"][alive].reshape(-1, 3, 3)
    np.testing.assert_array_equal(found.deviatoric_stress[:, 4], tensor[:, 1, 2])
    np.testing.assert_allclose(found.deviatoric_stress[:, [0, 3, 5]].sum(axis=1), 0.0, atol=1e-12)
    assert not formats.lacking(found)


@pytest.mark.parametrize(
    ("solid", "flaws", "porous"), [(False, False, False), (True, False, True), (True, True, False), (True, True, True)]
)
def test_miluphcuda_text(tmp_path, solid, flaws, porous):
    values, path = foreign.miluphcuda_values(9, 5), tmp_path / "impact.0012"
    foreign.miluphcuda_text(path, values, solid, flaws, porous)
    on = ["INTEGRATE_ENERGY"] + ["SOLID"] * solid + ["FRAGMENTATION"] * flaws + ["PALPHA_POROSITY"] * porous
    found = formats.read(path, "miluphcuda", columns=",".join(on))
    assert found.attributes["time"] == 33.0
    np.testing.assert_allclose(found.position, values["x"], rtol=1e-15)
    np.testing.assert_allclose(found.pressure, values["p"], rtol=1e-6)
    np.testing.assert_array_equal(found.material, values["material_type"])
    assert (
        ("damage" in found) == flaws and ("distention" in found) == porous and ("deviatoric_stress" in found) == solid
    )
    if solid:
        np.testing.assert_allclose(
            found.deviatoric_stress, values["deviatoric_stress"][:, miluphcuda._UPPER], rtol=1e-6
        )
    if flaws:
        np.testing.assert_allclose(found.damage, values["DIM_root_of_damage_tensile"] ** 3, rtol=3e-6)
    with pytest.raises(InputError, match="other switches"):
        formats.read(path, "miluphcuda", columns=",".join({"JC_PLASTICITY", *on}))


def test_what_miluphcuda_does_not_say_is_asked_for(tmp_path, impact_0012):
    path = tmp_path / "impact.0000"
    path.write_text("1 2 3\n")
    for columns, words in {
        None: "switches that were 1",
        "SOLIDS": "SOLIDS decides no column",
        "SOLID": "3 numbers, 22 expected",
    }.items():
        with pytest.raises(InputError, match=words):
            formats.read(path, "miluphcuda", columns=columns)
    with h5py.File(tmp_path / "flat.h5", "w") as file:
        for name in ("m", "rho", "material_type"):
            file[name] = np.ones(3)
        file["x"] = file["v"] = np.ones((3, 2))
    with pytest.raises(InputError, match="three dimensions"):
        formats.read(tmp_path / "flat.h5")
    with h5py.File(impact_0012[0], "a") as file:
        del file["rho"]
    with pytest.raises(InputError, match="lacks the dataset rho"):
        formats.read(impact_0012[0], "miluphcuda")


def test_datasets_are_mapped_with_their_units(tmp_path):
    rng = np.random.default_rng(1)
    place, stress = rng.normal(size=(6, 3)), rng.normal(size=(6, 9))
    with h5py.File(tmp_path / "swift.h5", "w") as file:
        file["PartType0/Coordinates"] = place
        file["PartType0/Velocities"] = 2.0 * place
        file["PartType0/Masses"] = np.full((6, 1), 3.0)
        file["PartType0/Stress"] = stress
        file["PartType0/ParticleIDs"] = np.arange(6)[::-1]
        file.attrs["time"] = 4.0
    mapping = (
        "position=PartType0/Coordinates [km], velocity=/PartType0/Velocities [km/s], m=PartType0/Masses [1e10 kg],"
    )
    mapping += "deviatoric_stress=PartType0/Stress [GPa],id=PartType0/ParticleIDs"
    found = formats.read(tmp_path / "swift.h5", columns=mapping)
    np.testing.assert_allclose(found.position, 1e3 * place)
    np.testing.assert_allclose(found.velocity, 2e3 * place)
    np.testing.assert_allclose(found.mass, 3e10)
    np.testing.assert_allclose(found.deviatoric_stress, 1e9 * stress[:, [0, 1, 2, 4, 5, 8]])
    np.testing.assert_array_equal(found.identity, np.arange(6)[::-1])
    assert found.attributes["time"] == 4.0
    assert formats.lacking(found) == {"handoff": ["density", "material"]}
    for columns, words in {
        "position=PartType0/Nowhere": "no dataset 'PartType0/Nowhere'",
        "position=PartType0/Coordinates [kg]": "is not a quantity in m",
        "m=PartType0/Coordinates": "one number per particle",
        "position=PartType0/Masses": "needs a dataset of shape",
        "colour=PartType0/Masses": "unknown field 'colour'",
        "position": "write 'position=",
        "m=PartType0/Masses": "lacks position",
        None: "no dataset is named like a position",
    }.items():
        with pytest.raises(InputError, match=words):
            formats.read(tmp_path / "swift.h5", columns=columns)


def test_datasets_with_known_names_need_no_mapping(tmp_path):
    with h5py.File(tmp_path / "a.hdf5", "w") as file:
        file["step/x"], file["step/y"], file["step/z"] = np.arange(3.0), np.arange(3.0), np.ones(3)
        file["step/density"] = np.full(3, 2700.0)
        file["step/unheard_of"] = np.ones((3, 3))
    found = formats.read(tmp_path / "a.hdf5")
    assert set(found) == {"identity", "position", "density"}
    np.testing.assert_array_equal(found.position[2], [2.0, 2.0, 1.0])
    with h5py.File(tmp_path / "a.hdf5", "a") as file:
        file["step/m"] = np.ones(5)
    with pytest.raises(InputError, match=r"differ in length: \[3, 5\]"):
        formats.read(tmp_path / "a.hdf5")


def test_what_an_hdf5_file_is_shows_in_its_content(tmp_path, impact_0012):
    snapshot.write(Particles({"position": np.eye(3)}, {"time": 1.0}), tmp_path / "ours.vtkhdf")
    (tmp_path / "ours.vtkhdf").rename(tmp_path / "ours.h5")
    assert formats.read(tmp_path / "ours.h5").attributes["time"] == 1.0
    assert formats.read(impact_0012[0]).attributes["stage"] == "sph"


@pytest.mark.parametrize("up", [(0, 0, 2), (0, 0, -1), (1, 0, 0), (0.3, -0.5, 0.7)])
def test_another_frame_is_turned_upright(up):
    rng = np.random.default_rng(4)
    up = np.array(up, dtype=float)
    place, spin = rng.normal(size=(5, 3)) + [7, 0, 0], rng.normal(size=(5, 3))
    stress = rng.normal(size=(5, 6))
    cloud = Particles(
        {"position": place, "velocity": spin, "deviatoric_stress": stress, "mass": np.ones(5)}, {"time": 2.0}
    )
    found = turned_frame.placed(cloud, (7.0, 0.0, 0.0), up)
    turn = turned_frame.rotation_onto_z(up)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    np.testing.assert_allclose(turn @ up, [0, 0, np.linalg.norm(up)], atol=1e-12)
    np.testing.assert_allclose(found.position[:, 2], (place - [7, 0, 0]) @ up / np.linalg.norm(up), atol=1e-12)
    # lengths, angles and the traction on the up plane stay what they are
    np.testing.assert_allclose(
        np.einsum("ij,ij->i", found.position, found.velocity),
        np.einsum("ij,ij->i", place - [7, 0, 0], spin),
        atol=1e-12,
    )
    full = stress[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    normal = up / np.linalg.norm(up)
    np.testing.assert_allclose(
        found.deviatoric_stress[:, 5], np.einsum("a,nab,b->n", normal, full, normal), atol=1e-12
    )
    with pytest.raises(InputError, match="no direction"):
        turned_frame.placed(cloud, up=(0, 0, 0))
