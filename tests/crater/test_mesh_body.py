"""A body given as a file of triangles through the crater stage: an ellipsoid as a mesh has the map and the measures of
the ellipsoid that is given by its axes."""

from __future__ import annotations

import json
import math

import h5py
import numpy as np
import pytest
import trimesh

from crater import stage
from crater.settings import Settings
from fixtures import grain_bodies as bodies
from matter.case.body import Target
from matter.files import snapshot
from matter.points import packing

AXES = (120.0, 110.0, 90.0)
SPACING = 5.0
IMPACT = {"speed": "6 km/s", "angle_from_vertical": "20 deg", "expected_transient_diameter": "40 m",
          "projectile": {"material": "aluminum", "radius": "0.4 m"}}  # fmt: skip
SITE = {"latitude": "20 deg", "longitude": "130 deg", "azimuth": "60 deg"}


def a_mesh(folder) -> Target:
    """The ellipsoid as triangles in kilometres, not about its centre; its volume is 0.2 % below the ellipsoid's."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    vertices = 0.5e-3 * ball.vertices * AXES + [0.3, -0.2, 0.1]
    trimesh.Trimesh(vertices, ball.faces, process=False).export(folder / "body.ply")
    given = {"shape": "mesh", "file": str(folder / "body.ply"), "file_unit": "1 km", "layers": [{"name": "rock",
             "material": "basalt"}], **SITE}  # fmt: skip
    return Target.model_validate(given)


def a_run(folder, target: Target) -> dict:
    """``measures.json`` of grains in the ellipsoid, the same ones for either body: a bed, and the same with a bowl and
    a body that moved on."""
    placed = bodies.target(AXES, 20.0, 130.0, azimuth=SITE["azimuth"]).placed
    assert target.placed.height == pytest.approx(placed.height, rel=3e-3)
    assert target.placed.turn == pytest.approx(placed.turn, abs=0.02)
    x = packing.hexagonal(SPACING, 75.0)
    x = x + 0.1 * SPACING * np.random.default_rng(1).standard_normal(x.shape)
    own = x @ placed.turn
    outside = np.sum((2.0 * own / AXES) ** 2, axis=1)
    bed = bodies.even(x[outside < 1.0], SPACING**3)
    middle = np.array([0.0, 0.0, placed.height]) + 14.0 * placed.normal
    last = bed.select(np.linalg.norm(bed.position - middle, axis=1) > 26.0)  # 12 m deep, 44 m wide
    last["position"] = last.position + [3.0, -40.0, 5.0]
    last.attributes["time"], last.attributes["stage"] = 600.0, "dem"
    for name in ("2_sph", "3_bed", "5_dem", "6_crater"):
        (folder / name).mkdir(parents=True)
    facts = {
        "frame": "solid", "surface_gravity_m_s2": 2e-5, "angular_velocity_1_s": [0.0, 0.0, 1e-4],
        "mass_kg": bodies.DENSITY * math.pi / 6.0 * math.prod(AXES), "volume_m3": math.pi / 6.0 * math.prod(AXES),
    }  # fmt: skip
    (folder / "2_sph" / "target.json").write_text(json.dumps(facts))
    snapshot.write(bed, folder / "3_bed" / "bed.vtkhdf")
    snapshot.write(last, folder / "5_dem" / "last.vtkhdf")
    stage.run(Settings(target=target, impact=IMPACT), folder, folder / "6_crater")
    return json.loads((folder / "6_crater" / "measures.json").read_text())


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mesh")
    target = bodies.target(AXES, 20.0, 130.0, azimuth=SITE["azimuth"])
    return {
        name: (folder / name, a_run(folder / name, given))
        for name, given in (("ellipsoid", target), ("mesh", a_mesh(folder)))
    }


@pytest.mark.validation
def test_a_mesh_has_the_measures_of_the_ellipsoid(both):
    """To a tenth of a spacing in lengths, some 0.5 % of the volume, and in the errors that both state."""
    one, two = (both[name][1]["body"]["dem"] for name in ("ellipsoid", "mesh"))
    assert one["class"] == two["class"]
    for name, first in one["measures"].items():
        cells = ("before", "after", "change") if "before" in first else (None,)
        for cell in cells:
            a, b = (row["measures"][name] if cell is None else row["measures"][name][cell] for row in (one, two))
            assert (a["value"] is None) == (b["value"] is None), (name, cell, a, b)
            if a["value"] is None:
                continue
            size = {"m": 0.1 * SPACING, "m^3": 5e-3 * math.pi / 6.0 * math.prod(AXES)}.get(a["unit"], 0.0)
            if name.startswith("axis_ratio"):
                size = 0.1 * SPACING / min(AXES)
            limit = max(size, 0.5 * (a["sigma"] or 0.0), 5e-3 * abs(a["value"]))
            assert a["value"] == pytest.approx(b["value"], abs=limit), (name, cell, a, b)
    assert one["measures"]["body_volume_m3"]["before"]["value"] == pytest.approx(math.pi / 6.0 * math.prod(AXES), 1e-3)


@pytest.mark.validation
def test_a_mesh_has_the_crater_of_the_ellipsoid(both):
    one, two = (both[name][1]["final"] for name in ("ellipsoid", "mesh"))
    for name in ("diameter_apparent_m", "depth_m", "volume_m3"):
        assert one[name]["value"] == pytest.approx(two[name]["value"], rel=0.03), name


@pytest.mark.validation
def test_the_map_is_the_same_place_by_place(both):
    """Heights, normals, latitudes and longitudes of either map at the places of the other."""
    from scipy.spatial import cKDTree

    maps = {}
    for name, (folder, _) in both.items():
        with h5py.File(folder / "6_crater" / "height_map.vtkhdf") as file:
            maps[name] = {key: file[f"surface/{key}"][:] for key in file["surface"]}
    one, two = maps["ellipsoid"], maps["mesh"]
    # about the centre of mass, wherever the file's zero lies
    assert np.average(two["place"], axis=0, weights=two["area"]) == pytest.approx([0.0] * 3, abs=0.02 * SPACING)
    assert np.sum((2.0 * two["place"] / AXES) ** 2, axis=1) == pytest.approx(1.0, abs=5e-3)
    away, near = cKDTree(one["place"]).query(two["place"])
    close = away < 0.1 * SPACING
    assert close.sum() > 100
    here = near[close]
    for name in ("height_before", "height_change"):
        apart = np.abs(two[name][close] - one[name][here])
        assert np.sqrt(np.mean(apart**2)) < 0.05 * SPACING and np.abs(apart).max() < 0.5 * SPACING, name
    assert np.einsum("ij,ij->i", two["normal"][close], one["normal"][here]).min() > math.cos(math.radians(3.0))
    site = np.argmin(two["height_change"])
    assert two["latitude"][site] == pytest.approx(20.0, abs=15.0)
    assert two["longitude"][site] == pytest.approx(130.0, abs=15.0)
    assert one["area"].sum() == pytest.approx(two["area"].sum(), rel=5e-3)
    grid = np.degrees(np.arcsin(two["place"][:, 2] / np.linalg.norm(two["place"], axis=1)))
    assert two["latitude"] == pytest.approx(grid)
