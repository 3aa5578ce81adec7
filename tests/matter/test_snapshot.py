"""Snapshots: what was written is read back, and pyvista opens the same file without a converter."""

from __future__ import annotations

import json

import h5py
import numpy as np
import pytest

from matter import snapshot
from matter.errors import InputError
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
    return Particles(fields, attributes, {"contacts/pair": rng.integers(0, 100, (80, 2)), "contacts/history": rng.normal(size=(80, 7))})


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
    np.testing.assert_array_equal(cloud.verts, [100, *range(100)])  # one cell of 100 vertices: they show as points
    assert set(cloud.point_data) == set(full) - {"position"}
    for name in full:
        if name != "position":
            np.testing.assert_array_equal(cloud.point_data[name].reshape(full[name].shape), full[name])


def test_an_empty_snapshot_opens_too(tmp_path):
    import pyvista

    snapshot.write(Particles({"position": np.zeros((0, 3)), "mass": []}), tmp_path / "s.vtkhdf")
    assert pyvista.read(tmp_path / "s.vtkhdf").n_points == 0


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
    snapshot.write_series(tmp_path, {"snap_0001.vtkhdf": 60.0, "snap_0000.vtkhdf": 0.0}, "snap")
    index = json.loads((tmp_path / "snap.vtkhdf.series").read_text())
    assert [entry["name"] for entry in index["files"]] == ["snap_0000.vtkhdf", "snap_0001.vtkhdf"]
    assert [path.name for path in snapshot.series(tmp_path)] == ["snap_0000.vtkhdf", "snap_0001.vtkhdf"]
