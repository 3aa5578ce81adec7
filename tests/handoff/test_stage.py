"""The stage on a whole run folder: outputs, repeatability, choice of time, the command's table, complaints; the direct
transition beside the mapped one: what it keeps, and its place in the ledger, the record and the report."""

import json
import math
import shutil

import numpy as np
import pytest
import trimesh

from handoff import stage
from handoff.ledger import LIMITS
from handoff.pages import handoff_report
from handoff.source import handoff_time
from handoff.transfer import direct
from matter.case import at_rest
from matter.errors import InputError, Unsound
from matter.files import snapshot
from matter.particles import Particles

WAIVE = {"t_handoff_over_T_crater_max": "the shock needs minutes to leave the domain"}


def run(folder, out, **settings):
    try:
        stage.run(stage.Settings(waive=WAIVE, **settings), folder, out)
        return None
    except Unsound as reason:
        return str(reason)


@pytest.fixture(scope="module")
def finished(run_folder):
    return run_folder, run(run_folder, run_folder / "4_handoff")


def test_outputs(finished):
    folder, unsound = finished
    out = folder / "4_handoff"
    start = snapshot.read(out / "start.vtkhdf")
    bed = snapshot.read(folder / "3_bed" / "bed.vtkhdf")
    assert set(bed) <= set(start) and "state" in start
    assert start.attributes["stage"] == "handoff" and start.attributes["time"] in (60.0, 120.0, 180.0, 240.0)
    assert (
        start.attributes["domain"] == bed.attributes["domain"]
        and start.attributes["species"] == bed.attributes["species"]
    )
    densities = dict(zip(start.attributes["materials"], start.attributes["reference_densities_kg_m3"], strict=True))
    assert densities == {name: at_rest.of_file(name).solid for name in start.attributes["materials"]}
    assert set(bed.tables) == set(start.tables)
    mesh = trimesh.load(out / "surface.ply", process=False)
    assert mesh.is_watertight and mesh.volume > 0.0
    rows = json.loads((out / "ledger.json").read_text())
    assert set(LIMITS) <= {row["name"] for row in rows}
    values = {row["name"]: row for row in rows}
    for name in ("mass_total_rel", "momentum_linear_rel_after", "momentum_angular_rel_after", "mass_raw_rel",
    "momentum_linear_raw_rel",
                 "momentum_angular_raw_rel", "correction_max_dv_over_rms_v", "kinetic_energy_change_max",
                 "overlap_max_over_r",
                 "cavity_hausdorff_over_r", "residual_pressure_over_bulk_modulus",
                 "bed_residual_speed_over_sqrt_g_r"):  # fmt: skip
        assert values[name]["verdict"] == "pass", (name, values[name])
    assert values["t_handoff_over_T_crater_max"]["verdict"] == "waived"
    failing = [name for name, row in values.items() if row["verdict"] == "fail"]
    assert (unsound is None) == (failing == [])
    record = json.loads((out / "handoff.json").read_text())
    assert record["choice"]["chosen"] == record["snapshot"] and len(record["choice"]["series"]["time"]) == 4
    page = (out / "report.html").read_text()
    for name in ("cut.png", "velocity.png", "residuals.png", "time.png"):
        assert name in page and (out / name).stat().st_size > 20_000
    assert "mass_raw_rel" in page and "waived" in page


def test_the_command_prints_the_table_and_its_exit_code(finished, capsys):
    folder, unsound = finished
    code = handoff_report.print_ledger(folder)
    printed = capsys.readouterr().out
    assert code == (1 if unsound else 0)
    assert "momentum_angular_rel_after" in printed


@pytest.fixture(scope="module")
def again(run_folder, tmp_path_factory):
    """The same handoff into another folder."""
    out = tmp_path_factory.mktemp("mapped")
    run(run_folder, out)
    return out


@pytest.fixture(scope="module")
def both_ways(finished, tmp_path_factory):
    """The run's folder, and those of the ``mapped`` and the ``direct`` handoff."""
    run_folder, out = finished[0], tmp_path_factory.mktemp("direct")
    unsound = run(run_folder, out, method="direct")
    assert unsound is None or "beyond the limit" in unsound
    return run_folder, {"mapped": run_folder / "4_handoff", "direct": out}


@pytest.mark.validation
def test_same_inputs_give_the_same_bits(finished, again):
    folder, _ = finished
    one, other = snapshot.read(folder / "4_handoff" / "start.vtkhdf"), snapshot.read(again / "start.vtkhdf")
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])
    for name in one.tables:
        np.testing.assert_array_equal(one.tables[name], other.tables[name])
    assert (again / "ledger.json").read_bytes() == (folder / "4_handoff" / "ledger.json").read_bytes()


@pytest.mark.validation
def test_the_time_can_be_given(finished, tmp_path):
    folder, _ = finished
    run(folder, tmp_path, time=130.0)
    assert snapshot.read(tmp_path / "start.vtkhdf").attributes["time"] == 120.0
    with pytest.raises(InputError, match="no snapshot near"):
        stage.run(stage.Settings(time=4000.0), folder, tmp_path)


