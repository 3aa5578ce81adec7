"""The notebooks, as they are shipped, run from top to bottom in one folder (they share its store), and what they
find: ``pytest -m notebook``. Four minutes of computing where kernels are compiled; the one with two collapses is
among the slow tests. The cases that they run are tested with the others: ``test_first_crater.py``,
``test_bolide.py``."""

from __future__ import annotations

import ast
import math
import os
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "notebooks"
NAMES = ("first_crater", "late_stage_friction", "own_shock_code")


@pytest.fixture(scope="module")
def asked(tmp_path_factory, request):
    """``asked(name, expression)`` runs a notebook, then one more cell with an expression of plain values."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    place = tmp_path_factory.mktemp("notebooks")
    patch = pytest.MonkeyPatch()
    patch.setenv("PYTHONPATH", str(ROOT))
    patch.setenv("NUMBA_NUM_THREADS", "1")
    patch.delenv("MPLBACKEND", raising=False)  # the notebook's own, which shows what is drawn
    request.addfinalizer(patch.undo)

    def ask(name: str, expression: str) -> Any:
        content = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
        content.cells.append(nbformat.v4.new_code_cell(f"print({expression})"))
        client = nbclient.NotebookClient(content, timeout=900, resources={"metadata": {"path": str(place)}})
        client.execute()
        shown = [cell for cell in content.cells[:-1] if cell.cell_type == "code" and cell.outputs]
        if kept := os.environ.get("BOLIDE_NOTEBOOKS"):  # for the pages of the site
            nbformat.write(nbformat.v4.new_notebook(cells=content.cells[:-1]), Path(kept) / f"{name}.ipynb")
        for cell in content.cells:
            if cell.cell_type == "code" and ".plot." in cell.source:
                assert any("image/png" in output.get("data", {}) for output in cell.outputs), cell.source
        assert shown and content.cells[-1].outputs[0].output_type == "stream"
        return ast.literal_eval(content.cells[-1].outputs[0].text)

    return ask


def both(run: str, crater: str) -> str:
    """Depth and diameter of a crater, as an expression."""
    return f"[{run}.measures[{crater!r}][name].value for name in ('depth_m', 'diameter_apparent_m')]"


@pytest.mark.parametrize("name", NAMES)
def test_it_is_kept_without_outputs_and_small(name):
    nbformat = pytest.importorskip("nbformat")
    content = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    nbformat.validate(content)
    code = [cell for cell in content.cells if cell.cell_type == "code"]
    assert code and not any(cell.outputs or cell.execution_count for cell in code)
    assert sorted(path.stem for path in FOLDER.glob("*.ipynb")) == sorted(NAMES)


@pytest.fixture(scope="module")
def first_crater(asked):
    """Depth and diameter of both craters, drift of the energy, verdicts of the ledger, diameters by the laws."""
    return asked(
        "first_crater",
        f"({both('run', 'transient')}, {both('run', 'final')}, float(drift.abs().max()), "
        "ledger['verdict'].to_dict(), list(laws['diameter_m']))",
    )


@pytest.mark.notebook
def test_first_crater(first_crater):
    """The cavity goes on growing in the grains and ends as deep as the case's own within its error; energy is kept;
    mass and momentum close; the laws for this impact lie around the final diameter of so coarse a run."""
    (deep, wide), (depth, width), drift, verdicts, laws = first_crater
    expected = tomllib.loads((ROOT / "cases" / "first_crater" / "expected.toml").read_text())["case"]["final"]
    known, *errors = (float(length.removesuffix(" m")) for length in expected["depth_m"].values())
    assert abs(depth - known) < math.hypot(*errors)
    assert 10.0 < deep < 30.0 and 35.0 < wide < 0.8 * width and width < 120.0
    assert drift < 0.01 and len(laws) > 1 and all(0.5 < law / width < 1.5 for law in laws)
    assert verdicts["mass_total_rel"] == verdicts["momentum_linear_rel_after"] == "pass"


@pytest.mark.notebook
@pytest.mark.xfail(
    reason="26.1 +- 0.8 m in four draws since a gap is no matter, 24.6 +- 0.9 m before; the case itself has 26.2 m",
    strict=False,  # a draw of grains may lie below: other machines round otherwise
)
def test_first_crater_is_no_deeper_than_it_was_thought_to_be(first_crater):
    (_, _), (depth, _), *_ = first_crater
    assert 8.0 < depth < 25.0


@pytest.mark.validation
@pytest.mark.notebook
def test_late_stage_friction(asked):
    """One shock stage, a bed and a collapse for each friction; grains that hardly rub leave a wider crater, shallower
    for its width."""
    made, found = asked("late_stage_friction", f"(made, {{key: {both('one', 'final')} for key, one in runs.items()}})")
    assert made == {"2_sph": 1, "3_bed": 2, "5_dem": 2}
    (slippery_depth, slippery), (depth, diameter) = found[0.1], found[0.5]
    assert slippery > diameter and slippery_depth / slippery < depth / diameter


@pytest.mark.notebook
def test_own_shock_code(asked):
    """The text file gives the crater of the reference to a tenth, on the same bed."""
    theirs, ours, kept, shared = asked(
        "own_shock_code",
        f"({both('run', 'final')}, {both('reference', 'final')}, run.ledger['verdict'].to_dict(), "
        "(run.folder / '3_bed').samefile(reference.folder / '3_bed'))",
    )
    assert theirs == pytest.approx(ours, rel=0.1) and shared
    assert kept["mass_total_rel"] == kept["momentum_linear_rel_after"] == "pass"
