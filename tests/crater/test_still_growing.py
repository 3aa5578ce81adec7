"""A shock stage that ends while its crater still grows, handed over to grains before: one snapshot is both its largest
crater and its end, and is shown once, as what still grows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from crater.drawing.figure import figure, legend_outside
from crater.measures import chain
from crater.measures.measure import Quantity
from crater.pages import report
from crater.pictures import plot, plot_sections
from crater.results import column_labels
from crater.results import findings as results
from crater.results.findings import Compared, Findings, GrainFindings, LastCrater, ShockFindings
from crater.results.rest import Rest
from crater.results.series import Moment
from crater.settings import ChainError
from matter.wording.crater_measures import MAXIMA

END = 0.6
DIAMETERS = {0.3: 42.0, 0.45: 47.0, END: 51.9}


class Crater(dict):
    """The measures of a crater of one diameter, with a ``word`` on where its errors come from."""

    def __init__(self, diameter: float, word: str = "its own"):
        super().__init__({name: Quantity(diameter, 1.0, "m", parts={word: 1.0}) for name in MAXIMA.values()})
        self.word = word


def shot(time: float) -> Moment:
    return Moment("sph", time, Path(f"snap_{time:g}.vtkhdf"), Crater(DIAMETERS[time]))  # type: ignore[arg-type]


def found(largest: float, **more) -> Findings:
    """What was found of a run whose crater is largest at the time ``largest`` [s]."""
    moments = tuple(shot(time) for time in DIAMETERS)
    growing = tuple(MAXIMA) if largest == END else ()
    end, transient, none = Path("last.vtkhdf"), dict.fromkeys(MAXIMA, shot(largest)), results.Ejected()
    late = LastCrater(Crater(DIAMETERS[END]), END, results.LATE_SHOCK, end)  # type: ignore[arg-type]
    shock = ShockFindings(moments, transient, growing, END, end, late, none, None, {}, handed=shot(0.3))  # type: ignore[arg-type]
    settled = LastCrater(Crater(92.7), 16.2, "settled grains", end, Rest(True))  # type: ignore[arg-type]
    grains = GrainFindings((), settled, None, {})  # type: ignore[arg-type]
    setting = SimpleNamespace(settings=SimpleNamespace(), inputs=Path("run"), shape=None)
    return Findings(setting, shock, grains, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("largest", "titles"),
    [
        (END, ["last snapshot, volume, depth and diameter still growing", "final"]),
        (0.45, ["transient, maximum volume, depth and diameter", results.LATE_SHOCK, "final"]),
    ],
)
def test_one_snapshot_has_one_column(largest, titles):
    assert [label.title for label, _ in results.columns(found(largest))] == titles


def test_the_page_and_the_terminal_call_a_crater_the_same():
    """Only the diameter still grows at the end: every list says so of the last crater."""
    found_here = found(END)
    shock = replace(found_here.shock, growing=("diameter",))
    page = [label.title for label, _ in results.columns(replace(found_here, shock=shock))]
    cells = {"time_s": {"value": END}, "stage": "sph", **{name: {"value": 52.0} for name in MAXIMA.values()}}
    held = {f"at_maximum_{key}": {**cells, "growing": key == "diameter"} for key in MAXIMA}
    final = {**cells, "time_s": {"value": 16.2}}
    terminal = [label.title for label, _ in column_labels.columns({"transient": held, "final": final})]
    assert page == terminal == ["last snapshot, diameter still growing", "final"]
    held["at_maximum_diameter"][MAXIMA["diameter"]] = {"value": None}  # a trough that no longer has one
    terminal = [label.title for label, _ in column_labels.columns({"transient": held, "final": final})]
    assert terminal == ["transient, maximum volume and depth", "final"]


@pytest.mark.parametrize(
    ("largest", "growing", "ratio"),
    [(END, MAXIMA, ""), (END, ("diameter",), ""), (END, (), "0.52"), (0.45, ("diameter",), "0.47")],
)
def test_what_still_grows_is_not_held_against_a_law(largest, growing, ratio):
    laws = {"diameter_m": {"holsapple_sand": 100.0}, "final_rim_diameter_m": {}}
    span = {"range_m": [75.0, 89.0], "range_of": ["holsapple_sand"] * 2, "formation_time_s": 3.9}
    here = found(largest, compared=Compared({**laws, **span}))
    said = report._scaling(replace(here, shock=replace(here.shock, growing=tuple(growing))))
    assert said["rows"][0][2] == ratio and ("still growing" in said["here"]) == (ratio == "")


@pytest.mark.parametrize(("largest", "word"), [(END, "chain"), (0.45, "its own")])
def test_one_snapshot_has_one_error(monkeypatch, largest, word):
    monkeypatch.setattr(chain, "with_chain", lambda measures, known: Crater(1.0, "chain"))
    assert results.with_chain_errors(found(largest), ChainError()).late_sph.measures.word == word


@pytest.mark.parametrize(
    ("largest", "titles"),
    [
        (END, ["SPH, handoff, 0.3 s", "SPH, end, 0.6 s"]),
        (0.45, ["SPH, transient (maximum volume), 0.45 s", "SPH, end, 0.6 s"]),
    ],
)
def test_no_snapshot_is_drawn_twice(largest, titles):
    assert [title for title, _ in plot_sections._shots_of_shock(found(largest))] == titles


def drawn(monkeypatch, largest: float) -> Figure:
    """The picture of the crater in time, with the longest names of scaling laws."""
    kept: list[Figure] = []
    monkeypatch.setattr(plot, "save", lambda fig, path: kept.append(fig))
    laws = ["schmidt_housen_sand", "holsapple_sand", "housen_holsapple_2011_sand"]
    plot.draw_series(
        found(largest, compared=Compared({"range_m": [75.0, 89.0], "range_of": laws})), Path("time_series.png")
    )
    return kept[0]


@pytest.mark.parametrize(("largest", "lines"), [(END, 0), (0.45, 2)])
def test_what_still_grows_has_no_maximum_in_time_and_no_word_of_the_legend_is_cut(monkeypatch, largest, lines):
    fig = drawn(monkeypatch, largest)
    fig.draw_without_rendering()
    [legend] = fig.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert sum(word.startswith("first maximum of") for word in words) == lines and "SPH" in words
    for text in legend.get_texts():
        box = text.get_window_extent()
        assert box.x0 >= 0.0 and box.x1 <= fig.bbox.width, text.get_text()


def test_a_legend_takes_as_many_columns_as_fit():
    for width, columns in ((9.0, 6), (3.0, 2)):
        fig = figure(width, 2.0)
        lines = [fig.subplots().plot([], [], label="word " * 3)[0] for _ in range(6)]
        legend_outside(fig, lines)
        fig.draw_without_rendering()
        assert fig.legends[0]._ncols == columns and fig.legends[0].get_window_extent().width <= np.ceil(fig.bbox.width)
