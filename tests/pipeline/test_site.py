"""The site's generated pages: a page, a picture and a check for every law, nothing empty."""

import importlib
import json
import re
import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "site"


@pytest.fixture(scope="module")
def site():
    """The modules that make the pages, imported as Sphinx does."""
    before = set(sys.modules)
    sys.path.insert(0, str(SITE))
    try:
        yield importlib.import_module
    finally:
        sys.path.remove(str(SITE))
        for name in set(sys.modules) - before:
            if Path(getattr(sys.modules[name], "__file__", None) or "/").parent == SITE:
                del sys.modules[name]


@pytest.fixture(scope="module")
def pages(site):
    reference = site("reference_pages")
    return site("law_pages").pages(reference.prose, reference.html)


def test_every_law_has_its_page_with_its_picture_and_its_check(site, pages):
    laws = site("law_pages")
    assert len(laws.names()) > 35
    for name in laws.names():
        text = pages[f"laws/{laws.page_path(name)}"]
        assert f"{name.rpartition('/')[2]}.svg" in text and "## Its check" in text and "`test_" in text
        assert f"<laws/{laws.page_path(name)}>" in pages["laws"]


def test_every_law_has_a_picture_and_one_without_is_named(site):
    laws, pictures = site("law_pages"), site("law_pictures")
    for name in laws.names():
        assert callable(pictures.picture_of(name))
    with pytest.raises(KeyError, match=r"sph/damage/seedling\.py has no picture"):
        pictures.picture_of("sph/damage/seedling")


def test_a_picture_is_drawn_by_the_law(site, tmp_path, monkeypatch):
    """The yield surface in the picture is the law's: another law, another picture, and the same law the same file."""
    pictures = site("law_pictures")
    first, again, other = (tmp_path / name for name in ("a.svg", "b.svg", "c.svg"))
    words = pictures.draw_law("sph/kernels/wendland", first)
    pictures.draw_law("sph/kernels/wendland", again)
    wendland = importlib.import_module("sph.kernels.wendland")
    plain = wendland.kernel
    monkeypatch.setattr(wendland, "kernel", lambda r, h: 2.0 * plain(r, h))
    pictures.draw_law("sph/kernels/wendland", other)
    assert "spectrum" in words
    assert first.read_bytes() == again.read_bytes() != other.read_bytes()


def test_a_law_that_no_test_reaches_is_refused_by_name(site, monkeypatch):
    laws, reference = site("law_pages"), site("reference_pages")
    monkeypatch.setattr(site("law_checks"), "tests", lambda: ())
    with pytest.raises(ValueError, match=r"sph/eos/murnaghan\.py: no test reaches this law"):
        laws.page("sph/eos/murnaghan", laws.LAW_FOLDERS["sph/eos"], reference.prose, reference.html)


def test_checks_are_found_by_what_tests_reach(site):
    checks = site("law_checks")
    found = checks.checks_of_law(
        ROOT / "sph/eos/murnaghan.py", ("sph.eos.dispatch", "sph.materials.families"), ("eos",)
    )
    own = {check.name for check in found if not check.family}
    assert "test_murnaghan" in own and "test_ideal_gas" not in own
    assert {check.name for check in found if check.family} >= {"test_every_source_of_a_law_is_in_the_bibliography"}
    shocks = checks.checks_of_law(
        ROOT / "sph/shock_states/hugoniot.py", ("sph.eos.dispatch", "sph.materials.families"), ("eos",)
    )
    assert shocks and not any(check.family for check in shocks)  # a law of its own, in no family's list
    quiet = {
        check.name
        for check in checks.checks_of_law(ROOT / "sph/boundary/quiet.py", ("sph.boundary.dispatch",), ("sides",))
    }
    assert "test_quiet_end_returns_less_than_five_percent_of_a_wave" in quiet


def empty(text: str) -> list[str]:
    """Headings of a page with nothing below them, and tables without a row."""
    sections = re.split(r"^#{1,4} (.+)$", text, flags=re.MULTILINE)[1:]
    levels = [len(mark) for mark in re.findall(r"^(#{1,4}) .+$", text, flags=re.MULTILINE)]
    bare = [
        head
        for k, (head, body) in enumerate(zip(sections[::2], sections[1::2], strict=True))
        if len(body.strip()) < 10 and not (k + 1 < len(levels) and levels[k + 1] > levels[k])
    ]
    return bare + re.findall(r"^(\|.*)\n\|[ |:-]+\|$(?!\n\|)", text, flags=re.MULTILINE)


def test_no_generated_page_is_empty(site, tmp_path):
    """Each page says something below each of its headings, and each of its tables has a row."""
    reference = site("reference_pages")
    made = {name: getattr(reference, name)() for name in ("keys", "materials", "measures", "ledger", "commands")}
    made["api"] = site("api_pages").page(reference.prose)
    made["gallery"] = site("gallery_page").page()
    made["hera"] = site("hera_page").page(tmp_path)
    made["speed"] = site("speed_page").page(site("speed_page").versions())
    made |= site("notebook_pages").pages(tmp_path, tmp_path)
    for name, text in made.items():
        assert text.startswith("# ") and len(text) > 1000, name
        assert empty(re.sub(r"^```.*?^```", "text of a block", text, flags=re.MULTILINE | re.DOTALL)) == [], name


