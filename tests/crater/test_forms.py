"""Peak, pit, terraces, one-sided rims, and the mass of what flies."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from crater import datum, ejecta, forms, scaling
from crater.measure import measure
from matter import frame
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
    curve = ejecta.mass_above(Particles({**fields, "velocity": velocity}), datum.plane(), 100.0)
    mass = np.interp([0.5, 5.0, 50.0], curve["speed_m_s"], curve["mass_kg"])
    assert mass == pytest.approx([200e3, 100e3, 0.0])


def test_ejected_mass_joins_launch_speed_and_place():
    """At the speed with which matter leaves x, M(>v) is k rho x^3."""
    strike = scaling.Strike(0.1, 5000.0, 0.3, 1.0, 2700.0, 1600.0)
    k, c1, mu, nu = 0.3, 0.55, 0.41, 0.4
    x = 0.7
    v = strike.speed * np.cos(0.3) * c1 * ((x / strike.radius) * (1600.0 / 2700.0) ** nu) ** (-1.0 / mu)
    assert scaling.ejected_mass(strike, v, k, c1, mu, nu) == pytest.approx(k * 1600.0 * x**3, rel=1e-12)
