"""The rule that picks the time, on made-up series; and the diagnosis of made-up clouds."""

from types import SimpleNamespace

import numpy as np
import pytest

from fixtures import clouds
from handoff import ledger
from handoff.domains import domain
from handoff.ledger_rows import shock_rows
from handoff.source import cavity, cloud_surface, handoff_time, hydrostatic
from handoff.source.handoff_time import Diagnosis, choose, first_maximum
from handoff.transfer import transfer
from matter.errors import InputError
from matter.particles import Particles

G = 1.24


def series(depth, drive, excess, radius=400e3, step=60.0, volume=1e17):
    return [
        Diagnosis(
            f"snap_{k:04d}",
            k * step,
            radius if d > 0 else 0.0,
            d,
            volume * d / max(depth),
            0.0,
            e,
            e,
            1e25,
            1e24,
            0.0,
            0.0,
            a,
        )
        for k, (d, a, e) in enumerate(zip(depth, drive, excess))
    ]


DEPTH = [0, 100e3, 160e3, 220e3, 250e3, 260e3, 255e3, 230e3, 150e3]


def test_first_maximum_ignores_small_dips_and_later_peaks():
    assert first_maximum([0, 1, 3, 2.9, 3.1, 4, 2, 1, 0.5, 9]) == 5
    assert first_maximum([0, 0, 1, 2, 3]) == 4
    assert first_maximum([5, 4, 3]) == 0


def test_takes_the_first_snapshot_under_gravity_when_the_window_is_empty():
    drive = [np.nan, 8, 3, 0.8, 1.2, 0.6, 0.5, 0.4, 0.4]
    choice = choose(series(DEPTH, drive, [1e-1] * 9), 30e3, G)
    assert choice.index == 5 and choice.deepest == 5  # 180 s is quiet, but 240 s is not
    assert "empty" in choice.reason and "0.6" in choice.reason
    choice = choose(series(DEPTH, [np.nan, 8, 3, 0.9, 0.8, 0.6, 0.5, 0.4, 0.4], [1e-1] * 9), 30e3, G)
    assert choice.index == 3 and choice.window[0] > choice.window[1]


def test_never_later_than_the_first_maximum_of_depth():
    choice = choose(series(DEPTH, [np.nan] + [5.0] * 8, [1e-1] * 9), 30e3, G)
    assert choice.index == 5 and "driven up to" in choice.reason


def test_takes_the_first_snapshot_of_the_window_where_there_is_one():
    """A small body: the shock has left long before a tenth of the crater's time."""
    depth = [0, 0.5, 0.8, 1.0, 1.3, 1.6, 1.8, 2.0, 1.9]
    found = series(
        depth,
        [np.nan] + [50.0] * 8,
        [1e-1, 1e-2, 5e-4, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5],
        radius=5.0,
        step=1.0,
        volume=300.0,
    )
    choice = choose(found, 0.3, 1.2e-4)
    assert choice.index == 2 and choice.reason.startswith("window")
    assert choice.window[0] == 2.0 and choice.window[1] == pytest.approx(0.08 * np.sqrt(300.0 ** (1 / 3) / 1.2e-4))
    # the cavity must be resolved by then
    later = [*found[:4], *(row for row in found[4:])]
    assert (
        choose(
            [Diagnosis(**{**row.__dict__, "radius": 1.0 if k < 4 else 5.0}) for k, row in enumerate(later)],
            0.3,
            1.2e-4,
        ).index
        == 4
    )


def test_no_crater_is_a_clear_message():
    with pytest.raises(InputError, match="cavity of 5 grain radii"):
        choose(series(DEPTH, [np.nan] + [0.5] * 8, [0.1] * 9, radius=100e3), 30e3, G)


def test_a_crater_must_be_as_deep_as_the_transfer_asks_for(monkeypatch):
    """The Ryugu shot in grains of 0.33 m: at 2 s wide enough and 0.58 m deep, which the transfer takes for none; 1.01
    m at 4 s will do."""
    seconds, radius, depth = (0.1, 1.1, 2.1, 3.1, 4.0), (0.75, 1.24, 1.72, 1.95, 2.16), (0.3, 0.5, 0.576, 0.65, 1.01)
    found = [
        Diagnosis(f"snap_{k:04d}", t, r, d, d * r**2, 0.0, 1e-5, 1e-5, 1.0, 0.0, 0.0, 0.0, 50.0)
        for k, (t, r, d) in enumerate(zip(seconds, radius, depth))
    ]
    assert choose(found, 0.33, 1.2e-4).index == 4
    with pytest.raises(InputError, match=r"deeper than 2 \(widest 2.16 m, deepest 0.65 m, grains 0.36 m\)"):
        choose([Diagnosis(**{**row.__dict__, "depth": min(row.depth, 0.65)}) for row in found], 0.36, 1.2e-4)
    # one rule: the transfer and the ledger ask for what the choice asks for
    monkeypatch.setattr(cavity, "RESOLVED_DEPTH", 1.7)
    assert choose(found, 0.33, 1.2e-4).index == 2
    assert ledger.LIMITS["cavity_radius_over_r_DEM_min"].limit == cavity.RESOLVED_RADIUS


