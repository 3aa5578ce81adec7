"""The house's own count, on a house of three files whose numbers are known."""

import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from pipeline.case import keys
from studies import house, house_words

ROOT = Path(__file__).parents[2]

ONE = '''"""murnaghan in a docstring."""
import sph.two  # murnaghan in a comment
from sph.eos import MURNAGHAN

def full(a, b, c, d, e, f, g, h, i, j, k):
    return a[0, 7] + b[4] + c[0, 2] + d[:3] + e[3:6] + as_murnaghan + f["murnaghan"] + "one murnaghan" + murnaghans
'''
TWO = """
def late():
    from sph import one
"""
LAW = """
@law(forceinline=True)
def pressure(x):
    return np.sqrt(x) + np.int64(3) + math.sqrt(x)

def plain(x):
    return np.sqrt(x)
"""
TALL = "def tall():\n" + "    pass\n" * 100


@pytest.fixture
def counted(tmp_path: Path) -> dict[str, list[str]]:
    (tmp_path / "sph").mkdir()
    for name, text in (("one", ONE), ("two", TWO), ("three", TALL), ("four", LAW)):
        (tmp_path / "sph" / f"{name}.py").write_text(text)
    return house.count(tmp_path)


def test_what_is_counted(counted):
    assert counted["functions of more than 10 parameters"] == ["11 sph/one.py:5 full"]
    assert (
        counted["functions of more than 60 lines"]
        == counted["functions of more than 100 lines"]
        == ["101 sph/three.py:1 tall"]
    )
    assert counted["lines of more than 119 characters"] == []


def test_circle_through_a_function(counted):
    assert counted["circles of imports"] == ["sph.one, sph.two"]