def test_a_page_that_is_empty_somewhere_is_found():
    assert empty("# A\n\nwords enough\n\n## B\n\n### C\n\n| a |\n| --- |\n| b and more |\n") == []
    assert empty("# A\n\nwords enough\n\n## B\n\n## C\n\nwords enough\n") == ["B"]
    assert empty("# A\n\nwords enough\n\n| a |\n| --- |\n\nmore\n") == ["| a |"]


def test_a_notebook_is_shown_with_what_it_printed_and_drew(site, tmp_path):
    pages = site("notebook_pages")
    shipped = json.loads((ROOT / "notebooks" / "first_crater.ipynb").read_text())
    assert "made without running it" in pages.page("first_crater", tmp_path, tmp_path)
    first = next(cell for cell in shipped["cells"] if cell["cell_type"] == "code")
    first["outputs"] = [
        {"output_type": "stream", "name": "stdout", "text": ["D 102 m\n"]},
        {"output_type": "display_data", "data": {"image/png": "aGVsbG8=", "text/plain": ["<Figure>"]}},
    ]
    (tmp_path / "first_crater.ipynb").write_text(json.dumps(shipped))
    text = pages.page("first_crater", tmp_path / "out", tmp_path)
    assert "```text\nD 102 m\n```" in text and "made without running it" not in text
    picture = re.search(r"!\[.*\]\((first_crater_\d+_1\.png)\)", text)
    assert picture and (tmp_path / "out" / picture[1]).read_bytes() == b"hello"

    first["source"] = ["another = 1"]  # a copy of other cells does not count
    (tmp_path / "first_crater.ipynb").write_text(json.dumps(shipped))
    assert "made without running it" in pages.page("first_crater", tmp_path / "out", tmp_path)


def test_words_of_a_docstring_stay_bold_and_nothing_else_is_markup(site):
    assert site("reference_pages").html("**State.** a*b*c ``x_y``") == r"**State.** a\*b\*c `x_y`"


def test_the_page_of_speeds_is_what_releases_kept(site):
    speed = site("speed_page")
    kept = speed.versions()
    text = speed.page(kept)
    assert kept and "python benchmarks/peers.py --record" in text
    for suite in kept[0]["suites"].values():
        assert suite["turns"] >= 5
        for side, row in suite["sides"].items():
            assert f"| {side} |" in text and row["ratio_from"] <= row["ratio"] <= row["ratio_to"]
            assert (row["ratio"] == 1.0) == (side == "bolide")
            assert side == "bolide" or f"**{row['ratio']:.2f}**" in text
    older = {**kept[0], "version": "0.0.9", "suites": {}}
    assert "| 0.0.9 | –" in speed.page([kept[0], older])
    with pytest.raises(ValueError, match="--record"):
        speed.page([])


def test_the_interface_page_has_every_public_name(site):
    import bolide

    text = site("api_pages").page(site("reference_pages").prose)
    assert all(f"## `bolide.{name}`" in text for name in bolide.__all__)
    assert "### `Run.snapshot`" in text and ">>> print(Value" in text


def test_the_gallery_states_what_the_results_state(site):
    gallery = site("gallery_page")
    text = gallery.page()
    for file in gallery.results():
        assert f"results/{file.parent.name}" in text
    assert all(f"`{file.name}`" in text or file.name in text for file in (ROOT / "notebooks").glob("*.ipynb"))
    page = (ROOT / "docs" / "results" / "sci_ryugu" / "README.md").read_text()
    assert gallery.stated("sci_ryugu", page)[0] == "104,556 particles, 100,000 grains"
    with pytest.raises(ValueError, match=r"sci_ryugu: 104,556 is not in docs/results"):
        gallery.stated("sci_ryugu", page.replace("104,556", "104,557"))
    with pytest.raises(ValueError, match="has nothing on docs/results/unknown"):
        gallery.stated("unknown", page)


def test_what_hera_should_see_is_what_the_frozen_file_says(site, tmp_path, monkeypatch):
    """Every number of ours follows the file: another forecast makes another page."""
    hera = site("hera_page")
    text = hera.page(tmp_path)
    assert "117 m wide (78 to 157) and 31 m deep" in text and "another shape 73 %" in text
    assert "| mass, million tonnes | **2.5** |" in text and "| bulk density, kg/m3 | **1,470** |" in text
    changed = tmp_path / "hera_v0.toml"
    changed.write_text(hera.FORECAST.read_text().replace("95.68, 116.9, 136.6", "95.68, 121.9, 136.6"))
    shutil.copy(hera.FORECAST.with_name("hera_v0_draws.h5"), tmp_path)
    monkeypatch.setattr(hera, "FORECAST", changed)
    assert "122 m wide" in hera.page(tmp_path)
