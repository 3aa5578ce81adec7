"""The store of stages: what is made once for all runs that want it, what a run folder shows of it, and what is left
alone."""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
import threading
import time
from pathlib import Path

import pytest

from matter import progress
from matter.case.body import Model
from matter.errors import InputError, UnphysicalState
from matter.files import lock
from pipeline.case import read as cases
from pipeline.case import stages
from pipeline.running import going_on, plan, prune
from pipeline.running.request import Request
from pipeline.running.run import run
from pipeline.settings import identity
from pipeline.settings.compose import compose, hash8
from pipeline.store import folder, store, view

VALHALLA = Path(__file__).resolve().parents[2] / "cases" / "valhalla_980km"
LATE = ["bed", "handoff", "dem", "crater"]
ALL = list(stages.ORDER)


class Recorder:
    """A screen that remembers."""

    def __init__(self):
        self.lines = []

    def say(self, text):
        self.lines.append(text)

    begins = ends = lambda self, stage, text: self.lines.append(text)

    def moves(self, stage, state):
        """Nothing."""

    def made(self):
        """The stages that were really made."""
        return [line.split(":")[0][2:] for line in self.lines if line.endswith((": begins", ": continued"))]

    def taken(self):
        """The stages that came from the store."""
        return [line.split(":")[0][2:] for line in self.lines if ": taken from the store" in line]


@pytest.fixture
def go(case_folder, tmp_path, fake_stages):
    """``go(*overrides, start=..., ...)`` runs the case with the fake stages: the run folder and what the screen
    heard."""

    def start(*overrides, out=None, **options):
        screen = Recorder()
        return run(
            Request(cases.read(case_folder, None, overrides), out or tmp_path / "runs", **options), screen
        ).run, screen

    return start


def entries(out: Path) -> list[str]:
    return sorted(path.name.partition("-")[0] for path in (out / store.STORE).iterdir() if path.name != store.LOCKS)


def edited(case_folder: Path, old: str, new: str) -> None:
    file = case_folder / "case.toml"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))


def test_a_run_folder_shows_stages_by_relative_links(go, tmp_path):
    run_folder, screen = go()
    assert screen.made() == ALL and entries(tmp_path / "runs") == sorted(ALL)
    for stage in ALL:
        link = stages.folder(run_folder, stage)
        assert link.is_symlink() and os.readlink(link).startswith(f"../.store/{stage}-")
        assert not [path for path in link.iterdir() if stat.S_IMODE(path.stat().st_mode) & 0o222]


@pytest.mark.parametrize(
    "change",
    [
        ("A small impact", "A small impact."),
        ('source = "Winter 2017"', 'source = "Winter, 2017"'),
        ('"18.234 km/s"', '"18234 m/s"'),
        ("[sph]", "# a comment\n[sph]"),
    ],
    ids=["title", "source", "unit", "comment"],
)
def test_a_case_that_says_the_same_in_other_words_makes_nothing_anew(go, case_folder, change):
    first, _ = go()
    edited(case_folder, *change)
    second, screen = go()
    assert second == first and screen.made() == []


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((), ("impact.speed=18.234 km/s",)),
        (("bed.radius=2 km", "sph.steps=7"), ("sph.steps=7", "bed.radius=2 km")),
        (("sph.steps=7",), ("sph.steps=9", "sph.steps=7")),
        ((), ("dem.ranks=4",)),
    ],
    ids=["redundant", "order", "overruled", "ranks"],
)
def test_options_that_decide_nothing_make_nothing_anew(go, one, other):
    first, _ = go(*one)
    second, screen = go(*other)
    assert second == first and screen.made() == []


@pytest.mark.parametrize(
    "override",
    [
        "dem.ranks=4",
        "case.title=x",
        "crater.reference.0.note=x",
    ],
)
def test_the_shipped_stages_say_what_decides_nothing(override):
    assert hash8(cases.read(VALHALLA, "tiny", [override])) == hash8(cases.read(VALHALLA, "tiny"))


@pytest.mark.parametrize(
    "override",
    ["dem.contact.shell.friction=0.4", "handoff.alpha=1.6", "dem.end_time=500 s", "bed.seed=2", "sph.seed=2"],
)
def test_and_what_decides(override):
    assert hash8(cases.read(VALHALLA, "tiny", [override])) != hash8(cases.read(VALHALLA, "tiny"))


@pytest.mark.parametrize("change", ["impact.speed=12 km/s", "target.layers.0.thickness=1800 km"])
def test_a_bed_depends_on_the_body_and_not_on_the_shot(tmp_path, change):
    """The body reaches it through ``target.json``; of the shot it takes the expected diameter alone."""

    def key(*overrides):
        return identity.stage_identity(
            "bed", compose(cases.read(VALHALLA, "tiny", overrides))["bed"], None, lambda stage: tmp_path
        ).inputs

    assert key(change) == key() != key("impact.expected_transient_diameter=900 km")


