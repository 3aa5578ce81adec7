"""``import bolide``: quick, and what a run is read as."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import bolide
from bolide import values
from crater.ground.radial_profile import Profile, write_csv
from matter.files import snapshot
from matter.particles import Particles
from pipeline.case import overlay
from pipeline.store import intact

ROOT = Path(__file__).resolve().parents[2]


def test_the_import_brings_nothing_heavy():
    """Neither numerics nor validation nor drawing; what it costs then is a matter of milliseconds."""
    code = (
        "import sys, bolide; print([name for name in ('numba', 'numpy', 'pandas', 'pydantic', 'matplotlib', "
        "'pyvista', 'h5py') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert done.stdout.strip() == "[]", done.stderr


def test_a_case_is_run_opened_and_gone_on_with(case_folder, tmp_path, fake_stages):
    run = bolide.run(
        case_folder, "quick", out=tmp_path / "runs", quiet=True, **{"impact.speed": "15 km/s", "handoff.broken": True}
    )
    assert run.settings["impact"]["speed"] == "15000.0 m/s" and run.settings["sph"]["steps"] == 20
    assert list(run.unsound) == ["handoff"] and "mass_total_rel" in run.unsound["handoff"]
    assert run.measures["final"]["depth_m"] == (1.2e4, 2.6e4, "m", {})
    assert str(run.measures["transient"]["depth_m"]) == "290 ± 26 km"
    again = bolide.run(run.folder, quiet=True)
    assert again.folder == run.folder and bolide.open(run.folder).measures == run.measures
    with pytest.raises(bolide.InputError, match="no case at"):
        bolide.run(tmp_path / "nowhere", quiet=True)
    with pytest.raises(bolide.InputError, match="is not a run folder"):
        bolide.open(tmp_path)


@pytest.fixture
def run(tmp_path) -> bolide.Run:
    """A run folder with the tables of every stage, made by hand."""
    (tmp_path / "case.used.toml").write_text("")
    for name in ("2_sph", "4_handoff", "5_dem", "6_crater"):
        (tmp_path / name).mkdir()
    (tmp_path / "2_sph" / "history.csv").write_text(
        "time_s,mass_kg,momentum_x,angular_momentum_x,total_J,steps\n0.0,1.0,2.0,3.0,4.0,5\n"
    )
    for stage, name, times in (("sph", "2_sph", (0.0, 60.0)), ("dem", "5_dem", (62.0, 600.0))):
        for number, time in enumerate(times):
            fields = {"position": np.full((3, 3), time), "velocity": np.zeros((3, 3)), "mass": np.ones(3)}
            snapshot.write(
                Particles(fields, {"time": time, "stage": stage}), tmp_path / name / f"snap_{number:04d}.vtkhdf"
            )
    radius = np.linspace(1e3, 1e5, 50)
    write_csv(
        Profile(
            radius, -1e3 + 0.01 * radius, -2e3 + 0.01 * radius, 0.01 * radius, np.full(50, 9), {"body": "callisto"}
        ),
        tmp_path / "6_crater" / "profile.csv",
    )
    cell = {"value": 1.2e4, "sigma": 2e3, "unit": "m", "sigma_parts": {"chain": 1e3, "azimuth": None}}
    content = {
        "final": {"depth_m": cell, "settled": True, "time_s": cell},
        "transient": {"depth_m": {**cell, "value": None}},
    }
    (tmp_path / "6_crater" / "measures.json").write_text(json.dumps(content))
    (tmp_path / "4_handoff" / "ledger.json").write_text(
        json.dumps([{"name": "a", "value": 1.0, "limit": 2.0, "verdict": "pass", "unit": "1", "note": ""}])
    )
    return bolide.open(tmp_path)


def test_tables_carry_their_units(run):
    profile = run.profile()
    assert (
        list(profile["radius_m"])[-1] == 1e5
        and profile.attrs["units"]["height_p16_m"] == "m"
        and profile.attrs["body"] == "callisto"
    )
    units = run.history("sph").attrs["units"]
    assert units == {
        "time_s": "s",
        "mass_kg": "kg",
        "momentum_x": "kg m/s",
        "angular_momentum_x": "kg m^2/s",
        "total_J": "J",
        "steps": "",
    }
    assert values.of_column("volume_m3_sigma") == "m^3"
    assert run.ledger.loc["a", "verdict"] == "pass"
    for call in (
        lambda: run.profile("transient"),
        lambda: run.profile("deep"),
        lambda: run.history("dem"),
        lambda: run.history("bed"),
    ):
        with pytest.raises(bolide.InputError):
            call()


def test_measures_are_values_with_errors(run):
    assert set(run.measures) == {"final"} and run.measures["final"]["depth_m"].parts == {"chain": 1e3}
    page = run._repr_html_()
    assert "final crater: depth 12.0 ± 2.0 km" in page and run.folder.name in page


def test_the_snapshot_nearest_to_a_time(run):
    assert [stage for stage, _, _ in run.snapshots] == ["sph", "sph", "dem", "dem"]
    assert run.snapshot("1 min").position[0, 0] == 60.0 and run.snapshot(60.0, "dem").position[0, 0] == 62.0
    assert run.snapshot(1e9).position[0, 0] == 600.0
    assert run.snapshot(0.0, form="pyvista").n_points == 3
    with pytest.raises(bolide.InputError, match="time"):
        run.snapshot("5 km")
    with pytest.raises(bolide.InputError, match="no snapshots of bed"):
        run.snapshot(0.0, "bed")


def test_craters_side_by_side(run):
    table = run.compare(run)
    assert (
        list(table["value"]) == [1.2e4, 1.2e4] and set(table["measure"]) == {"depth_m"} and set(table["unit"]) == {"m"}
    )


def test_a_profile_is_drawn(run):
    import matplotlib

    matplotlib.use("Agg")
    axes = run.plot.profile()
    assert axes.get_lines()[0].get_xdata()[-1] == pytest.approx(100.0) and "km" in axes.get_xlabel()
    assert run.plot.profile(axes=axes) is axes and len(axes.get_lines()) == 2


def test_what_is_known_without_a_run():
    assert (
        bolide.materials["ice"]["tillotson"]["rho0"] == pytest.approx(917.0, rel=0.1) and "basalt" in bolide.materials
    )
    with pytest.raises(KeyError, match="known: "):
        bolide.materials["cheese"]
    shot = dict(
        projectile="ice",
        radius="53.9 km",
        speed="18.234 km/s",
        target="ice",
        gravity=1.236,
        angle_from_vertical="40 deg",
    )
    table = bolide.scaling(**shot)
    from crater.scaling import crater_size

    rho = bolide.materials["ice"]["tillotson"]["rho0"]
    event = crater_size.ImpactEvent(53.9e3, 18234.0, np.radians(40.0), 1.236, rho, rho)
    assert table.loc["zahnle_2003", "diameter_m"] == pytest.approx(crater_size.zahnle_2003(event))
    assert len(bolide.scaling(**shot, ground="sand")) == 3 < len(table)
    porous = bolide.materials["pumice"]["tillotson"]["rho0"] / bolide.materials["pumice"]["p_alpha"]["alpha0"]
    event = crater_size.ImpactEvent(53.9e3, 18234.0, np.radians(40.0), 1.236, rho, porous)
    loose = bolide.scaling(**{**shot, "target": "pumice"})
    assert loose.loc["zahnle_2003", "diameter_m"] == pytest.approx(crater_size.zahnle_2003(event))
    for wrong in ({"speed": "3 km"}, {"ground": "cheese"}, {"target": "cheese"}):
        with pytest.raises(bolide.InputError):
            bolide.scaling(**{**shot, **wrong})


def test_another_code_s_text_becomes_a_snapshot(tmp_path):
    """Units of the header, names of the materials, time, and the axis that points up turned onto z."""
    text = tmp_path / "theirs.csv"
    text.write_text("x [km],y [km],z [km],vx,vy,vz,m,rho,mat\n1,0,0,2,0,0,3,917,0\n0,2,0,0,4,0,3,1000,1\n")
    made = bolide.import_snapshot(text, tmp_path / "a.vtkhdf", materials="ice,water", time="2 min", up=(1.0, 0.0, 0.0))
    read = snapshot.read(made)
    assert read.attributes["time"] == 120.0 and list(read.attributes["materials"]) == ["ice", "water"]
    np.testing.assert_allclose(read.position, [[0.0, 0.0, 1e3], [0.0, 2e3, 0.0]], atol=1e-9)
    np.testing.assert_allclose(read.velocity[0], [0.0, 0.0, 2.0], atol=1e-12)
    for options, words in (({"time": "2 km"}, "time"), ({"materials": "ice", "columns": "x,q"}, "q")):
        with pytest.raises(bolide.InputError, match=words):
            bolide.import_snapshot(text, tmp_path / "b.vtkhdf", **options)
    with pytest.raises(bolide.InputError, match="vtkhdf"):
        bolide.import_snapshot(text, tmp_path / "b.h5", materials="ice,water")


def flipped(path: Path, byte: int, bit: int) -> None:
    content = bytearray(path.read_bytes())
    content[byte] ^= bit
    path.write_bytes(bytes(content))


def test_a_result_that_was_altered_is_refused_and_never_read_as_good(run):
    """Of a stage with its record: a digit that became another, whatever is read."""
    for stage, name in (("sph", "2_sph"), ("dem", "5_dem"), ("handoff", "4_handoff"), ("crater", "6_crater")):
        content = {"stage": stage, "files": intact.files_of(run.folder / name)}
        (run.folder / name / "done.json").write_text(json.dumps(content))
    assert run.history("sph")["momentum_x"][0] == 2.0 and len(run.profile()) == 50
    altered = {
        "2_sph/history.csv": lambda: run.history("sph"),
        "2_sph/snap_0000.vtkhdf": lambda: run.snapshot(0.0),
        "4_handoff/ledger.json": lambda: run.ledger,
        "6_crater/measures.json": lambda: run.measures,
        "6_crater/profile.csv": lambda: run.profile(),
    }
    for name, read in altered.items():
        read()
        run.__dict__.pop("measures", None)
        flipped(run.folder / name, -20, 1)
        with pytest.raises(bolide.InputError, match=rf"is not as the stage left it: {Path(name).name} has other"):
            read()
    with pytest.raises(bolide.InputError, match=r"is not as the stage left it: .* has other"):
        run.compare(run)


@pytest.mark.parametrize("content", [b"a,b\n1,2\n1,2,3\n", b"a,b\n1,\xff\n", b"", b'a,"b\n1,2\n'])
def test_a_table_that_is_none_is_a_message(run, content):
    """Of a run without records, such as one that an older version made."""
    (run.folder / "2_sph" / "history.csv").write_bytes(content)
    with pytest.raises(bolide.InputError, match=r"history\.csv is damaged, it is not a table"):
        run.history("sph")


def test_commands_by_the_module():
    def start(*arguments: str) -> subprocess.CompletedProcess:
        return subprocess.run(
            [sys.executable, "-m", "bolide", *arguments], capture_output=True, text=True, cwd=ROOT, timeout=60
        )

    assert start().returncode == 2 and "run_case" in start("--help").stderr
    assert start("run_case", "--version").stdout.startswith("bolide ")
    shown = start("--version")
    assert shown.returncode == 0 and shown.stdout == start("run_case", "--version").stdout


@pytest.mark.parametrize(
    "value",
    [
        0.25, True, "a \"b\" \\ c", [1, 2.5], {"at": "0.9 s", "slower": [{"at": "2 s", "sound speed": "8 m/s"}]},
        [{"material": "granite"}], [], {},
    ],
)  # fmt: skip
def test_a_setting_is_written_as_toml_on_one_line(value):
    text = overlay.toml(value)
    assert tomllib.loads(f"value = {text}") == {"value": value} and "\n" not in text
