"""Whether imported particles can be what they claim to be: values that no particle can have are refused, with the
first particle that has one."""

from __future__ import annotations

import difflib

import numpy as np

from matter.case import material
from matter.errors import InputError
from matter.formats.words import listed, short
from matter.particles import FIELDS, UNDEFINED, Particles

_ROUNDING = 1e-6
# field -> smallest value, whether that value itself is allowed, largest value
_RANGES = {
    "mass": (0.0, False, np.inf),
    "density": (0.0, False, np.inf),
    "radius": (0.0, False, np.inf),
    "smoothing_length": (0.0, False, np.inf),
    "damage": (-_ROUNDING, True, 1.0 + _ROUNDING),
    "distention": (1.0 - _ROUNDING, True, np.inf),
    "material": (0.0, True, np.inf),
}


def check(particles: Particles) -> None:
    """Raise ``InputError`` for values that are not finite, masses, densities, radii and lengths that are not above
    zero, damage outside 0 to 1, distention below 1, and material numbers without a name where there are names."""
    for name in particles:
        values = np.asarray(particles[name], dtype=float).reshape(len(particles), -1)
        wrong = not_finite(name, values)
        if wrong.any():
            raise InputError(
                f"field {name!r} has {int(np.count_nonzero(wrong))} values that are not "
                f"finite{_first(np.any(wrong, axis=1), values)}"
            )
        if name in _RANGES:
            least, itself, most = _RANGES[name]
            bad = ((values < least) | (values > most) | ((values == least) & (not itself))).any(axis=1)
            if bad.any():
                words = (
                    f"above {least:g}"
                    if not itself
                    else f"at least {round(least, 3) + 0.0:g}"
                    + (f" and at most {round(most, 3):g}" if np.isfinite(most) else "")
                )
                unit = "" if FIELDS[name].unit == "1" else f" {FIELDS[name].unit}"
                raise InputError(
                    f"field {name!r} must be {words}{unit}: {int(bad.sum())} of {len(particles)} particles are "
                    f"not{_first(bad, values)}"
                )
    names = particles.attributes.get("materials")
    if names and "material" in particles and (largest := int(np.max(particles["material"], initial=0))) >= len(names):
        raise InputError(
            f"material number {largest} has no name: there are {len(names)} ({listed(names)}), counted from 0"
        )


def not_finite(name: str, values: np.ndarray) -> np.ndarray:
    """Which of a field's values are not finite and should be: NaN may stand where there is nothing to say
    (``UNDEFINED``)."""
    return np.isinf(values) if name in UNDEFINED else ~np.isfinite(values)


def _first(bad: np.ndarray, values: np.ndarray) -> str:
    index = int(np.argmax(bad))
    return f" (the first is particle {index + 1}: {', '.join(f'{value:g}' for value in values[index])})"


def named(particles: Particles, names: list[str]) -> None:
    """Give the material numbers of particles their ``names``. Particles without numbers are all of the one material;
    several raise ``InputError``."""
    if "material" not in particles:
        if len(names) != 1:
            raise InputError(
                f"--materials names {len(names)} materials ({listed(names)}), and the file has no column of "
                f"material numbers: give one name for all"
            )
        particles["material"] = np.zeros(len(particles), dtype=np.int32)
    particles.attributes["materials"] = names


def unknown_materials(particles: Particles) -> list[str]:
    """A sentence for each material name without a file: the stages will ask for it."""
    sentences = []
    for name in particles.attributes.get("materials", []):
        if name not in material.names():
            near = difflib.get_close_matches(name, material.names(), n=1)
            sentences.append(
                f"material {short(name)} is not one of this project's{f'; did you mean {near[0]!r}?' if near else ''}"
            )
    return sentences
