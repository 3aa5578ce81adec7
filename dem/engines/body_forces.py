"""Gravity and the damped layer in the variable syntax that LAMMPS and LIGGGHTS share."""

from __future__ import annotations

import math

import numpy as np

from dem.beds.domain import Domain
from dem.engines.central_gravity import Polynomial
from dem.engines.scene import HOLD_STEPS, Scene


def lines(scene: Scene) -> list[str]:
    """Commands that add gravity and damping to every grain.

    m g(r)/r and the damping rate are held for ``HOLD_STEPS`` steps and then multiply the present place and velocity.
    """
    out = []
    pull = scene.gravity.uniform
    if np.any(pull):
        strength = float(np.linalg.norm(pull))
        out.append(f"fix uniform all gravity {strength:.17g} vector {' '.join(f'{c / strength:.17g}' for c in pull)}")
    damped = scene.domain is not None and scene.domain.damped_width > 0.0
    if scene.gravity.radius == 0.0 and not damped:
        return out
    out.append('variable squared atom "x*x+y*y+z*z"')
    gravity = Polynomial.fit(scene.gravity, scene.lower).formula("v_squared") if scene.gravity.radius > 0.0 else "0.0*x"
    out.append(f'variable pull atom "mass*({gravity})"')
    if damped and scene.domain is not None:
        out += _drag(scene.domain)
    else:
        out.append('variable drag atom "0.0*x"')
    out.append(f"fix held all store/state {HOLD_STEPS} v_pull v_drag")
    out += [f'variable f{c} atom "-f_held[1]*{c}-f_held[2]*v{c}"' for c in "xyz"]
    out.append("fix body all addforce v_fx v_fy v_fz")
    return out


def _drag(domain: Domain) -> list[str]:
    """``drag``: the mass times the rate of ``Domain.drag``."""
    depth = f"(1.0-({domain.half_angle:.17g}-acos(z/sqrt(v_squared)))*{domain.datum_radius / domain.damped_width:.17g})"
    inside = f"(v_squared<={domain.top_radius**2:.17g})"
    return [
        f'variable depth atom "{depth}"',
        f'variable drag atom "mass*{domain.damping_rate:.17g}*{inside}*((v_depth>0.0)*(v_depth<1.0)*v_depth*v_depth+(v_depth>=1.0))"',
    ]


def aside(domain: Domain) -> list[str]:
    """The region ``aside``: beside the cone and below its top. Grains there have left the domain and are taken out, as the stage itself does."""
    height = domain.top_radius
    low, width = 1e-3 * height, math.tan(domain.half_angle)
    return [
        f"region beside cone z 0 0 {width * low:.17g} {width * height:.17g} {low:.17g} {height:.17g} side out",
        f"region below sphere 0 0 0 {domain.top_radius:.17g} side in",
        "region aside intersect 2 beside below",
    ]