def test_late_stages_share_what_comes_before_them(go, tmp_path):
    first, _ = go()
    second, screen = go("dem.contact.friction=0.4")
    assert second != first and screen.taken() == ["nbody", "sph"] and screen.made() == LATE
    third, screen = go("handoff.alpha=2.0")
    assert screen.taken() == ["nbody", "sph", "bed"] and screen.made() == ["handoff", "dem", "crater"]
    assert screen.made() and entries(tmp_path / "runs").count("sph") == 1
    assert all((one / "2_sph").samefile(first / "2_sph") for one in (second, third))
    assert (second / "3_bed" / "bed.txt").read_text() != (first / "3_bed" / "bed.txt").read_text()


def test_what_a_check_says_is_what_a_run_does(go, case_folder, tmp_path):
    def planned(*overrides, **options):
        request = Request(cases.read(case_folder, None, overrides), tmp_path / "runs", **options)
        return plan.plan(request, compose(request.case))

    assert planned() == {**dict.fromkeys(ALL, plan.MADE), "bed": plan.UNKNOWN}
    go()
    assert planned() == dict.fromkeys(ALL, plan.HERE)
    found = planned("dem.contact.friction=0.4")
    assert [stage for stage in ALL if found[stage].startswith(plan.STORED)] == ["nbody", "sph"]
    assert [stage for stage in ALL if found[stage] == plan.MADE] == LATE
    assert planned(start="dem") == {"dem": plan.MADE, "crater": plan.MADE}


def test_other_code_never_serves_as_this_one_s_result(go, monkeypatch):
    """The run that has a stage keeps it, and says so; another run makes its own."""
    first, _ = go()
    before = identity.sources_of
    monkeypatch.setattr(
        identity, "sources_of", lambda stage, settings: "of today" if stage == "sph" else before(stage, settings)
    )
    _, screen = go()
    assert screen.made() == [] and next(
        line for line in screen.lines if "another version of the code" in line
    ).startswith("2_sph")
    second, screen = go("dem.contact.friction=0.4")
    assert "sph" in screen.made() and not (second / "2_sph").samefile(first / "2_sph")


@pytest.mark.parametrize(("stage", "writes_a_page"), [("sph", False), ("handoff", True), ("crater", True)])
def test_the_style_of_pages_makes_only_stages_with_a_page_anew(monkeypatch, stage, writes_a_page):
    before, read = identity.sources_of(stage, Model()), Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: b"" if path.name == "page.css" else read(path))
    assert (identity.sources_of(stage, Model()) != before) == writes_a_page


def test_threads_count_where_bits_depend_on_them(go, monkeypatch):
    first, _ = go()
    monkeypatch.setattr(stages.load("bed"), "threads", lambda settings: 3, raising=False)
    _, screen = go("handoff.alpha=2.0")
    assert screen.taken() == ["nbody", "sph"] and "bed" in screen.made()
    assert (
        json.loads((first.parent / os.readlink(first / "3_bed").removeprefix("../") / "done.json").read_text()).get(
            "threads"
        )
        is None
    )


def test_files_from_elsewhere_count_by_their_content(tmp_path):
    file = tmp_path / "asymptotes.csv"
    keys = []
    for text in ("1,2\n", "1,3\n"):
        file.write_text(text)
        settings = compose(cases.read(VALHALLA, "tiny"))["nbody"].model_copy(update={"population": str(file)})
        keys.append(identity.stage_identity("nbody", settings, None, lambda stage: tmp_path).key)
    assert keys[0] != keys[1]


def test_what_is_written_later_belongs_to_the_run(go):
    """One run's stage turned into a folder of its own: the other run and the store keep what they have."""
    first, _ = go()
    second, screen = go("crater.bins=7")
    assert screen.made() == ["crater"]
    place = view.own(first, "handoff")
    assert place == first / "4_handoff" and not place.is_symlink() and view.own(first, "handoff") == place
    (place / "report.html").write_text("page")
    assert (place / "handoff.json").read_bytes() == (second / "4_handoff" / "handoff.json").read_bytes()
    assert not (second / "4_handoff" / "report.html").exists()
    _, screen = go()
    assert screen.made() == [] and (place / "report.html").read_text() == "page"


