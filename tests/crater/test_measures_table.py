"""One list of measures: every one is measured, shown and kept from its row, nothing else lists them, and a new one
takes a row and a function."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from crater.measures import quantities
from crater.measures.measure import measure
from crater.measures.uncertainty import Quantity
from fixtures import synthetic_craters as synthetic
from matter.particles import Particles
from matter.wording import crater_measures

ROOT = Path(__file__).parents[2]
ROOMS = ("matter", "nbody", "sph", "handoff", "dem", "crater", "pipeline")
NAMES = frozenset(crater_measures.UNITS)
WHERE_NAMED = {
    "matter/wording/crater_measures.py": "the table",
    "crater/ground/shape.py": "Shape.sizes, which measures six of them by every method",
    "handoff/stage.py": "the cavity that is handed over, another thing under like names",
}
FEWEST = 3
"""So many measures side by side are a list of measures."""


def test_every_row_has_its_function_and_every_function_its_row():
    made_here = [
        f
        for _, f in inspect.getmembers(quantities, inspect.isfunction)
        if f.__module__ == quantities.__name__ and not f.__name__.startswith("_")
    ]
    assert {f.__name__ for f in made_here} == NAMES
    assert len(crater_measures.TABLE) == len(NAMES)
    for row in crater_measures.TABLE:
        assert (
            row.needs in ("", "diameter", "rim") and row.words and row.noun and row.unit in ("m", "m^3", "1", "deg")
        ), row
        assert bool(row.symbol) or not row.compared, row
    assert sorted(row.column for row in crater_measures.TABLE if row.column) == list(
        range(1, len(crater_measures.COLUMNS) + 1)
    )


def test_a_crater_has_every_measure_in_its_unit():
    shape = synthetic.Shape(synthetic.bowl(10.0, 0.25, 0.05), 10.0, 40.0)
    found = measure(
        Particles(synthetic.as_fields(synthetic.cloud_on_plane(shape, 1.0, np.random.default_rng(3), "jitter"), 1.0)),
        "plane",
    )
    assert {name: cell.unit for name, cell in found.quantities.items()} == crater_measures.UNITS
    assert all(
        isinstance(cell, Quantity) and (cell.value is not None or cell.reason) for cell in found.quantities.values()
    )


def lists_of_measures(source: str) -> list[tuple[int, set[str]]]:
    """Lines at which a literal, a mapping or a class body names several measures."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.Tuple, ast.List, ast.Set, ast.Dict)):
            names = {
                part.value for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str)
            }
        elif isinstance(node, ast.ClassDef):
            names = {
                part.target.id
                for part in node.body
                if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name)
            }
        elif isinstance(node, ast.Subscript):
            names = {
                part.value
                for part in ast.walk(node.slice)
                if isinstance(part, ast.Constant) and isinstance(part.value, str)
            }
        else:
            continue
        if len(names & NAMES) >= FEWEST:
            found.append((node.lineno, names & NAMES))
    return found


def test_nothing_else_lists_the_measures():
    found = []
    for file in (file for room in ROOMS for file in sorted((ROOT / room).rglob("*.py"))):
        where = file.relative_to(ROOT).as_posix()
        if where not in WHERE_NAMED and "published" not in file.parts:
            found += [f"{where}:{line} {sorted(names)}" for line, names in lists_of_measures(file.read_text())]
    assert not found, "\n".join(found)


@pytest.mark.parametrize(
    "source",
    [
        'SHOWN = ("depth_m", "volume_m3", "rim_height_m")',
        'WORDS = {"depth_m": "depth", "volume_m3": "volume", "rim_height_m": "rim"}',
        'ROWS = (("depth_m", "d", 1), ("volume_m3", "V", 2), ("rim_height_m", "h", 3))',
        "class Errors:\n    depth_m: float\n    volume_m3: float\n    rim_height_m: float",
        'quantity: Literal["depth_m", "volume_m3", "rim_height_m"]',
    ],
)
def test_a_list_elsewhere_would_be_found(source):
    assert lists_of_measures(source)


NEW_MEASURE = r"""
import sys, types
from pathlib import Path
import matter.wording
unit, worded = {unit!r}, {text!r}
row = f'Measure("hole_m", "{{unit}}", "depth of the hole", "hole", "hole", terminal=True, compared=True, '
row += 'match=0.3, column=6),'
source = Path("matter/wording/crater_measures.py").read_text()
source = source.replace(")  # fmt: skip\n\nBY_NAME", row + ")\n\nBY_NAME", 1)
table = types.ModuleType("matter.wording.crater_measures")
sys.modules[table.__name__] = matter.wording.crater_measures = table
exec(source, table.__dict__)
assert table.TABLE[-1].name == "hole_m"
from crater.measures import quantities
from crater.measures.uncertainty import Quantity
quantities.hole_m = lambda hollow: Quantity(hollow.base.depth, 0.1, unit)

sys.path.insert(0, {here!r})
import numpy as np
from fixtures import synthetic_craters as synthetic
from crater import settings
from crater.comparison import craters, difference
from crater.pages import compare, report
from crater.results import series
from crater.measures.measure import measure
from matter.particles import Particles
from pipeline.running import result; from pipeline.settings import expected
shape = synthetic.Shape(synthetic.bowl(10.0, 0.25, 0.05), 10.0, 40.0)
cloud = synthetic.cloud_on_plane(shape, 1.0, np.random.default_rng(3), "jitter")
found = measure(Particles(synthetic.as_fields(cloud, 1.0)), "plane")
assert abs(found["hole_m"].value - 5.0) < 0.5 and "depth of the hole" in report.as_text(found)
out = Path({out!r})
series.write_csv([series.Moment("sph", 1.0, out, found)], out / "time_series.csv")
assert "hole_m,hole_m_sigma" in (out / "time_series.csv").read_text()
entry = {{**found.as_dict(), "time_s": {{"value": 1.0}}, "from": "grains"}}
(out / "6_crater").mkdir()
text = __import__("json").dumps({{"final": entry, "transient": {{}}}}, default=float)
(out / "6_crater" / "measures.json").write_text(text)
assert "depth of the hole" in result.table(out)
values = craters.values_of(entry)
assert "hole_m" in values and "hole_m" in difference.verdict(values, values, None)
one = craters.Crater("one", values, None)
assert "hole / 1st" in compare._printed([one, craters.Crater("two", values, None)], "")
assert "hole_m_ratio" in compare._table([one])
assert settings.Errors(hole_m=worded).hole_m == 1.0
assert expected.Crater(hole_m={{"value": worded, "measuring": worded}}).hole_m.value == 1.0
known = settings.Published(quantity="hole_m", value=worded, plus=worded, minus=worded, source="made up")
assert known.quantity == "hole_m"
factor, of = expected.scale("hole_m", 5.0)
assert f"{{5.0 * factor:g}} {{of}}".rstrip() == "5" + worded[1:]
assert "5" + worded[1:] in compare._shown((5.0, np.nan, np.nan), "hole_m").replace("5.000", "5")
from crater.comparison import observations
entry = {{"value": worded, "minus": worded, "plus": worded}}
assert observations._measure(out / "x.toml", "hole_m", entry) == (1.0, 1.0, 1.0)
"""


@pytest.mark.parametrize(("unit", "text"), [("m", "1 m"), ("1", "1")])
def test_a_new_measure_takes_one_row_and_one_function(tmp_path, unit, text):
    code = NEW_MEASURE.format(here=str(Path(__file__).parent), out=str(tmp_path), unit=unit, text=text)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
