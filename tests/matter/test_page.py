"""Pages: nothing is cut, nothing comes from the network, numbers and names are worded."""

from __future__ import annotations

import base64
import re
import shutil
import subprocess

import jinja2
import markupsafe
import pytest

from matter.wording import ledger_words, page
from tests import pages


def _picture(path, caption: str) -> str:
    return page.render(page.PARTS, "picture", path=path, caption=caption)


def test_every_table_and_picture_scrolls_in_a_box_of_its_own(tmp_path):
    (tmp_path / "a.png").write_bytes(b"\x89PNG")
    whole = pages.document(
        "A < B", [pages.table(["x", "y"], [["1", "2"]]), "", _picture(tmp_path / "a.png", "seen from above")]
    )
    assert "<meta name=viewport content='width=device-width" in whole and "<title>A &lt; B</title>" in whole
    for tag in ("<table", "<img"):
        assert len(re.findall(tag, whole)) == len(re.findall(f"<div class=scroll>{tag}", whole)) == 1
    assert "://" not in whole and 'src="data:image/png;base64,' in whole and 'data-file="a.png"' in whole
    assert _picture(tmp_path / "none.png", "nothing") == ""


def test_bytes_of_a_picture_are_not_worded(tmp_path):
    """Their text may look like a number: ``/12e5/`` is no 12 × 10⁵."""
    (tmp_path / "a.png").write_bytes(base64.b64decode("AA/12e5/AAAA"))
    assert 'base64,AA/12e5/AAAA"' in _picture(tmp_path / "a.png", "1e5 grains")


@pytest.mark.parametrize("text", ["<script>alert(1)</script>", "<b>", '"><img src=x>'])
def test_no_text_of_a_case_becomes_a_tag(tmp_path, text):
    """Not in any text of a page: headline, title, heads, cells, small print, verdicts, captions."""
    cells = [text, page.Cell(text, key=text), page.Cell(text, style="fail")]
    table = page.render(page.PARTS, "table", head=[text, (text, text)], rows=[cells], notes=(0,))
    row = {"name": text, "value": text, "limit": 1.0, "verdict": "pass", "unit": text, "note": text}
    (tmp_path / "a.png").write_bytes(b"")
    whole = pages.document(text, [table, page.ledger([row]), _picture(tmp_path / "a.png", text)])
    assert text not in whole and whole.count(markupsafe.escape(text)) >= 12


def test_a_fact_that_is_missing_is_an_error():
    with pytest.raises(jinja2.UndefinedError, match="rows"):
        page.render(page.PARTS, "table", head=["x"])


def test_a_ledger_in_words():
    rows = [
        {
            "name": "mass_raw_rel",
            "value": 0.0016,
            "limit": 0.01,
            "verdict": "pass",
            "unit": "1",
            "note": "source 1.707662e+21 kg <",
        },
        {
            "name": "cavity_radius",
            "value": 214323.2,
            "limit": None,
            "verdict": "not_applicable",
            "unit": "m",
            "note": "",
        },
        {
            "name": "ejecta_by_rule",
            "value": "compact 3, fast 1",
            "limit": None,
            "verdict": "not_applicable",
            "unit": "1",
            "note": "particles",
        },
        {"name": "new_row", "value": None, "limit": 1e-12, "verdict": "not_measured", "unit": "1", "note": ""},
    ]
    shown = page.ledger(rows)
    assert "mass: grains against source, before any rescaling<span class=key>mass_raw_rel</span>" in shown
    assert "1.707662 × 10²¹ kg &lt;" in shown and "214.3 km" in shown and "10⁻¹²" in shown
    assert "compact 3,\u200b fast 1" in shown or "compact 3, fast 1; particles" in shown
    criteria, quantities = shown.split("<h3>Quantities</h3>")
    assert "cavity_radius" not in criteria and "mass_raw_rel" not in quantities and "verdict" not in quantities
    assert "<td class='word not_measured'>not measured</td>" in shown and "new row<span class=key>new_row" in shown


def test_layers_carry_their_name():
    assert ledger_words.words("layer_volume_rel_water") == "volume of the layer of water: grains against source"


@pytest.mark.parametrize(
    ("path", "shown"),
    [
        ("/home/someone/runs/base", "runs/base"),
        ("cases/valhalla_980km", "cases/valhalla_980km"),
        ("sph.snapshot=/home/someone/mine.vtkhdf", "sph.snapshot=someone/mine.vtkhdf"),
        ("/x", "x"),
        ("--out", "--out"),
    ],
)
def test_a_page_names_no_folders_of_the_machine(path, shown):
    assert page.local(path) == shown


@pytest.mark.parametrize("width", [1200, 400])
def test_nothing_makes_the_page_itself_scroll_sideways(tmp_path, width):
    """In a browser: wide tables and pictures scroll inside their boxes, long words break, the page stays as wide as
    the window."""
    program = shutil.which("chromium") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("no Chromium on this machine")
    from PIL import Image

    Image.new("RGB", (1400, 300)).save(tmp_path / "wide.png")
    wide = pages.table(
        ["quantity", *[f"column {k}" for k in range(12)]], [["apparent diameter", *["(24.16 ± 0.72) × 10⁶ km³"] * 12]]
    )
    notes = pages.table(["file", "note"], [["x", "a" * 60 + ",b=" + "c/" * 200]], notes=(1,))
    words = f"<p>{'volume_below_the_datum_' * 12}</p>"
    measured = (
        "<script>addEventListener('load',function(){var d=document.documentElement,out=[d.scrollWidth,innerWidth];"
        "document.querySelectorAll('.scroll').forEach(function(x){out.push(x.scrollWidth>x.clientWidth?1:0)});"
        "parent.postMessage(out.join(' '),'*')})</script>"
    )
    (tmp_path / "p.html").write_text(
        pages.document("A page", [words, wide, notes, _picture(tmp_path / "wide.png", "wide"), measured])
    )
    # in a frame: a headless window has a least width of 500
    frame = "<script>addEventListener('message',function(e){document.documentElement.dataset.found=e.data})</script>"
    (tmp_path / "frame.html").write_text(
        f"<!doctype html>{frame}<iframe src=p.html style='width:{width}px;height:900px;border:0'></iframe>"
    )
    quiet = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
    ]
    place = [
        f"--user-data-dir={tmp_path / 'profile'}",
        "--window-size=1300,950",
        "--virtual-time-budget=1000",
        "--dump-dom",
    ]
    seen = subprocess.run(
        [program, *quiet, *place, f"file://{tmp_path / 'frame.html'}"], capture_output=True, text=True, timeout=60
    ).stdout
    page_width, window, *boxes = map(int, re.search(r'data-found="([^"]*)"', seen).group(1).split())
    assert window == width and page_width <= width
    assert boxes == [1, 0, 1 if width < 700 else 0]  # the wide table always, the picture on a phone


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[case]\ntitle = "Mine"\n', "Mine | Crater"),
        ("[case]\n", "Crater"),
        ("case = 1", "Crater"),
        ("[", "Crater"),
        (None, "Crater"),
    ],
)
def test_a_page_is_headed_by_the_title_of_its_case(tmp_path, text, words):
    if text is not None:
        (tmp_path / "case.used.toml").write_text(text)
    assert page.heading(tmp_path, "Crater") == words
