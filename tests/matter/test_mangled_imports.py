"""Files of others that are cut and mangled: particles, or one short message; nothing else."""

from __future__ import annotations

import random
import string

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from matter import formats
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from matter.solids import solid
from tests.faults import mutations
from tests.matter import foreign_files as foreign

LONGEST = 4000
"""Characters of a message."""
ODD = st.one_of(
    st.sampled_from(
        [
            "nan",
            "inf",
            "-1",
            "1e999",
            "9" * 400,
            "9" * 5000,
            "1_0",
            "x",
            "-",
            "",
            "\n",
            "\0",
            "é",
            "0.5",
            "[km]",
            "[" * 900,
        ]
    ),
    st.text(string.printable, max_size=12),
    st.integers().map(str),
    st.sampled_from(["[" * 900, "ab" * 2500]),
)
few = settings(max_examples=30, deadline=None, derandomize=True)

CSV = "id,x [km],y,z,m,rho [g/cm^3],mat\n1,1,2,3,4,5,0\n2,4,5,6,7,8,1\n9007199254740993,7,8,9,1,1,0\n"
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf -4/1 -1/2 -2/3\nf 2 3 4\n"


@st.composite
def mangled(draw, text: str) -> str:
    """A text with one to three mistakes: cut, a word or a line replaced, taken out or doubled."""
    for _ in range(draw(st.integers(1, 3))):
        how = draw(st.sampled_from(("cut", "word", "word", "word", "line", "twice", "swap")))
        lines = text.split("\n")
        k = draw(st.integers(0, len(lines) - 1))
        if how == "cut":
            text = text[: draw(st.integers(0, len(text)))]
            continue
        if how == "word":
            mark = "," if "," in lines[k] else " "
            words = lines[k].split(mark)
            words[draw(st.integers(0, len(words) - 1))] = draw(ODD)
            lines[k] = mark.join(words)
        elif how == "line":
            del lines[k]
        elif how == "twice":
            lines.insert(k, lines[k])
        else:
            j = draw(st.integers(0, len(lines) - 1))
            lines[k], lines[j] = lines[j], lines[k]
        text = "\n".join(lines)
    return text


def judged(call) -> None:
    """The call ends, with a result or with an ``InputError`` that can be read."""
    try:
        call()
    except InputError as reason:
        assert 0 < len(str(reason)) < LONGEST, f"{len(str(reason))} characters: {str(reason)[:300]}"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("mangled")


def written(path, text: str):
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    return path


@pytest.mark.parametrize("name", ["whole.dump", "whole.csv", "whole.obj"])
def test_what_is_mangled_below_is_whole(place, name):
    text = {"whole.dump": foreign.DUMP, "whole.csv": CSV, "whole.obj": OBJ}[name]
    path = written(place / name, text)
    if name.endswith("obj"):
        assert solid.read(path, 1.0).volume == pytest.approx(1.0 / 6.0)
    else:
        assert len(formats.read(path)) == 3


@few
@given(text=mangled(foreign.DUMP))
def test_mangled_dumps(place, text):
    path = written(place / "a.dump", text)
    judged(lambda: formats.convert(path, place / "a.vtkhdf"))


@few
@given(text=mangled(CSV))
def test_mangled_tables(place, text):
    path = written(place / "a.csv", text)
    judged(lambda: formats.convert(path, place / "a.vtkhdf"))


@few
@given(text=mangled(OBJ))
def test_mangled_surfaces(place, text):
    path = written(place / "a.obj", text)
    judged(lambda: solid.read(path, 1.0))


@few
@given(text=mangled("x,y,z,m"), whole=st.booleans())
def test_mangled_names_of_columns(place, text, whole):
    path = written(place / ("b.csv" if whole else "b.dump"), "1 2 3 4\n" if whole else foreign.DUMP)
    judged(lambda: formats.convert(path, place / "a.vtkhdf", columns=text))


@few
@given(text=mangled("position=PartType0/Coordinates [km],m=PartType0/Masses"))
def test_mangled_names_of_datasets(place, text):
    with h5py.File(place / "b.h5", "w") as file:
        file["PartType0/Coordinates"], file["PartType0/Masses"] = np.eye(3), np.ones(3)
    judged(lambda: formats.convert(place / "b.h5", place / "a.vtkhdf", columns=text))


@pytest.mark.campaign  # a flipped byte can send the HDF5 library round for ever in an attribute
@few
@given(seed=st.integers(0, 2**32))
def test_mangled_snapshots(place, seed):
    rng = random.Random(seed)
    fields = {"position": np.eye(3), "identity": [1, 2, 3], "mass": np.ones(3), "material": [0, 0, 1]}
    snapshot.write(Particles(fields, {"time": 1.0, "materials": ["ice", "basalt"]}), place / "whole.vtkhdf")
    mutations.snapshot_file(place / "whole.vtkhdf", place / "b.vtkhdf", rng)
    judged(lambda: formats.convert(place / "b.vtkhdf", place / "a.vtkhdf"))
    judged(lambda: formats.convert(place / "b.vtkhdf", place / "a.vtkhdf", form="hdf5"))
    judged(lambda: formats.export(formats.read(place / "b.vtkhdf"), place / "a.lmp"))


@pytest.mark.campaign  # as above
@few
@given(seed=st.integers(0, 2**32))
def test_mangled_files_of_other_codes(place, seed):
    """Bytes of OpenSPH's states flipped, cut and put in; miluphcuda's datasets of another kind, shape and value."""
    rng = random.Random(seed)
    foreign.ssf(place / "c.ssf", [foreign.body(4, 2, "ice"), foreign.body(3, 5)], attractors=1)
    content = bytearray((place / "c.ssf").read_bytes())
    for _ in range(rng.choice((1, 3))):
        at = 8 * rng.randrange(len(content) // 8)
        odd = rng.choice((0, 1, -1, 2**62, -(2**62), 2**31, 7))
        content[at : at + 8] = odd.to_bytes(8, "little", signed=True)
    (place / "c.ssf").write_bytes(bytes(content[: rng.choice((len(content), len(content), at + 3))]))
    judged(lambda: formats.convert(place / "c.ssf", place / "a.vtkhdf"))
    with h5py.File(place / "impact.h5", "w") as file:
        for name, values in foreign.miluphcuda_values(5, 5).items():
            file[name] = values
    mutations.snapshot_file(place / "impact.h5", place / "c.h5", rng)
    judged(lambda: formats.convert(place / "c.h5", place / "a.vtkhdf", form="miluphcuda"))
    foreign.miluphcuda_text(place / "impact.0001", foreign.miluphcuda_values(5, 5), True, True, True)
    text = (place / "impact.0001").read_text()
    at = rng.randrange(len(text))
    bad = rng.choice(("", "nan", "x", "9" * 500, "\n", "-1 ", "\0"))
    (place / "impact.0001").write_text(text[:at] + bad + text[at + rng.randrange(9) :])
    (place / "impact.0001.info").write_text(f"Time: {rng.choice(('33', 'nan', 'soon', ''))}\n")
    switches = "INTEGRATE_ENERGY,SOLID,FRAGMENTATION,PALPHA_POROSITY"
    judged(lambda: formats.convert(place / "impact.0001", place / "a.vtkhdf", form="miluphcuda", columns=switches))
