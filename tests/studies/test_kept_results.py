"""Kept results stay small, and every page of them fits a screen, finds its pictures and begins with its command."""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from studies import kept_pictures

RESULTS = Path(__file__).resolve().parents[2] / "docs" / "results"


def kept() -> list[Path]:
    done = subprocess.run(["git", "ls-files", "."], cwd=RESULTS, capture_output=True, text=True)
    if done.returncode:
        pytest.skip("not a git checkout")
    return [RESULTS / name for name in done.stdout.splitlines() if (RESULTS / name).is_file()]


def test_results_are_small():
    files = kept()
    assert sum(file.stat().st_size for file in files) < 4e6
    assert [file for file in files if file.suffix == ".png" and file.stat().st_size > 150e3] == []
    for folder in {file.relative_to(RESULTS).parts[0] for file in files} - {"README.md"}:
        assert sum(file.stat().st_size for file in files if file.relative_to(RESULTS).parts[0] == folder) < 1e6, folder


def test_every_page_has_its_pictures_and_a_command():
    for page in (file for file in kept() if file.name == "README.md" and file.parent != RESULTS):
        text = page.read_text()
        for target in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text):
            assert (page.parent / target).is_file(), (page, target)
        assert re.search(r"run_case |python |pytest |measure_crater |impact_census |inspect_handoff ", text), page


def test_every_page_fits_a_screen():
    for page in (file for file in kept() if file.name == "README.md" and file.parent != RESULTS):
        text = page.read_text()
        assert len(text.splitlines()) <= 60, page
        prose = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE).splitlines()
        assert [line for line in prose if len(line) > 300 and not line.startswith("|")] == [], page


def test_a_picture_is_made_smaller_and_keeps_its_rare_colours(tmp_path):
    image = pytest.importorskip("PIL.Image")
    rng = np.random.default_rng(1)
    field = np.full((600, 1000, 3), 255, np.uint8)
    field[:, :, 0] = field[:, :, 1] = np.linspace(0, 255, 1000).astype(np.uint8)
    field[100:500] ^= rng.integers(0, 8, (400, 1000, 3), dtype=np.uint8)
    field[:20, :20] = (200, 40, 30)  # a legend's colour
    path = tmp_path / "a.png"
    image.fromarray(field).save(path)
    before, after = kept_pictures.shrink(path, limit=150)
    assert after == path.stat().st_size < before and after < 150e3
    with image.open(path) as small:
        pixel = np.array(small.convert("RGB"))[5, 5].astype(int)
    assert np.abs(pixel - (200, 40, 30)).max() < 40
    assert kept_pictures.shrink(path, limit=150) == (after, after)