def test_a_run_inside_a_run_or_behind_a_link_has_the_store_of_the_run(go, tmp_path):
    first, _ = go()
    inside = first / "sensitivity" / "small-12345678"
    (tmp_path / "runs" / "sweep").mkdir()
    (tmp_path / "runs" / "sweep" / "m01").symlink_to(Path("..") / ".." / "runs" / first.name)
    places = {store.store_of(place) for place in (first, inside, tmp_path / "runs" / "sweep" / "m01")}
    assert places == {(tmp_path / "runs" / store.STORE).resolve()}
    screen = Recorder()
    run(Request(going_on.read(tmp_path / "runs" / "sweep" / "m01"), tmp_path / "runs"), screen)
    assert screen.made() == []


def test_large_files_of_a_stage_of_its_own_are_links(go):
    first, _ = go()
    place = view.own(first, "sph")
    assert (place / "last.vtkhdf").is_symlink() and (place / "last.vtkhdf").read_bytes()
    assert not (place / "target.json").is_symlink()


def test_a_moved_folder_of_runs_still_opens(go, tmp_path):
    go()
    (tmp_path / "runs").rename(tmp_path / "elsewhere")
    _, screen = go(out=tmp_path / "elsewhere")
    assert screen.made() == []


def test_a_copied_run_is_whole_and_may_be_written_to(go, tmp_path):
    first, _ = go()
    copy = tmp_path / "far" / first.name
    shutil.copytree(first, copy)
    shutil.rmtree(tmp_path / "runs")
    screen = Recorder()
    run(Request(going_on.read(copy), tmp_path / "far"), screen)
    assert screen.made() == [] and not any(path.is_symlink() for path in copy.rglob("*"))
    assert all(os.stat(path).st_mode & 0o200 for path in view.own(copy, "crater").iterdir())


def test_without_links_there_are_copies(go, monkeypatch, tmp_path):
    def refused(*_, **__):
        raise OSError("no links here")

    monkeypatch.setattr(os, "symlink", refused)
    first, screen = go()
    assert screen.made() == ALL and not any(path.is_symlink() for path in first.iterdir())
    assert json.loads((first / "6_crater" / "done.json").read_text())["stage"] == "crater"
    second, screen = go("handoff.alpha=2.0")
    assert (
        screen.taken() == ["nbody", "sph", "bed"]
        and (second / "2_sph" / "x.txt").read_text() == (first / "2_sph" / "x.txt").read_text()
    )
    assert go()[1].made() == []


def test_what_is_made_anew_takes_its_place_when_it_is_done(go, monkeypatch):
    first, _ = go()
    second, _ = go("crater.bins=7")
    marks = (first / "5_dem" / "done.json").read_text()
    make = stages.load("dem").run

    def killed(settings, inputs, out):
        assert (second / "5_dem" / "done.json").read_text() == marks  # the other run has its stage all the while
        raise UnphysicalState("here")

    monkeypatch.setattr(stages.load("dem"), "run", killed)
    with pytest.raises(UnphysicalState):
        go(start="dem")
    assert (second / "5_dem" / "done.json").read_text() == marks
    monkeypatch.setattr(stages.load("dem"), "run", make)
    _, screen = go()  # what was asked for anew is still to be made
    assert screen.made() == ["dem", "crater"] and "5_dem: continued" in screen.lines
    assert (second / "5_dem" / "done.json").read_text() != marks and go("crater.bins=7")[1].made() == []
    assert not [path.name for path in (first.parent / store.STORE).iterdir() if path.name.endswith((".anew", ".old"))]


def test_a_maker_killed_while_a_stage_takes_its_place_loses_nothing(go):
    first, _ = go()
    place = (first / "5_dem").resolve()
    place.rename(place.with_name(f"{place.name}.anew"))
    _, screen = go()
    assert screen.made() == [] and screen.taken() == ["dem"]


def test_two_runs_that_want_one_stage_make_it_once(go, monkeypatch):
    """The first makes the shock stage until the second has said that it waits for it."""
    begun, heard, make, made = threading.Event(), threading.Event(), stages.load("sph").run, []

    def slow(settings, inputs, out):
        begun.set()
        made.append(heard.wait(60))
        make(settings, inputs, out)

    monkeypatch.setattr(stages.load("sph"), "run", slow)
    monkeypatch.setattr(
        Recorder, "say", lambda self, text: (self.lines.append(text), heard.set() if ": waits, " in text else None)
    )
    first = threading.Thread(target=go)
    first.start()
    assert begun.wait(60)
    _, screen = go("dem.contact.friction=0.4")
    first.join()
    assert any(
        line.startswith("2_sph: waits, sph-") and f"in use by process {os.getpid()} on" in line
        for line in screen.lines
    )
    assert made == [True] and "sph" in screen.taken() and "sph" not in screen.made()


