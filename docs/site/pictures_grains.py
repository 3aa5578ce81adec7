"""Pictures of the contacts of grains: collisions, slip, rolling and cohesion, integrated with the laws themselves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np

from dem.contact.contact import Bodies
from dem.laws import normal_hertz, normal_hooke, tangential_spring

BODIES = Bodies(1e6, 0.5, 0.25, 0.5, 0.5, 0.0)
"""Two grains of 0.5 m and 1 kg: k_n = 1 MN/m, reduced mass, R."""
MODULUS = 1e7
LONGEST = 20_000
"""Steps after which two grains that have not parted count as stuck."""


def _row(law: ModuleType) -> Any:
    if law is not normal_hertz:
        return ()
    grain = normal_hertz.Parameters(elastic_modulus=MODULUS)
    return normal_hertz.Row(*normal_hertz.row(grain, grain))


def collision(
    law: ModuleType, speed: float, restitution: float, pull: Callable[[float], float] | None = None
) -> np.ndarray:
    """Overlap [m], force [N] and separation speed [m/s] of two grains that meet at ``speed`` [m/s], step by step
    until they part."""
    row, number, m = _row(law), law.damping_number(restitution), BODIES.mass
    quick = math.sqrt(BODIES.stiffness / m) if law is normal_hooke else 120.0 * speed**0.2
    x, u, dt, told = 0.0, -speed, 2e-3 / quick, []
    while len(told) < LONGEST:
        k = law.stiffness(max(x, 1e-12), BODIES, row)
        f = law.force(x, u, k, number * math.sqrt(k * m)) - (pull(x) if pull else 0.0)
        told.append((x, f, u))
        u += f / m * dt  # half a step behind x: second order
        x -= u * dt
        if x < 0.0:
            break
    return np.array(told)


def normal(law: ModuleType, axes: Any) -> str:
    """Force against overlap in a collision, and the restitution."""
    for e in (1.0, 0.55, 0.2):
        way = collision(law, 1.0, e)
        axes[0].plot(way[:, 0] * 1e3, way[:, 1] / 1e3, label=f"e = {e:g}")
    axes[0].axhline(0, color="0.5", lw=0.8)
    axes[0].set(xlabel="overlap [mm]", ylabel="force [kN]")
    axes[0].legend()
    speeds = np.geomspace(0.01, 3.0, 7)
    for k, e in enumerate((0.8, 0.55, 0.2)):
        ends = [collision(law, float(speed), e)[-1, 2] / speed for speed in speeds]
        axes[1].semilogx(speeds, ends, "o", color=f"C{k}", ms=5, mfc="none", label=f"e = {e:g}")
    for e in (0.8, 0.55, 0.2):
        axes[1].axhline(e, color="0.6", ls=":", lw=1)
    axes[1].set(xlabel="speed of the collision [m/s]", ylabel="restitution", ylim=(0, 1))
    axes[1].legend()
    stiff = f"k_n = {BODIES.stiffness:g} N/m" if law.LINEAR else f"E = {MODULUS:g} Pa, nu = 0.25"
    return (
        f"Left: two grains of 1 kg and 0.5 m meet at 1 m/s, with three coefficients of restitution ({stiff}). Right: "
        "the restitution that comes out at any speed; dotted: what was asked for."
    )


def _slip(way: np.ndarray, limit: float, k: float, damping: float, dt: float) -> np.ndarray:
    """Force along the slip ``way`` (n,) [m]."""
    s, told = 0.0, []
    for before, now in itertools.pairwise(way):
        s += now - before
        f, _, _, s, _, _ = tangential_spring.force(s, 0.0, 0.0, (now - before) / dt, 0.0, 0.0, k, damping, limit)
        told.append(f)
    return np.array(told)


def sliding(law: ModuleType, axes: Any) -> str:
    """Force against slip, there and back; slow and fast."""
    k, limit, n = 2.0 / 7.0 * BODIES.stiffness, 500.0, 400
    way = 4e-3 * np.sin(np.linspace(0.0, 2.5 * np.pi, n))
    for axis, seconds, words in ((axes[0], 4.0, "slow"), (axes[1], 0.02, "fast")):
        axis.plot(way[1:] * 1e3, _slip(way, limit, k, 300.0, seconds / n))
        axis.set(xlabel="slip [mm]", ylabel="tangential force [N]", title=words)
    return (
        f"A contact under a friction limit of {limit:g} N slips 4 mm to and fro, slowly (left: springs alone) and "
        "fast (right: the dashpot takes its share under the limit)."
    )


def mindlin(law: ModuleType, axes: Any) -> str:
    """A contact that is pressed, sheared, let loose and sheared back."""
    grain = normal_hertz.Parameters(elastic_modulus=MODULUS)
    row, ratio = _row(normal_hertz), law.stiffness_ratio(grain, grain)
    phase = np.linspace(0.0, 4.0 * np.pi, 800)
    overlap = 1e-3 * (1.0 - 0.5 * np.sin(2.0 * phase))
    slip = 0.15e-3 * np.sin(phase)
    s, before, force, work = 0.0, 0.0, [], [0.0]
    for k in range(1, len(phase)):
        stiff = normal_hertz.stiffness(overlap[k], BODIES, row)
        s = s * law.retained_fraction(stiff, before) + slip[k] - slip[k - 1]
        before = stiff
        force.append(ratio * stiff * s)
        work.append(work[-1] + force[-1] * (slip[k] - slip[k - 1]))
    axes[0].plot(slip[401:] * 1e3, force[400:])
    axes[1].plot(phase / (2 * np.pi), work)
    axes[0].set(xlabel="slip [mm]", ylabel="tangential force [N]")
    axes[1].set(xlabel="cycles", ylabel="work done on the contact [J]")
    return (
        "Two grains are sheared while loose and let back while pressed, without slipping (E = 10 MPa). Left: the "
        "force over the last cycle. Right: the work that went in, which never falls from cycle to cycle."
    )


def turning(law: ModuleType, axes: Any) -> str:
    """Moment against angle, there and back, and the spring that is left."""
    k, limit, n = 4e3, 20.0, 400
    way = 0.02 * np.sin(np.linspace(0.0, 2.5 * np.pi, n))
    rolling = law.__name__.endswith("rolling_sds")
    a, moments, springs = 0.0, [], []
    for before, now in itertools.pairwise(way):
        a, rate = a + now - before, (now - before) / (0.05 / n)
        if rolling:
            m, _, _, a, _, _ = law.moment(a, 0.0, 0.0, rate, 0.0, 0.0, k, 8.0, limit)
        else:
            m, a = law.moment(a, rate, k, 8.0, limit)
        moments.append(m)
        springs.append(a)
    axes[0].plot(np.degrees(way[1:]), moments)
    axes[1].plot(np.degrees(way[1:]), np.degrees(springs))
    axes[0].set(xlabel="angle [deg]", ylabel="moment [N m]")
    axes[1].set(xlabel="angle [deg]", ylabel="spring [deg]")
    return (
        f"A contact is {'rolled' if rolling else 'twisted'} to and fro in a twentieth of a second, under a limit of "
        f"{limit:g} N m: the moment, and the spring that it keeps."
    )


def cohesion(law: ModuleType, axes: Any) -> str:
    """The pull, and a collision at three speeds with it."""
    (strength,) = (key for key, least in law.Parameters._field_defaults.items() if least == 0.0)
    unit = law.Parameters(**{**law.EXAMPLE, strength: 1.0})
    p = unit._replace(**{strength: float(f"{300.0 / law.pull(2.5e-3, BODIES, unit):.1g}")})  # some 300 N in the middle
    x = np.linspace(0.0, 5e-3, 200)
    pull = np.array([law.pull(v, BODIES, p) for v in x])
    axes[0].plot(x * 1e3, pull / 1e3, "C1", label="pull")
    axes[0].plot(x * 1e3, normal_hooke.elastic_force(x, BODIES.stiffness) / 1e3, "C0", label="spring")
    axes[0].plot(x * 1e3, (normal_hooke.elastic_force(x, BODIES.stiffness) - pull) / 1e3, "k", label="both")
    axes[0].axhline(0, color="0.5", lw=0.8)
    axes[0].set(xlabel="overlap [mm]", ylabel="force [kN]")
    axes[0].legend()
    stuck = []
    for speed in (0.3, 1.0, 3.0):
        way = collision(normal_hooke, speed, 0.55, pull=lambda v: law.pull(v, BODIES, p))
        if way[-1, 0] > 0.0 and len(way) == LONGEST:
            stuck.append(f"{speed:g} m/s")
        time = np.arange(len(way)) * 2e-3 / math.sqrt(BODIES.stiffness / BODIES.mass)
        axes[1].plot(time * 1e3, way[:, 0] * 1e3, label=f"{speed:g} m/s")
    axes[1].set(xlabel="time [ms]", ylabel="overlap [mm]")
    axes[1].legend(title="meets at")
    words = ", ".join(f"{name} = {value:g}" for name, value in p._asdict().items())
    ends = f"at {' and '.join(stuck)} they stick" if stuck else "at none of these speeds do they stick"
    return (
        f"Left: the pull between two grains of 0.5 m against their overlap, beside a linear spring of 1 MN/m "
        f"({words}). Right: collisions with both, restitution 0.55: {ends}."
    )


def shaking(law: ModuleType, axes: Any) -> str:
    """The friction that is left under a pressure while a vibration dies away, and that of a layer by depth."""
    time, decay, rho, sound = np.linspace(0.0, 900.0, 300), 120.0, 3000.0, 7000.0
    for P in (1e7, 1e8, 1e9):
        left = [law.bearing_fraction(law.speed_after(200.0, t, decay), P, rho, sound) for t in time]
        axes[0].plot(time, left, label=f"{P / 1e6:g} MPa")
    axes[0].set(xlabel="time after the shock [s]", ylabel="fraction of friction that is left")
    axes[0].legend(title="pressure")
    depth = np.linspace(0.0, 30e3, 200)
    for v_vib in (0.0, 2.0, 5.0):
        P = rho * 1.62 * depth
        left = [0.6 * one * law.bearing_fraction(v_vib, one, rho, sound) for one in P]
        axes[1].plot(np.array(left) / 1e6, depth / 1e3, label=f"{v_vib:g} m/s")
    axes[1].invert_yaxis()
    axes[1].set(xlabel="friction of 0.6 [MPa]", ylabel="depth on the Moon [km]")
    axes[1].legend(title="vibration")
    return (
        f"Grains of {rho:,.0f} kg/m$^3$ and a speed of sound of 7 km/s. Left: what is left of friction after a "
        f"vibration of 200 m/s that dies away in {decay:g} s, under three pressures. Right: the stress that friction "
        "holds in a level layer, without vibration and with two."
    )


DRAWN = {
    "dem/laws/shaken_friction": shaking,
    "dem/laws/normal_": normal,
    "dem/laws/tangential_spring": sliding,
    "dem/laws/tangential_mindlin": mindlin,
    "dem/laws/rolling_": turning,
    "dem/laws/twisting_": turning,
    "dem/laws/cohesion_": cohesion,
}
