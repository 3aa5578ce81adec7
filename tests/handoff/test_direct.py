"""The direct transition: what it keeps, how its overlaps are measured, and its place in the ledger, the record and the
report."""

import json
import math

import numpy as np
import pytest

from handoff import direct, overlaps, stage
from handoff.domain import Cylinder
from matter import snapshot
from matter.errors import InputError, Unsound
from matter.particles import Particles

WAIVE = {"t_handoff_over_T_crater_max": "the shock needs minutes to leave the domain"}


def grains(position, radius, mass=1.0, stiffness=100.0) -> Particles:
    n = len(position)
    return Particles({"position": position, "radius": np.full(n, radius) if np.isscalar(radius) else radius,
    "mass": np.full(n, mass),
                      "stiffness": np.full(n, stiffness)})  # fmt: skip


def test_two_spheres():
    found = overlaps.measure(grains([[0, 0, 0], [1.9, 0, 0], [50, 0, 0]], 1.0, mass=4.0))
    np.testing.assert_allclose(found.depth, [0.1])
    assert found.largest == pytest.approx(0.1) and found.energy == pytest.approx(0.5 * 100.0 * 0.01)
    assert found.release_speed[0] == pytest.approx(0.1 * math.sqrt(100.0 / 4.0))
    # an overlap of 0.05 at pressure 5 Pa (r^2 P / k) is what the undisturbed body carries
    assert found.beyond(lambda place: np.full(len(place), 5.0)).depth == pytest.approx([0.05])
    assert len(found.beyond(lambda place: np.full(len(place), 11.0)).depth) == 0
    # k = m (v / (x r))^2 keeps a grain of that speed below x radii: dt = pi sqrt(m / 2 k) / n
    speed, x, n = float(found.release_speed[0]), 0.15, 30
    assert found.step(x, n) == pytest.approx(math.pi * math.sqrt(0.5 * 4.0 / (4.0 * (speed / x) ** 2)) / n)
    assert overlaps.measure(grains([[0, 0, 0], [3, 0, 0]], 1.0)).step(x, n) == math.inf


def test_pairs_of_very_different_sizes_are_all_found():
    rng = np.random.default_rng(1)
    position, radius = rng.random((400, 3)), 0.004 * 2.0 ** rng.uniform(0, 6, 400)
    found = overlaps.measure(grains(position, radius))
    gap = radius[:, None] + radius[None] - np.linalg.norm(position[:, None] - position[None], axis=2)
    every = np.triu(gap > 0.0, 1)
    np.testing.assert_allclose(np.sort(found.depth), np.sort(gap[every]))
    assert 100 < len(found.depth)


def test_walls_count_as_contacts():
    box = Cylinder(radius=10.0, floor=-5.0, datum=0.0, top=5.0)
    found = overlaps.measure(grains([[0, 0, -4.5], [9.2, 0, 0], [0, 0, 4.9]], 1.0), box)
    np.testing.assert_allclose(np.sort(found.depth), [0.2, 0.5])  # the side and the floor, never the top


@pytest.fixture(scope="module")
def finished(run_folder, tmp_path_factory):
    outs = {}
    for method in ("mapped", "direct"):
        outs[method] = tmp_path_factory.mktemp(method)
        try:
            stage.run(
                stage.Settings(waive=WAIVE, method=method, pictures=method == "direct"), run_folder, outs[method]
            )
        except Unsound as reason:
            assert "beyond the limit" in str(reason)
    return run_folder, outs


def test_direct_grains_are_the_particles(finished):
    folder, outs = finished
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


def test_the_ledger_of_the_direct_way(finished):
    _, outs = finished
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
    from handoff.ledger import LIMITS

    assert set(LIMITS) <= set(book)


def test_both_ways_stand_side_by_side_whichever_is_taken(finished, capsys):
    _, outs = finished
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
    assert (
        "Mapped against direct" in page
        and direct.LABELS["release_speed_excess_m_s"] in page
        and "velocity.png" in page
    )
    print(direct.as_text(tables[0]))
    assert len(capsys.readouterr().out.splitlines()) == len(direct.LABELS) + 1


def test_a_bed_without_stiffness_cannot_say_how_stiff_the_grains_are(finished, tmp_path):
    import shutil

    folder, _ = finished
    for name in ("2_sph", "3_bed"):
        shutil.copytree(folder / name, tmp_path / name)
    bed = snapshot.read(tmp_path / "3_bed" / "bed.vtkhdf")
    bare = Particles({name: bed[name] for name in bed if name != "stiffness"}, bed.attributes, bed.tables)
    snapshot.write(bare, tmp_path / "3_bed" / "bed.vtkhdf")
    with pytest.raises(InputError, match="stiffness"):
        stage.run(stage.Settings(waive=WAIVE, method="direct", time="last"), tmp_path, tmp_path)
