"""HDF5 files of others: what is not an array of numbers that the file holds is refused with its name."""

import os
import signal

import h5py
import numpy as np
import pytest

from matter import formats
from matter.errors import InputError
from matter.files import archive, hdf5_input, snapshot
from matter.particles import Particles


@pytest.fixture
def cloud(tmp_path):
    path = tmp_path / "cloud.vtkhdf"
    rng = np.random.default_rng(1)
    snapshot.write(Particles({"position": rng.normal(size=(200, 3)), "mass": np.zeros(200)}, {"time": 0.0}), path)
    return path


def spoil(path, name, make):
    with h5py.File(path, "r+") as file:
        del file[f"particles/{name}"]
        make(file["particles"])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda group: group.create_group("mass"), "mass is a group, and an array is needed"),
        (lambda group: group.create_dataset("mass", data=[b"abc"] * 200), "mass holds no numbers"),
        (
            lambda group: group.create_dataset("mass", shape=(10**11,), dtype="f8", chunks=(1024,)),
            "mass claims to hold 800 GB, and 0 MB are stored",
        ),
    ],
)
def test_what_is_no_array_of_this_file_is_refused(cloud, make, words):
    spoil(cloud, "mass", make)
    with pytest.raises(InputError, match=words):
        snapshot.read(cloud)
    assert "position" in snapshot.read(cloud, only=("position",))  # what is sound can still be read


def outward(path, elsewhere):
    """Ways in which a file can take ``mass`` from another one."""
    layout = h5py.VirtualLayout(shape=(200,), dtype="f8")
    layout[:] = h5py.VirtualSource(elsewhere, "mass", shape=(200,))
    return {
        "is a link to another file": lambda group: group.__setitem__("mass", h5py.ExternalLink(elsewhere, "mass")),
        "is made of datasets of other files": lambda group: group.create_virtual_dataset("mass", layout),
        "has its values in another file": lambda group: group.create_dataset(
            "mass", shape=(200,), dtype="f8", external=[(elsewhere, 0, 1600)]
        ),
    }


@pytest.mark.parametrize(
    "words",
    ["is a link to another file", "is made of datasets of other files", "has its values in another file"],
)
@pytest.mark.parametrize(
    "call",
    [
        snapshot.read,
        snapshot.names,
        snapshot.attributes,
        archive.read,
        formats.read,
        lambda path: formats.read(path, "hdf5"),
        lambda path: formats.read(path, "miluphcuda"),
    ],
)
def test_a_file_that_takes_values_from_another_one_is_refused(cloud, tmp_path, words, call):
    """By every reader, wherever in the file it does, and whether or not that is read."""
    with h5py.File(tmp_path / "elsewhere.h5", "w") as file:
        file["mass"] = np.ones(200)
    make = outward(cloud, str(tmp_path / "elsewhere.h5"))[words]
    spoil(cloud, "mass", make)
    with pytest.raises(InputError, match=f"particles/mass {words}"):
        call(cloud)
    with h5py.File(cloud, "r+") as file:  # deep below a group that nobody asks for
        del file["particles/mass"]
        make(file.create_group("a/" + "b/" * 1500 + "c"))
    with pytest.raises(InputError, match=words) as caught:
        call(cloud)
    assert len(str(caught.value)) < 1000


def test_a_link_within_the_file_is_followed(cloud):
    """And one that leads back to a group above ends."""
    with h5py.File(cloud, "r+") as file:
        file["particles/mass"].file.move("particles/mass", "elsewhere")
        file["particles/mass"] = h5py.SoftLink("/elsewhere")
        file["particles/up"] = h5py.SoftLink("/")
        file["round"] = file["/"]
    with pytest.raises(InputError, match="up is a group"):
        snapshot.read(cloud)
    assert len(snapshot.read(cloud, only=("mass",)).mass) == 200


def test_what_was_squeezed_well_is_read(tmp_path):
    """64 MB and more of zeros, as they compress best, are there."""
    many = np.zeros(3 * 10**7)
    archive.write(tmp_path / "zeros.h5", {"a": many})
    with hdf5_input.opened(tmp_path / "zeros.h5") as file:
        assert file["a"].id.get_storage_size() < many.nbytes / 100
        assert hdf5_input.array(file, "a").shape == many.shape


def test_whatever_the_library_raises_is_one_message(cloud):
    """Every byte of the header flipped in turn: particles or a message, nothing else."""
    content = cloud.read_bytes()
    ends = set()
    for place in range(0, 2048, 5):
        cloud.write_bytes(content[:place] + bytes([content[place] ^ 0x41]) + content[place + 1 :])
        try:
            snapshot.read(cloud)
            ends.add("read")
        except InputError as reason:
            ends.add("refused")
            assert str(cloud) in str(reason)
    assert ends == {"read", "refused"}


def test_values_that_are_not_finite_are_not_exported(tmp_path):
    mass = np.ones(5)
    mass[3] = np.nan
    with pytest.raises(InputError, match="field 'mass' has 1 values that are not finite"):
        formats.export(Particles({"position": np.zeros((5, 3)), "mass": mass}, {}), tmp_path / "out.csv")
    assert not (tmp_path / "out.csv").exists()


def code_of(action):
    """Exit code of ``action`` in a process of its own: 2 for an ``InputError``; -14 where it takes 10 s."""
    child = os.fork()
    if child == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(10)
        try:
            action()
        except InputError:
            os._exit(2)
        except BaseException:
            os._exit(3)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def test_a_heap_of_texts_that_leads_nowhere_is_refused_before_the_library_loops(cloud, tmp_path):
    """One byte of the size of an object: HDF5 1.14 then walks into zeros and stays there."""
    whole = cloud.read_bytes()
    start = whole.find(b"GCOL")
    assert start > 0 and len(snapshot.read(cloud)) == 200
    objects, at = [], start + 16
    while whole[at : at + 2] != b"\0\0":
        objects.append(at)
        at += 16 + (int.from_bytes(whole[at + 8 : at + 16], "little") + 7) // 8 * 8
    last, free = objects[-1], at
    for place, value in ((last + 9, 1), (free + 8, 0), (free + 9, 1)):
        spoiled = bytearray(whole)
        spoiled[place] = value
        (tmp_path / "spoiled.vtkhdf").write_bytes(spoiled)
        assert code_of(lambda: snapshot.read(tmp_path / "spoiled.vtkhdf")) == 2, place - start
