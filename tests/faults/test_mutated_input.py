"""Input that is wrong in every way that a seed can draw: no traceback, nothing slow, nothing large, no value out of
its range accepted.

A part of it runs with every change; the whole by ``pytest -m campaign tests/faults`` (the numbers of cases that the
page names).
"""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fixtures import synthetic_craters
from handoff.ledger import LIMITS, Ledger
from matter.files import snapshot
from matter.particles import Particles
from tests.faults import mutations
from tests.faults.calls import Said, call
from tests.matter import foreign_files

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = sorted((ROOT / "cases").glob("*/case.toml")) + [ROOT / "examples" / "own_case.toml"]


def sizes(few: int, many: int):
    """The seed's draws: ``few`` with every change, ``many`` by the marker ``campaign``."""
    return pytest.mark.parametrize(
        "draws", [range(few), pytest.param(range(few, many), marks=pytest.mark.campaign)], ids=["few", "whole"]
    )


@pytest.fixture(scope="module", autouse=True)
def warm():
    """What commands import, before any child is forked."""
    from pipeline.case import stages

    for stage in stages.ORDER:
        stages.load(stage)


def campaign(draws: range, one: Callable[[random.Random, int], tuple[str, Said, tuple[int, ...]]]) -> None:
    """Run every draw and fail with all that went wrong."""
    wrong = []
    for draw in draws:
        what, said, codes = one(random.Random(draw), draw)
        if found := said.faults(codes):
            wrong.append(f"draw {draw} ({what}): {', '.join(found)}\n{said.text[-600:]}")
    assert not wrong, f"{len(wrong)} of {len(draws)}:\n\n" + "\n\n".join(wrong[:10])


@sizes(5, 1000)
def test_mutated_cases(draws, tmp_path):
    def one(rng: random.Random, draw: int) -> tuple[str, Said, tuple[int, ...]]:
        base = rng.choice(SHIPPED)
        file = tmp_path / "case.toml"
        file.write_bytes(mutations.case_text(base.read_text(), rng).encode("utf-8", "surrogateescape"))
        return (
            base.parent.name,
            call("run_case", [str(file), "--check", "--out", str(tmp_path / "runs")], tmp_path / "said"),
            (0, 2),
        )

    campaign(draws, one)
    assert not (tmp_path / "runs").exists()  # --check makes nothing


def numeric_keys() -> list[tuple[str, str, list[str]]]:
    """Keys with a range: name, unit, and values outside of it."""
    from pipeline.case import keys

    found = []
    for table in keys.tables():
        if table.listed or "NAME" in table.path:
            continue
        for key in keys.keys(table):
            unit = re.search(r"quantity in (\S+?)[,;]", key.allowed + ",")
            ends = re.findall(r"(>=|<=|>|<) (-?[0-9.e+-]+)", key.allowed)
            if not ends or not (unit or key.allowed.startswith(("number", "whole number"))):
                continue
            outside = []
            for sign, end in ends:
                beyond = float(end) + (-1.0 if ">" in sign else 1.0) * max(1.0, abs(float(end)))
                outside.append(f"{beyond:.17g}" if not unit else f"{beyond:.17g} {unit[1]}")
                if sign in (">", "<"):
                    outside.append(end if not unit else f"{end} {unit[1]}")
            found.append((key.name, unit[1] if unit else "", outside))
    return found


@sizes(5, 1000)
def test_no_value_out_of_its_range_is_taken(draws, tmp_path):
    """The message names the key, so that the refusal is of this value and no other."""
    trials = [(name, value) for name, _, outside in numeric_keys() for value in outside]
    assert len(trials) > 100
    random.Random(0).shuffle(trials)
    wrong = []
    for name, value in trials[draws.start : draws.stop]:
        said = call(
            "run_case",
            [str(ROOT / "examples" / "own_case.toml"), "--set", f"{name}={value}", "--check"],
            tmp_path / "said",
            tmp_path,
        )
        if said.faults((2,)) or name.split(".")[-1] not in said.text:
            wrong.append(f"{name} = {value}: {said.faults((2,))}\n{said.text[-300:]}")
    assert not wrong, f"{len(wrong)}:\n" + "\n".join(wrong[:20])


@pytest.fixture(scope="module")
def crater(tmp_path_factory) -> Path:
    """A snapshot of a synthetic crater that can be measured."""
    shape = synthetic_craters.Shape(synthetic_craters.bowl(10.0), 10.0, 30.0)
    position = synthetic_craters.cloud_on_plane(shape, 1.2, np.random.default_rng(1), ejecta=0.02)
    fields = synthetic_craters.as_fields(position, 1.2)
    path = tmp_path_factory.mktemp("crater") / "crater.vtkhdf"
    rest = {name: np.zeros((len(position), 3)) for name in ("velocity",)}
    snapshot.write(
        Particles(
            {"position": position, **rest, **{k: v for k, v in fields.items() if k != "position"}},
            {"time": 1.0, "frame": "plane"},
        ),
        path,
    )
    return path


def test_the_snapshot_can_be_measured(crater, tmp_path):
    said = call("measure_crater", [str(crater), "--datum", "plane"], tmp_path / "said", tmp_path)
    assert said.code == 0 and "apparent diameter" in said.text, said.text


