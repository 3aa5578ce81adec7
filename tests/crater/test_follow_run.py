"""What follow_run reads from snapshots, on clouds whose answer is known; two series compared; extrapolation of a known
law."""

from __future__ import annotations

import json

import numpy as np
import pytest

from crater.ground import datum
from matter.errors import InputError
from matter.files import snapshot
from matter.particles import Particles
from studies.winter_2017 import convergence, follow_run, series_difference

R, SHELL, SPACING = 1000e3, 150e3, 25e3


def sphere_cloud() -> np.ndarray:
    """Points of a cubic lattice in the outer 250 km of a sphere."""
    axis = np.arange(-R, R + 1, 2 * SPACING) + SPACING
    p = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    r = np.linalg.norm(p, axis=1)
    return p[(r < R) & (r > R - 250e3)]


def target(position=None, damage=None, projectile=None, time=396.0) -> Particles:
    start = sphere_cloud()
    layer = np.where(np.linalg.norm(start, axis=1) > R - SHELL, 2, 1)
    now = start.copy() if position is None else position(start)
    broken = np.zeros(len(start)) if damage is None else damage(start)
    if projectile is not None:
        start, now = np.vstack([start, projectile]), np.vstack([now, projectile])
        layer, broken = np.r_[layer, np.full(len(projectile), -1)], np.r_[broken, np.zeros(len(projectile))]
    n = len(start)
    fields = {"position": now, "initial_position": start, "layer": layer.astype(np.int32), "damage": broken}
    fields |= {
        "mass": np.full(n, 917.0 * (2 * SPACING) ** 3),
        "density": np.full(n, 917.0),
        "velocity": np.zeros((n, 3)),
        "material": np.zeros(n, np.int32),
    }
    return Particles(
        fields, {"time": time, "spacing_at_impact_m": SPACING, "frame": "sphere", "stage": "sph", "materials": ["ice"]}
    )


GROUND = datum.sphere(R)


def arc(p: np.ndarray) -> np.ndarray:
    return R * np.arctan2(np.hypot(p[:, 0], p[:, 1]), p[:, 2])


def test_matter_in_the_air_is_counted_and_weighed_apart():
    up = np.array([[0.0, 0.0, R + 60e3], [0.0, 0.0, R + 40e3], [0.0, 0.0, R - 10e3]])
    cloud = target(position=lambda p: np.where((np.arange(len(p)) < 3)[:, None], p * 1.5, p), projectile=up)
    found = follow_run.airborne(cloud, GROUND, 2 * SPACING)
    assert (found["airborne_target"], found["airborne_projectile"]) == (3, 1)
    assert found["airborne_target_kg"] == pytest.approx(3 * cloud.mass[0]) and found[
        "airborne_projectile_kg"
    ] == pytest.approx(cloud.mass[0])


def test_the_projectile_below_the_shell_is_a_share_of_its_mass():
    places = np.array([[0.0, 0.0, R - d] for d in (10e3, 100e3, 160e3, 200e3)])
    found = follow_run.projectile_depth(target(projectile=places), GROUND, SHELL)
    assert found["projectile_deepest_m"] == pytest.approx(200e3) and found["projectile_below_shell"] == pytest.approx(
        0.5
    )
    assert np.isnan(follow_run.projectile_depth(target(), GROUND, SHELL)["projectile_deepest_m"])


