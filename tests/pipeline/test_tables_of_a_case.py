"""A table of an equation of state that a case names: found beside the case, counted by its content, refused in one
line."""

from __future__ import annotations

import pytest

from fixtures import tables
from pipeline.case import read as cases
from pipeline.settings import identity

CASE = """
[case]
stages = ["sph"]
[target]
shape = "half_space"
gravity = "9.81 m/s^2"
[[target.layers]]
name = "rock"
material = "basalt"
thickness = "2 km"
[impact]
speed = "5 km/s"
angle_from_vertical = "0 deg"
[impact.projectile]
radius = "50 m"
material = "basalt"
[sph]
particles = 2000
[sph.materials.basalt]
eos = "table"
[sph.materials.basalt.table]
rho0 = "{rho0} kg/m^3"
file = "rock.txt"
[sph.materials.basalt.thermal]
temperature = "300 K"
"""


@pytest.fixture
def folder(tmp_path):
    tables.written(tmp_path / "rock.txt", tables.solid(), (tables.SOLID_NODES[0][::5], tables.SOLID_NODES[1][::5]))
    (tmp_path / "case.toml").write_text(CASE.format(rho0=f"{tables.solid_at_rest(300.0):.6f}"))
    return tmp_path


def table_of(case):
    return case.document["sph"]["materials"]["basalt"]["table"]["file"]


def test_the_path_starts_at_the_case_or_where_the_command_was_typed(folder, monkeypatch):
    assert table_of(cases.read(folder)) == str(folder / "rock.txt")
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    assert table_of(cases.read(folder)) == str(folder / "rock.txt")
    typed = cases.read(folder, overrides=['sph.materials.basalt.table.file="other.txt"'])
    assert table_of(typed) == str(folder / "elsewhere" / "other.txt")


def test_a_table_without_a_dot_in_its_name_counts_by_its_content(folder):
    plain = folder / "table"
    plain.write_text("one")
    assert list(identity._files_named({"a": [str(plain)]})) == [plain]


def _line(text, number, words):
    lines = text.splitlines()
    return "\n".join([*lines[:number], words, *lines[number + 1 :]])


def _at(text, number, column, word):
    words = text.splitlines()[number].split()
    words[column] = word
    return _line(text, number, " ".join(words))


def _scaled(text, column, factor):
    lines = text.splitlines()
    nodes = [line.split() for line in lines[16:]]
    for words in nodes:
        words[column] = repr(float(words[column]) * factor)
    return "\n".join([*lines[:16], *map(" ".join, nodes)])


@pytest.mark.parametrize(
    "spoil,words",
    [
        (lambda text: text.replace("e+", "x", 1), "not a number"),
        (lambda text: text[: len(text) // 2], "is cut short"),
        (None, "no table at"),
        (lambda text: _at(text, 20, 1, "nan"), "P is no number at"),
        (lambda text: _line(text, 20, "0 0 0 0"), "a hole at"),
        (lambda text: _line(text, 14, " ".join(reversed(text.splitlines()[14].split()))), "densities must ascend"),
        (lambda text: _scaled(text, 1, 1e-9), "the columns are not all in SI"),
    ],
    ids=["a word", "half of it", "gone", "a NaN", "a hole", "unsorted", "pressures in GPa"],
)
def test_a_bad_table_ends_the_command_with_2_and_one_line(folder, spoil, words, capsys, run_case):
    table = folder / "rock.txt"
    if spoil:
        table.write_text(spoil(table.read_text()))
    else:
        table.unlink()
    code, _ = run_case(folder, "--check")
    told = capsys.readouterr()
    assert code == 2
    assert words in " ".join((told.out + told.err).split()) and "Traceback" not in told.out + told.err


def test_a_sound_table_passes_the_check(folder, run_case):
    assert run_case(folder, "--check")[0] == 0