def test_flat_files_and_shared_names(tmp_path):
    for name in ("sph/a.py", "sph/stage.py", "sph/laws/a.py", "dem/stage.py", "dem/__init__.py", "tests/b.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("pass\n")
    flat = house.flat_files(tmp_path)
    assert (flat["sph"], flat["dem"], flat["crater"]) == (["a.py", "stage.py"], ["stage.py"], [])
    assert set(house.shared_names(tmp_path)) == {"2 a", "2 stage"}


def test_floors_and_keys(tmp_path):
    files = {
        "sph/stage.py": "from sph.pairs import loop\nfrom sph.laws import law\n",
        "sph/pairs/loop.py": "from sph.laws import law\nfrom sph.pairs import row\n",
        "sph/pairs/row.py": "class Settings(body.Model):\n    at: float\n    'When.'\n    of = 1\n",
        "sph/laws/law.py": "class Late(Settings):\n    end: float = 1.0\n"
        "class Parameters(NamedTuple):\n    mu: float\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    counted = house.House.read(tmp_path)
    assert house.floors(counted, "sph") == ["stage", "pairs", "laws"]
    assert [key.partition(" ")[2] for key in house.keys(counted)] == ["Late.end", "Parameters.mu", "Settings.at"]


def test_wide_lines_are_counted_around_the_rooms_too(tmp_path):
    for folder in ("studies", "sph", "tests"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.py").write_text(f"pass\n# {'µ' * (117 + (folder == 'tests'))}\n")
    assert house.wide_lines(tmp_path) == ["tests/a.py:2 (120)"]


@pytest.fixture(scope="module")
def ours():
    """The rooms of this checkout: to parse them takes seconds."""
    return house.House.read(ROOT)


def test_no_room_has_a_circle_of_imports(ours):
    assert house.circles(house.imports(ours)) == []


@pytest.mark.parametrize("room", house.ROOMS)
def test_few_files_lie_flat_in_a_room(room):
    """A newcomer finds the place of a change by the names of folders."""
    assert len(house.flat_files(ROOT)[room]) <= house.MOST_FLAT


def test_few_names_stand_twice():
    """What a search for a module's name finds is that module."""
    assert len(house.shared_names(ROOT)) <= 3


def test_names_that_say_no_result_and_words_of_no_field_are_found(tmp_path):
    (tmp_path / "sph").mkdir()
    (tmp_path / "sph" / "a.py").write_text("def of(x):\n    return x.place\n\ndef lines_of(kept):\n    return kept\n")
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / "unrolled.py").write_text("class Lie:\n    flat = soft\n")
    assert house_words.banned_names(tmp_path) == [
        "sph/a.py:1 of", "sph/a.py:2 place", "studies/unrolled.py:1 Lie", "studies/unrolled.py: unrolled"
    ]  # fmt: skip


def test_functions_are_named_by_their_result_and_words_are_the_field_s():
    assert house_words.banned_names(ROOT) == []


def test_keys_that_a_case_may_set_are_few():
    """Each is a branch, a test and a line of ``run_case --describe``."""
    assert sum(len(keys.keys(table)) for table in keys.tables()) <= 233


@pytest.mark.parametrize("room", house.ROOMS)
def test_few_floors(ours, room):
    """A room reads from the ground up like a table of contents."""
    assert len(house.floors(ours, room)) <= 10


def test_few_functions_are_long_or_have_many_parameters(ours):
    assert house.arguments(ours) == []
    assert len(house.long_functions(ours, house.VERY_LONG)) <= 6
    assert len(house.long_functions(ours, house.LONG)) <= 16


def test_no_line_is_above_119_characters():
    assert house.wide_lines(ROOT) == []


def test_a_tag_in_python_is_found(tmp_path):
    (tmp_path / "sph").mkdir()
    lines = ['a = "<p>x</p>"', 'b = f"<td class={a}>"', 'c = "a < b > c, <run>, x<y"', 'd = "&beta;"', 'e = "</body>"']
    (tmp_path / "sph" / "a.py").write_text("\n".join(lines))
    assert house.tags_in_python(tmp_path) == [f"sph/a.py:{line}" for line in (1, 2, 4, 5)]


def test_a_test_that_states_nothing_is_found(tmp_path):
    """An assertion of a helper counts, in the file or imported; one that nobody calls does not."""
    (tmp_path / "tests").mkdir()
    (tmp_path / "fixtures").mkdir()
    (tmp_path / "fixtures" / "balls.py").write_text("def held(x):\n    np.testing.assert_allclose(x, 1)\n")
    (tmp_path / "tests" / "test_a.py").write_text(
        "from fixtures import balls\nfrom fixtures.balls import held as kept\n"
        "def judged(x):\n    deeper(x)\ndef deeper(x):\n    assert x\n"
        "def circle(x):\n    circle(x)\n"
        "def test_own():\n    with pytest.raises(ValueError):\n        f()\n"
        "def test_helper():\n    judged(1)\n"
        "def test_other_file():\n    balls.held(1)\n"
        "def test_other_name():\n    kept(1)\n"
        "def test_nothing():\n    circle(1)\n    x.raises(1)\n"
    )
    assert house_words.tests_without_assertion(tmp_path) == ["tests/test_a.py:18 test_nothing"]


def test_every_test_states_something():
    assert house_words.tests_without_assertion(ROOT) == []


def test_tags_stand_in_templates():
    assert house.tags_in_python(ROOT) == []


def test_every_dependency_has_a_tested_version():
    """``constraints.txt`` names each library that pyproject.toml asks for, in a version that it allows."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [
        *project["dependencies"],
        *(line for lines in project["optional-dependencies"].values() for line in lines),
    ]
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    tested = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    tested = {canonicalize_name(name): version for name, version in tested.items()}
    for requirement in map(Requirement, wanted):
        if requirement.name == project["name"]:  # an extra that holds another
            assert requirement.extras <= set(project["optional-dependencies"])
            continue
        assert requirement.specifier.contains(tested[canonicalize_name(requirement.name)]), requirement


def test_columns_above_the_coordinates(counted):
    assert (
        len(counted["raw columns in sph"]) == len(counted["  above 5 in sph"]) == 1
    )  # one line, whatever stands in it
    assert house.raw_columns(
        house.House({"sph/a.py": ("", house.ast.parse("a[0, 2]\nb[:3]\nc['x']\nd[-1]\ne[3:6]\nf[i, 5]"))}), "sph"
    ) == [
        "sph/a.py:5",
        "sph/a.py:6",
    ]


def test_tables_of_grains_by_number_are_found(tmp_path):
    (tmp_path / "dem").mkdir()
    lines = [
        "bed.X[:, :3]",
        "bed.position[:, 2]",
        "self.W[k, 2]",
        "X[i, 2]",
        "bed.V[:, MASS]",
        "bed.X[k]",
        "b.W[:, WX:]",
    ]
    (tmp_path / "dem" / "a.py").write_text("\n".join(lines))
    assert house.raw_tables(tmp_path) == ["dem/a.py:1", "dem/a.py:3"]


def test_columns_have_names(ours):
    """What stays are tensors of the shock stage's loops, coefficients of a polynomial and a stencil."""
    assert house.raw_tables(ROOT) == []
    most = {"nbody": 6, "sph": 29}
    assert [room for room in house.ROOMS if len(house.raw_columns(ours, room)) > most.get(room, 0)] == []


def test_places_are_code_not_words(counted):
    assert counted["places for one more equation of state (as murnaghan)"] == ["sph/one.py:3", "sph/one.py:6"]


def test_laws_that_call_numpy(counted):
    assert counted["lines of scalar laws that call numpy"] == ["sph/four.py:4"]
