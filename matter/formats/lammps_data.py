"""Data files that LIGGGHTS and LAMMPS read with ``read_data`` (``atom_style sphere``, ``units si``): grains with
position, size, mass, velocity and spin.

``Atoms`` lines are ``id type diameter density x y z``, ``Velocities`` lines ``id vx vy vz wx wy wz`` (both programs:
``atom_vec_sphere.cpp``). Numbers carry 17 digits; the mass is what the program makes of density and diameter, pi / 6
d^3 rho, so that it comes back to a rounding or two. Types are the grains' species (contact parameters), or their
materials where they carry none; the first line names them. A data file holds no contact history.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from matter.errors import InputError
from matter.files import archive
from matter.particles import Particles

_MARGIN = 0.01
_LONGEST = 240  # LIGGGHTS reads lines into 256 characters


def write(particles: Particles, path: Path) -> None:
    """Write grains; identities are counted from 1 where they are not unique and positive. Raises ``InputError``
    without position, mass and radius."""
    particles.need("position", "mass", "radius")
    if len(particles) == 0:
        raise InputError("there are no particles to write")
    if np.any(particles.mass <= 0.0) or np.any(particles.radius <= 0.0):
        raise InputError(
            "grains without a mass or a radius cannot be written: a diameter of zero would make them points of "
            "another kind"
        )
    kind, names = types(particles)
    who = identities(particles)
    density = particles.mass / (4.0 / 3.0 * np.pi * particles.radius**3)
    low, high = box(particles)
    still = np.zeros((len(particles), 3))
    velocity = particles.velocity if "velocity" in particles else still
    spin = particles.angular_velocity if "angular_velocity" in particles else still
    with archive.replacing(Path(path)) as temporary, open(temporary, "w") as file:
        listed = ", ".join(f"{k + 1} {name}" for k, name in enumerate(names))
        title = f"bolide grains, SI; time {particles.attributes.get('time', 0.0)!r} s; types: {listed}"
        file.write(f"{title if len(title) < _LONGEST else title[: _LONGEST - 4] + ' ...'}\n\n")
        file.write(f"{len(particles)} atoms\n{max(len(names), int(kind.max()))} atom types\n\n")
        for axis in range(3):
            file.write(f"{low[axis]:.17g} {high[axis]:.17g} {'xyz'[axis]}lo {'xyz'[axis]}hi\n")
        file.write("\nAtoms\n\n")
        np.savetxt(
            file,
            np.column_stack([who, kind, 2.0 * particles.radius, density, particles.position]),
            fmt=["%d", "%d"] + ["%.17g"] * 5,
        )
        file.write("\nVelocities\n\n")
        np.savetxt(file, np.column_stack([who, velocity, spin]), fmt=["%d"] + ["%.17g"] * 6)


def identities(particles: Particles) -> np.ndarray:
    """Whole numbers from 1: the grains' own identities, one higher, where those are unique and not negative (identity
    0 is no atom), else counted."""
    own = particles.identity if "identity" in particles else np.arange(len(particles))
    if len(np.unique(own)) < len(own) or own.min() < 0 or own.max() >= 2**31 - 1:
        own = np.arange(len(particles))
    return own + 1


def types(particles: Particles) -> tuple[np.ndarray, list[str]]:
    """Type of each grain, from 1, and the names of the types."""
    field = "species" if "species" in particles else "material"
    number = particles[field] if field in particles else np.zeros(len(particles), dtype=np.int32)
    if number.min() < 0:
        raise InputError(f"the field {field!r} holds negative numbers: no type can be made of them")
    named = particles.attributes.get({"species": "species", "material": "materials"}[field], [])
    names = [str(name) for name in named] or [f"{field}_{k}" for k in range(int(number.max()) + 1)]
    return number.astype(np.int64) + 1, names


def box(particles: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Corners (3,) of a box that holds every sphere, with a margin of 1 % and a radius."""
    reach = particles.radius[:, None] if "radius" in particles else 0.0
    low, high = (particles.position - reach).min(axis=0), (particles.position + reach).max(axis=0)
    margin = _MARGIN * (high - low) + float(np.max(reach))
    return low - margin, high + margin
