"""The body without projectile, as ``2_sph/target.json`` describes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dem.contact.gravity import Field
from matter.errors import InputError
from matter.files import archive

_LAYER_KEYS = ("name", "material", "inner_radius_m", "outer_radius_m")
_PROFILE_KEYS = ("radius_m", "density_kg_m3", "pressure_Pa", "gravity_m_s2", "layer")


@dataclass(frozen=True)
class LayeredBody:
    """Layers from the centre outwards and the hydrostatic profile; SI."""

    radius: float
    names: tuple[str, ...]
    materials: tuple[str, ...]
    inner: np.ndarray
    outer: np.ndarray
    profile: dict[str, np.ndarray]
    solid_densities: tuple[float | None, ...]
    """Of each layer's solid at rest [kg/m^3], where the case gave its material another than its file."""

    @staticmethod
    def read(path: Path) -> LayeredBody:
        """Read ``target.json``; ``InputError`` says what is missing in it."""
        if not path.is_file():
            raise InputError(f"no {path.name} at {path.parent}: the shock stage writes it; run that stage first")
        content: dict[str, Any] = archive.read_json(path)
        if content.get("frame") == "plane":
            raise InputError(f"{path} describes flat ground: beds of grains are made for spherical targets only")
        missing = [k for k in ("radius_m", "layers", "profile") if k not in content]
        missing += [f"profile.{k}" for k in _PROFILE_KEYS if k not in content.get("profile", {})]
        missing += [f"layers.{k}" for k in _LAYER_KEYS if any(k not in layer for layer in content.get("layers", []))]
        if missing:
            raise InputError(f"{path} lacks {', '.join(missing)}")
        layers = content["layers"]
        profile = {key: np.asarray(content["profile"][key], dtype=float) for key in _PROFILE_KEYS}
        if not (np.diff(profile["radius_m"]) >= 0.0).all():
            raise InputError(f"{path}: profile.radius_m must run from the centre to the surface")
        if not profile["pressure_Pa"].any():  # it started as published, without stress; its grains have weight
            profile["pressure_Pa"] = _hydrostatic(profile)
        return LayeredBody(
            float(content["radius_m"]),
            tuple(layer["name"] for layer in layers),
            tuple(layer["material"] for layer in layers),
            np.array([layer["inner_radius_m"] for layer in layers], dtype=float),
            np.array([layer["outer_radius_m"] for layer in layers], dtype=float),
            profile,
            tuple(layer.get("reference_density_kg_m3") for layer in layers),
        )

    @property
    def surface_gravity(self) -> float:
        """g [m/s^2] at the surface."""
        return float(np.interp(self.radius, self.profile["radius_m"], self.profile["gravity_m_s2"]))

    def gravity(self) -> Field:
        """Central gravity of the body."""
        return Field.of_target({key: list(values) for key, values in self.profile.items()})

    def layer_of(self, radius: np.ndarray) -> np.ndarray:
        """Layer index at a distance from the centre; above the surface the outermost layer."""
        return np.minimum(np.searchsorted(self.outer, radius, side="left"), len(self.outer) - 1)

    def density(self, radius: np.ndarray) -> np.ndarray:
        """Bulk density [kg/m^3] at a distance from the centre, interpolated within the layer; above the surface that
        of the surface."""
        radius = np.asarray(radius, dtype=float)
        layer = self.layer_of(radius)
        rho = np.empty(radius.shape)
        for k in np.unique(layer):
            here = self.profile["layer"].astype(int) == k
            if not here.any():
                raise InputError(f"target.json: the profile holds no point of layer {self.names[k]!r}")
            rho[layer == k] = np.interp(
                radius[layer == k], self.profile["radius_m"][here], self.profile["density_kg_m3"][here]
            )
        return rho

    def pressure(self, radius: np.ndarray) -> np.ndarray:
        """Hydrostatic pressure [Pa]; zero above the surface."""
        return np.interp(radius, self.profile["radius_m"], self.profile["pressure_Pa"], right=0.0)

    def mass_between(self, inner: float, outer: float, solid_angle: float = 4.0 * np.pi) -> float:
        """Mass [kg] of a shell sector of the profile (midpoint rule, layer by layer)."""
        total = 0.0
        for lo, hi in zip(self.inner, self.outer):
            a, b = max(lo, inner), min(hi, outer)
            if b > a:
                edges = np.linspace(a, b, 4001)
                middle = 0.5 * (edges[1:] + edges[:-1])
                total += float(np.sum(self.density(middle) * np.diff(edges**3) / 3.0))
        return total * solid_angle


def _hydrostatic(profile: dict[str, np.ndarray]) -> np.ndarray:
    """Pressure [Pa] at the points of a profile: integral of rho g from there to the surface (trapezoids)."""
    weight = profile["density_kg_m3"] * profile["gravity_m_s2"]
    steps = 0.5 * (weight[1:] + weight[:-1]) * np.diff(profile["radius_m"])
    return np.concatenate([np.cumsum(steps[::-1])[::-1], [0.0]])