def test_a_stage_whose_maker_is_gone_is_continued_by_whoever_wants_it(go, monkeypatch):
    make = stages.load("dem").run

    def killed(settings, inputs, out):
        (out / "half").write_text("x")
        raise UnphysicalState("here")

    monkeypatch.setattr(stages.load("dem"), "run", killed)
    with pytest.raises(UnphysicalState):
        go()
    monkeypatch.setattr(stages.load("dem"), "run", make)
    second, screen = go("crater.bins=7")
    assert "5_dem: continued" in screen.lines and (second / "5_dem" / "half").exists()
    assert folder.record(second / "5_dem" / folder.DONE)


def test_a_prune_that_is_killed_loses_nothing_and_is_finished_by_the_next(go, tmp_path, monkeypatch):
    go()
    second, _ = go("dem.contact.friction=0.4")
    shutil.rmtree(second)
    out, remove = tmp_path / "runs", shutil.rmtree

    def killed(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(prune.shutil, "rmtree", killed)
    with pytest.raises(KeyboardInterrupt):
        prune.remove(out, prune.chosen(prune.held(out)))
    monkeypatch.setattr(prune.shutil, "rmtree", remove)
    left = prune.chosen(prune.held(out))
    assert len(left) == len(LATE) - 1  # one was taken out before the kill, and is no stage any more
    assert go()[1].made() == [] and prune.remove(out, left) == []
    assert entries(out) == sorted(ALL)


def names(found) -> list[str]:
    return [one.name.partition("-")[0] for one in found]


def test_prune_takes_what_no_run_shows(go, tmp_path):
    first, _ = go()
    second, _ = go("dem.contact.friction=0.4")
    out = tmp_path / "runs"
    view.own(first, "sph")  # links to files count as much as links to folders
    shutil.rmtree(second)
    found = prune.held(out)
    assert len(found) == 10 and sorted(names(prune.chosen(found))) == sorted(LATE)
    assert prune.chosen(found, budget=1e12) == [] and len(prune.chosen(found, budget=0.0)) == 4
    oldest = prune.chosen(found)[0]
    assert prune.chosen(found, budget=sum(one.size for one in found) - 1) == [oldest]
    assert f"{oldest.name}" in prune.table(found, [oldest]) and "(1 of 10)" in prune.table(found, [oldest])
    with store.Entry(out / store.STORE, oldest.name).held():
        assert prune.remove(out, [oldest]) == [oldest.name]
    assert prune.remove(out, prune.chosen(found)) == [] and entries(out) == sorted(ALL)
    assert go()[1].made() == []


def test_prune_by_name_takes_what_a_run_shows_and_the_run_makes_it_again(drive, go, tmp_path):
    first, _ = go()
    name = os.readlink(first / "5_dem").rpartition("/")[2]
    code, out, err = drive(name, "--prune", "--out", tmp_path / "runs", "--check")
    assert code == 0 and "to be removed" in out and (first / "5_dem" / "done.json").exists(), err
    assert drive(name, "--prune", "--out", tmp_path / "runs")[0] == 0 and not (first / "5_dem").exists()
    assert go()[1].made() == ["dem"]
    code, _, err = drive("dem-12", "--prune", "--out", tmp_path / "runs")
    assert code == 2 and "no 'dem-12' in the store" in err and "Traceback" not in err
    with pytest.raises(InputError, match="holds no store"):
        prune.held(tmp_path)
    with pytest.raises(InputError, match="--budget"):
        prune.size_of("20 km")


def test_without_kernel_locks_an_owner_file_stands_and_a_silent_one_is_taken_over(go, monkeypatch, tmp_path):
    def refused(*_):
        raise OSError(errno.ENOLCK, "no locks available")

    monkeypatch.setattr(lock.fcntl, "flock", refused)
    monkeypatch.setattr(lock, "BEAT_S", 0.01)
    path = tmp_path / "lock"
    owner = tmp_path / "lock.owner"
    told = []
    progress.hear(told.append)
    try:
        with lock.held(path, "x"):
            os.utime(owner, (1.0, 1.0))
            while owner.stat().st_mtime == 1.0:  # its heart beats
                time.sleep(0.01)
            with pytest.raises(InputError, match=f"x is in use by process {os.getpid()}"), lock.held(path, "x"):
                pass
            assert lock.taken(path)
        assert not owner.exists() and not lock.taken(path) and not told
        owner.write_text('{"pid": 7, "host": "gone", "since": "then"}')
        os.utime(owner, (1.0, 1.0))
        with lock.held(path, "x"):
            assert "process 7 on gone" in told[0] and json.loads(owner.read_text())["pid"] == os.getpid()
        assert sorted(one.name for one in tmp_path.glob("lock*")) == ["lock"]
    finally:
        progress.silence()
    assert go()[1].made() == ALL