@pytest.mark.validation
def test_what_is_too_shallow_for_the_choice_is_none_to_the_transfer():
    """A bowl 2.6 grain radii deep is handed over, one of 1.6 is refused."""
    bed = clouds.flat_bed(1.0, 21.0, 10.0, 3.0)
    column = hydrostatic.uniform(1.0, 1000.0, 20.0)
    for depth in (2.6, 1.6):
        source = clouds.flat_source(
            1.6,
            21.0,
            10.0,
            lambda p, depth=depth: np.minimum(depth * ((np.hypot(p[:, 0], p[:, 1]) / 10.0) ** 2 - 1.0), 0.0),
            np.zeros_like,
            disorder=0.02,
        )
        if depth > cavity.RESOLVED_DEPTH:
            assert transfer.hand_over(source, bed, cloud_surface.Rules(), column).carving.size.depth == pytest.approx(
                depth, abs=0.6
            )
            continue
        with pytest.raises(InputError, match="no crater"):
            transfer.hand_over(source, bed, cloud_surface.Rules(), column)


def test_diagnosis_of_a_bowl_and_its_drive(sphere_cloud):
    column = hydrostatic.from_target(clouds.target_table(), clouds.R_BODY)
    region = domain.Cone(clouds.R_CORE, clouds.R_BODY, clouds.R_BODY + clouds.HEADROOM, clouds.ARC / clouds.R_BODY)
    source = clouds.sphere_source(
        sphere_cloud, 500e3, 200e3, 40e3, time=100.0, velocity=lambda p: np.zeros_like(p), curtain=40
    )
    body = source.neighbours > 10
    falling = Particles({name: source[name] for name in source}, {**source.attributes, "time": 110.0})
    up = region.frame.up(source.position)
    falling["velocity"] = source.velocity + np.where(body[:, None], -10.0 * G * up, 0.0)
    found = handoff_time.diagnose(falling, source, "snap_0001", region, column, cloud_surface.Rules())
    assert found.drive == pytest.approx(1.0, rel=0.02)  # free fall: all of the weight is unbalanced
    assert found.depth == pytest.approx(200e3, abs=40e3)  # half a particle spacing
    assert found.radius == pytest.approx(500e3 * np.sqrt(200 / 240), rel=0.12)
    assert found.excess_pressure < 1e-3  # the synthetic body is in balance
    assert found.ejected == pytest.approx(source.mass[~body].sum(), rel=0.1)
    assert np.isnan(handoff_time.diagnose(source, None, "snap_0000", region, column, cloud_surface.Rules()).drive)
    inside = body & (region.depth_inside(source.position) > 0.0)
    assert found.kinetic == pytest.approx(0.5 * np.sum(source.mass[inside]) * (10.0 * G) ** 2, rel=0.02)


def test_files_of_a_stage(tmp_path):
    with pytest.raises(InputError, match="no snapshots"):
        handoff_time.files(tmp_path)
    (tmp_path / "last.vtkhdf").touch()
    assert [path.name for path in handoff_time.files(tmp_path)] == ["last.vtkhdf"]
    for number in (2, 0, 1):
        (tmp_path / f"snap_{number:04d}.vtkhdf").touch()
    assert [path.name for path in handoff_time.files(tmp_path)] == [
        "snap_0000.vtkhdf",
        "snap_0001.vtkhdf",
        "snap_0002.vtkhdf",
    ]


def test_a_window_that_is_empty_waives_the_row_on_the_time_and_no_other_choice_does():
    """A flow that the rule hands over late is not blamed for it; a time that somebody gave, or a window that held one,
    is judged."""
    late = choose(series(DEPTH, [np.nan] + [5.0] * 8, [1e-1] * 9), 30e3, G)
    depth = [0, 0.5, 0.8, 1.0, 1.3, 1.6, 1.8, 2.0, 1.9]
    early = choose(
        series(depth, [np.nan] + [50.0] * 8, [1e-1, 1e-2] + [1e-5] * 7, radius=5.0, step=1.0, volume=300.0),
        0.3,
        1.2e-4,
    )
    assert late.window_is_empty and not early.window_is_empty
    column = hydrostatic.uniform(G, 3000.0, 1e6)
    cavity_now = SimpleNamespace(carving=SimpleNamespace(size=SimpleNamespace(volume=1e17)))
    for choice, verdict in ((late, "waived"), (None, "fail")):
        book = ledger.Ledger()
        shock_rows.time_row(book, cavity_now, 300.0, choice, column)
        (row,) = book.rows
        assert row["verdict"] == verdict and row["value"] == pytest.approx(300.0 / (0.8 * np.sqrt(np.cbrt(1e17) / G)))
