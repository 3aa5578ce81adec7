"""The collapse stage on a small carved bed."""

import csv
import json
import shutil

import numpy as np
import pytest
from pydantic import ValidationError

from dem import stage
from dem.beds import bed_walls
from dem.beds.flat_ground import ground_of
from dem.collapse import collapse_run as collapsing
from dem.collapse.origins import Origins
from dem.stiffness import change
from dem.stiffness.following import Following
from matter import progress
from matter.errors import InputError, Stopped, UnphysicalState, Unsound
from matter.files import snapshot
from matter.particles import ORIGINS, Particles
from tests.dem.stops import interrupted, same_grains

BOWL, DEPTH = 350e3, 260e3


@pytest.fixture(scope="module")
def carved(tmp_path_factory, bed_run):
    """The bed with a paraboloid bowl, outward velocities at its rim, and six grains in flight (one escaping)."""
    run = tmp_path_factory.mktemp("carved")
    shutil.copytree(bed_run / "2_sph", run / "2_sph")
    (run / "4_handoff").mkdir()
    bed = snapshot.read(bed_run / "3_bed" / "bed.vtkhdf")
    datum = bed.attributes["domain"]["datum_radius_m"]
    distance = np.linalg.norm(bed.position, axis=1)
    flat = np.hypot(bed.position[:, 0], bed.position[:, 1])
    arc = datum * np.arctan2(flat, bed.position[:, 2])
    height = distance - datum
    keep = np.where(
        arc < BOWL, height < -DEPTH * (1 - (arc / BOWL) ** 2), height < 60e3 * np.exp(-(arc - BOWL) / 100e3)
    )
    start = bed.select(keep)
    arc, flat = arc[keep], flat[keep]
    outward = np.column_stack([start.position[:, :2] / flat[:, None], np.zeros(len(start))])
    up = start.position / distance[keep][:, None]
    start["velocity"] = start.velocity + 150.0 * np.exp(-(((arc - BOWL) / 1e5) ** 2))[:, None] * (outward + up)
    flyers = start.select(np.arange(6))
    azimuth = np.arange(6) * np.pi / 3
    flyers["identity"] = 10_000 + np.arange(6)
    flyers["position"] = (datum + 4e5) * np.column_stack(
        [0.15 * np.cos(azimuth), 0.15 * np.sin(azimuth), np.full(6, np.sqrt(1 - 0.15**2))]
    )
    flyers["velocity"] = np.array([0.0, 0.0, 1.0]) * np.array([2500.0, 100.0, 0.0, -300.0, 200.0, 300.0])[:, None]
    flyers["mass"] = flyers.mass * np.array([1, 1, 0.01, 1, 1, 1])
    fields = {name: np.concatenate([start[name], flyers[name]]) for name in start}
    fields["state"] = np.concatenate([np.zeros(len(start)), np.ones(6)])
    together = Particles(fields, {**bed.attributes, "time": 300.0, "stage": "handoff"}, bed.tables)
    snapshot.write(together, run / "4_handoff" / "start.vtkhdf")
    return run


SETTINGS = stage.Settings(end_time=900.0, latest_time=1500.0, still_interval=200.0)


@pytest.fixture(scope="module")
def result(carved):
    out = carved / "5_dem"
    out.mkdir()
    stage.run(SETTINGS, carved, out)
    return out


def history(out):
    with open(out / "history.csv") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def test_balances_hold(result):
    found = history(result)
    assert found["momentum_error"].max() < 1e-11 and found["angular_momentum_error"].max() < 1e-11
    assert np.abs(found["energy_error"]).max() < 0.01
    assert np.all(np.diff(found["dissipated_contacts_J"]) >= 0.0)


def test_what_is_not_known_yet_is_an_empty_cell_and_null(result):
    """Neither JSON nor a spreadsheet knows NaN and infinity."""
    text = (result / "history.csv").read_text()
    assert "inf" not in text and "nan" not in text and np.isnan(history(result)["profile_change"][0])
    report = (result / "stage_report.json").read_text()
    assert "NaN" not in report and "Infinity" not in report


def test_it_ends_between_its_two_times_and_leaves_its_files(result):
    report = json.loads((result / "stage_report.json").read_text())
    assert 900.0 <= report["time_s"] <= 1502.0
    last = snapshot.read(result / "last.vtkhdf")
    assert last.attributes["stage"] == "dem" and last.attributes["time"] == pytest.approx(report["time_s"])
    assert "contacts/pair" in last.tables
    times = [snapshot.read(path).attributes["time"] for path in snapshot.series(result)]
    assert times[0] == 300.0 and np.allclose(np.diff(times), 120.0, atol=3.0)
    assert len(list(result.glob("checkpoint_*"))) <= 1


