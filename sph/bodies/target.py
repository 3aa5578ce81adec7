"""The layered target as particles, uniform or in hydrostatic balance (its projectile: ``sph.bodies.projectile``).

Layer masses are those of the uniform layers (density rho0 of each material, pores taken off). A relaxed body keeps
them: the one-dimensional profile

    dP/dr = -rho g,   g = G m(r) / r^2,   P = P_cold(rho)        (cold curve of the layer's equation of state, u = 0)

is solved on shells of fixed mass, and the particles are stretched radially to it, r -> r(m). A porous layer starts at
rho0 / alpha0, and where the pressure closes pores it is set up with them closed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from matter.case import at_rest
from matter.case.body import Target
from matter.compilation.jit import kernel
from matter.constants import G
from matter.errors import InputError
from matter.points import packing
from matter.points.regions import Cut, Shell
from sph.bodies import symmetry as symmetries
from sph.materials.rows import Materials, collect
from sph.porosity import dispatch as porosity


class Profile(NamedTuple):
    """The body against radius, on shells of fixed mass from the centre: all arrays (n,), SI.

    ``uniform_radius`` is the outer radius of a shell at uniform density, ``radius`` in balance; density and pressure
    hold at ``middle``, gravity and the enclosed ``mass`` at ``radius``; ``layer`` counts from the centre;
    ``distention`` is that at rest.
    """

    uniform_radius: np.ndarray
    radius: np.ndarray
    middle: np.ndarray
    density: np.ndarray
    pressure: np.ndarray
    gravity: np.ndarray
    mass: np.ndarray
    layer: np.ndarray
    distention: np.ndarray


@kernel
def loaded(P, material, rows, rho, distention):
    """Density and resting distention of cold shells under the pressure P."""
    for i in range(len(P)):
        m = material[i]
        rho[i], distention[i] = porosity.at_pressure(
            rows.porosity[m], rows.pores[m], rows.crush[m], rows.crush_row[m], rows.eos[m], rows.eos_row[m], P[i]
        )


def hydrostatic(target: Target, shells: int = 4000, materials: Materials | None = None) -> Profile:
    """The one-dimensional profile of the target, relaxed or (``start = "literal"``) uniform with P = 0; ``materials``
    as published by default.

    Raises ``InputError`` when the balance does not converge (a body too massive for its materials).
    """
    outer = np.array(target.outer_radii)
    inner = np.concatenate([[0.0], outer[:-1]])
    pieces = [np.linspace(a, b, max(10, round(shells * (b - a) / outer[-1])) + 1)[1:] for a, b in zip(inner, outer)]
    edges = np.concatenate([[0.0], *pieces])
    middle = 0.5 * (edges[1:] + edges[:-1])
    layer = np.searchsorted(outer, middle)
    materials = materials or collect(target.materials)
    material = np.array([materials.index(piece.material) for piece in target.layers], dtype=np.int32)[layer]
    rho0, distention = materials.bulk_density[material], materials.rows.alpha0[material]
    dm = rho0 * 4.0 / 3.0 * math.pi * np.diff(edges**3)
    mass = np.cumsum(dm)
    rho, P, r = rho0.copy(), np.zeros_like(rho0), edges[1:].copy()
    converged = target.start == "literal" or not target.attracts or target.solid
    for sweep in range(0 if converged else 400):
        r_new = np.cbrt(np.cumsum(dm / rho) * 3.0 / (4.0 * math.pi))
        # dP = G m dm / (4 pi r^4) per shell, summed from the surface inwards; half a shell to its middle
        inner = np.concatenate([[0.0], r_new[:-1]])
        r_mid = 0.5 * (inner + r_new)
        m_mid = mass - 0.5 * dm
        dP = G * m_mid * dm / (4.0 * math.pi * np.maximum(r_mid, 1e-9 * outer[-1]) ** 4)
        P = np.cumsum(dP[::-1])[::-1] - 0.5 * dP
        loaded(P, material, materials.rows, rho, distention)
        if not (rho > 0.0).all():
            break
        change = float(np.abs(r_new - r).max() / outer[-1])
        r = r_new
        if sweep > 0 and change < 1e-12:  # the first sweep still sees uniform density
            converged = True
            break
    if not converged:
        raise InputError("no hydrostatic equilibrium exists for this target: it is too massive for its materials")
    middle = 0.5 * (np.concatenate([[0.0], r[:-1]]) + r)
    return Profile(
        edges[1:], r, middle, rho, P, (G if target.attracts else 0.0) * mass / r**2, mass, layer, distention
    )


def target_json(target: Target, profile: Profile, materials: Materials) -> dict:
    """The content of ``target.json``: the body in balance against radius. A layer's ``reference_density_kg_m3`` is
    there where the case gives the solid another than the material's file: springs of grains go by its sound speed."""
    inner = np.concatenate([[0.0], profile.radius])
    layers = []
    for l, piece in enumerate(target.layers):
        shells = np.flatnonzero(profile.layer == l)
        layers.append(
            {
                "name": piece.name,
                "material": piece.material,
                "inner_radius_m": float(inner[shells[0]]),
                "outer_radius_m": float(profile.radius[shells[-1]]),
                "mass_kg": float(np.diff(np.concatenate([[0.0], profile.mass]))[shells].sum()),
            }
        )
        solid = materials.at_rest[piece.material].solid
        if solid != at_rest.of_file(piece.material).solid:
            layers[-1]["reference_density_kg_m3"] = solid
    edges = np.flatnonzero(np.diff(profile.layer))
    pick = np.unique(np.concatenate([np.linspace(0, len(profile.radius) - 1, 400).astype(int), edges, edges + 1]))
    gravity_mid = np.interp(
        profile.middle, np.concatenate([[0.0], profile.radius]), np.concatenate([[0.0], profile.gravity])
    )
    return {
        "centre": [0.0, 0.0, 0.0],
        "start": target.start,
        "radius_m": float(profile.radius[-1]),
        "mass_kg": float(profile.mass[-1]),
        "surface_gravity_m_s2": float(profile.gravity[-1]),
        "layers": layers,
        "profile": {
            "radius_m": profile.middle[pick].tolist(),
            "density_kg_m3": profile.density[pick].tolist(),
            "pressure_Pa": profile.pressure[pick].tolist(),
            "gravity_m_s2": gravity_mid[pick].tolist(),
            "layer": profile.layer[pick].tolist(),
        },
    }


