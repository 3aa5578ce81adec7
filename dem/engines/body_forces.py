"""Gravity and the damped layer in the variable syntax that LAMMPS and LIGGGHTS share."""

from __future__ import annotations

import math

import numpy as np

from dem.beds.bed_walls import Domain
from dem.engines.central_gravity import Polynomial
from dem.engines.scene import HOLD_STEPS, Scene
from matter.geometry.ground_region import Upright


def force_commands(scene: Scene) -> list[str]:
    """Commands that add gravity and damping to every grain.

    m g(r)/r and the damping rate are held for ``HOLD_STEPS`` steps and then multiply the present position and
    velocity.
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
    gravity = (
        Polynomial.fit(scene.gravity, scene.lower).formula("v_squared") if scene.gravity.radius > 0.0 else "0.0*x"
    )
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
    """``drag``: the mass times the rate of ``drag`` of the domain, below its top."""
    if isinstance(domain, Upright):
        depth, inside = _layer_of_container(domain), f"(z<={domain.top:.17g})"
    else:
        widths = domain.datum / domain.damped_width
        depth = f"(1.0-({domain.half_angle:.17g}-acos(z/sqrt(v_squared)))*{widths:.17g})"
        inside = f"(v_squared<={domain.top**2:.17g})"
    return [
        f'variable depth atom "{depth}"',
        f"variable drag atom "
        f'"mass*{domain.damping_rate:.17g}*{inside}*((v_depth>0.0)*(v_depth<1.0)*v_depth*v_depth+(v_depth>=1.0))"',
    ]


def _layer_of_container(container: Upright) -> str:
    """Depth into the damped layer over its width: 0 at its inner side, 1 at the container's."""
    if container.shape == "box":  # the larger of |x| and |y|, which the programs have no function for
        across = "(0.5*(sqrt(x*x)+sqrt(y*y)+sqrt((sqrt(x*x)-sqrt(y*y))*(sqrt(x*x)-sqrt(y*y)))))"
    else:
        across = "sqrt(x*x+y*y+z*z*(z<0.0))" if container.shape == "bowl" else "sqrt(x*x+y*y)"
    return f"(1.0-({container.radius:.17g}-{across})/{container.damped_width:.17g})"


def aside(domain: Domain) -> list[str]:
    """The region ``aside``: beside the domain and below its top. Grains there have left and are taken out, as the
    stage itself does."""
    if isinstance(domain, Upright):
        return _aside_of_container(domain)
    height = domain.top
    low, width = 1e-3 * height, math.tan(domain.half_angle)
    return [
        f"region beside cone z 0 0 {width * low:.17g} {width * height:.17g} {low:.17g} {height:.17g} side out",
        f"region below sphere 0 0 0 {domain.top:.17g} side in",
        "region aside intersect 2 beside below",
    ]


def _aside_of_container(container: Upright) -> list[str]:
    """Beside upright sides; what is below z = 0 outside a bowl lies within those and has gone through it, which is an
    error and not taken out."""
    radius, height = f"{container.radius:.17g}", f"{container.top:.17g}"
    if container.shape == "box":
        side_region = f"region beside block -{radius} {radius} -{radius} {radius} INF INF side out"
    else:
        side_region = f"region beside cylinder z 0 0 {radius} INF INF side out"
    return [
        side_region,
        f"region below block INF INF INF INF INF {height} side in",
        "region aside intersect 2 beside below",
    ]