def test_missing_inputs_are_named(run_folder, tmp_path):
    for missing, word in (("2_sph/target.json", "target"), ("3_bed/bed.vtkhdf", "bed.vtkhdf")):
        copy = tmp_path / missing.replace("/", "_")
        shutil.copytree(run_folder, copy, ignore=shutil.ignore_patterns("4_handoff"))
        (copy / missing).unlink()
        with pytest.raises(InputError, match=word):
            stage.run(stage.Settings(), copy, tmp_path)
    with pytest.raises(InputError, match="no snapshots"):
        handoff_time.files(tmp_path)


def test_prediction_grows_with_the_sizes():
    small, large = (
        stage.predict(stage.Settings(particles=p, grains=g)) for p, g in ((15_000, 20_000), (300_000, 100_000))
    )
    assert set(small) == {"wall_s", "memory_bytes", "disk_bytes"}
    assert all(large[name] > 2.0 * small[name] for name in small)


def test_direct_grains_are_the_particles(both_ways):
    folder, outs = both_ways
    start, mapped = (snapshot.read(outs[method] / "start.vtkhdf") for method in ("direct", "mapped"))
    record = json.loads((outs["direct"] / "handoff.json").read_text())
    source = snapshot.read(folder / "2_sph" / record["snapshot"])
    assert set(start) == set(mapped) and start.attributes["domain"] == mapped.attributes["domain"]
    place = {tuple(p): k for k, p in enumerate(source.position)}
    which = np.array([place[tuple(p)] for p in start.position])
    assert len(np.unique(which)) == len(start) == record["grains"]["kept"] + record["grains"]["ejecta"]
    for name in ("mass", "velocity"):
        np.testing.assert_array_equal(start[name], source[name][which])
    compact = np.arange(record["grains"]["kept"])
    volume = 4.0 / 3.0 * np.pi * start.radius[compact] ** 3
    np.testing.assert_allclose(volume, (source.mass / source.density)[which[compact]], rtol=1e-12)
    assert record["grains"]["ejecta"] == int(
        np.sum([count for name, count in record["particles"].items() if name != "compact"])
    )


def test_the_ledger_of_the_direct_way(both_ways):
    _, outs = both_ways
    book = {row["name"]: row for row in json.loads((outs["direct"] / "ledger.json").read_text())}
    for name in (
        "mass_total_rel",
        "momentum_linear_rel_after",
        "momentum_angular_rel_after",
        "kinetic_energy_change_max",
    ):
        assert book[name]["verdict"] == "pass"
    for name in ("overlap_max_over_r", "overlap_release_speed_over_median_flow"):
        assert book[name]["verdict"] == "fail", book[
            name
        ]  # spheres of the full volume cannot fill space without overlap
    assert set(LIMITS) <= set(book)


def test_both_ways_stand_side_by_side_whichever_is_taken(both_ways, capsys):
    _, outs = both_ways
    tables = [json.loads((outs[method] / "handoff.json").read_text())["methods"] for method in ("mapped", "direct")]
    assert tables[0] == tables[1] and set(tables[0]["mapped"]) == set(tables[0]["direct"]) == set(direct.LABELS)
    mapped, straight = tables[0]["mapped"], tables[0]["direct"]
    assert straight["overlap_max_excess_over_r"] > 0.1 > mapped["overlap_max_excess_over_r"]
    assert (
        straight["momentum_linear_rel_after"] > 1e-6 > mapped["momentum_linear_rel_after"]
    )  # the domain's side cuts particles
    assert straight["kinetic_energy_change"] != 0.0
    ledger = {row["name"]: row["value"] for row in json.loads((outs["mapped"] / "ledger.json").read_text())}
    assert mapped["momentum_linear_rel"] == ledger["momentum_linear_raw_rel"]
    for row in (mapped, straight):
        step = min(row["time_step_contact_s"], row["time_step_release_s"] or math.inf)
        assert row["core_s_per_simulated_s"] == pytest.approx(row["grains"] / step / direct.GRAIN_STEPS_PER_S)
    page = (outs["direct"] / "report.html").read_text()
    assert "Mapped against direct" in page and direct.LABELS["release_speed_excess_m_s"] in page
    print(direct.as_text(tables[0]))
    assert len(capsys.readouterr().out.splitlines()) == len(direct.LABELS) + 1


def test_a_bed_without_stiffness_cannot_say_how_stiff_the_grains_are(both_ways, tmp_path):
    folder, _ = both_ways
    for name in ("2_sph", "3_bed"):
        shutil.copytree(folder / name, tmp_path / name)
    bed = snapshot.read(tmp_path / "3_bed" / "bed.vtkhdf")
    bare = Particles({name: bed[name] for name in bed if name != "stiffness"}, bed.attributes, bed.tables)
    snapshot.write(bare, tmp_path / "3_bed" / "bed.vtkhdf")
    with pytest.raises(InputError, match="stiffness"):
        stage.run(stage.Settings(waive=WAIVE, method="direct", time="last"), tmp_path, tmp_path)
