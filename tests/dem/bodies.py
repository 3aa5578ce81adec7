"""A small ``target.json`` for tests: a layered body in hydrostatic balance, made here so that no other stage is
needed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from matter.blocks import block_file, placing
from matter.case.body import Target

G = 6.6743e-11


def write_callisto(path: Path) -> None:
    """Basalt to 1803 km, water to 1947 km, ice to 2102 km, with the densities of the relaxed body (g = 1.284 m/s^2 at
    the surface)."""
    layers = [
        ("core", "basalt", 0.0, 1802.752e3),
        ("ocean", "water", 1802.752e3, 1946.92e3),
        ("shell", "ice", 1946.92e3, 2101.811e3),
    ]
    density = {
        0: lambda p: 2700.0 * (1 + p / 26.7e9),
        1: lambda p: 998.0 + (1108.9 - 998.0) * (p / 4.06e8) ** 0.9,
        2: lambda p: 917.0 * (1 + p / 9.6e9),
    }
    write_layered(path, layers, density, core_density=3006.0)


def write_layered(path: Path, layers, density, core_density: float) -> None:
    """Integrate dP/dr = -rho g downwards through the layers; the mass below the surface follows by iteration."""
    radius = layers[-1][3]
    edges = np.unique(np.concatenate([np.linspace(lo, hi, 150) for _, _, lo, hi in layers]))
    middle = 0.5 * (edges[1:] + edges[:-1])
    which = np.array([next(k for k, layer in enumerate(layers) if m <= layer[3]) for m in middle])
    rho = np.where(which == 0, core_density, 1000.0)
    for _ in range(50):
        shell = 4.0 / 3.0 * np.pi * rho * np.diff(edges**3)
        mass = np.concatenate([[0.0], np.cumsum(shell)])
        inside = 0.5 * (mass[1:] + mass[:-1])
        g = G * inside / middle**2
        weight = rho * g * np.diff(edges)
        pressure = np.cumsum(weight[::-1])[::-1] - 0.5 * weight
        rho = np.array([core_density if which[k] == 0 else density[which[k]](pressure[k]) for k in range(len(middle))])
    content = {
        "centre": [0, 0, 0],
        "radius_m": radius,
        "mass_kg": float(mass[-1]),
        "surface_gravity_m_s2": float(G * mass[-1] / radius**2),
        "layers": [
            {
                "name": n,
                "material": m,
                "inner_radius_m": lo,
                "outer_radius_m": hi,
                "mass_kg": float(shell[which == k].sum()),
            }
            for k, (n, m, lo, hi) in enumerate(layers)
        ],
        "profile": {
            "radius_m": [*middle.tolist(), radius],
            "density_kg_m3": [*rho.tolist(), float(rho[-1])],
            "pressure_Pa": [*pressure.tolist(), 0.0],
            "gravity_m_s2": [*g.tolist(), float(G * mass[-1] / radius**2)],
            "layer": [*which.tolist(), len(layers) - 1],
        },
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))


def write_blocks(path: Path, target: Target, density: float, unresolved: Sequence[int] = ()) -> None:
    """Write the blocks of ``target`` beside its ``target.json`` (``path``), which then names their hash. The
    ``unresolved`` ones have no particles of their own."""
    found = placing.of_target(target)
    if found is None:
        return
    resolved = np.ones(len(found.volume), dtype=int)
    resolved[list(unresolved)] = 0
    blocks = block_file.particles(target, found, density, resolved)
    block_file.write(blocks, path.parent)
    path.write_text(json.dumps(json.loads(path.read_text()) | {block_file.DIGEST: block_file.digest(blocks)}))
