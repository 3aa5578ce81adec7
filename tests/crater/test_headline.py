"""The first line of a crater's page: the numbers of the last column of its table, in one line."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from crater.bodies.body_comparison import Pair
from crater.measures.uncertainty import Quantity
from crater.pages import report
from crater.results.column_labels import ColumnLabel

D, DEPTH = Quantity(106.0, 3.1, "m"), Quantity(21.7, 1.5, "m")


def _headline(monkeypatch, diameter=D, title="final", cautions=(), kind=None, measured=True, **soundness) -> str:
    early = (ColumnLabel("transient/volume", "transient", "transient", ""), {"diameter_apparent_m": DEPTH})
    last = (ColumnLabel("final", "final", title, ""), {"diameter_apparent_m": diameter, "depth_m": DEPTH})
    monkeypatch.setattr(report, "columns", lambda findings: [early, last] if measured else [])
    ratio = Pair(Quantity(1.35, 0.01, "1"), Quantity(1.52, 0.01, "1"), Quantity(0.17, 0.01, "1"))
    unknown = Quantity(None, None, "m", "no flight")
    body = {"axis_ratio_a_over_c": ratio, "height_change_rms_m": Quantity(1.2, 0.1, "m"), "beta_normal": unknown}
    stages = (SimpleNamespace(kind=kind, measures=body),) if kind else ()
    return report.headline(SimpleNamespace(body=stages, soundness={"cautions": cautions, **soundness}))


@pytest.mark.parametrize(
    ("how", "line"),
    [
        ({"cautions": ("a", "b")}, "D = 106.0 ± 3.1 m, depth 21.7 ± 1.5 m, settled; 2 cautions"),
        (
            {"not_resolved": "few", "cautions": ("a",)},
            "NOT RESOLVED: D = 106.0 ± 3.1 m, depth 21.7 ± 1.5 m, settled; 1 caution",
        ),
        (
            {"title": "last snapshot, still growing"},
            "D = 106.0 ± 3.1 m, depth 21.7 ± 1.5 m, last snapshot, still growing; no cautions",
        ),
        (
            {"diameter": Quantity(None, None, "m", "no hollow")},
            "No D (no hollow), depth 21.7 ± 1.5 m, settled; no cautions",
        ),
        ({"measured": False}, "No crater was measured; no cautions"),
        (
            {"kind": "crater", "not_resolved": "few"},
            "NOT RESOLVED: a crater: D = 106.0 ± 3.1 m, depth 21.7 ± 1.5 m, settled; no cautions",
        ),
        ({"kind": "crater"}, "A crater: D = 106.0 ± 3.1 m, depth 21.7 ± 1.5 m, settled; no cautions"),
        (
            {"kind": "reshaped"},
            "A body of another shape: a / c 1.350 ± 0.010 → 1.520 ± 0.010, RMS change of height 1.20 ± 0.10 m; "
            "no cautions",
        ),
    ],
)
def test_the_headline_says_size_state_and_cautions(monkeypatch, how, line):
    assert _headline(monkeypatch, **how) == line
