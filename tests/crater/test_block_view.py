"""The block inside the page: its bytes are the height map and the origins that were put in, and a browser draws it."""

from __future__ import annotations

import base64
import json
import re

import numpy as np
import pytest

from crater.measures.measure import measure
from crater.pages import block_view, report
from crater.results.findings import Findings, GrainFindings, LastCrater
from crater.results.rest import Rest
from fixtures import synthetic_craters as synthetic
from matter.geometry import frame
from matter.particles import Particles
from tests import pages
from tests.crater import browser

SPACING = {"plane": 80.0, "sphere": 30e3}
LIFT = {"plane": 300.0, "sphere": 100e3}
AROUND = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


@pytest.fixture(scope="module", params=["plane", pytest.param("sphere", marks=pytest.mark.validation)])
def bowl(request):
    """A bowl, its measures, and its block: matter came up by ``LIFT``; what lies uprange is of unknown origin."""
    kind, rng = request.param, np.random.default_rng(5)
    if kind == "plane":
        shape = synthetic.Shape(synthetic.bowl(1000.0), 1000.0, 2500.0)
        position, datum = (
            synthetic.cloud_on_plane(shape, SPACING[kind], rng, "lattice", centre=(120.0, -80.0)),
            "plane",
        )
        places = position - np.array([0.0, 0.0, LIFT[kind]])
    else:
        shape = synthetic.Shape(synthetic.bowl(300e3), 300e3, 750e3, 2142e3)
        position, datum = synthetic.cloud_on_sphere(shape, SPACING[kind], rng, "jitter"), frame.Sphere(2142e3)
        places = position * (1.0 - LIFT[kind] / np.linalg.norm(position, axis=1))[:, None]
    particles = Particles(synthetic.as_fields(position, SPACING[kind]))
    measures = measure(particles, datum)
    places[measures.ground.datum.local(position)[:, 0] < -2.0 * SPACING[kind]] = np.nan
    return kind, shape, measures, block_view.data(measures, particles, places)


def heights(content):
    """The height map [m] (rows along y, columns along x) as the viewer decodes it; NaN where nothing was measured."""
    height, counts = content["height"], np.frombuffer(base64.b64decode(content["height"]["counts"]), dtype="<u2")
    decoded = np.where(counts == block_view.NO_HEIGHT, np.nan, height["low"] + counts * height["step"])
    return decoded.reshape(content["grid"], content["grid"])


