"""The section of a crater's page on what became of its ejecta among other bodies, and where it stands."""

from __future__ import annotations

import pytest

from crater.pages import ejecta_fates, report_matter
from matter.errors import InputError
from tests import pages

FOUND = {
    "particles": 40, "closure": 0.0,
    "target_kg": {"falls back": 6.0, "hits Europa": 0.5, "leaves": 3.0},
    "projectile_kg": {"falls back": 0.25, "hits Europa": 0.0, "leaves": 2.0},
    "ends": {
        "falls back": {
            "time_s": [600.0, 3 * 3600.0, 5 * 86400.0],
            "distance_m": [2e3, 3e4, 4e5], "speed_m_s": [50.0, 200.0, 900.0],
        },
        "hits Europa": {"time_s": [9e6, 9.1e6, 9.2e6], "speed_m_s": [5e3, 6e3, 7e3]},
    },
    "flown": {
        "body": "Callisto", "duration_s": 8.64e6, "seed": 4,
        "latitude_rad": 0.2, "longitude_rad": 0.0, "azimuth_rad": 1.5,
    },
}  # fmt: skip


def test_it_says_mass_by_fate_and_when_where_and_how_fast():
    words = ejecta_fates.section(FOUND)
    row = words[words.index("falls back") : words.index("hits Europa")]
    assert all(part in row for part in ("6 kg", "0.25 kg", "3 h (10.0 min to 5 days)", "30 km (2 km to 400 km)"))
    hit = words[words.index("hits Europa") : words.index("leaves")]
    assert "0.5 kg" in hit and "none" in hit and "km (" not in hit and "105 days" in hit
    assert "40 launches from Callisto, followed for 100 days" in words and "seed 4" in words


def test_it_stands_on_the_page_once_where_the_fates_of_free_flight_end(tmp_path):
    report = tmp_path / "report.html"
    report.write_text(
        pages.document("A", ["<h2>Where the ejecta end</h2>", ejecta_fates.slot(), "<h2>References</h2>"])
    )
    ejecta_fates.show(report, FOUND)
    ejecta_fates.show(report, {**FOUND, "particles": 41})
    text = report.read_text()
    assert text.count("among other bodies") == 1 and "41 launches" in text and "40 launches" not in text
    assert text.index("Where the ejecta end<") < text.index("among other bodies") < text.index("References")


def test_a_page_without_a_place_has_it_at_its_end(tmp_path):
    report = tmp_path / "report.html"
    report.write_text(pages.document("A", ["<h2>References</h2>"]))
    ejecta_fates.show(report, FOUND)
    text = report.read_text()
    assert text.index("References") < text.index("among other bodies") < text.index("</body>")
    with pytest.raises(InputError, match="is missing"):
        ejecta_fates.show(tmp_path / "none.html", FOUND)


def test_the_crater_page_leaves_a_place_for_it(monkeypatch):
    """Right after the fates of free flight; none where there is no catalogue."""
    from types import SimpleNamespace

    for fates, count in (({"some": 1}, 1), ({}, 0)):
        ejected = SimpleNamespace(excavation={}, fates=fates)
        shock = SimpleNamespace(molten={}, heat=(), decay={}, melt={})
        event = SimpleNamespace(event=SimpleNamespace(mass=1.0))
        monkeypatch.setattr(report_matter, "fates", lambda facts: "FATES" if facts else "")
        parts = report_matter.all_parts(
            SimpleNamespace(shock=shock, ejected=ejected, setting=event, soundness={}, settled_matter={}), None
        )
        assert parts.count(ejecta_fates.slot()) == count
        assert not count or parts[parts.index("FATES") + 1] == ejecta_fates.slot()