def spacing_law(target: Target, zones: Zones):
    """Spacing [m] against position, as ``Zones`` says: a function of points (n, 3)."""
    pole = np.array(target.impact_point)

    return lambda points: zones.spacing(np.linalg.norm(points - pole, axis=1))


class Zones(NamedTuple):
    """Particle spacing against the distance d from the impact point, all [m] but ``growth`` (spacing per distance) and
    ``support``.

    ``contact`` for d < ``contact_radius``, growing to ``fine``, which holds to ``fine_radius``, then growing to
    ``coarse``. ``support`` : h over the spacing.
    """

    contact: float
    contact_radius: float
    fine: float
    fine_radius: float
    coarse: float
    growth: float
    support: float = 2.0

    @property
    def uniform(self) -> bool:
        return self.contact >= self.coarse

    def spacing(self, distance: np.ndarray) -> np.ndarray:
        """Spacing [m] at distances from the impact point (n,) [m]."""
        inner = np.clip(self.contact + self.growth * (distance - self.contact_radius), self.contact, self.fine)
        return np.clip(inner + self.growth * np.maximum(distance - self.fine_radius, 0.0), self.contact, self.coarse)


class Body(NamedTuple):
    """Particles of the target or the projectile: position (n, 3), mass, density, h (n,), layer (n,) int (-1
    projectile), material index, distention (density of the matrix over that of the particle; 1 is solid), and the
    block (n,) that each belongs to (-1: none)."""

    position: np.ndarray
    mass: np.ndarray
    density: np.ndarray
    h: np.ndarray
    layer: np.ndarray
    material: np.ndarray
    distention: np.ndarray | float = 1.0
    block: np.ndarray | int = -1


def build(
    target: Target, profile: Profile, materials: Materials, zones: Zones, seed: int, symmetry: str = "none"
) -> Body:
    """The target's particles: a graded glass, layer by layer, or (one spacing everywhere) a uniform hexagonal lattice.

    Masses of every layer are those of ``profile``; positions are stretched to it. With a ``symmetry`` only its part.
    """
    mirrors, parts = symmetries.MIRRORS[symmetry], symmetries.copies(symmetry)
    radii = (0.0, *target.outer_radii)
    points, volumes, layers, supports = [], [], [], []
    if zones.uniform:
        fine = zones.contact
        lattice = symmetries.folded(packing.hexagonal(fine, target.radius), symmetry, 0.35 * fine)
        layer = np.searchsorted(np.array(radii[1:]), np.linalg.norm(lattice, axis=1))
        points, volumes, layers = [lattice], [np.full(len(lattice), fine**3)], [layer]
        supports = [np.full(len(lattice), zones.support * fine)]
    else:
        spacing, pole = spacing_law(target, zones), np.array(target.impact_point)
        streams = np.random.SeedSequence(seed).spawn(len(target.layers))
        for l in range(len(target.layers)):
            shell = Shell(radii[l], radii[l + 1])
            part = Cut(shell, mirrors) if mirrors else shell
            stream = np.random.default_rng(streams[l])
            least = float(zones.spacing(np.array([target.radius - radii[l + 1]]))[0])
            centres, volume = packing.graded(spacing, part, stream, grown_from=(pole, least))
            points.append(centres)
            volumes.append(volume)
            layers.append(np.full(len(centres), l))
            supports.append(zones.support * spacing(centres))
    position, volume = np.concatenate(points), np.concatenate(volumes)
    layer_of, h = np.concatenate(layers), np.concatenate(supports)
    mass = np.empty(len(position))
    density0 = np.array([materials.bulk_density[materials.index(piece.material)] for piece in target.layers])
    for l in range(len(target.layers)):
        mine = layer_of == l
        if not mine.any():
            raise InputError(
                f"layer {target.layers[l].name!r} holds no particle: the spacing is too coarse for its thickness"
            )
        wanted = density0[l] * 4.0 / 3.0 * math.pi * (radii[l + 1] ** 3 - radii[l] ** 3) / parts
        mass[mine] = density0[l] * volume[mine]
        mass[mine] *= wanted / mass[mine].sum()
    r = np.linalg.norm(position, axis=1)
    stretched = np.interp(r, np.concatenate([[0.0], profile.uniform_radius]), np.concatenate([[0.0], profile.radius]))
    position = position * (stretched / r)[:, None]
    density, distention = np.empty(len(position)), np.empty(len(position))
    for l in range(len(target.layers)):  # layer by layer: density jumps at interfaces
        mine, shells = layer_of == l, profile.layer == l
        density[mine] = np.interp(stretched[mine], profile.middle[shells], profile.density[shells])
        distention[mine] = np.interp(stretched[mine], profile.middle[shells], profile.distention[shells])
    material = np.array([materials.index(piece.material) for piece in target.layers])[layer_of]
    return Body(position, mass, density, h, layer_of.astype(np.int32), material.astype(np.int32), distention)
