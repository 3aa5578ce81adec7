"""The case that README begins with, at its tiny size: the whole chain on flat ground. Half a minute."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from pipeline.case import read as cases
from pipeline.running import compiling
from pipeline.settings.compose import compose

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "first_crater"


def made(out: Path, *options: str) -> tuple[Path, str]:
    """The run folder, and what the terminal said."""
    code = "from pipeline.cli import run_case; run_case()"
    command = [sys.executable, "-c", code, str(CASE), "--preset", "tiny", "--out", str(out), "--threads", "1"]
    command += options
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_NUM_THREADS": "1"}
    process = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=900)
    # 1: so few particles and grains fail rows of the handoff's ledger
    assert process.returncode in (0, 1) and "Traceback" not in process.stderr, process.stdout + process.stderr
    return next(out.glob("first_crater-*")), process.stdout


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> tuple[Path, str]:
    return made(tmp_path_factory.mktemp("first") / "runs")


def test_it_waives_nothing_and_resolves_its_crater():
    """As it ships: no row of the ledger is given up, and the projectile has five particles to its radius."""
    settings = compose(cases.read(CASE))
    assert not settings["handoff"].waive
    assert settings["sph"].impact.projectile.radius / settings["sph"].zones.contact > 5.0


@pytest.mark.validation
def test_it_goes_through_the_whole_chain(done):
    run, text = done
    assert (run / "6_crater" / "report.html").is_file() and (run / "6_crater" / "cross_section.png").is_file()
    assert "0.3 s after the impact: as set in the case." in (run / "4_handoff" / "report.html").read_text()
    final = json.loads((run / "6_crater" / "measures.json").read_text())["final"]
    assert final["settled"] and "settled grains" in text
    # draws at this size come to 94 (the first, as another machine rounds), 100, 109 and 110 m (103 +- 8); as it
    # ships, the case to 93.3 +- 4.1 m; sand's law says 84 m
    assert 87.0 < final["diameter_apparent_m"]["value"] < 119.0
    assert 8.0 < final["depth_m"]["value"] < 22.0


@pytest.mark.validation
def test_the_coarsest_crater_with_the_former_numerics_is_that_of_sand(tmp_path):
    """The scaling law says 84 m."""
    run, _ = made(
        tmp_path / "runs",
        "--set",
        "sph.numerics=monaghan",
        "--set",
        'sph.late={at="25 ms",sound_speed="1.3 km/s",alpha=0.03}',
    )
    final = json.loads((run / "6_crater" / "measures.json").read_text())["final"]
    assert 65.0 < final["diameter_apparent_m"]["value"] < 105.0
    assert 8.0 < final["depth_m"]["value"] < 22.0


@pytest.mark.validation
def test_weight_and_friction_end_the_growth_in_the_grains(done):
    """The cavity that is handed over is half as wide as the crater that is left: the grains go on with its flow."""
    run, _ = done
    handed = json.loads((run / "4_handoff" / "handoff.json").read_text())["cavity"]
    final = json.loads((run / "6_crater" / "measures.json").read_text())["final"]
    assert final["volume_m3"]["value"] > 1.3 * handed["volume_m3"]
    rows = {row["name"]: row for row in json.loads((run / "4_handoff" / "ledger.json").read_text())}
    assert rows["cavity_radius_over_r_DEM_min"]["verdict"] == rows["t_handoff_over_T_crater_max"]["verdict"] == "pass"
    assert not [name for name, row in rows.items() if row["verdict"] == "waived"]


def test_a_kernel_that_is_compiled_is_told_once_and_one_that_is_there_is_not():
    import numba

    half, told = numba.njit(lambda x: 0.5 * x), []
    with compiling.told(told.append):
        half(3.0), half(3)
    assert told == [compiling.WORDS]
    with compiling.told(told.append):
        half(5.0)
    assert len(told) == 1


def test_the_pages_for_a_newcomer_give_one_set_of_numbers():
    """README, the first run, its page and its result: what came out and what is expected are the same everywhere."""
    expected = tomllib.loads((CASE / "expected.toml").read_text())["case"]["final"]
    parts = ("measuring", "draws", "handoff", "alpha", "size")
    number = {}
    for key in ("diameter_apparent_m", "depth_m"):
        row = {name: float(text.split()[0]) for name, text in expected[key].items() if name in ("value", *parts)}
        number[key] = row["value"], sum(row[name] ** 2 for name in parts) ** 0.5
    (d, d_error), (depth, depth_error) = number.values()
    start = ROOT / "docs" / "site" / "start"
    assert f"diameter of {d:.0f} +- {d_error:.0f} m and a depth of {depth:.1f} +- {depth_error:.1f} m" in read(
        "README.md"
    )
    first = (start / "first_run.md").read_text()
    assert f"expected {d:.1f} +- {d_error:.1f} m" in first and f"expected {depth:.1f} +- {depth_error:.1f} m" in first
    final = [
        re.search(rf"^{row}.* ([\d.]+ \+- [\d.]+) m$", first, re.M)[1] for row in ("apparent diameter", "depth below")
    ]
    headline = "D = {} m, depth {} m, settled".format(*(text.replace("+-", "±") for text in final))
    assert headline in (start / "read_the_page.md").read_text()
    result = read("docs/results/first_crater/README.md")
    sizes = re.search(r"([\d,]+ particles), ([\d,]+ grains)", result)
    assert all(size in read("cases/first_crater/README.md") for size in sizes.groups())
    made = re.search(r"apparent diameter \| ([\d.]+)", result)[1]
    assert final[0].split()[0] == made
    assert all(f"A crater of {float(made):.0f} m" in read(page) for page in ("README.md", "docs/site/index.md"))
    spread = re.search(r"diameter and depth stay within ([\d.]+) and ([\d.]+) m", result).groups()
    assert "within {} m of D and {} m of the depth".format(*spread) in read("cases/first_crater/README.md")
    quick = tomllib.loads(read("cases/valhalla_980km/expected.toml"))["quick"]
    size = float(quick["transient"]["diameter_apparent_m"]["value"].removesuffix(" km"))
    depth = float(quick["final"]["depth_m"]["value"].removesuffix(" km"))
    assert f"{size:.0f} +- " in read("README.md") and f"some {round(size, -2):.0f} km on Callisto" in first
    assert f"settled depth of {depth:.0f} +- " in read("README.md")


def read(name: str) -> str:
    return (ROOT / name).read_text()
