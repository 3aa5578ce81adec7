"""Random synthetic craters for the error bars: every family, body, sampling and disturbance drawn from one seed. Shares no code with crater/."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import synthetic

BODIES = (None, 1085e3, 2142e3, 2410e3)
FAMILIES = ("bowl", "exponential", "rounded", "complex")
KINDS = ("lattice", "jitter", "random")


@dataclass(frozen=True)
class Trial:
    """One drawn cloud: ``position`` [m], ``spacing`` [m], the true ``shape``, and ``facts`` that say what was drawn."""

    position: np.ndarray
    spacing: float
    shape: synthetic.Shape
    body: float | None
    datum: str
    """What is known: ``given`` (all), ``centre`` or ``radius`` of the sphere, ``free`` (nothing: fitted to the far field)."""
    facts: dict[str, object]

    @property
    def truth(self) -> dict[str, float]:
        """The known answers, by the names of ``measures.json``."""
        s = self.shape
        return {
            "diameter_rim_m": 2 * s.rim_found,
            "diameter_apparent_m": 2 * s.apparent,
            "depth_m": s.depth,
            "rim_height_m": s.rim_height,
            "volume_m3": s.volume,
        }


def random_profile(family: str, rng):
    """Height function of a rim radius of one, proportions drawn."""
    u = rng.uniform
    if family == "bowl":
        return synthetic.bowl(1.0, u(0.15, 0.3), u(0.03, 0.06), u(2.5, 3.5), u(1.7, 2.5))
    if family == "exponential":
        return synthetic.exponential(1.0, u(0.15, 0.3), u(0.03, 0.06), u(0.25, 0.5))
    if family == "rounded":
        return synthetic.rounded(1.0, u(0.12, 0.25), u(0.03, 0.07), u(0.2, 0.35))
    return synthetic.complex_crater(1.0, u(0.08, 0.15), u(0.03, 0.05), u(0.4, 0.6), u(0.0, 0.4))


def draw(seed: int, across: tuple[float, float] = (5.0, 40.0), kinds=KINDS) -> Trial:
    """The trial of a seed: ``across`` bounds the particles per rim radius (log-uniform)."""
    rng = np.random.default_rng(seed)
    family, body = FAMILIES[rng.integers(4)], BODIES[rng.integers(4)]
    kind = kinds[rng.integers(len(kinds))]
    per_radius = float(np.exp(rng.uniform(*np.log(across))))
    rim = 1.0 if body is None else rng.uniform(100e3, 300e3)
    spacing = rim / per_radius
    unit = random_profile(family, rng)
    shape = synthetic.Shape(lambda s: rim * unit(np.asarray(s) / rim), rim, 3.6 * rim, body)
    stretch = float(rng.uniform(1.05, 1.3)) if rng.random() < 0.25 else 1.0
    ejecta = 0.05 if rng.random() < 0.5 else 0.0
    noise = float(rng.uniform(0.05, 0.2)) if rng.random() < 0.3 else 0.0
    tilt = float(rng.uniform(0.0, 0.03))
    known = ("given", "free")[int(rng.random() < 0.7)] if body is None else ("given", "centre", "radius", "free")[rng.integers(4)]
    away = rng.uniform(-0.25, 0.25, 2) * rim
    if body is None:
        tilt = tilt if known == "free" else 0.0
        position = synthetic.cloud_on_plane(shape, spacing, rng, kind, centre=away, tilt=tilt, stretch=stretch, ejecta=ejecta, noise=noise)
    else:
        position = synthetic.cloud_on_sphere(shape, spacing, rng, kind, ejecta=ejecta, stretch=stretch)
        position = synthetic.turned(position, away / body) + rng.normal(scale=max(noise, 1e-12) * spacing, size=position.shape)
    facts = dict(
        seed=seed, family=family, body_km=0 if body is None else body / 1e3, kind=kind, per_radius=per_radius, stretch=stretch,
        ejecta=ejecta, noise=noise, tilt=tilt, datum=known, particles=len(position),
    )  # fmt: skip
    return Trial(position, spacing, shape, body, known, facts)