@sizes(5, 500)
def test_mutated_snapshots(draws, crater, tmp_path):
    def one(rng: random.Random, draw: int) -> tuple[str, Said, tuple[int, ...]]:
        file = tmp_path / "bad.vtkhdf"
        what = mutations.snapshot_file(crater, file, rng)
        name, more = rng.choice(
            [
                ("measure_crater", ["--datum", "plane"]),
                ("export_snapshot", ["--out", str(tmp_path / "out.ply")]),
                ("measure_crater", []),
            ]
        )
        return f"{name}: {what}", call(name, [str(file), *more], tmp_path / "said", tmp_path), (0, 1, 2)

    campaign(draws, one)


@sizes(8, 400)
def test_mutated_ledgers(draws, tmp_path):
    book = Ledger()
    for k, (name, limit) in enumerate(LIMITS.items()):
        book.measure(name, 0.5 * limit.limit if not limit.least else 2.0 * abs(limit.limit), f"row {k}")
    place = tmp_path / "run" / "4_handoff"
    place.mkdir(parents=True)
    book.write(place / "ledger.json")
    (place / "handoff.json").write_text("{}")
    text = (place / "ledger.json").read_text()
    sound = call("inspect_handoff", [str(place.parent)], tmp_path / "said", tmp_path)
    assert "mass_total_rel" in sound.text and not sound.faults(), (
        sound.text
    )  # there is no run around it to draw pictures of

    def one(rng: random.Random, draw: int) -> tuple[str, Said, tuple[int, ...]]:
        (place / "ledger.json").write_text(mutations.json_text(text, rng))
        return "ledger", call("inspect_handoff", [str(place.parent)], tmp_path / "said", tmp_path), (0, 1, 2)

    campaign(draws, one)


HEIGHTS = [(r, -50.0 + 0.5 * r if r < 100 else 20.0 * (100 / r) ** 3) for r in range(0, 400, 10)]
PROFILE = "# stage = final\nradius_m,height_m\n" + "".join(f"{r}e3,{h:.3f}e3\n" for r, h in HEIGHTS)


@sizes(8, 200)
def test_mutated_files_of_others(draws, tmp_path):
    """Profiles for comparison, tables and dumps of particles to import."""
    rng0 = np.random.default_rng(3)
    rows = "\n".join(",".join(f"{v:.4g}" for v in row) for row in np.abs(rng0.normal(size=(40, 8))) + 0.1)
    table = "x,y,z,vx,vy,vz,mass,density\n" + rows + "\n"
    (tmp_path / "profile.csv").write_text(PROFILE)
    (tmp_path / "table.csv").write_text(table)
    (tmp_path / "whole.dump").write_text(foreign_files.DUMP)
    texts = {"profile.csv": PROFILE, "table.csv": table, "whole.dump": foreign_files.DUMP}
    for name, words in (
        ("compare_profiles", ["profile.csv", "thesis_980km", "--out", "compared"]),
        ("import_snapshot", ["table.csv", "--out", "table.vtkhdf"]),
        ("import_snapshot", ["whole.dump", "--out", "dump.vtkhdf"]),
    ):
        sound = call(name, words, tmp_path / "said", tmp_path)
        assert sound.code == 0, sound.text

    def one(rng: random.Random, draw: int) -> tuple[str, Said, tuple[int, ...]]:
        kind = rng.choice(list(texts))
        text = texts[kind]
        for _ in range(rng.randint(1, 3)):
            text = _spoiled(text, rng)
        file = tmp_path / kind
        file.write_bytes(text.encode("utf-8", "surrogateescape"))
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        if kind == "profile.csv":
            name, words = "compare_profiles", [str(file), "thesis_980km", "--out", str(tmp_path / "out")]
        else:
            name, words = "import_snapshot", [str(file), "--out", str(tmp_path / "new.vtkhdf")]
        return name, call(name, words, tmp_path / "said", tmp_path), (0, 1, 2)

    campaign(draws, one)


def _spoiled(text: str, rng: random.Random) -> str:
    if not text:
        return text
    place = rng.randrange(len(text))
    bad = rng.choice(
        ["nan", "1e999", ",", ",,", "\n", "\x00", "x", "-", "1e-320", '"', "\udcff", "#", ";", " " * 1000, "9" * 400]
    )
    return rng.choice(
        [
            text[:place],
            text[:place] + bad + text[place + rng.randint(0, 6) :],
            text.replace(",", bad, rng.randint(1, 5)),
            bad + text,
        ]
    )


def test_the_campaign_sees_what_it_looks_for(tmp_path):
    """A child that raises, one that dawdles and one that takes memory are all found."""
    from tests.faults import calls

    def raises():
        raise KeyError("x")

    def dawdles():
        import time

        end = time.process_time() + 0.3
        while time.process_time() < end:
            pass

    assert {"exit code 70", "a traceback"} <= set(calls.forked(raises, tmp_path / "a").faults())
    slow = calls.forked(dawdles, tmp_path / "b")
    assert (
        slow.code == 0
        and slow.seconds > 0.25
        and not slow.faults()
        and slow._replace(seconds=11.0).faults() == ["11.0 s"]
    )
    large = calls.forked(lambda: np.ones(2**26).sum(), tmp_path / "c")
    assert large.bytes > 400 * 2**20
