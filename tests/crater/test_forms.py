"""Peak, pit, terraces, one-sided rims, and the mass of what flies."""

from __future__ import annotations

import numpy as np
import pytest

from crater.ejecta import launch
from crater.ground import datum
from crater.measures import blanket, forms
from crater.measures.measure import measure
from crater.scaling import crater_size
from fixtures import synthetic_craters as synthetic
from matter.errors import InputError
from matter.geometry import frame
from matter.particles import Particles


def test_terraces_are_benches_between_walls():
    s = np.arange(0.0, 60.0, 0.5)
    slope = np.where((s > 20) & (s < 50), 35.0, 0.0)
    slope[(s > 28) & (s < 32)] = 3.0
    slope[(s > 38) & (s < 42)] = 0.0
    h = np.concatenate([[0.0], np.cumsum(np.tan(np.radians(slope[:-1])) * 0.5)])
    assert forms.terraces(s, h, np.ones(len(s)), 20.0, 50.0) == 2
    smooth = np.where(s > 20, (s - 20) * 0.7, 0.0)
    assert forms.terraces(s, smooth, np.ones(len(s)), 20.0, 50.0) == 0


def test_a_pit_needs_a_ridge():
    x = np.linspace(0.0, 1.0, 30)
    pit = np.where(x < 0.3, -1.5 + 2.0 * x, np.where(x < 0.4, -0.9, -1.0))
    depth, prominence = forms.central_pit(pit)
    assert depth == pytest.approx(0.6, abs=0.02) and prominence == pytest.approx(0.1, abs=0.02)
    assert forms.central_pit(x**2) == (0.0, 0.0)


def test_a_rim_that_is_higher_on_one_side():
    """The rim of a bowl raised by cos(azimuth): the first harmonic is found with its azimuth."""
    rng = np.random.default_rng(3)
    base = synthetic.bowl(1000.0, 0.2, 0.06)
    shape = synthetic.Shape(base, 1000.0, 3300.0)
    spacing = 80.0
    box = synthetic.fill(rng, spacing, (-3300, -3300, -750), (3300, 3300, 400), "jitter")
    s, azimuth = np.hypot(box[:, 0], box[:, 1]), np.arctan2(box[:, 1], box[:, 0])
    lift = 0.5 * np.cos(azimuth - np.pi / 2) * np.maximum(base(s), 0.0)
    found = measure(Particles(synthetic.as_fields(box[box[:, 2] < base(s) + lift], spacing)), frame.Plane())
    assert found["rim_asymmetry"].value == pytest.approx(0.5, abs=0.15)
    assert "azimuth" in found["rim_asymmetry"].reason
    towards = float(found["rim_asymmetry"].reason.split("azimuth ")[1].split(" ")[0])
    assert towards == pytest.approx(90.0, abs=25.0)
    assert shape.rim_height > 0


def test_mass_above_a_speed_counts_what_flies():
    rng = np.random.default_rng(1)
    ground = synthetic.fill(rng, 1.0, (-8, -8, -5), (8, 8, 0), "jitter")
    thrown = rng.uniform((-8, -8, 3), (8, 8, 60), size=(200, 3))
    fields = synthetic.as_fields(np.vstack([ground, thrown]), 1.0)
    velocity = np.zeros((len(ground) + 200, 3))
    velocity[len(ground) :, 2] = np.repeat([1.0, 10.0], 100)
    curve = blanket.mass_above(Particles({**fields, "velocity": velocity}), datum.plane(), 100.0)
    mass = np.interp([0.5, 5.0, 50.0], curve["speed_m_s"], curve["mass_kg"])
    assert mass == pytest.approx([200e3, 100e3, 0.0])


def test_ejected_mass_joins_launch_speed_and_place():
    """At the speed with which matter leaves x, M(>v) is k rho x^3."""
    event = crater_size.ImpactEvent(0.1, 5000.0, 0.3, 1.0, 2700.0, 1600.0)
    k, c1, mu, nu = 0.3, 0.55, 0.41, 0.4
    x = 0.7
    v = event.speed * np.cos(0.3) * c1 * ((x / event.radius) * (1600.0 / 2700.0) ** nu) ** (-1.0 / mu)
    assert crater_size.ejected_mass(event, v, k, c1, mu, nu) == pytest.approx(k * 1600.0 * x**3, rel=1e-12)


def sand_ejecta(mu: float, c1: float, height: float):
    """An event, a radius, and flat ground in two snapshots: particles at rest, then on their parabolas when each is
    1.1 times as high as ``height``."""
    event = crater_size.ImpactEvent(0.01, 2000.0, 0.0, 10.0, 900.0, 1500.0)
    radius, gravity, rng = 0.2, 10.0, np.random.default_rng(3)
    x, azimuth, slope = rng.uniform(0.013, 0.17, 4000), rng.uniform(0.0, 2.0 * np.pi, 4000), np.radians(47.0)
    v = crater_size.launch_speed(event, x, radius, c1, mu)
    rise, out = v * np.sin(slope), v * np.cos(slope)
    time = (rise - np.sqrt(np.maximum(rise**2 - 2.2 * gravity * height, 0.0))) / gravity
    reach = x + out * time
    place = np.column_stack([reach * np.cos(azimuth), reach * np.sin(azimuth), rise * time - 0.5 * gravity * time**2])
    speed = np.column_stack([out * np.cos(azimuth), out * np.sin(azimuth), rise - gravity * time])
    frames = []
    for moved in (0.0, 1.0):
        content = {
            "position": np.where(moved, place, [1.0, 1.0, -0.1]), "velocity": moved * speed, "mass": np.full(4000,
            1e-3), "layer": np.zeros(4000, np.int32),
        }  # fmt: skip
        frames.append(Particles(content, {"frame": "plane"}))
    return event, radius, gravity, frames


@pytest.mark.parametrize(("mu", "c1"), [(0.41, 0.55), (0.5, 1.0)])
def test_launches_are_led_back_to_the_ground(mu, c1):
    event, radius, gravity, frames = sand_ejecta(mu, c1, 1e-3)
    thrown = launch.launched(frames, gravity, 1e-3)
    assert np.degrees(thrown.angle) == pytest.approx(47.0, abs=1e-6)
    assert thrown.speed == pytest.approx(crater_size.launch_speed(event, thrown.distance, radius, c1, mu), rel=1e-6)
    fit = launch.fit(thrown, event, radius)
    assert fit.mu == pytest.approx(mu, rel=0.01) and fit.c1 == pytest.approx(c1, rel=0.03)
    assert fit.mu_sigma < 0.02 * mu


def test_launches_need_flat_ground_and_ejecta():
    _, _, gravity, frames = sand_ejecta(0.41, 0.55, 1e-3)
    with pytest.raises(InputError, match="nothing of the target flies"):
        launch.launched(frames[:1], gravity, 1e-3)
    frames[0].attributes["frame"] = "sphere"
    with pytest.raises(InputError, match="flat ground"):
        launch.launched(frames, gravity, 1e-3)