def test_the_bytes_are_the_height_map(bowl):
    kind, _, measures, content = bowl
    found = heights(content)
    x = np.linspace(-content["half"], content["half"], content["grid"])
    distance = np.hypot(*np.meshgrid(x, x))
    here = distance < 0.9 * content["half"]
    assert np.isfinite(found[here]).all()
    middle = found[content["grid"] // 2, content["grid"] // 2]
    assert middle == pytest.approx(-measures["depth_m"].value, abs=0.5 * SPACING[kind])
    ring = measures.profile  # the mean height at a distance is the profile's
    for r, h in zip(ring.radius[2:-3], ring.height[2:-3]):
        if r < 0.9 * content["half"] and np.isfinite(h):
            near = np.abs(distance - r) < 0.25 * SPACING[kind]
            assert found[near].mean() == pytest.approx(h, abs=0.25 * SPACING[kind])


def test_every_cell_of_the_section_has_the_origin_of_what_lies_there(bowl):
    kind, shape, measures, content = bowl
    section = content["section"]
    cells = np.frombuffer(base64.b64decode(section["cells"]), np.uint8).reshape(section["down"], section["along"])
    u = (np.arange(section["along"]) + 0.5) / section["along"] * 2.0 * content["half"] - content["half"]
    h = section["low"] + (np.arange(section["down"]) + 0.5) / section["down"] * (section["high"] - section["low"])
    u, h = np.meshgrid(u, h)
    inner = np.abs(u) < 0.8 * content["half"]
    known = inner & (u > 0.0) & (cells < 254)
    origin = cells / 253.0 * content["deepest"]
    expected = np.minimum(-h + LIFT[kind], content["deepest"])
    assert known.sum() > 2000 and np.abs(origin - expected)[known].max() < SPACING[kind]
    assert not (cells[inner & (u > 3 * SPACING[kind])] == block_view.UNKNOWN).any()
    left = cells[inner & (u < -4 * SPACING[kind])]
    assert set(left) == {block_view.UNKNOWN, block_view.EMPTY}
    above = inner & (np.abs(u) < 0.3 * shape.rim) & (h > -0.5 * measures["depth_m"].value)
    assert (cells[above] == block_view.EMPTY).all()  # air over the hollow


def _page(bowl, tmp_path):
    file = tmp_path / "block.html"
    file.write_text(pages.document("Block", [block_view.html(bowl[3])]))
    return file


def test_a_browser_draws_it(bowl, tmp_path):
    seen = browser.dom(_page(bowl, tmp_path), tmp_path, *browser.SOFTWARE)
    figure = re.search(r"<figure [^>]*id=\"block\"[^>]*>", seen).group()
    if "hidden" in figure and "no WebGL" in seen:
        pytest.skip("this Chromium has no WebGL")
    drawn = int(re.search(r'data-vertices="(\d+)"', figure).group(1))
    assert "hidden" not in figure and 60_000 < drawn < 300_000
    assert int(re.search(r'data-pixels="(\d+)"', figure).group(1)) > 20_000  # of the canvas that are not background
    assert "depth of origin 0" in seen


def test_without_webgl_nothing_of_it_shows(bowl, tmp_path):
    seen = browser.dom(_page(bowl, tmp_path), tmp_path, "--disable-3d-apis", "--disable-gpu")
    assert "hidden" in re.search(r"<figure [^>]*id=\"block\"[^>]*>", seen).group()


def test_it_needs_no_network_and_stays_small(bowl):
    text = block_view.html(bowl[3])
    assert "://" not in text and len(text) < 120_000
    facts = json.loads(re.search(r"id=block-data>(.*?)</script>", text, re.S).group(1))
    np.testing.assert_array_equal(heights(facts), heights(bowl[3]))


@pytest.mark.parametrize(
    ("rest", "words"),
    [
        (Rest(True), "The final crater"),
        (Rest(False, "still growing", "depth grows"), "The crater in the last snapshot, still growing"),
        (Rest(False, "still moving", "depth falls"), "The crater in the last snapshot, still moving"),
    ],
)
def test_a_crater_that_moves_is_not_called_final(bowl, rest, words):
    last = LastCrater(bowl[2], 60.0, "grains", None, rest)
    found = Findings(setting=None, shock=None, grains=GrainFindings((), last, None, {}))
    assert report._last(found) == words
    assert words in block_view.html(bowl[3], report._last(found))


def test_a_pore_between_coarse_grains_is_no_hole_of_the_face(bowl):
    """Four fine grains lie in a gap between coarse ones; a cavity wider than these stays a hole."""
    kind, shape, measures, _ = bowl
    if kind == "sphere":
        pytest.skip("the same rule")
    rng, spacing = np.random.default_rng(7), SPACING["plane"]
    position = synthetic.cloud_on_plane(shape, spacing, rng, "lattice", centre=(120.0, -80.0))
    middle = measures.ground.datum.outside(np.array([[0.0, 0.0, -700.0], [1200.0, 0.0, -500.0]]))
    away = np.linalg.norm(position[:, None] - middle[None], axis=2)
    gaps = (0.9 * spacing, 4.0 * spacing)
    position = position[(away > gaps).all(axis=1)]
    size, fine = np.full(len(position), 0.5 * spacing), 0.2 * spacing
    side = measures.ground.datum.outside(np.array([[x, 0.0, -700.0 + z] for x, z in 0.8 * spacing * AROUND]))
    particles = Particles(
        {
            "position": np.concatenate([position, side]),
            "radius": np.concatenate([size, np.full(len(side), 0.5 * fine)]),
        }
    )
    content = block_view.data(measures, particles, None)
    section = content["section"]
    cells = np.frombuffer(base64.b64decode(section["cells"]), np.uint8).reshape(section["down"], section["along"])
    u = (np.arange(section["along"]) + 0.5) / section["along"] * 2.0 * content["half"] - content["half"]
    h = section["low"] + (np.arange(section["down"]) + 0.5) / section["down"] * (section["high"] - section["low"])
    from_gap = [np.hypot(u[None, :] - x, h[:, None] - z) for x, z in ((0.0, -700.0), (1200.0, -500.0))]
    assert not (cells[from_gap[0] < gaps[0]] == block_view.EMPTY).any()
    assert (cells[from_gap[1] < gaps[1] - 1.1 * spacing] == block_view.EMPTY).all()
