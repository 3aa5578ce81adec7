"""The friction angle of a bed of grains, measured: steady shear, or a bed that is tilted until it flows; and contact
parameters for a wanted angle.

``shear``  slow simple shear of a periodic cell at constant normal stress (``dem.trials.steady_shear``)
``tilt``   a deep bed on a rough base, turned until it flows and back until it rests (``dem.trials.tilted_bed``)

Each gives two angles:

``mohr_coulomb_deg``  sin phi = (s1 - s3) / (s1 + s3) of the principal stresses in the plane of the flow: what
                      compression tests of sand give, and what ``friction_angle`` means, here as in
                      ``drucker_prager`` of the shock stage;
``angle_deg``         tan phi = tau / sigma_n on the plane of shear: what slopes of these grains follow. It is the
                      smaller one: were the axes of stress those of the rate of strain, its tangent would be the sine
                      of the other (Davis 1968).

Both use the contact laws of the stage with k_n = ``CELL_STIFFNESS`` P d. An angle is kept under a hash of everything
that it depends on, in ``friction_angle/`` beside the compiled kernels.

Command: ``python -m dem.trials.friction_angle [--case CASE] [--friction MU] [--shape BETA] [--method shear|tilt]
[--inertial I] [--find "30 deg"]``.

Sources: Davis 1968, in Soil Mechanics: Selected Topics, ch. 6; GDR MiDi 2004, Eur. Phys. J. E 14, 341 (both flows, I);
Peyneau & Roux 2008, Phys. Rev. E 78, 011307 (frictionless spheres: 5.76 deg).
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dem.contact.rest_springs import REST_FRACTION
from dem.contact.settings import Contact
from dem.trials import angle_of_friction
from dem.trials.shear_cell import CELL_STIFFNESS
from dem.trials.steady_shear import shear
from dem.trials.tilted_bed import tilt
from matter.compilation import jit
from matter.errors import InputError, Unsound
from matter.files import archive, toml_input

Method = Literal["shear", "tilt"]


# -- kept results


def _sources() -> list[str]:
    """What of the code an angle depends on: the contact laws, the cell, and how it is sheared or tilted."""
    here = Path(__file__).resolve()
    # comments and lay-out do not matter
    trees = [ast.dump(ast.parse(path.read_text())) for path in sorted(here.parent.glob("*.py"))]
    return [
        jit.source_key(here.parent.parent / "contact" / "contact.py"),
        hashlib.sha256("".join(trees).encode()).hexdigest(),
    ]


def _cache_path(contact: Contact, method: str, options: dict[str, Any]) -> Path:
    law = contact.model_dump(include={"shell"})
    text = json.dumps([law, method, options, _sources()], sort_keys=True)
    return jit.cache_root().parent / "friction_angle" / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.json"


def measure(contact: Contact, method: Method = "shear", **options: Any) -> dict[str, float]:
    """The angle of the solid grains (``contact.shell``) by ``shear`` or ``tilt``, taken from the kept results when it
    was measured before."""
    path = _cache_path(contact, method, options)
    if path.is_file():
        return json.loads(path.read_text())
    result = shear(contact, **options) if method == "shear" else tilt(contact, **options)
    path.parent.mkdir(parents=True, exist_ok=True)
    archive.write_json(path, result)
    return result


FLOWING = 0.02
"""Inertial number of ``loose_fraction``: ten times as fast as for an angle, and as loose within 0.002."""


def loose_stiffness(contact: Contact) -> float:
    """Springs k_n / (P d) as stiff as those of a bed halfway down (``dem.contact.rest_springs``): with
    ``CELL_STIFFNESS`` grains overlap by 0.7 % of a diameter, which makes the cell denser by 0.015 to 0.02."""
    return max(CELL_STIFFNESS, contact.stiffness_factor / (REST_FRACTION * contact.static_overlap))


def loose(contact: Contact, seed: int = 1) -> dict[str, float]:
    """Steady shear in springs of ``loose_stiffness``."""
    return measure(contact, "shear", seed=seed, inertial=FLOWING, stiffness=loose_stiffness(contact))


def loose_fraction(contact: Contact) -> float:
    """Solid fraction that steady shear of the solid grains settles at, the critical state of soil mechanics: as
    measured once for the grains of the shipped cases, else measured now."""
    known = angle_of_friction.loose_fraction(contact.shell.friction, loose_stiffness(contact))
    return loose(contact)["fraction"] if known is None or not _as_measured(contact) else known


def with_friction(contact: Contact, friction: float) -> Contact:
    """The same law with another friction mu_s of the solid grains."""
    return contact.model_copy(update={"shell": contact.shell.model_copy(update={"friction": round(friction, 4)})})


TRIAL = (0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0)
"""Frictions that are tried, from the middle outwards, until two enclose the wanted angle."""


def friction_for(angle_deg: float, contact: Contact, seeds: Sequence[int] = (1, 2)) -> tuple[float, float, float]:
    """mu_s at which the solid grains of ``contact`` have this Mohr-Coulomb angle: (mu_s, angle by the fitted line, its
    standard error [deg]).

    mu_s and not beta, because the angle goes on rising with mu_s while it saturates in beta. The two neighbouring
    trials that enclose the angle are measured with all ``seeds``; the line through their means gives mu_s. Raises
    ``InputError`` with the reachable range when no trial reaches the angle.
    """

    def look(friction: float, seed: int) -> dict[str, float]:
        return measure(with_friction(contact, friction), "shear", seed=seed)

    k = len(TRIAL) // 2
    angles = {k: look(TRIAL[k], seeds[0])["mohr_coulomb_deg"]}
    step = 1 if angles[k] < angle_deg else -1
    while (angles[k] < angle_deg) == (step > 0):
        k += step
        if not 0 <= k < len(TRIAL):
            have, edge = angles[k - step], "most" if step > 0 else "least"
            raise InputError(
                f"a friction angle of {angle_deg:.3g} deg cannot be reached with shape = {contact.shell.shape:g} "
                f"({edge}: {have:.3g} deg)"
            )
        angles[k] = look(TRIAL[k], seeds[0])["mohr_coulomb_deg"]
    ends = sorted((TRIAL[k], TRIAL[k - step]))
    known = [[look(end, seed) for seed in seeds] for end in ends]
    low, high = (float(np.mean([one["mohr_coulomb_deg"] for one in row])) for row in known)
    errors = [math.sqrt(sum(one["mohr_coulomb_error_deg"] ** 2 for one in row)) / len(row) for row in known]
    part = min(1.0, max(0.0, (angle_deg - low) / (high - low))) if high > low else 0.5
    return (
        round(ends[0] + part * (ends[1] - ends[0]), 4),
        low + part * (high - low),
        math.hypot((1.0 - part) * errors[0], part * errors[1]),
    )


def resolved(contact: Contact) -> Contact:
    """The settings with the friction that gives ``friction_angle``, when that is set: by the measured points for the
    default law, by a search for any other, which takes minutes the first time and is kept."""
    if contact.friction_angle is None:
        return contact
    angle = math.degrees(contact.friction_angle)
    friction = angle_of_friction.friction(angle) if _as_measured(contact) else None
    if friction is None:
        friction, _, _ = friction_for(angle, contact)
    return with_friction(contact, friction).model_copy(update={"friction_angle": None})


def _as_measured(contact: Contact) -> bool:
    """Whether the law is the default one, but for friction and cohesion, which the cell leaves out."""
    shell = {"restitution", "restitution_tangential", "shape", "rolling", "twisting"}
    return contact.shell.model_dump(include=shell) == Contact().shell.model_dump(include=shell)


# -- the command


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m dem.trials.friction_angle", description="The friction angle of grains, measured."
    )
    parser.add_argument("--case", type=Path, help="a case file: its [dem.contact] is taken")
    parser.add_argument("--friction", type=float, help="mu_s instead of the case's")
    parser.add_argument("--shape", type=float, help="beta instead of the case's")
    parser.add_argument("--method", choices=("shear", "tilt"), default="shear")
    parser.add_argument("--inertial", type=float, metavar="I", help="inertial number of the shear; default: slow")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--find", metavar="ANGLE", help='the friction that gives this angle, "30 deg" for example')
    options = parser.parse_args(arguments)
    try:
        contact = _contact_of(options)
        if options.find:
            friction, angle, error = friction_for(_degrees(options.find), contact)
            print(
                f"friction = {friction:.4g}  gives {angle:.2f} +- {error:.2f} deg with shape {contact.shell.shape:g}"
            )
            return 0
        result = measure(contact, options.method, seed=options.seed, **_rate_of(options))
    except (InputError, Unsound) as reason:
        print(f"{parser.prog}: {reason}", file=sys.stderr)
        return reason.exit_code
    print(
        f"friction {contact.shell.friction:g}, shape {contact.shell.shape:g}: {result['mohr_coulomb_deg']:.2f} +- "
        f"{result['mohr_coulomb_error_deg']:.2f} deg "
        f"(Mohr-Coulomb); slopes of {result['angle_deg']:.2f} +- {result['error_deg']:.2f} deg"
    )
    print("\n".join(f"{name:18s}{value:10.4g}" for name, value in result.items()))
    return 0


def _rate_of(options: argparse.Namespace) -> dict[str, float]:
    if options.inertial is None:
        return {}
    if options.method != "shear" or not 1e-4 <= options.inertial <= 10.0:
        raise InputError(f"--inertial {options.inertial:g}: 0.0001 to 10, with --method shear")
    return {"inertial": options.inertial}


def _degrees(text: str) -> float:
    from matter.case.quantity import parse

    try:
        return math.degrees(parse(text, "rad"))
    except ValueError as reason:
        raise InputError(f"--find: {reason}") from None


def _contact_of(options: argparse.Namespace) -> Contact:
    contact = Contact()
    if options.case:
        path = options.case / "case.toml" if options.case.is_dir() else options.case
        try:
            table = toml_input.loads(path.read_text())
            contact = Contact.model_validate(table.get("dem", {}).get("contact", {}))
        except (OSError, ValueError) as reason:  # pydantic and the reader of TOML raise ValueErrors
            raise InputError(f"{path}: {reason}") from None
    changes = {
        name: value for name, value in (("friction", options.friction), ("shape", options.shape)) if value is not None
    }
    try:
        shell = type(contact.shell).model_validate({**contact.shell.model_dump(), **changes})
    except ValueError as reason:
        raise InputError(str(reason)) from None
    return contact.model_copy(update={"shell": shell})


if __name__ == "__main__":
    sys.exit(main())
