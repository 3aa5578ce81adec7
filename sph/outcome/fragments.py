"""Fragments of a broken body: groups of whole particles that hang together (``matter.geometry.connected``).

python -m sph.outcome.fragments SNAPSHOT [--json]
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from matter.errors import InputError
from matter.files import archive, snapshot
from matter.geometry import connected
from matter.particles import Particles
from matter.wording import readable


class Fragment(NamedTuple):
    """Mass [kg], number of particles, centre [m] and velocity [m/s]."""

    mass: float
    particles: int
    centre: tuple[float, float, float]
    velocity: tuple[float, float, float]


def find(particles: Particles) -> list[Fragment]:
    """Fragments of the target, the largest first; broken particles are dust and belong to none. Needs position,
    velocity, mass, damage, support_radius."""
    particles.need("position", "velocity", "mass", "damage", "support_radius")
    among = particles.layer >= 0 if "layer" in particles else np.ones(len(particles), dtype=bool)
    group = connected.groups(particles, among)
    whole = group != connected.NONE
    if not whole.any():
        return []
    x, v, m, group = particles.position[whole], particles.velocity[whole], particles.mass[whole], group[whole]
    count = int(group.max()) + 1
    mass, number = np.bincount(group, m, count), np.bincount(group, minlength=count)
    centre = np.stack([np.bincount(group, m * x[:, a], count) / mass for a in range(3)], axis=1)
    speed = np.stack([np.bincount(group, m * v[:, a], count) / mass for a in range(3)], axis=1)
    order = np.argsort(-mass, kind="stable")
    return [
        Fragment(float(mass[k]), int(number[k]), tuple(map(float, centre[k])), tuple(map(float, speed[k])))  # type: ignore[arg-type]
        for k in order
    ]


def largest_fraction(particles: Particles) -> float:
    """Mass of the largest fragment over that of the target."""
    target = particles.mass[particles.layer >= 0].sum() if "layer" in particles else particles.mass.sum()
    found = find(particles)
    return found[0].mass / float(target) if found else 0.0


def outcome_lines(folder: Path) -> list[str]:
    """What the shock stage in ``folder`` leaves of a body, in words: mass that its own pull holds (what does not
    escape, ``sph.outcome.escaping``) and pieces that hang together. Nothing of flat ground and of a stage from
    elsewhere."""
    last, report = folder / "last.vtkhdf", folder / "stage_report.json"
    if not last.is_file() or not report.is_file():
        return []
    particles = snapshot.read(last)
    if particles.attributes.get("frame", "sphere") == "plane" or "layer" not in particles:
        return []
    clock, words = readable.clock(float(particles.attributes["time"])), []
    body = float(particles.mass[particles.layer >= 0].sum())
    if leaves := archive.read_json(report).get("escaping"):
        lost = float(leaves["mass_kg"])
        words.append(f"{1.0 - lost / body:.1%} of the body's mass stay bound, {readable.amount(lost, 'kg', 3)} escape")
    found = find(particles)
    largest = found[0].mass / body if found else 0.0
    words.append(
        f"{len(found)} pieces hang together, the largest with {largest:.1%} of it" if found else "nothing is whole"
    )
    return [readable.terminal(f"the body after {clock}: {'; '.join(words)}")]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m sph.outcome.fragments", description="Fragments of a snapshot of the shock stage."
    )
    parser.add_argument("snapshot", type=Path)
    parser.add_argument("--json", action="store_true", help="one object")
    options = parser.parse_args(arguments)
    try:
        particles = snapshot.read(options.snapshot)
        found, fraction = find(particles), largest_fraction(particles)
    except InputError as reason:
        print(f"{parser.prog}: {reason}", file=sys.stderr)
        return reason.exit_code
    if options.json:
        print(json.dumps({"largest_over_target": fraction, "fragments": [piece._asdict() for piece in found[:100]]}))
        return 0
    print(f"largest fragment {fraction:.4f} of the target; {len(found)} fragments")
    for piece in found[:10]:
        print(f"{piece.mass:12.4g} kg {piece.particles:8d} particles  {np.linalg.norm(piece.velocity):8.3g} m/s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