def test_what_escapes_is_booked_and_what_falls_comes_back(result):
    report = json.loads((result / "stage_report.json").read_text())
    last = snapshot.read(result / "last.vtkhdf")
    assert report["booked"]["escaped"]["grains"] == 1
    assert report["booked"]["escaped"]["mass_kg"] == pytest.approx(last.mass[last.identity == 10_000][0])
    fallen = np.isin(last.identity, 10_000 + np.arange(1, 6))
    assert np.sum(last.state[fallen] == 0) >= 4


def test_a_light_grain_does_not_set_the_step(carved, result):
    start = snapshot.read(carved / "4_handoff" / "start.vtkhdf")
    capped = collapsing.capped_stiffness(start)
    light = start.identity == 10_002
    assert capped[light] < start.stiffness[light]
    assert np.mean(capped == start.stiffness) > 0.99


def test_the_bowl_fills(carved, result):
    from dem.collapse.stillness import surface_profile
    from dem.contact.settings import Contact
    from dem.grains.assembly import Assembly
    from matter.geometry.ground_region import Cone

    profiles = []
    for path in (result / "snap_0000.vtkhdf", result / "last.vtkhdf"):
        grains = snapshot.read(path)
        domain = Cone.of_attribute(grains.attributes["domain"])
        profiles.append(surface_profile(Assembly(grains, Contact(), bed_walls.walls(domain)), domain))
    assert profiles[0][0] < -0.5 * DEPTH
    assert profiles[1][0] > profiles[0][0] + 30e3


def final(out):
    """Profile of the last snapshot [m] in rings of two mean radii, mean radius, mass that flies or has been booked."""
    from dem.collapse.stillness import surface_profile
    from dem.contact.settings import Contact
    from dem.grains.assembly import Assembly
    from matter.geometry.ground_region import Cone

    grains = snapshot.read(out / "last.vtkhdf")
    domain = Cone.of_attribute(grains.attributes["domain"])
    return (
        surface_profile(Assembly(grains, Contact(), bed_walls.walls(domain)), domain),
        grains.radius.mean(),
        grains.mass[grains.state != 0].sum(),
    )


def apparent_diameter(profile, radius):
    """Twice the distance at which the profile first rises through the datum."""
    k = int(np.flatnonzero((profile[:-1] < 0.0) & (profile[1:] >= 0.0))[0])
    return 4.0 * radius * (k + 0.5 - profile[k] / (profile[k + 1] - profile[k]))


@pytest.mark.validation
def test_softening_ends_in_the_same_crater(tmp_path, carved):
    """Springs that follow against fixed ones: D within 2 %, profile within half a radius, ejected mass within 5 %."""
    ends = []
    for name, shortcuts in (("fixed", {}), ("following", {"stiffness": "following"})):
        run = tmp_path / name
        run.mkdir()
        for part in ("2_sph", "4_handoff"):
            (run / part).symlink_to(carved / part)
        (run / "5_dem").mkdir()
        contact = SETTINGS.contact.model_copy(update={"static_overlap": 0.2, "overlap_stop": 1.5})
        settings = SETTINGS.model_copy(
            update={"end_time": 900.0, "latest_time": 900.0, "contact": contact, **shortcuts}
        )
        stage.run(settings, run, run / "5_dem")
        ends.append(final(run / "5_dem"))
        found = history(run / "5_dem")
        assert found["momentum_error"].max() < 1e-11 and np.abs(found["energy_error"]).max() < 0.01
    assert found["stiffness_over_start"].min() < 0.6 and found["dt_s"].max() > 1.25 * found["dt_s"][0]
    (one, radius, ejected), (two, _, ejected_two) = ends
    inner = slice(0, int(0.8e6 / (2 * radius)))
    assert np.sqrt(np.nanmean((one - two)[inner] ** 2)) < 0.5 * radius
    assert apparent_diameter(two, radius) == pytest.approx(apparent_diameter(one, radius), rel=0.02)
    assert ejected > 0.0 and ejected_two == pytest.approx(ejected, rel=0.05)


SOFT = SETTINGS.contact.model_copy(update={"static_overlap": 0.2, "overlap_stop": 1.5})
SHORTCUTS = pytest.mark.parametrize(
    "changes",
    [{}, pytest.param({"contact": SOFT, "stiffness": "following"}, marks=pytest.mark.validation)],
    ids=["as it is", "following"],
)


