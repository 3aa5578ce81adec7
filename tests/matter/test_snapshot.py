"""Snapshots: what was written is read back, and pyvista opens the same file without a converter."""

from __future__ import annotations

import json
import os
import shutil
import subprocess

import h5py
import numpy as np
import pytest

from matter.errors import InputError
from matter.files import snapshot
from matter.particles import FIELDS, Particles


@pytest.fixture
def full() -> Particles:
    """Every field there is, on 100 particles, with contacts."""
    rng = np.random.default_rng(7)
    fields = {name: rng.integers(0, 100, (100, *entry.shape)).astype(entry.dtype) for name, entry in FIELDS.items()}
    fields["position"] = rng.normal(size=(100, 3)) * 2.1e6
    attributes = {
        "time": 61.5,
        "stage": "dem",
        "frame": "sphere",
        "materials": ["ice", "water"],
        "domain": {"core_radius_m": 1.8e6},
        "count": 3,
    }
    return Particles(
        fields,
        attributes,
        {"contacts/pair": rng.integers(0, 100, (80, 2)), "contacts/history": rng.normal(size=(80, 7))},
    )


@pytest.mark.parametrize("count", [0, 1, 64, 65, 100])
def test_what_was_written_is_read_back_to_the_bit(tmp_path, full, count):
    some = Particles({name: full[name][:count] for name in full}, full.attributes, full.tables)
    snapshot.write(some, tmp_path / "s.vtkhdf")
    back = snapshot.read(tmp_path / "s.vtkhdf")
    assert set(back) == set(some) and len(back) == count
    for name in some:
        np.testing.assert_array_equal(back[name], some[name])
        assert back[name].dtype == some[name].dtype
    assert back.attributes == full.attributes
    for name, table in full.tables.items():
        np.testing.assert_array_equal(back.tables[name], table)


def test_pyvista_opens_it_without_a_converter(tmp_path, full):
    import pyvista

    snapshot.write(full, tmp_path / "s.vtkhdf")
    cloud = pyvista.read(tmp_path / "s.vtkhdf")
    np.testing.assert_array_equal(cloud.points, full.position)
    np.testing.assert_array_equal(
        cloud.cells.reshape(-1, 2), np.column_stack([np.ones(100), np.arange(100)])
    )  # a vertex for each particle
    assert set(cloud.celltypes) == {pyvista.CellType.VERTEX}
    assert set(cloud.point_data) == set(full) - {"position"}
    for name in full:
        if name != "position":
            np.testing.assert_array_equal(cloud.point_data[name].reshape(full[name].shape), full[name])


def test_an_empty_snapshot_opens_too(tmp_path):
    import pyvista

    snapshot.write(Particles({"position": np.zeros((0, 3)), "mass": []}), tmp_path / "s.vtkhdf")
    assert pyvista.read(tmp_path / "s.vtkhdf").n_points == 0


def broken(count: int = 1000) -> Particles:
    """Particles of which every third is broken, in a cube of side 2."""
    rng = np.random.default_rng(3)
    fields = {
        "position": rng.uniform(-1, 1, (count, 3)),
        "damage": np.where(np.arange(count) % 3 == 0, 1.0, 0.1),
        "material": np.arange(count) % 2,
    }
    domain = {"datum_radius_m": 2.1e6, "core_species": 0}
    return Particles(
        fields,
        {
            "time": 180.0,
            "stage": "sph",
            "materials": ["ice", "water"],
            "domain": domain,
            "contact": {"ice": {"friction": 0.5}},
        },
    )


def test_thresholds_and_clips_take_particles_apart(tmp_path):
    import pyvista

    some = broken()
    snapshot.write(some, tmp_path / "s.vtkhdf")
    cloud = pyvista.read(tmp_path / "s.vtkhdf")
    assert cloud.n_cells == cloud.n_points == 1000
    chosen = cloud.threshold([0.5, 1.0], scalars="damage")
    np.testing.assert_array_equal(chosen.points, some.position[some.damage > 0.5])
    slab = cloud.clip_box([-2, 2, -0.1, 0.1, -2, 2], invert=False)
    assert slab.n_points == np.count_nonzero(np.abs(some.position[:, 1]) < 0.1)


def test_time_materials_and_datum_are_field_data(tmp_path):
    import pyvista

    snapshot.write(broken(), tmp_path / "s.vtkhdf")
    facts = pyvista.read(tmp_path / "s.vtkhdf").field_data
    assert (
        facts["TimeValue"] == [180.0]
        and list(facts["materials"]) == ["ice", "water"]
        and list(facts["stage"]) == ["sph"]
    )
    assert facts["domain.datum_radius_m"] == [2.1e6] and "contact" not in facts


def test_pyvista_plays_a_series_in_time(tmp_path):
    import pyvista

    for number, time in enumerate((0.0, 60.0, 90.0)):
        some = broken()
        some.attributes["time"] = time
        some["damage"] = np.full(1000, time)
        snapshot.write(some, tmp_path / f"snap_{number:04d}.vtkhdf")
    snapshot.write_series(tmp_path, {"snap_0000.vtkhdf": 0.0, "snap_0001.vtkhdf": 60.0, "snap_0002.vtkhdf": 90.0})
    reader = pyvista.get_reader(tmp_path / "snap.vtkhdf.series")
    assert reader.time_values == [0.0, 60.0, 90.0]
    reader.set_active_time_value(90.0)
    cloud = reader.read()
    assert cloud.field_data["TimeValue"] == [90.0] and cloud["damage"][0] == 90.0


