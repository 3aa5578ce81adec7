"""Beds and clouds that several tests share, made once."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fixtures import clouds
from fixtures.clouds import ARC_FLAT, DEPTH
from handoff.source import hydrostatic
from handoff.transfer import carve
from matter.files import snapshot


@pytest.fixture(scope="session")
def flat_bed():
    return clouds.flat_bed(1.0, ARC_FLAT, DEPTH, 5.0)


@pytest.fixture(scope="session")
def ground():
    """Gravity so strong that nothing below 200 m/s counts as ejecta."""
    return hydrostatic.uniform(5e3, 1000.0, 30.0)


@pytest.fixture(scope="session")
def sphere_cloud():
    return clouds.sphere_cloud(fine=80e3)


@pytest.fixture(scope="session")
def sphere_bed():
    return clouds.sphere_bed(grain=42e3)


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory, sphere_cloud, sphere_bed) -> Path:
    """A run folder with a growing and collapsing crater on a layered body: four source snapshots, target, bed."""
    run = tmp_path_factory.mktemp("run")
    for name in ("2_sph", "3_bed", "4_handoff"):
        (run / name).mkdir()
    (run / "2_sph" / "target.json").write_text(json.dumps(clouds.target_table()))
    snapshot.write(sphere_bed, run / "3_bed" / "bed.vtkhdf")
    for number, (time, size) in enumerate(((60.0, 0.75), (120.0, 0.9), (180.0, 1.0), (240.0, 0.97))):
        source = clouds.sphere_source(
            sphere_cloud,
            500e3 * size,
            200e3 * size,
            50e3 * size,
            time,
            lambda p, s=size: clouds.excavation(p, 500e3, 80.0 * (1.0 - 0.6 * s)),
        )
        snapshot.write(source, run / "2_sph" / f"snap_{number:04d}.vtkhdf")
    return run


@pytest.fixture(scope="module")
def fewer_points():
    """An eighth of the usual points: what is asked for here does not depend on their number."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(carve, "_LEAST_POWER", 16)
        yield