@SHORTCUTS
def test_a_stopped_run_resumes_bit_for_bit(tmp_path, carved, monkeypatch, changes):
    """The same files, whether a run was stopped on its way or not; the last stop falls behind the first softening of
    the springs."""
    settings = SETTINGS.model_copy(update={"end_time": 700.0, "latest_time": 700.0, **changes})
    results = []
    for name, stops in (("whole", ()), ("resumed", (7, 61, 350))):
        run = tmp_path / name
        run.mkdir()
        for part in ("2_sph", "4_handoff"):
            (run / part).symlink_to(carved / part)
        out = run / "5_dem"
        out.mkdir()
        interrupted(monkeypatch, stops, lambda run=run, out=out: stage.run(settings, run, out))
        results.append((snapshot.read(out / "last.vtkhdf"), (out / "history.csv").read_text()))
    (one, text_one), (two, text_two) = results
    same_grains(one, two)
    assert text_one == text_two


def test_grains_keep_what_matter_they_stand_for(tmp_path, carved, monkeypatch):
    """Marks that the handoff gave stay with their grains, through sorting, stop and resume, in every snapshot; motion
    knows nothing of them."""
    settings = SETTINGS.model_copy(update={"end_time": 420.0, "latest_time": 420.0, "snapshot_interval": 60.0})
    plain = snapshot.read(carved / "4_handoff" / "start.vtkhdf")
    marked = Particles({name: plain[name] for name in plain}, plain.attributes, plain.tables)
    for number, name in enumerate(ORIGINS):
        marked[name] = marked.identity * 0.5 + number
    ends = {}
    for name, start, stops in (("plain", plain, ()), ("marked", marked, (9,))):
        run = tmp_path / name
        (run / "4_handoff").mkdir(parents=True)
        (run / "2_sph").symlink_to(carved / "2_sph")
        snapshot.write(start, run / "4_handoff" / "start.vtkhdf")
        out = run / "5_dem"
        out.mkdir()
        interrupted(monkeypatch, stops, lambda run=run, out=out: stage.run(settings, run, out))
        ends[name] = out
    same_grains(*(snapshot.read(out / "last.vtkhdf") for out in ends.values()))
    shots = [snapshot.read(path) for path in (*snapshot.series(ends["marked"]), ends["marked"] / "last.vtkhdf")]
    assert len(shots) >= 3 and not set(ORIGINS) & set(snapshot.read(ends["plain"] / "last.vtkhdf"))
    for shot in shots:
        for number, name in enumerate(ORIGINS):
            assert shot[name].tolist() == (shot.identity * 0.5 + number).tolist()


def test_marks_go_by_identity_and_not_by_place():
    start = Particles({"identity": [7, 3, 9], "first_depth": [70.0, 30.0, 90.0]})
    grains = Origins(start).onto(Particles({"identity": [9, 3, 7]}))
    assert grains.first_depth.tolist() == [90.0, 30.0, 70.0] and "melt_fraction" not in grains


@SHORTCUTS
def test_a_checkpoint_at_every_step_holds_the_whole_state(tmp_path, carved, monkeypatch, changes):
    """A collapse that is made anew from its checkpoint after every step goes the way of one that runs through, in
    every array and number that it saves."""
    settings = SETTINGS.model_copy(update={"end_time": 900.0, "latest_time": 900.0, **changes})
    saved = {}

    def keep(out, step, arrays, scalars):
        saved[out.name] = ({name: np.array(values) for name, values in arrays.items()}, dict(scalars))

    monkeypatch.setattr(stage.checkpoint, "save", keep)
    monkeypatch.setattr(collapsing.Collapse, "_write_history", lambda self: None)
    monkeypatch.setattr(collapsing.Collapse, "_snapshot", lambda self, name, tables: None)
    ground = ground_of(carved / "2_sph" / "target.json")
    start = snapshot.read(carved / "4_handoff" / "start.vtkhdf")

    def made(name):
        return collapsing.Collapse(
            settings,
            Particles({k: v.copy() for k, v in start.items()}, start.attributes, start.tables),
            ground,
            tmp_path / name,
        )

    through, anew = made("through"), made("anew")
    for collapse in (through, anew):  # to just before the springs soften for the first time
        _advance(collapse, until=600.0 if changes else 300.0)
    softness = []
    for _ in range(40):
        for collapse in (through, anew):
            _advance(collapse)
        (one, numbers), (two, others) = saved["through"], saved["anew"]
        assert [
            name for name in one if not np.array_equal(one[name], two[name], equal_nan=one[name].dtype.kind == "f")
        ] == []
        assert numbers == others
        softness.append(through.bed.softness)
        anew = made("anew")
        anew.restore(*saved["anew"])
    assert not changes or softness[-1] < softness[0]


