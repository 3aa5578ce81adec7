"""Flat ground without projectile, as ``2_sph/target.json`` (frame ``plane``) describes it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem.beds.layered_body import LayeredBody
from dem.contact.gravity import Field
from matter.errors import InputError
from matter.files import archive

_LAYER_KEYS = ("name", "material", "bottom_m", "top_m")
_PROFILE_KEYS = ("height_m", "density_kg_m3", "pressure_Pa", "layer")


def is_flat(path: Path) -> bool:
    """Whether a ``target.json`` describes flat ground (False when it cannot be read: its reader says why)."""
    try:
        return bool(json.loads(path.read_text()).get("frame") == "plane")
    except (OSError, ValueError, AttributeError):
        return False


@dataclass(frozen=True)
class FlatGround:
    """Layers from the bottom up, heights [m] above the undisturbed surface z = 0, uniform gravity ``g`` [m/s^2]
    towards -z."""

    depth: float
    g: float
    shape: str
    half_width: float
    names: tuple[str, ...]
    materials: tuple[str, ...]
    tops: np.ndarray
    profile: dict[str, np.ndarray]

    @staticmethod
    def read(path: Path) -> FlatGround:
        """Read ``target.json``; ``InputError`` says what is missing in it, or that the ground has no weight."""
        content = archive.read_json(path)
        missing = [
            k for k in ("depth_m", "half_width_m", "surface_gravity_m_s2", "layers", "profile") if k not in content
        ]
        missing += [f"profile.{k}" for k in _PROFILE_KEYS if k not in content.get("profile", {})]
        missing += [f"layers.{k}" for k in _LAYER_KEYS if any(k not in layer for layer in content.get("layers", []))]
        if missing:
            raise InputError(f"{path} lacks {', '.join(missing)}")
        g = float(content["surface_gravity_m_s2"])
        if not g > 0.0:
            raise InputError(f"{path}: without gravity no bed of grains settles; set [target] gravity")
        profile = {key: np.asarray(content["profile"][key], dtype=float) for key in _PROFILE_KEYS}
        if not profile[
            "pressure_Pa"
        ].any():  # start = "literal": the shock stage begins without the weight, the grains lie under it
            profile["pressure_Pa"] = weight(profile["height_m"], profile["density_kg_m3"], g)
        return FlatGround(
            float(content["depth_m"]),
            g,
            str(content.get("shape", "half_space")),
            float(content["half_width_m"]),
            tuple(layer["name"] for layer in content["layers"]),
            tuple(layer["material"] for layer in content["layers"]),
            np.array([layer["top_m"] for layer in content["layers"]], dtype=float),
            profile,
        )

    @property
    def surface_gravity(self) -> float:
        """g [m/s^2]."""
        return self.g

    def gravity(self) -> Field:
        """Uniform gravity."""
        return Field.constant((0.0, 0.0, -self.g))

    def layer_of(self, height: np.ndarray) -> np.ndarray:
        """Layer index at a height; above the surface the uppermost layer."""
        return np.minimum(np.searchsorted(self.tops, height, side="left"), len(self.tops) - 1)

    def density(self, height: np.ndarray) -> np.ndarray:
        """Bulk density [kg/m^3] at a height, interpolated within the layer; beyond the profile that of its nearest
        point."""
        height = np.asarray(height, dtype=float)
        layer, rho = self.layer_of(height), np.empty(np.shape(height))
        for k in np.unique(layer):
            here = self.profile["layer"].astype(int) == k
            if not here.any():
                raise InputError(f"target.json: the profile holds no point of layer {self.names[k]!r}")
            rho[layer == k] = np.interp(
                height[layer == k], self.profile["height_m"][here], self.profile["density_kg_m3"][here]
            )
        return rho

    def pressure(self, height: np.ndarray) -> np.ndarray:
        """Weight of the ground above [Pa]; zero above the surface."""
        heights = np.append(self.profile["height_m"], 0.0)
        return np.interp(height, heights, np.append(self.profile["pressure_Pa"], 0.0), right=0.0)


def ground_of(path: Path) -> LayeredBody | FlatGround:
    """What a ``target.json`` describes: a body of layers or flat ground."""
    return FlatGround.read(path) if is_flat(path) else LayeredBody.read(path)


def weight(height: np.ndarray, density: np.ndarray, g: float) -> np.ndarray:
    """g times the integral of the density [kg/m^3] from each ``height`` [m], ascending, to the surface z = 0: the
    pressure [Pa] of ground in balance."""
    steps = np.diff(np.append(height, 0.0)) * 0.5 * (density + np.append(density[1:], density[-1]))
    return np.asarray(g * np.cumsum(steps[::-1])[::-1])