def test_cells_cost_a_byte_per_particle_at_most(tmp_path):
    count = 20_000
    snapshot.write(Particles({"position": np.random.default_rng(1).normal(size=(count, 3))}), tmp_path / "s.vtkhdf")
    with h5py.File(tmp_path / "s.vtkhdf") as file:
        assert sum(file["VTKHDF"][name].id.get_storage_size() for name in ("Connectivity", "Offsets", "Types")) < count


PARAVIEW = """
from paraview.simple import *
from paraview import servermanager
reader = VTKHDFReader(FileName=[r'{0}', r'{1}'])
reader.UpdatePipeline()
facts = servermanager.Fetch(reader).GetFieldData()
chosen = Threshold(Input=reader, Scalars=['POINTS', 'damage'], LowerThreshold=0.5, UpperThreshold=1.0)
chosen.UpdatePipeline()
print('found', chosen.GetDataInformation().GetNumberOfPoints(), len(reader.TimestepValues),
      facts.GetArray('TimeValue').GetValue(0),
      facts.GetAbstractArray('materials').GetValue(1))
"""


def test_paraview_itself_thresholds_particles(tmp_path):
    program = shutil.which("pvpython")
    if program is None:
        pytest.skip("no pvpython on this machine (Debian: apt-get install python3-paraview)")
    for name in ("a", "b"):
        snapshot.write(broken(), tmp_path / f"{name}.vtkhdf")
    (tmp_path / "look.py").write_text(PARAVIEW.format(tmp_path / "a.vtkhdf", tmp_path / "b.vtkhdf"))
    clean = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run([program, tmp_path / "look.py"], capture_output=True, text=True, timeout=120, env=clean)
    assert "found 334 2 180.0 water" in done.stdout, done.stdout + done.stderr


def test_a_snapshot_of_before_with_one_cell_for_all_particles_is_read(tmp_path):
    some = broken()
    snapshot.write(some, tmp_path / "s.vtkhdf")
    with h5py.File(tmp_path / "s.vtkhdf", "a") as file:
        del file["VTKHDF"]
        group = file.create_group("VTKHDF/Vertices")
        group["Connectivity"], group["Offsets"] = np.arange(1000), np.array([0, 1000])
    np.testing.assert_array_equal(snapshot.read(tmp_path / "s.vtkhdf").position, some.position)


def test_fields_carry_unit_and_meaning_and_nothing_is_stored_twice(tmp_path, full):
    snapshot.write(full, tmp_path / "s.vtkhdf")
    with h5py.File(tmp_path / "s.vtkhdf") as file:
        for name in full:
            assert file[f"particles/{name}"].attrs["unit"] == FIELDS[name].unit
            assert file[f"particles/{name}"].attrs["meaning"] == FIELDS[name].meaning
            twin = file["VTKHDF/Points"] if name == "position" else file[f"VTKHDF/PointData/{name}"]
            assert twin == file[f"particles/{name}"]  # h5py: the same object in the file
        assert file.attrs["time"] == 61.5


@pytest.mark.parametrize(("content", "words"), [(None, "no snapshot at"), (b"text", "not a readable HDF5 file")])
def test_a_file_that_is_no_snapshot_is_a_message(tmp_path, content, words):
    path = tmp_path / "s.vtkhdf"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        snapshot.read(path)


def test_hdf5_of_another_kind_is_a_message(tmp_path):
    with h5py.File(tmp_path / "s.h5", "w") as file:
        file["x"] = [1, 2]
    with pytest.raises(InputError, match="no group '/particles'"):
        snapshot.read(tmp_path / "s.h5")


def test_a_file_cut_short_is_a_message(tmp_path, full):
    snapshot.write(full, tmp_path / "s.vtkhdf")
    content = (tmp_path / "s.vtkhdf").read_bytes()
    (tmp_path / "s.vtkhdf").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError):
        snapshot.read(tmp_path / "s.vtkhdf")


def test_the_series_index_lists_snapshots_in_order_of_time(tmp_path, full):
    for name in ("snap_0001", "snap_0000"):
        snapshot.write(full, tmp_path / f"{name}.vtkhdf")
    snapshot.write_series(tmp_path, {"snap_0001.vtkhdf": 60.0, "snap_0000.vtkhdf": 0.0})
    index = json.loads((tmp_path / "snap.vtkhdf.series").read_text())
    assert [entry["name"] for entry in index["files"]] == ["snap_0000.vtkhdf", "snap_0001.vtkhdf"]
    assert [path.name for path in snapshot.series(tmp_path)] == ["snap_0000.vtkhdf", "snap_0001.vtkhdf"]


def test_snapshots_beyond_the_9999th_stay_in_order(tmp_path):
    names = [f"snap_{number:04d}.vtkhdf" for number in (9998, 9999, 10000, 10001)]
    for name in reversed(names):
        (tmp_path / name).touch()
    assert [path.name for path in snapshot.series(tmp_path)] == names
    snapshot.write_series(tmp_path, dict.fromkeys(reversed(names), 5.0))  # one moment: by their numbers
    index = json.loads((tmp_path / "snap.vtkhdf.series").read_text())
    assert [entry["name"] for entry in index["files"]] == names