def _advance(collapse, until=0.0):
    """One step and those up to the time ``until``, and a checkpoint."""
    while True:
        progress.request_stop()
        try:
            with pytest.raises(Stopped):
                collapse.advance()
        finally:
            progress.clear_stop()
        if collapse.bed.time >= until:
            return


@pytest.mark.validation
def test_springs_that_put_in_energy_make_a_run_unsound(tmp_path, carved, monkeypatch):
    """The rule that guards against it switched off, and a weight that is said to need nothing: the report and the exit
    say so."""
    run = tmp_path
    for part in ("2_sph", "4_handoff"):
        (run / part).symlink_to(carved / part)
    (run / "5_dem").mkdir()
    rest = change.at_rest

    def weightless(bed):
        rest(bed)
        bed.rest_energy = 0.0

    monkeypatch.setattr(change, "at_rest", weightless)
    monkeypatch.setattr(collapsing, "HOPELESS", np.inf)  # it would be stopped on its way
    monkeypatch.setattr(Following, "_affordable", lambda self, q: True)
    settings = SETTINGS.model_copy(
        update={"end_time": 640.0, "latest_time": 640.0, "contact": SOFT, "stiffness": "following"}
    )
    with pytest.raises(Unsound, match=r"energy_error = .*stiffness_excess = .*limit 0.01"):
        stage.run(settings, run, run / "5_dem")
    report = json.loads((run / "5_dem" / "stage_report.json").read_text())
    found = history(run / "5_dem")
    handed = report["kinetic_handed_J"]
    assert found["stiffness_excess_J"][-1] == pytest.approx(report["stiffness_excess"] * handed)
    # nothing is taken out of the balance, so that its error shows it too
    spent = (
        sum(found[f"dissipated_{where}_J"][-1] for where in ("contacts", "damping", "walls"))
        - found["dissipated_flight_J"][-1]
    )
    assert report["energy_error"] * (handed + spent) == pytest.approx(found["stiffness_excess_J"][-1], rel=0.02)


def test_balances_beyond_hope_stop_a_run_on_its_way(tmp_path, carved, monkeypatch):
    for part in ("2_sph", "4_handoff"):
        (tmp_path / part).symlink_to(carved / part)
    (tmp_path / "5_dem").mkdir()
    monkeypatch.setattr(collapsing, "HOPELESS", -1.0)
    with pytest.raises(
        UnphysicalState, match=r"unstable: momentum_error = .* \(limit 1e-09\), with overlaps of up to"
    ):
        stage.run(SETTINGS, tmp_path, tmp_path / "5_dem")
    assert not (tmp_path / "5_dem" / "last.vtkhdf").exists()


def test_a_bed_that_explodes_stops_with_a_name(tmp_path, carved):
    run = tmp_path
    shutil.copytree(carved / "2_sph", run / "2_sph")
    (run / "4_handoff").mkdir()
    (run / "5_dem").mkdir()
    start = snapshot.read(carved / "4_handoff" / "start.vtkhdf")
    velocity = start.velocity.copy()
    velocity[np.argmin(start.position[:, 0] ** 2 + start.position[:, 1] ** 2 + 1e12 * start.state)] = [
        0.0,
        0.0,
        -9000.0,
    ]
    start["velocity"] = velocity
    snapshot.write(start, run / "4_handoff" / "start.vtkhdf")
    with pytest.raises(UnphysicalState, match=r"overlaps? .*limit 0.5.*position"):
        stage.run(SETTINGS, run, run / "5_dem")
    assert (run / "5_dem" / "snap_0000.vtkhdf").is_file()


def test_bad_settings_and_inputs(tmp_path, carved):
    with pytest.raises(ValidationError, match="latest_time"):
        stage.Settings(end_time=100.0, latest_time=50.0)
    with pytest.raises(InputError, match="no snapshot"):
        stage.run(SETTINGS, tmp_path, tmp_path)
    with pytest.raises(InputError, match="not after the handoff"):
        stage.run(stage.Settings(end_time=200.0, latest_time=200.0), carved, tmp_path)