def test_a_base_that_sank_under_the_crater_is_told_from_a_body_that_shrank():
    def pushed(p: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(p, axis=1)
        down = 10e3 + np.where(arc(p) < 250e3, 30e3, 0.0)  # the whole body by 10 km, under the crater 30 km more
        return p * ((r - down) / r)[:, None]

    found = follow_run.interface(target(pushed), GROUND, SHELL, 400e3, SPACING)
    assert found["interface_down_m"] == pytest.approx(30e3, abs=1.0) and found[
        "interface_down_most_m"
    ] == pytest.approx(30e3, abs=1.0)
    assert found["below_risen_kg"] == 0.0


def test_matter_that_rose_through_the_base_is_weighed():
    def risen(p: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(p, axis=1)
        below = (r < R - SHELL) & (arc(p) < 100e3)
        return p * (np.where(below, R - 50e3, r) / r)[:, None]

    cloud = target(risen)
    n = ((np.linalg.norm(cloud.initial_position, axis=1) < R - SHELL) & (arc(cloud.initial_position) < 100e3)).sum()
    assert n > 0 and follow_run.interface(cloud, GROUND, SHELL, 200e3, SPACING)["below_risen_kg"] == pytest.approx(
        n * cloud.mass[0]
    )


def test_a_whole_ring_between_two_broken_zones_is_found_and_only_that():
    def ring(p: np.ndarray) -> np.ndarray:
        s = arc(p)
        return np.where((s > 500e3) & (s < 900e3), 0.0, np.where(s < 1500e3, 1.0, 0.2))

    s, mean = follow_run.damage_by_distance(target(damage=ring), GROUND, SHELL)
    inner, outer = follow_run.undamaged_annulus(s, mean)
    assert inner == pytest.approx(520e3, abs=60e3) and outer == pytest.approx(880e3, abs=60e3)
    assert (np.diff(s) > 0).all() and s[-1] > 2500e3
    s, mean = follow_run.damage_by_distance(target(damage=lambda p: (arc(p) < 500e3).astype(float)), GROUND, SHELL)
    assert follow_run.undamaged_annulus(s, mean) is None  # broken inside only: whole ice to the antipode is no ring
    assert (
        follow_run.undamaged_annulus(np.arange(5.0), np.array([1.0, 0.7, 0.6, 0.7, 1.0])) is None
    )  # neither broken nor whole


def test_rings_hold_enough_members_and_weigh_them():
    s = np.linspace(0.0, 100.0, 101)
    middles, means = follow_run.ring_means(s, s, np.ones(101), 30.0)
    assert len(middles) == 3 and means == pytest.approx(middles)
    heavy = follow_run.ring_means(np.arange(12.0), np.r_[np.zeros(11), 1.0], np.r_[np.ones(11), 11.0], 1.0)[1]
    assert heavy == pytest.approx([0.5])


def test_interior_file_holds_rows_and_the_ring(tmp_path):
    folder = tmp_path / "2_sph"
    folder.mkdir()
    facts = {
        "radius_m": R,
        "layers": [
            {"inner_radius_m": 0.0, "outer_radius_m": R - SHELL},
            {"inner_radius_m": R - SHELL, "outer_radius_m": R},
        ],
    }
    with pytest.raises(InputError, match=r"target\.json"):
        follow_run.write(tmp_path, 200e3, 396.0, tmp_path)
    (folder / "target.json").write_text(json.dumps(facts))
    for number, time in enumerate((0.0, 390.0)):
        snapshot.write(
            target(damage=lambda p: (arc(p) < 600e3).astype(float), time=time), folder / f"snap_{number:04d}.vtkhdf"
        )
    follow_run.write(tmp_path, 200e3, 396.0, tmp_path)
    content = json.loads((tmp_path / follow_run.FILE).read_text())
    assert [row["time_s"] for row in content["rows"]] == [0.0, 390.0] and content["rows"][0][
        "projectile_deepest_m"
    ] is None
    assert (
        content["damage"]["time_s"] == 390.0
        and content["damage"]["annulus_m"] is None
        and content["damage"]["mean"][0] == pytest.approx(1.0)
    )
    follow_run.write(tmp_path, 200e3, 1000.0, tmp_path)
    assert json.loads((tmp_path / follow_run.FILE).read_text())["damage"] is None


TIME = np.arange(60.0, 1260.0, 60.0)
DEPTH = np.where(TIME < 600.0, 200e3, 200e3 * np.maximum(0.05, 1.0 - (TIME - 600.0) / 400.0))


def test_two_series_differ_by_what_was_put_in():
    until = series_difference.open_until(TIME, DEPTH)
    assert until == 840.0
    found = series_difference.difference(TIME, DEPTH, TIME, DEPTH * np.where(TIME == 480.0, 1.03, 1.01), 180.0, until)
    assert found.relative == pytest.approx(0.03) and found.at_s == 480.0 and found.until_s == 780.0
    # after the crater has fallen in, and before the start, nothing counts
    late = series_difference.difference(
        TIME, DEPTH, TIME, np.where((TIME < 180.0) | (TIME >= 840.0), 5 * DEPTH, DEPTH), 180.0, until
    )
    assert late.relative == 0.0
    # other times are interpolated
    shifted = TIME + 30.0
    assert series_difference.difference(TIME, TIME, shifted, 1.02 * shifted, 180.0, 1000.0).relative == pytest.approx(
        0.02
    )
    with pytest.raises(InputError, match="fewer than three"):
        series_difference.difference(TIME, DEPTH, TIME, np.where(TIME < 300.0, DEPTH, np.nan), 250.0, until)


def test_series_are_read_with_their_gaps(tmp_path):
    path = tmp_path / "time_series.csv"
    path.write_text("stage,time_s,depth_m,note\nsph,60,1000,\nsph,120,,shallow\ndem,240,5,\n")
    found = series_difference.read_series(path)
    assert (
        found["time_s"].tolist() == [60.0, 120.0] and found["depth_m"][0] == 1000.0 and np.isnan(found["depth_m"][1])
    )


def test_a_linear_law_is_extrapolated_and_its_error_covers_the_truth():
    s = np.array([74e3, 52e3, 37e3, 26e3])
    exact = convergence.extrapolated(s, 600e3 - 2.0 * s, np.full(4, 5e3))
    assert (
        exact.value == pytest.approx(600e3)
        and exact.slope == pytest.approx(-2.0)
        and exact.free_order == pytest.approx(1.0, abs=0.02)
    )
    rng, covered = np.random.default_rng(3), 0
    for _ in range(200):
        fit = convergence.extrapolated(s, 600e3 - 2.0 * s + rng.normal(0, 5e3, 4), np.full(4, 5e3))
        covered += abs(fit.value - 600e3) < fit.sigma
    assert covered > 0.68 * 200  # the spread of the orders is added: on the safe side
    quadratic = convergence.extrapolated(s, 600e3 - 1e-5 * s**2, np.full(4, 1e3))
    assert quadratic.free_order == pytest.approx(2.0, abs=0.05) and quadratic.free_value == pytest.approx(
        600e3, rel=1e-3
    )
    assert (
        0.8 * quadratic.sigma < abs(quadratic.value - 600e3) < quadratic.sigma
    )  # the two orders differ, and the error says so
    with pytest.raises(InputError, match="three spacings"):
        convergence.extrapolated(s[:2], s[:2], s[:2])


def test_the_picture_of_convergence_is_drawn(tmp_path):
    row = {"diameter_apparent_m": 500e3, "depth_m": 200e3}
    rows = [{"spacing_m": s, **{f"{q}_at_{c}{e}": (v - s if not e else 5e3) for q, v in row.items() for c in ("depth",
    "volume") for e in ("", "_sigma")}}
            for s in (74e3, 52e3, 37e3)]  # fmt: skip
    keys = [f"{q}_at_{c}" for q in row for c in ("depth", "volume")]
    fits = {k: convergence.extrapolated(*([r[c] for r in rows] for c in ("spacing_m", k, f"{k}_sigma"))) for k in keys}
    assert fits["depth_m_at_depth"].value == pytest.approx(200e3)
    convergence.draw_convergence(rows, fits, tmp_path / "c.png", rows[0])
    assert (tmp_path / "c.png").read_bytes()[:4] == b"\x89PNG"
